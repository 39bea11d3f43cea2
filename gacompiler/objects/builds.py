"""Status of the compilation of operations in this process."""

from __future__ import annotations

from typing import NamedTuple

from .native import extension_is_settled
from .operators import operators


class Builds(NamedTuple):
    """The operations that were used so far, by the state of their compiled functions; see `Operator.state`.

    Attributes
    ----------
    ready, running, waiting, failed, text : tuple of str
        Names of operations, in the order of first use. While the extension that stores single objects is being built,
        which happens once, `running` contains ``"extension"``; until then single objects are numpy arrays.
    """

    ready: tuple[str, ...]
    running: tuple[str, ...]
    waiting: tuple[str, ...]
    failed: tuple[str, ...]
    text: tuple[str, ...]

    @property
    def pending(self) -> int:
        """The number of operations that are not compiled yet but will be, automatically."""
        return len(self.running) + len(self.waiting)


def builds() -> Builds:
    """Return the status of all operations that were used so far.

    Compilation runs in the background; this function does not wait for it, and does not have to be called for it.

    Returns
    -------
    Builds

    Examples
    --------
    >>> from gacompiler.objects import PGA3, builds
    >>> line = PGA3.point(1, 2, 3) & PGA3.point(0, 0, 1)
    >>> builds().failed
    ()
    """
    states = [(each.kernel.name, each.state) for each in operators()]
    states += [] if extension_is_settled() else [("extension", "running")]
    return Builds(*(tuple(name for name, state in states if state == field) for field in Builds._fields))
