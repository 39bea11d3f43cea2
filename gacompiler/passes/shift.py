"""Replacement of inputs by their differences, if results depend only on the differences.

If the results do not change when some inputs are moved together along a constant direction (such as points ``a, b, c``
by the same translation), one of the inputs can be set to zero after subtracting it from the others. The directions are
the constant null vectors of the Jacobian. They are found by exact elimination.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from fractions import Fraction

from ..algebra.blades import Rational
from ..rings.polynomial import Monomial, Polynomial
from .system import Definition, System

PRIME = 2**61 - 1
VARIABLE_LIMIT = 40
"""Kernels with more inputs are not changed."""


def shift(system: System) -> System | None:
    """Express as many polynomials of `system` as possible by differences of inputs. Return None if there are none."""
    ring = system.ring
    definitions, atoms = system.live()
    arguments = [argument for atom in atoms for argument in ring.atom_of(atom).arguments]
    polynomials = [*(definition.polynomial for definition in definitions), *system.outputs, *arguments]
    group, used, directions = _invariant_group(polynomials, _depths(system, definitions))
    if not directions:
        return None
    values, added = _differences(system, used, directions)
    changed = [p.substitute(values) if k in group else p for k, p in enumerate(polynomials)]
    rest = iter(changed[len(definitions) + len(system.outputs) :])
    renewed_atoms: dict[int, Polynomial] = {}
    for variable in atoms:  # An atom comes after the atoms in its arguments.
        atom = ring.atom_of(variable)
        new = [next(rest).substitute(renewed_atoms) for _ in atom.arguments]
        if any(a != b for a, b in zip(new, atom.arguments, strict=True)):
            renewed_atoms[variable] = ring.atom(atom.op, *new)
    changed = [polynomial.substitute(renewed_atoms) for polynomial in changed]
    renewed = tuple(Definition(d.variable, p) for d, p in zip(definitions, changed, strict=False))
    outputs = changed[len(definitions) : len(definitions) + len(system.outputs)]
    return System(ring, system.n_inputs, (*added, *renewed), tuple(outputs))


def _differences(
    system: System, used: list[int], directions: list[list[Fraction]]
) -> tuple[dict[int, Polynomial], list[Definition]]:
    """Set one variable of each direction to zero.

    Return the replacements of variables, and the definitions of the differences.
    """
    ring = system.ring
    values: dict[int, Polynomial] = {}
    added: list[Definition] = []
    for direction in directions:
        moved = [k for k, step in enumerate(direction) if step]
        base = moved[-1]
        values[used[base]] = ring.constant(0)
        for k in moved[:-1]:
            ratio = direction[k] / direction[base]
            old = values.get(used[k], Polynomial(ring, {(used[k],): 1}))
            name = ring.variable(f"d_{ring.names[used[k]]}")
            added.append(Definition(len(ring.names) - 1, old - Polynomial(ring, {(used[base],): ratio})))
            values[used[k]] = name
    return values, added


def _invariant_group(
    polynomials: list[Polynomial], depth: Mapping[int, int]
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
        used = sorted(occurring, key=lambda variable: (-depth.get(variable, 0), variable))
        if len(used) <= VARIABLE_LIMIT:
            directions = _null_space(_jacobian([polynomials[k] for k in group], used), len(used))
            if directions:
                return set(group), used, directions
        least = min(freedom[k] for k in group)
        group.remove(max(k for k in group if freedom[k] == least))
    return set(), [], []


def _depths(system: System, definitions: Iterable[Definition]) -> dict[int, int]:
    """Return the depth of each named result above the inputs; inputs have depth 0 and are not listed."""
    polynomial_of = {definition.variable: definition.polynomial for definition in definitions}
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
    return len(used) - _rank(_jacobian([polynomial], used)) if len(used) <= VARIABLE_LIMIT else 0


def _rank(rows: list[dict[int, Rational]]) -> int:
    pivots: dict[int, dict[int, int]] = {}
    for given in rows:
        row = {k: v.numerator * pow(v.denominator, -1, PRIME) % PRIME for k, v in given.items()}
        while row:
            first = min(row)
            if first not in pivots:
                inverse = pow(row[first], -1, PRIME)
                pivots[first] = {k: v * inverse % PRIME for k, v in row.items()}
                break
            factor = row[first]
            for k, value in pivots[first].items():
                total = (row.get(k, 0) - factor * value) % PRIME
                if total:
                    row[k] = total
                else:
                    row.pop(k, None)
    return len(pivots)


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
