"""Extraction of common divisors of three or more terms, as intersections of quotients.

The common terms of two quotients of sums by literals, up to sign, form a divisor of both sums, with the literals as
cofactors. These are the *kernel intersections* of multi-level logic synthesis (Brayton & McMullen, ISCAS 1982),
restricted to cofactors of at most one literal.
"""

from __future__ import annotations

Cube = tuple[int, ...]
Sum = dict[Cube, int]
"""A mapping from cubes to signs. Cubes are sorted tuples of literals with repetition."""
Divisor = tuple[tuple[Cube, int], ...]
Place = tuple[int, Cube, int]
"""An occurrence of a divisor: the index of the sum, the cofactor, and the sign."""

SHORTEST = 3
"""Minimum number of terms of a divisor. Divisors of two terms are extracted by `gacompiler.passes.factor`."""
TERM_LIMIT = 160
"""Maximum total number of terms of the sums."""


def best_divisor(sums: list[Sum]) -> tuple[Divisor, list[Place]] | None:
    """Return the divisor that saves most operations and its occurrences, or None if no divisor saves any."""
    if sum(map(len, sums)) > TERM_LIMIT:
        return None
    places: dict[Divisor, dict[Place, None]] = {}
    quotients = _quotients(sums)
    for k, (index, cofactor, quotient) in enumerate(quotients):
        for other_index, other_cofactor, other in quotients[k + 1 :]:
            for relative in (1, -1):
                common = sorted(cube for cube, sign in quotient.items() if other.get(cube) == relative * sign)
                if len(common) < SHORTEST:
                    continue
                lead = quotient[common[0]]
                divisor = tuple((cube, quotient[cube] * lead) for cube in common)
                found = places.setdefault(divisor, {})
                found[index, cofactor, lead] = None
                found[other_index, other_cofactor, lead * relative] = None
    best: tuple[int, Divisor, list[Place]] | None = None
    for divisor in sorted(places):
        chosen = _disjoint(divisor, list(places[divisor]))
        value = sum(_saving(divisor, cofactor) for _, cofactor, _ in chosen) - _cost(divisor)
        if value > 0 and (best is None or value > best[0]):
            best = (value, divisor, chosen)
    return None if best is None else best[1:]


def _quotients(sums: list[Sum]) -> list[tuple[int, Cube, Sum]]:
    found: list[tuple[int, Cube, Sum]] = []
    for index, terms in enumerate(sums):
        if len(terms) < SHORTEST:
            continue
        found.append((index, (), terms))
        for literal in sorted({literal for cube in terms for literal in cube}):
            quotient = {_without(cube, literal): sign for cube, sign in terms.items() if literal in cube}
            if len(quotient) >= SHORTEST:
                found.append((index, (literal,), quotient))
    return found


def _without(cube: Cube, literal: int) -> Cube:
    place = cube.index(literal)
    return cube[:place] + cube[place + 1 :]


def _disjoint(divisor: Divisor, places: list[Place]) -> list[Place]:
    """Return occurrences that share no term."""
    taken: set[tuple[int, Cube]] = set()
    chosen = []
    for index, cofactor, sign in sorted(places):
        terms = {(index, tuple(sorted((*cofactor, *cube)))) for cube, _ in divisor}
        if not terms & taken:
            taken |= terms
            chosen.append((index, cofactor, sign))
    return chosen


def _saving(divisor: Divisor, cofactor: Cube) -> int:
    before = sum(max(len(cube) + len(cofactor) - 1, 0) for cube, _ in divisor) + len(divisor) - 1
    return before - len(cofactor)


def _cost(divisor: Divisor) -> int:
    return sum(max(len(cube) - 1, 0) for cube, _ in divisor) + len(divisor) - 1
