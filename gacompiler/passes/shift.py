"""Replacement of inputs by their differences, if results depend only on the differences.

If the results do not change when some inputs are moved together along a constant direction (such as points ``a, b, c``
by the same translation), one of the inputs can be set to zero after subtracting it from the others. The directions are
the constant null vectors of the Jacobian. They are found by exact elimination.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction

from ..algebra.blades import Rational
from ..rings.polynomial import Monomial, Polynomial
from ..rings.residues import rank, residue
from .system import Definition, System

VARIABLE_LIMIT = 40
"""Kernels with more inputs are not changed."""


def shift(system: System) -> System | None:
    """Express as many polynomials of `system` as possible by the same differences of inputs, or return None."""
    polynomials = system.polynomials
    group, used, directions = _invariant_group(polynomials, _depths(system))
    if not directions:
        return None
    differences = _Differences(system)
    values = differences.along(used, directions)
    return differences.system({polynomials[k]: values for k in group})


def shift_each(system: System) -> System | None:
    """Express every polynomial of `system` by differences of its own, such as those of several pairs of points.

    Return None if there are no such polynomials, or if all of them have the same inputs.
    """
    depths, differences = _depths(system), _Differences(system)
    changes: dict[Polynomial, Mapping[int, Polynomial]] = {}
    for polynomial in system.polynomials:
        if polynomial.degree > 1 and _freedom(polynomial):
            used = _in_order({variable for variable in polynomial.variables if variable >= 0}, depths)
            changes[polynomial] = differences.along(used, _null_space(_jacobian([polynomial], used), len(used)))
    if len({polynomial.variables for polynomial in changes}) < 2:
        return None
    return differences.system(changes)


class _Differences:
    """The differences of inputs of a system, each of which is defined once."""

    def __init__(self, system: System) -> None:
        self._system = system
        self._known: dict[Polynomial, Definition] = {}

    def along(self, used: list[int], directions: list[list[Fraction]]) -> dict[int, Polynomial]:
        """Return the replacements of variables that set one variable of each direction to zero."""
        ring = self._system.ring
        values: dict[int, Polynomial] = {}
        for direction in directions:
            moved = [k for k, step in enumerate(direction) if step]
            base = moved[-1]
            values[used[base]] = ring.constant(0)
            for k in moved[:-1]:
                ratio = direction[k] / direction[base]
                old = values.get(used[k], Polynomial(ring, {(used[k],): 1}))
                difference = old - Polynomial(ring, {(used[base],): ratio})
                if difference not in self._known:
                    ring.variable(f"d_{ring.names[used[k]]}")
                    self._known[difference] = Definition(len(ring.names) - 1, difference)
                values[used[k]] = Polynomial(ring, {(self._known[difference].variable,): 1})
        return values

    def system(self, changes: Mapping[Polynomial, Mapping[int, Polynomial]]) -> System:
        """Return the system with variables replaced in some polynomials."""

        def change(polynomial: Polynomial, _: int | None) -> Polynomial:
            return polynomial.substitute(changes[polynomial]) if polynomial in changes else polynomial

        return self._system.changed(change, self._known.values())


def _invariant_group(
    polynomials: Sequence[Polynomial], depth: Mapping[int, int]
) -> tuple[set[int], list[int], list[list[Fraction]]]:
    """Return polynomials that are invariant along common directions, their variables, and the directions.

    The search starts with all polynomials that are invariant along some direction, and removes those with the fewest
    directions until there is a common one. The last variable of a direction is later set to zero. Variables of least
    `depth` therefore come last, so that the differences do not depend on results that are computed from them.
    """
    freedom = {k: _freedom(polynomial) for k, polynomial in enumerate(polynomials) if polynomial.degree > 1}
    group = [k for k, directions in freedom.items() if directions]
    while group:
        occurring = {variable for k in group for variable in polynomials[k].variables if variable >= 0}
        used = _in_order(occurring, depth)
        if len(used) <= VARIABLE_LIMIT:
            directions = _null_space(_jacobian([polynomials[k] for k in group], used), len(used))
            if directions:
                return set(group), used, directions
        least = min(freedom[k] for k in group)
        group.remove(max(k for k in group if freedom[k] == least))
    return set(), [], []


def _in_order(variables: Iterable[int], depth: Mapping[int, int]) -> list[int]:
    return sorted(variables, key=lambda variable: (-depth.get(variable, 0), variable))


def _depths(system: System) -> dict[int, int]:
    """Return the depth of each named result above the inputs; inputs have depth 0 and are not listed."""
    polynomial_of = {definition.variable: definition.polynomial for definition in system.live[0]}
    found: dict[int, int] = {}

    def depth(variable: int) -> int:
        if variable not in found and (variable < 0 or variable in polynomial_of):
            parts = system.ring.atom_of(variable).arguments if variable < 0 else (polynomial_of[variable],)
            found[variable] = 1 + max((depth(v) for part in parts for v in part.variables), default=0)
        return found.get(variable, 0)

    for variable in polynomial_of:
        depth(variable)
    return found


def _freedom(polynomial: Polynomial) -> int:
    """Return the number of directions that leave a polynomial invariant, computed modulo a prime.

    The directions are later computed exactly.
    """
    used = [variable for variable in polynomial.variables if variable >= 0]
    if len(used) > VARIABLE_LIMIT:
        return 0
    rows = _jacobian([polynomial], used)
    return len(used) - rank({k: residue(value).value for k, value in row.items()} for row in rows)


def _jacobian(polynomials: list[Polynomial], variables: list[int]) -> list[dict[int, Rational]]:
    """Return one sparse row for each monomial of the derivatives of each polynomial, over the unknown direction."""
    place = {variable: k for k, variable in enumerate(variables)}
    rows: list[dict[int, Rational]] = []
    for polynomial in polynomials:
        by_monomial: dict[Monomial, dict[int, Rational]] = {}
        for monomial, value in polynomial.terms.items():
            for variable in dict.fromkeys(monomial):
                if variable in place:
                    rest = list(monomial)
                    rest.remove(variable)
                    row = by_monomial.setdefault(tuple(rest), {})
                    k = place[variable]
                    row[k] = row.get(k, 0) + value * monomial.count(variable)
        rows.extend(by_monomial.values())
    return rows


def _null_space(rows: list[dict[int, Rational]], n: int) -> list[list[Fraction]]:
    """Return the null vectors, one for each free column of the reduced row echelon form."""
    pivots: dict[int, dict[int, Fraction]] = {}
    for given in rows:
        row = {k: Fraction(v) for k, v in given.items() if v}
        for pivot in sorted(set(row) & set(pivots)):
            if pivot in row:
                row = _minus(row, pivots[pivot], row[pivot])
        if not row:
            continue
        first = min(row)
        row = {k: v / row[first] for k, v in row.items()}
        for pivot, other in pivots.items():
            if first in other:
                pivots[pivot] = _minus(other, row, other[first])
        pivots[first] = row
        if len(pivots) == n:
            return []
    free = [k for k in range(n) if k not in pivots]
    vectors = []
    for column in free:
        vector = [Fraction(0)] * n
        vector[column] = Fraction(1)
        for pivot, row in pivots.items():
            vector[pivot] = -row.get(column, Fraction(0))
        vectors.append(vector)
    return vectors


def _minus(row: Mapping[int, Fraction], other: Mapping[int, Fraction], factor: Fraction) -> dict[int, Fraction]:
    result = dict(row)
    for k, value in other.items():
        total = result.get(k, Fraction(0)) - factor * value
        if total:
            result[k] = total
        else:
            result.pop(k, None)
    return result
