"""The exceptions of this package: one hierarchy, with messages of one form, and the error for a missing package."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Self

LONGEST = 500
"""Maximum number of characters of a part of the message of a `KernelError`."""


def shortened(text: str, longest: int = LONGEST) -> str:
    """Return a text with its middle replaced by dots if it has more than `longest` characters."""
    if len(text) <= longest:
        return text
    half = (longest - 5) // 2
    return f"{text[:half]} ... {text[-half:]}"


class GacError(Exception):
    """Base class of the exceptions that this package raises.

    Parameters
    ----------
    where : str
        The location of the error: a file, kernel, argument or blade.
    found : str
        What was found there.
    expected : str, optional
        What was expected instead.
    remedy : str, optional
        How to correct the error.
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
        """Prefix the message with the place of the error (file, line and kernel), and return the error."""
        self.where = f"{place}: {self.where}"
        self.args = (f"{place}: {self}",)
        return self

    def __reduce__(self) -> tuple[type[GacError], tuple[str, str, str, str]]:
        return type(self), (self.where, self.found, self.expected, self.remedy)


class AlgebraError(GacError):
    """Raised for a blade, metric or operation that is not valid in the algebra."""


class ZeroDivisorError(AlgebraError, ZeroDivisionError):
    """Raised for a divisor that is exactly zero, or an element without an inverse."""


class OperandError(AlgebraError, TypeError):
    """Raised for an operand that is neither a multivector nor a number."""


class LayoutError(GacError):
    """Raised for coefficients that do not fit a layout."""


class KernelError(GacError):
    """Raised for a kernel definition that cannot be compiled. Long texts, such as expressions, are shortened."""

    def __init__(self, where: str, found: str, expected: str = "", remedy: str = "") -> None:
        super().__init__(where, shortened(found), shortened(expected), remedy)


class SpecError(GacError):
    """Raised for a spec file that cannot be read."""


def text_of(path: Path) -> str:
    """Return the text of a file that a person wrote.

    Raises
    ------
    SpecError
        If it is not UTF-8, the encoding of Python files.
    """
    try:
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        found = f"the byte {error.object[error.start]:#x} at {error.start} is no text"
        raise SpecError(str(path), found, "a text in UTF-8") from None


class InexactError(GacError):
    """Raised for a function of exact arguments whose value is not in the ring of the arguments."""


class TooLargeError(GacError):
    """Raised for an expansion that exceeds its budget; callers fall back to a smaller one.

    Attributes
    ----------
    left : int
        The effort that was left, in pairs of terms that are multiplied.
    """

    left = 0


class BackendError(GacError):
    """Raised for a backend that is not available, or a compiler that failed."""


class StaleError(GacError):
    """Raised for generated files that differ from the output of the current specs."""


class ProofError(GacError):
    """Raised for a generated kernel that differs from its definition."""


def remedy_of(extra: str) -> str:
    """Return how to install an extra of the distribution."""
    return f"run: pip install 'gacompiler[{extra}]'"


OWN_PACKAGES = ("gacompiler", "generated", "algorithms")


def missing_package(error: ModuleNotFoundError) -> str:
    """Return the package whose absence an error reports; raise the error if it is none of others."""
    package = (error.name or "").partition(".")[0]
    if not package or package in OWN_PACKAGES:
        raise error
    return package


@contextmanager
def needs(extra: str, where: str) -> Iterator[None]:
    """Import packages of an extra of the distribution in the body of a ``with`` statement.

    Parameters
    ----------
    extra : str
    where : str
        What needs the packages: a command, or a function.

    Raises
    ------
    BackendError
        If a package is missing.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        package = missing_package(error)
        raise BackendError(where, f"{package} is not installed", remedy=remedy_of(extra)) from None
