"""Decision of the layout of each result, from the coefficients that vanish or are constant.

Evaluation at exact points that satisfy the relations of the inputs refutes that a coefficient is constant. Polynomials
modulo these relations prove it. A coefficient is omitted only if it is proved to be constant.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import lru_cache
from random import Random
from typing import Any

import mpmath

from ..algebra.algebra import Algebra
from ..algebra.layout import SCALAR, SCALARS, Layout
from ..algebra.layout import Slot as LayoutSlot
from ..algebra.multivector import Multivector
from ..errors import KernelError, TooLargeError
from ..frontend.expression import Expression
from ..frontend.facts import is_unit
from ..frontend.kernel import Kernel, Output, Parameter, Trace
from ..ir.scalar import Graph, Scalar
from ..rings.points import DIGITS
from ..rings.polynomial import Polynomial
from ..rings.residues import Residue
from .lower import Lowering, Reduction, Slot, scalars_of, stages
from .matrices import has_huge_product
from .samples import samples, to_mpmath
from .script_constants import prove_by_result

POINTS, FEW_POINTS = 4, 2
EFFORT, WHOLE_EFFORT = 400_000, 800_000
"""Maximum number of pairs of terms that are multiplied to prove constants from one form, and in total. The proofs of
all kernels of the catalog require at most 7 500, those of 2 000 random ones at most 400 000."""
PROOFS = 64
"""Number of kernels whose proved constants are kept in memory."""
PROOF_EFFORT = 30_000
"""Maximum number of pairs of terms that are multiplied to prove the relations of a result."""
FAR = 10**20
"""Relations are not checked if the squares of coefficients exceed this limit."""


@dataclass(frozen=True, slots=True)
class Decision:
    """The layout of each output, and the numbers to compute, in the order of the result arrays."""

    layouts: tuple[Layout, ...]
    slots: tuple[tuple[Slot, ...], ...]
    constants: Mapping[tuple[int, int], Any]
    """Proved constants by (expression, blade)."""
    related: tuple[bool, ...] = ()
    """Whether each output satisfies the relations of its layout, such as unit norm, at every point."""
    author: tuple[Graph, list[Multivector]] | None = field(default=None, repr=False, compare=False)
    """The results as written, over shared scalar expressions, and their graph, until candidates are found."""


def decide(trace: Trace, variants: Sequence[Sequence[Expression]]) -> Decision:
    """Decide every coefficient of every result; `variants` are equivalent, possibly simpler forms of the results."""
    expressions = trace.expressions
    if _are_declared_numbers(trace):
        return _of_numbers(trace)
    huge = has_huge_product(expressions)
    author = None if huge else scalars_of(trace.kernel, expressions)
    written = author[1] if author else []
    supports = [tuple(value.terms) for value in written] or [tuple(sorted(e.blades)) for e in expressions]
    n_points = FEW_POINTS if huge else POINTS
    points = [value for _, value in samples(trace.kernel, trace.expressions, Random(7), n_points, huge)]
    suspected = _suspects(points, supports)
    for k, value in enumerate(written):
        for blade, scalar in value.terms.items():
            if not isinstance(scalar, Scalar):
                suspected[k, blade] = Fraction(scalar)
            elif scalar.is_constant:
                suspected[k, blade] = scalar.value
    constants = (prove_by_result if trace.kernel.result_names else _prove)(trace, suspected, variants)
    layouts, slots, related = [], [], []
    first = 0
    for output in trace.outputs:
        numbers = range(first, first + len(output.expressions))
        first += len(output.expressions)
        found = {
            blade: _common(constants, [(k, blade) for k in numbers], [supports[k] for k in numbers])
            for blade in sorted({blade for k in numbers for blade in supports[k]})
        }
        layout = output.layout or _infer(output, found, bool(trace.kernel.result_names))
        _check(trace, output, layout, found)
        layouts.append(layout)
        related.append(all(satisfies(layout, value[k]) for value in points for k in numbers))
        slots.append(tuple(Slot(k, slot.blade, slot.sign) for k in numbers for slot in layout.stored))
    return Decision(tuple(layouts), tuple(slots), constants, tuple(related), author)


def _are_declared_numbers(trace: Trace) -> bool:
    """Return whether all results are declared as numbers and can have no other coefficient: nothing is to be decided.

    Those are most parts of kernels with loops, on which the points and polynomials of a decision would be wasted.
    """
    return not trace.kernel.result_names and all(
        output.layout is SCALAR and all(each.is_scalar for each in output.expressions) for output in trace.outputs
    )


def _of_numbers(trace: Trace) -> Decision:
    slots, first = list[tuple[Slot, ...]](), 0
    for output in trace.outputs:
        slots.append(tuple(Slot(first + k, 0, 1) for k in range(len(output.expressions))))
        first += len(output.expressions)
    n = len(slots)
    return Decision((SCALAR,) * n, tuple(slots), {}, (True,) * n)


def satisfies(layout: Layout, value: Multivector) -> bool:
    """Return whether a value satisfies the relations of a layout.

    They are checked to double precision, since functions may be defined by short series.
    """
    if not layout.has_relations:
        return True
    if any(isinstance(x, Residue) for x in value.terms.values()):
        return all(relation == 0 for relation in layout.relations(value))
    with mpmath.workdps(DIGITS):
        size = 1 + max((abs(to_mpmath(x)) for x in value.terms.values()), default=0) ** 2
        if size > FAR:
            return True  # The working precision is too small to check the relations.
        limit = size * mpmath.mpf(2) ** -52
        return all(abs(to_mpmath(relation)) < limit for relation in layout.relations(value))


def _common(
    constants: Mapping[tuple[int, int], Any], keys: list[tuple[int, int]], supports: list[tuple[int, ...]]
) -> Any:
    """Return the constant coefficient of a blade that is common to all elements of an array, or None."""
    values = {constants.get(key) if key[1] in support else 0 for key, support in zip(keys, supports, strict=True)}
    return values.pop() if len(values) == 1 else None


def _suspects(values: list[list[Multivector]], supports: list[tuple[int, ...]]) -> dict[tuple[int, int], Any]:
    """Return the coefficients that have the same rational value at all points."""
    if not values:
        return {}
    found = {}
    for k, support in enumerate(supports):
        for blade in support:
            at_points = [value[k].terms.get(blade, 0) for value in values]
            first = _rational(at_points[0])
            if first is not None and all(_rational(value) == first for value in at_points):
                found[k, blade] = first
    return found


def _rational(value: Any) -> Fraction | None:
    """Return `value` as a rational with a small denominator if it is one to the working precision, else None."""
    if isinstance(value, (int, Fraction)):
        return Fraction(value)
    if isinstance(value, Residue):
        return value.near(720720)
    if isinstance(value, mpmath.mpf) and mpmath.isfinite(value) and mpmath.mag(value) > DIGITS:
        return None
    with mpmath.workdps(DIGITS):
        try:
            near = Fraction(int(mpmath.nint(value * 720720)), 720720)
            error = abs(value - mpmath.mpf(near.numerator) / near.denominator)
        except (TypeError, ValueError, OverflowError):
            return None
        return near if error < mpmath.mpf(10) ** (-DIGITS // 2) else None


def _prove(
    trace: Trace, suspected: Mapping[tuple[int, int], Any], variants: Sequence[Sequence[Expression]]
) -> dict[tuple[int, int], Any]:
    """Return the suspected constants that polynomials of any variant prove."""
    return _proved(trace.kernel.parameters, tuple(suspected.items()), tuple(map(tuple, variants)))


@lru_cache(maxsize=PROOFS)
def _proved(
    parameters: tuple[Parameter, ...],
    suspects: tuple[tuple[tuple[int, int], Any], ...],
    variants: tuple[tuple[Expression, ...], ...],
) -> dict[tuple[int, int], Any]:
    """Return the proved constants; the bodies of loops are decided when they are traced, and when they are compiled."""
    kernel, suspected = Kernel("proof", tuple, parameters, None, ""), dict(suspects)
    proved: dict[tuple[int, int], Any] = {}
    forms = [(variant, cuts) for variant in variants for cuts in (frozenset[Expression](), frozenset(stages(variant)))]
    left = WHOLE_EFFORT
    for budget in (300, 20_000):
        for variant, cuts in forms:
            open_keys = [key for key in suspected if key not in proved]
            if not open_keys or left <= 0:
                return proved
            effort = min(EFFORT, left)
            needed = sorted({k for k, _ in open_keys})
            try:
                lowered = Lowering(kernel, [variant[k] for k in needed], cuts, budget=budget, effort=effort)
                system = lowered.system([Slot(needed.index(k), blade) for k, blade in open_keys])
                left -= lowered.pairs
            except TooLargeError as error:
                left -= effort - error.left
                continue
            for key, polynomial in zip(open_keys, system.outputs, strict=True):
                if polynomial.constant_value == suspected[key]:
                    proved[key] = suspected[key]
    return proved


def _infer(output: Output, found: Mapping[int, Any], with_constants: bool = False) -> Layout:
    """Return the layout of a result: a named layout with the same blades if the algebra has one, else a new layout.

    Constants are stored as well if `with_constants` is true.
    """
    algebra = next((e.algebra for e in output.expressions if e.algebra != SCALARS), SCALARS)
    variable = {blade for blade, value in found.items() if value is None}
    fixed = {blade: value for blade, value in found.items() if value is not None and value != 0}
    if not variable or with_constants:
        variable, fixed = variable | set(fixed) or {0}, {}
    return SCALAR if variable == {0} and not fixed else layout_of(algebra, variable, fixed)


def layout_of(algebra: Algebra, variable: set[int], fixed: Mapping[int, Any]) -> Layout:
    """Return the layout that stores some blades and fixes others: a named layout of the algebra, or a new one."""
    for candidate in algebra.layouts.values():
        named_fixed = {slot.blade: slot.sign * value for slot, value in candidate.fixed}
        if (
            not candidate.implied
            and not candidate.has_relations
            and {s.blade for s in candidate.stored} == variable
            and named_fixed == fixed
        ):
            return candidate
    return _new_layout(algebra, variable, fixed)


def _new_layout(algebra: Algebra, variable: set[int], fixed: Mapping[int, Any]) -> Layout:
    order = sorted(variable, key=lambda blade: (blade.bit_count(), blade))
    names = [algebra.spelling(blade)[1] for blade in order]
    constants = {algebra.spelling(blade)[1]: algebra.spelling(blade)[0] * value for blade, value in fixed.items()}
    return algebra.layout("(" + " ".join(names) + ")", " ".join(names), fixed=constants)


def _check(trace: Trace, output: Output, layout: Layout, found: Mapping[int, Any]) -> None:
    """Raise an error if the layout given by ``returns=`` cannot hold the result."""
    algebra = layout.algebra
    where = trace.kernel.where
    own = next((e.algebra for e in output.expressions if e.algebra != SCALARS), algebra)
    if own != algebra and own != SCALARS and algebra != SCALARS:
        raise KernelError(where, f"a result of {own.name}", f"{layout}, as specified by returns=")
    for blade, value in found.items():
        if value != 0 and blade not in layout.support:
            name = own.spelling(blade)[1]
            raise KernelError(
                where,
                f"the result has blade {name}",
                f"only {' '.join(layout.blades)}, as specified by returns={layout}",
                f"add {name} to the layout, or select the intended grades with .grade()",
            )
    if layout.implied:
        _check_implied(trace, output, layout)
    for slot, value in layout.fixed:
        if found.get(slot.blade, 0) != slot.sign * value:
            raise KernelError(
                where,
                f"the coefficient of {slot.name} could not be proved to be {value}",
                f"{slot.name} = {value}, as specified by returns={layout}",
                "normalise the result, or return a layout that stores it",
            )


def _check_implied(trace: Trace, output: Output, layout: Layout) -> None:
    """Raise an error if the result is not proved to have the coefficients that a layout implies."""
    lowered = Lowering(trace.kernel, output.expressions)
    for value in lowered.values:
        for slot, difference in _implied_differences(lowered, value, layout):
            if not difference.is_zero:
                raise KernelError(
                    trace.kernel.where,
                    f"the coefficient of {slot.name} could not be proved to have the value that {layout} implies",
                    f"an element of {layout.name}, as specified by returns=",
                    "build the result from its stored coefficients, or return a layout that stores it",
                )


def _implied_differences(
    lowered: Lowering, value: Multivector, layout: Layout
) -> Iterator[tuple[LayoutSlot, Polynomial]]:
    """Yield each coefficient that a layout implies, and its difference from that of a value, in normal form."""
    stored = {slot.name: _coefficient(lowered, value, slot) for slot in layout.stored}
    wanted = [function(stored) for _, function in layout.implied]
    found = [_coefficient(lowered, value, slot) for slot, _ in layout.implied]
    differences = lowered.relations.reduce([a - b for a, b in zip(found, wanted, strict=True)], Reduction.NORMAL)
    yield from zip((slot for slot, _ in layout.implied), differences, strict=True)


def is_proved_in(kernel: Kernel, expression: Expression, layout: Layout) -> bool:
    """Return whether a result is proved to have the implied coefficients and the relations of a layout.

    Exact points refute them and polynomials prove them, except for ``x ~x = 1``, which may also follow from rules.

    Raises
    ------
    TooLargeError
        If the polynomials of the result are too large.
    """
    for _, (value,) in samples(kernel, [expression], Random(7), FEW_POINTS):
        if not satisfies(layout, value) or not has_implied(layout, value):
            return False
    by_rules = is_unit(expression) and layout.user_relations is None
    if by_rules and not layout.implied:
        return True
    lowered = Lowering(kernel, [expression], effort=PROOF_EFFORT)
    (value,) = lowered.values
    if any(not difference.is_zero for _, difference in _implied_differences(lowered, value, layout)):
        return False
    relations = [] if by_rules else list(map(lowered.ring.lift, layout.relations(value)))
    return all(relation.is_zero for relation in lowered.relations.reduce(relations, Reduction.NORMAL))


def has_implied(layout: Layout, value: Multivector) -> bool:
    """Return whether a value has the coefficients that a layout implies, to half of the working digits."""
    with mpmath.workdps(DIGITS):
        stored = {slot.name: slot.sign * value.terms.get(slot.blade, 0) for slot in layout.stored}
        for slot, function in layout.implied:
            difference = to_mpmath(function(stored)) - to_mpmath(slot.sign * value.terms.get(slot.blade, 0))
            size = 1 + max((abs(to_mpmath(x)) for x in value.terms.values()), default=0)
            if abs(difference) > size * mpmath.mpf(10) ** (-DIGITS // 2):
                return False
    return True


def _coefficient(lowered: Lowering, value: Multivector, slot: LayoutSlot) -> Polynomial:
    polynomial = lowered.ring.lift(value.terms.get(slot.blade, 0))
    return polynomial if slot.sign > 0 else -polynomial
