"""Resubstitution: results are expressed in terms of other results if polynomial division makes them cheaper.

For example, the offset of the plane through three points is the inner product of its normal with one of the points.
This is found by dividing the polynomial of the offset by those of the normal, with remainder zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from ..algebra.blades import Rational, exact
from ..rings.polynomial import Monomial, Polynomial, quotient
from ..rings.sparse import weight
from .system import Definition, System

TERM_LIMIT = 400
"""Systems with more terms than this are not changed."""
STEPS = 200
"""Maximum number of division steps."""


def resubstitute(system: System) -> System | None:
    """Divide the most expensive results of `system` by the others. Return None if this saves nothing."""
    if sum(len(p.terms) for p in system.outputs) > TERM_LIMIT:
        return None
    ring = system.ring
    order = sorted(
        range(len(system.outputs)), key=lambda k: (len(system.outputs[k].terms), system.outputs[k].degree, k)
    )
    names: dict[int, Polynomial] = {}
    outputs = list(system.outputs)
    divided = False
    for place, k in enumerate(order):
        others = [j for j in order[:place] if len(outputs[j].terms) > 1]
        found = _divide(system.outputs[k], [system.outputs[j] for j in others])
        if found is None:
            continue
        quotients, remainder = found
        divided = True
        result = remainder
        for j, factor in zip(others, quotients, strict=True):
            if not factor.is_zero:
                if j not in names:
                    names[j] = ring.variable(f"r{j}")
                result = result + factor * names[j]
        outputs[k] = result
    if not divided:
        return None
    added = []
    for j, name in names.items():
        (variable,) = name.variables
        added.append(Definition(variable, outputs[j]))
        outputs[j] = name
    return System(ring, system.n_inputs, (*system.definitions, *added), tuple(outputs))


def _divide(polynomial: Polynomial, divisors: Sequence[Polynomial]) -> tuple[list[Polynomial], Polynomial] | None:
    """Return the quotients and the remainder if they cost less than the polynomial, else None."""
    leads = [(divisor.leading, divisor) for divisor in divisors]
    rest = dict(polynomial.terms)
    remainder: dict[Monomial, Rational] = {}
    quotients: list[dict[Monomial, Rational]] = [{} for _ in divisors]
    for _ in range(STEPS):
        if not rest:
            break
        monomial = min(rest, key=lambda m: (-len(m), m))
        value = rest[monomial]
        for number, (lead, divisor) in enumerate(leads):
            cofactor = quotient(monomial, lead)
            if cofactor is not None:
                factor = exact(Fraction(value) / divisor.terms[lead]) if value % divisor.terms[lead] == 0 else None
                if factor is None:
                    continue
                quotients[number][cofactor] = quotients[number].get(cofactor, 0) + factor
                for part, part_value in divisor.terms.items():
                    target = tuple(sorted(part + cofactor))
                    total = rest.get(target, 0) - factor * part_value
                    if total:
                        rest[target] = exact(total)
                    else:
                        rest.pop(target, None)
                break
        else:
            remainder[monomial] = rest.pop(monomial)
    else:
        return None
    before = sum(weight(m, v) for m, v in polynomial.terms.items())
    after = sum(weight(m, v) for m, v in remainder.items()) + sum(
        weight(m, v) + 1 for q in quotients for m, v in q.items()
    )
    if after >= before:
        return None
    ring = polynomial.ring
    return [Polynomial(ring, terms) for terms in quotients], Polynomial(ring, remainder)
