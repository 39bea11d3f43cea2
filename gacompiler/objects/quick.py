"""Distances and axes of single elements by one compiled operation each.

Shapes in numpy (`shapes.py`) take some hundred microseconds for one element. They are used for arrays, for all other
kinds, and for elements near a degenerate case, in which these functions return None.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..algebra.catalog import PGA2, PGA3
from ..algebra.layout import Layout
from .checks import largest
from .definitions import Definition
from .methods import applied
from .operators import OBSERVERS

_DISTANCE = Definition("distance", ("point", "other"), "ga.norm(point & other) / ga.norm(other)")
# About a unit line a, a screw motion of pitch h has the bivector ``b = a (1 + h e0123)``, and ``b ^ b = -2 h e0123``.
_AXIS = Definition("axis", ("m",), "(lambda b: (b + b * (b ^ b) / 2).grade(2))(ga.normalize(-ga.log(m)))")
_FLATS = {PGA2: ("POINT", "LINE", "UNIT_LINE"), PGA3: ("POINT", "LINE", "PLANE", "UNIT_LINE", "UNIT_PLANE")}
_FAR = 1e12
"""Coefficients of flats are finite, and no flat is at infinity, where the norm times this exceeds all of them."""
_STILL = 1e-6
"""The least sine of half the angle of a rotation whose axis is computed here."""

_known: dict[tuple[type, type], tuple[bool, bool]] = {}
"""For the types of two elements whether the distance is computed here, and whether the second one may be a screw.

Elements that the extension does not store have one type, whatever their layouts are; it is not among these types.
"""


def distance(a: Any, b: Any) -> Any:
    """Return the distance of a point of weight 1 from a point, line or plane of the same projective space, or None."""
    is_here, may_be_screw = _known.get((type(a), type(b))) or _how(a, b)
    if not is_here or OBSERVERS:  # checks of operands are no part of a recorded program
        return None
    size = largest(b.values)
    if not (b.norm() * _FAR > size and largest(a.values) < _FAR):
        return None
    if may_be_screw and largest((b ^ b).values) > 16 * np.finfo(float).eps * size**2:
        return None
    return float(applied(_DISTANCE, a, b))


def _how(a: Any, b: Any) -> tuple[bool, bool]:
    algebra, two = a.algebra, getattr(b, "layout", None)
    found = False, False
    if algebra in _FLATS and a.layout == algebra.POINT and two in [algebra.layouts[name] for name in _FLATS[algebra]]:
        found = True, algebra == PGA3 and two in (PGA3.LINE, PGA3.UNIT_LINE)
    if all(isinstance(getattr(type(x), "layout", None), Layout) for x in (a, b)):
        _known[type(a), type(b)] = found
    elif found[0] and (a.shape or b.shape or not a.values.dtype == b.values.dtype == np.float64):
        return False, False
    return found


def axis(m: Any) -> Any:
    """Return the axis of a single motor of PGA3, or None."""
    if OBSERVERS or m.shape or m.layout != PGA3.MOTOR or m.values.dtype != np.float64:
        return None
    sine = largest(np.array([m.e12, m.e13, m.e23]))
    return applied(_AXIS, m) if sine > _STILL and largest(m.values) < _FAR * sine else None
