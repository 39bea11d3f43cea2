"""The numbers that a picture needs of an object, as expressions, so that a kernel computes them.

A browser draws these numbers with the same rules as `scene`: they are homogeneous, so that nothing divides by 0 before
it is known whether a round is flat.
"""

from __future__ import annotations

from typing import Any

from ..algebra.algebra import Algebra
from ..algebra.catalog import CGA2, CGA3, PGA2, PGA3
from ..algebra.layout import Layout
from ..errors import AlgebraError
from .definitions import Definition
from .shapes import CENTRE

Numbers = list[Any]

_EINF = '{A}.multivector({"einf": 1})'
_EQUATION = Definition("equation", ("x",), "x * {A}.pseudoscalar")
_PLANE_OF_CIRCLE = Definition("plane_of_circle", ("x",), f"ga.left_contraction({_EINF}, x * {{A}}.pseudoscalar)")
_SQUARE = Definition("square", ("x",), "ga.scalar_product(x, ga.grade_involution(x))")
_WEIGHT = Definition(
    "weight", ("x",), f"ga.scalar_product(ga.left_contraction({_EINF}, x), ga.left_contraction({_EINF}, x))"
)

DIMENSIONS: dict[Algebra, int] = {PGA2: 2, CGA2: 2, PGA3: 3, CGA3: 3}


def is_of_motors(layout: Layout) -> bool:
    """Whether elements of a layout are even, and more than numbers."""
    grades = sorted({blade.bit_count() for blade in layout.support})
    is_even = not any(grade % 2 for grade in grades)
    return layout.algebra in DIMENSIONS and grades[0] == 0 and len(grades) > 1 and is_even


def kind_of(where: str, layout: Layout) -> str:
    """Return the kind of picture of elements of a layout.

    Returns
    -------
    str
        ``point``, ``line2``, ``line3``, ``plane``, ``ball`` (a circle of the plane or a sphere, or flat), ``pair``,
        ``circle3``, or ``frame`` for motors: the moved coordinate axes.

    Raises
    ------
    AlgebraError
        If there is no picture of these elements.
    """
    algebra, d = layout.algebra, DIMENSIONS.get(layout.algebra, 0)
    grades = sorted({blade.bit_count() for blade in layout.support})
    if is_of_motors(layout):
        return "frame"
    if not d or len(grades) != 1 or grades[0] in (0, algebra.dimension):
        raise AlgebraError(
            where, f"a {layout} of grades {grades}", "points, lines, planes, rounds or motors of PGA2, PGA3, CGA2, CGA3"
        )
    (grade,) = grades
    if not algebra.null_pairs:
        return {(2, 1): "line2", (2, 2): "point", (3, 1): "plane", (3, 2): "line3", (3, 3): "point"}[d, grade]
    if layout == algebra.POINT:
        return "point"
    if layout == CGA3.LINE:
        return "line3"
    return {1: "ball", 2: "pair", d + 1: "ball"}.get(grade, "circle3")


def numbers_of(x: Any, kind: str, grade: int) -> Numbers:
    """Return the numbers that a picture of a kind needs, of an element or expression of one grade."""
    algebra: Algebra = x.algebra
    d, is_conformal = DIMENSIONS[algebra], bool(algebra.null_pairs)
    euclidean = ["e1", "e2", "e3"][:d]

    def made(definition: Definition) -> Any:
        return definition.function(algebra)(x)

    match kind:
        case "point" if is_conformal:
            return [x[name] for name in (*euclidean, "e0")]
        case "point":
            return [x[name] for name in (("e20", "e01", "e12") if d == 2 else ("e032", "e013", "e021", "e123"))]
        case "line2" | "plane":
            return [x[name] for name in (*euclidean, "e0")]
        case "line3" if is_conformal:
            return _signed(x, "-e10inf -e20inf -e30inf e23inf -e13inf e12inf")
        case "line3":
            return _signed(x, "e23 -e13 e12 e01 e02 e03")
        case "ball":
            vector = x if grade == 1 else made(_EQUATION)
            return [vector[name] for name in (*euclidean, "e0", "einf")]
        case "pair":
            centre = made(CENTRE)
            flat = [x[f"{name}inf"] for name in euclidean]
            along = [-x[f"{name}0"] for name in euclidean]
            rest = [made(_SQUARE), made(_WEIGHT), *flat, x["e0inf"]]
            return [*(centre[name] for name in (*euclidean, "e0")), *along, *rest]
        case "circle3":
            centre, plane = made(CENTRE), made(_PLANE_OF_CIRCLE)
            normal = [plane[name] for name in euclidean]
            line = _signed(x, "-e10inf -e20inf -e30inf e23inf -e13inf e12inf")
            return [*(centre[name] for name in (*euclidean, "e0")), *normal, made(_SQUARE), made(_WEIGHT), *line]
    return _frame(x)


def _frame(motor: Any) -> Numbers:
    """Return the moved origin, followed by the moved ends of the unit vectors."""
    from . import conformal, projective

    space: Any = {PGA2: projective.PGA2, PGA3: projective.PGA3, CGA2: conformal.CGA2, CGA3: conformal.CGA3}[
        motor.algebra
    ]
    d = DIMENSIONS[motor.algebra]
    found: Numbers = []
    for k in range(-1, d):
        found += numbers_of(motor * space.point(*(float(k == n) for n in range(d))) * ~motor, "point", d)
    return found


def _signed(x: Any, names: str) -> Numbers:
    return [-x[name[1:]] if name[0] == "-" else x[name] for name in names.split()]
