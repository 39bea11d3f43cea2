"""Spaces by their signature."""

from __future__ import annotations

from .euclidean import VGA2, VGA3
from .projective import PGA2, PGA3
from .spaces import Space


def Cl(p: int, q: int = 0, r: int = 0) -> Space:
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
    found = Space(p, q, r)
    return next((known for known in (VGA2, VGA3, PGA2, PGA3) if known.algebra == found.algebra), found)
