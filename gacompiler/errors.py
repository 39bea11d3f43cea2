"""Every error this package raises on purpose: one tree, one message shape."""

from __future__ import annotations

from typing import Self


class GacError(Exception):
    """An error a person can act on.

    Parameters
    ----------
    where : str
        The file, kernel, argument or blade at fault.
    found : str
        What was found there.
    expected : str, optional
        What would have been right.
    remedy : str, optional
        What to do next.
    """

    def __init__(self, where: str, found: str, expected: str = "", remedy: str = "") -> None:
        self.where, self.found, self.expected, self.remedy = where, found, expected, remedy
        message = f"{where}: {found}"
        if expected:
            message += f"; expected {expected}"
        if remedy:
            message += f"; {remedy}"
        super().__init__(message)

    def at(self, place: str) -> Self:
        """This error, after the place where it was raised: a file, a line and a kernel."""
        self.where = f"{place}: {self.where}"
        self.args = (f"{place}: {self}",)
        return self

    def __reduce__(self) -> tuple[type[GacError], tuple[str, str, str, str]]:
        return type(self), (self.where, self.found, self.expected, self.remedy)


class AlgebraError(GacError):
    """A blade, metric or operation that the algebra does not have."""


class ZeroDivisorError(AlgebraError, ZeroDivisionError):
    """A divisor that is exactly zero, or an element without inverse."""


class LayoutError(GacError):
    """Coefficients that a layout does not describe or cannot hold."""


class KernelError(GacError):
    """A kernel definition that cannot be compiled."""


class SpecError(GacError):
    """A spec file that cannot be read."""


class InexactError(GacError):
    """A function whose exact value is not in the ring it was asked for."""


class TooLargeError(GacError):
    """An expansion that outgrew its budget; callers fall back to a smaller one."""


class BackendError(GacError):
    """A target that is missing, or a compiler that failed."""


class StaleError(GacError):
    """Generated files that are not what the specs give now."""


class ProofError(GacError):
    """An emitted kernel that is not its author's definition."""
