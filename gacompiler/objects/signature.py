"""Spaces by their signature."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, overload

from .euclidean import VGA2, VGA3
from .projective import PGA2, PGA3
from .spaces import Space

if TYPE_CHECKING:
    from .names import AnySpace, Pga2Space, Pga3Space, Vga2Space, Vga3Space


@overload
def Cl(p: Literal[2], q: Literal[0] = 0, r: Literal[0] = 0) -> Vga2Space: ...  # type: ignore[overload-overlap]
@overload
def Cl(p: Literal[3], q: Literal[0] = 0, r: Literal[0] = 0) -> Vga3Space: ...  # type: ignore[overload-overlap]
@overload
def Cl(p: Literal[2], q: Literal[0], r: Literal[1]) -> Pga2Space: ...  # type: ignore[overload-overlap]
@overload
def Cl(p: Literal[3], q: Literal[0], r: Literal[1]) -> Pga3Space: ...  # type: ignore[overload-overlap]
@overload
def Cl(p: int, q: int = 0, r: int = 0) -> AnySpace: ...
def Cl(p: int, q: int = 0, r: int = 0) -> Space[Any]:
    """Return the space of the geometric algebra of a signature, whose basis blades are attributes.

    Parameters
    ----------
    p, q, r : int
        The numbers of basis vectors with the squares 1, -1 and 0.

    Returns
    -------
    Space
        `VGA2`, `VGA3`, `PGA2` or `PGA3` for the signatures of these spaces, with their constructors of geometric
        objects and the null vector ``e0``; for every other signature a space with the basis vectors ``e1 e2 ...``.

    Examples
    --------
    >>> from gacompiler import Cl
    >>> G = Cl(1, 3)
    >>> G.e1 * G.e2 + 2
    G(1,3,0).(1 e12)(2 + e12)
    >>> Cl(3, 0, 1).point(1, 2, 3)
    PGA3.POINT(e032 + 2 e013 + 3 e021 + e123)
    """
    found: Space[Any] = Space(p, q, r)
    return next((known for known in (VGA2, VGA3, PGA2, PGA3) if known.algebra == found.algebra), found)
