"""What the C compiler has done for the operations of this process, and what it has yet to do."""

from __future__ import annotations

from typing import NamedTuple

from .native import extension_is_settled
from .operators import operators


class Builds(NamedTuple):
    """The operations that were used so far, by the state of their compiled functions; see `Operator.state`.

    Attributes
    ----------
    ready, running, waiting, failed, text : tuple of str
        Names of operations, in the order of first use. Among those that run is ``"extension"`` while the extension that
        holds single objects is built, which happens once; until then these are arrays of numpy.
    """

    ready: tuple[str, ...]
    running: tuple[str, ...]
    waiting: tuple[str, ...]
    failed: tuple[str, ...]
    text: tuple[str, ...]

    @property
    def pending(self) -> int:
        """How many are not compiled yet but will be, by themselves."""
        return len(self.running) + len(self.waiting)


def builds() -> Builds:
    """What the C compiler has done so far, and what it has yet to do.

    It works in the background: this does not wait for it, and nothing has to be called for it to go on.

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
