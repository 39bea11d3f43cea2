"""The tangent directions that correspond to the columns of a Jacobian."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from ..algebra.layout import Layout
from ..algebra.multivector import Multivector
from ..errors import KernelError
from ..frontend.expression import Expression, lift

Tangents = Callable[[Expression, Layout], list[Expression]]


def basis(layout: Layout) -> list[Expression]:
    """Return one basis blade for each stored coefficient."""
    return [lift(Multivector(layout.algebra, {slot.blade: slot.sign})) for slot in layout.stored]


def coefficient_tangents(_: Expression, layout: Layout) -> list[Expression]:
    """Return one basis blade for each stored coefficient of a layout without implied coefficients.

    Raises
    ------
    KernelError
        When the layout implies coefficients.
    """
    if layout.implied:
        raise KernelError(
            "jacobian()",
            f"{layout} has implied coefficients",
            "a layout that stores all its coefficients",
            "rebuild the element inside the kernel",
        )
    return basis(layout)


def _bivector_tangents(side: str) -> Tangents:
    def tangents(versor: Expression, layout: Layout) -> list[Expression]:
        blades = [lift(Multivector(layout.algebra, {blade: 1})) for blade in layout.algebra.blades(2)]
        return [blade * versor if side == "left" else versor * blade for blade in blades]

    return tangents


KINDS: Mapping[str, Tangents] = {
    "coefficients": coefficient_tangents,
    "left": _bivector_tangents("left"),
    "right": _bivector_tangents("right"),
}
