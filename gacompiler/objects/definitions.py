"""Definitions of the operators and methods of numeric objects, one line of the kernel language each.

The text is compiled when an operation is first used, and ``gac record`` writes it into the spec. In it ``ga`` is
`gacompiler`, and ``{A}`` is replaced by the algebra.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from typing import Any, Protocol

from ..algebra.algebra import Algebra
from ..algebra.layout import SCALARS, Layout
from ..algebra.operations import Kind, Operation
from ..algebra.signs import norm_signs
from ..frontend.kernel import Kernel


@dataclass(frozen=True, slots=True)
class Definition:
    """An operation.

    Attributes
    ----------
    name : str
    parameters : tuple of str
    text : str
        The result, in terms of the parameters.
    keeps : int, optional
        Index of the parameter whose layout is also that of the result, if this can be proved.
    unit : callable, optional
        Function that returns whether the result is a unit versor for parameters of given layouts, in addition to the
        compiler's own analysis.
    algebra : Algebra, optional
        The algebra of the result, if all parameters may be numbers.
    """

    name: str
    parameters: tuple[str, ...]
    text: str
    keeps: int | None = None
    unit: Callable[[tuple[Layout, ...]], bool] | None = None
    algebra: Algebra | None = None

    def algebra_of(self, layouts: Iterable[Layout]) -> Algebra:
        """Return the algebra of the operation on these layouts, which is that of the first that is not of numbers."""
        found = (layout.algebra for layout in layouts if layout.algebra != SCALARS)
        return self.algebra or next(found, SCALARS)

    def expression(self, algebra: str) -> str:
        """Return the text with the name of the algebra inserted."""
        return self.text.replace("{A}", algebra)

    def function(self, algebra: Algebra) -> Callable[..., Any]:
        """Return the function of a kernel for this operation."""
        package = import_module(__name__.partition(".")[0])
        source = f"lambda {', '.join(self.parameters)}: {self.expression('algebra')}"
        return eval(source, {"ga": package, "algebra": algebra})


class Applied(Protocol):
    """An operation on given layouts, as it is written to a spec; implemented by `Operator`."""

    @property
    def definition(self) -> Definition:
        """The definition, a line of the kernel language."""

    @property
    def result(self) -> Layout:
        """The layout of the result."""

    @property
    def kernel(self) -> Kernel:
        """The kernel of the definition on given layouts."""


def _is_bivector(layouts: tuple[Layout, ...]) -> bool:
    """Whether the first parameter is a bivector in at most five dimensions, so that exp has a closed form."""
    (first, *_) = layouts
    return first.algebra.dimension <= 5 and {blade.bit_count() for blade in first.support} == {2}


def _is_unit(layouts: tuple[Layout, ...]) -> bool:
    return layouts[0].unit


def has_scalar_square(layout: Layout) -> bool:
    """Whether ``x ~x`` is a scalar for every element: vectors, rotors of two and three dimensions, pseudovectors."""
    return frozenset(_squared(layout)) <= {0}


def is_never_negative(layout: Layout) -> bool:
    """Whether the metric excludes ``x ~x < 0``; otherwise ``x / norm(x)`` may have ``x ~x = -1`` and not be a unit."""
    return not norm_signs(layout.algebra, layout.support).negative


def unit_by_study(layout: Layout) -> bool:
    """Whether ``x ~x`` is a scalar plus a part that squares to zero: motors and lines of projective space."""
    found = _squared(layout)
    (rest, *others) = [blade for blade in found if blade] or [0]
    return bool(rest) and not others and not layout.algebra.blade_product(rest, rest)


def _squared(layout: Layout) -> Mapping[int, Any]:
    from ..rings.polynomial import PolynomialRing

    ring = PolynomialRing()
    element = layout.element([ring.variable(f"x{k}") for k in range(layout.size)])
    return (element * ~element).terms


_UNIT: Mapping[str, Callable[[tuple[Layout, ...]], bool]] = {"exp": _is_bivector, "sqrt": _is_unit, "power": _is_unit}


def _definition(name: str, n: int, text: str = "", keeps: int | None = None) -> Definition:
    parameters = ("a", "b")[:n]
    return Definition(name, parameters, text or f"ga.{name}({', '.join(parameters)})", keeps, _UNIT.get(name))


def _by_table(operation: Operation) -> Definition:
    row = operation.row
    text = f"{row.operator}a" if row.operands == 1 else f"a {row.operator} b"
    keeps = 1 if operation is Operation.SANDWICH else None
    return _definition(row.name, row.operands, text if row.operator else "", keeps)


_TABLE = tuple(
    _by_table(each)
    for each in Operation
    if each.row.kind in (Kind.ARITHMETIC, Kind.MULTIVECTOR) and each is not Operation.NORMALIZE
)

FUNCTIONS = ("exp", "log", "sqrt")
WAVES = ("sin", "cos", "tan", "sinh", "cosh", "tanh")

UNARY: Mapping[str, Definition] = {
    **{each.name: each for each in _TABLE if len(each.parameters) == 1},
    **{name: _definition(name, 1) for name in (*FUNCTIONS, *WAVES)},
}
"""Operations of one object, by name; for normalization see `normalize_of`."""

BINARY: Mapping[str, Definition] = {
    **{each.name: each for each in _TABLE if len(each.parameters) == 2},
    "power": _definition("power", 2),
}
"""Operations of two objects, by name."""

NORMALIZE = Definition(
    "normalize",
    ("a",),
    "ga.normalize(a)",
    unit=lambda layouts: has_scalar_square(layouts[0]) and is_never_negative(layouts[0]),
)
NORMALIZE_STUDY = Definition(
    "normalize",
    ("a",),
    # With s + p = a ~a and p p = 0, the inverse root is (1 - p / (2 s)) / sqrt(s); if s < 0, that of -a ~a.
    "a * (1 - (a * ~a).grade({G}) / (2 * ga.norm_squared(a))) / ga.norm(a)",
    unit=lambda layouts: is_never_negative(layouts[0]),
)
"""Normalization in projective space: motors satisfy the Study condition, lines are orthogonal to their moment."""


@cache
def normalize_of(layout: Layout) -> Definition:
    """Return the normalization for a layout: by the norm, or by the Study norm if ``x ~x`` is a dual number."""
    if not unit_by_study(layout):
        return NORMALIZE
    (grade,) = {blade.bit_count() for blade in _squared(layout) if blade}
    return Definition("normalize", ("a",), NORMALIZE_STUDY.text.replace("{G}", str(grade)), unit=NORMALIZE_STUDY.unit)


@cache
def grade_of(grades: tuple[int, ...]) -> Definition:
    """Return the operation that selects the given grades."""
    return _definition("grade_" + "_".join(map(str, grades)), 1, f"a.grade({', '.join(map(str, grades))})")


@cache
def power_of(exponent: int) -> Definition:
    """Return a natural power as a single operation, so that the square of a vector is known to be a number."""
    return _definition(f"power_{exponent}", 1, f"a ** {exponent}")
