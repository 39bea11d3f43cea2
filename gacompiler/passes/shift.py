"""Differences: inputs that only ever occur as differences are replaced by their differences.

If moving some inputs together along a constant direction changes nothing that is computed (points ``a, b, c`` by the
same translation), one of them can be put at zero and subtracted from the others. The directions are the constant null
vectors of the Jacobian, found by exact elimination.
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction

from ..rings.polynomial import Monomial, Polynomial
from .system import Definition, System

VARIABLE_LIMIT = 40
"""Kernels with more inputs are left as they are."""


def shift(system: System) -> System | None:
    """`system` in differences of its inputs, or None where there is no such direction."""
    definitions, atoms = system.live()
    polynomials = [*system.outputs, *(definition.polynomial for definition in definitions)]
    for atom in atoms:
        polynomials.extend(system.ring.atom_of(atom).arguments)
    used = sorted({v for p in polynomials for v in p.variables if 0 <= v < system.n_inputs})
    if not used or len(used) > VARIABLE_LIMIT or atoms:
        return None
    directions = _null_space(_jacobian(polynomials, used), len(used))
    if not directions:
        return None
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
            difference = old - Polynomial(ring, {(used[base],): ratio})
            name = ring.variable(f"d_{ring.names[used[k]]}")
            added.append(Definition(len(ring.names) - 1, difference))
            values[used[k]] = name
    changed = tuple(Definition(d.variable, d.polynomial.substitute(values)) for d in definitions)
    outputs = tuple(polynomial.substitute(values) for polynomial in system.outputs)
    return System(ring, system.n_inputs, (*added, *changed), outputs)


def _jacobian(polynomials: list[Polynomial], variables: list[int]) -> list[dict[int, Fraction]]:
    """One sparse row for each monomial of each polynomial's derivatives: coefficients of the unknown direction."""
    place = {variable: k for k, variable in enumerate(variables)}
    rows: list[dict[int, Fraction]] = []
    for polynomial in polynomials:
        by_monomial: dict[Monomial, dict[int, Fraction]] = {}
        for monomial, value in polynomial.terms.items():
            for variable in dict.fromkeys(monomial):
                if variable in place:
                    rest = list(monomial)
                    rest.remove(variable)
                    row = by_monomial.setdefault(tuple(rest), {})
                    k = place[variable]
                    row[k] = row.get(k, Fraction(0)) + Fraction(value) * monomial.count(variable)
        rows.extend(by_monomial.values())
    return rows


def _null_space(rows: list[dict[int, Fraction]], n: int) -> list[list[Fraction]]:
    """Null vectors, one for each free column of the reduced row echelon form."""
    pivots: dict[int, dict[int, Fraction]] = {}
    for given in rows:
        row = {k: v for k, v in given.items() if v}
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
