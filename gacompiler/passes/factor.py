"""Joint factorisation of several sums of products by greedy extraction of common divisors.

This is the *fast extract* algorithm of multi-level logic synthesis (Rajski & Vasudevamurthi, IEEE Trans. CAD 11(6),
1992), applied to polynomials as by Hosangadi, Fallah and Kastner (IEEE Trans. CAD 25(10), 2006). Two kinds of divisors
are searched in all sums simultaneously:

- a sum of two terms, up to sign, found by dividing a pair of terms by their common factor;
- a product of two literals.

The divisor that saves most operations is named and substituted everywhere, until no divisor saves any. A coefficient
other than one is treated as a literal, like a variable, so that common numeric factors are found by the same rule.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from dataclasses import dataclass
from fractions import Fraction
from heapq import heappop, heappush

from ..algebra.blades import Rational
from ..rings.polynomial import Polynomial
from .kernel_extraction import Cube, Sum, best_divisor

Literal = int

_NUMBER = 1 << 30
"""Literals from this value on represent numbers. They sort after all variables."""


@dataclass(frozen=True, slots=True)
class Factored:
    """Sums after extraction: the given sums, followed by one for each new variable.

    `is_final` states that there is nothing to extract, so that the other policies of the same cost give the same sums.
    """

    sums: tuple[Sum, ...]
    n_given: int
    first_new: int
    numbers: tuple[Fraction, ...]
    is_final: bool

    def number(self, literal: Literal) -> Fraction | None:
        """Return the number that a literal represents, or None for a variable."""
        return self.numbers[literal - _NUMBER] if literal >= _NUMBER else None

    def new_sum(self, variable: int) -> Sum | None:
        """Return the sum that defines a variable if it was introduced by the extraction, else None."""
        k = variable - self.first_new
        return self.sums[self.n_given + k] if 0 <= k < len(self.sums) - self.n_given else None


@dataclass(frozen=True, slots=True)
class Policy:
    """Options whose best values depend on the kernel, so that callers try several.

    Attributes
    ----------
    prefer_products : bool
        Whether a product is extracted before a sum that saves the same number of operations.
    split_numbers : bool
        Whether terms of a sum that have the same numeric factor are collected first: ``x + 2 (...)``.
    long_sums_first : bool
        Whether common divisors of three or more terms are extracted first (`gacompiler.passes.kernel_extraction`).
    fused : bool
        Whether a sum and one product are counted as one operation, as on machines with fused multiply-add.
    expanded : bool
        Whether no divisors are extracted.
    """

    prefer_products: bool = False
    split_numbers: bool = False
    long_sums_first: bool = False
    fused: bool = False
    expanded: bool = False


def factor(polynomials: tuple[Polynomial, ...], first_new: int, policy: Policy) -> Factored:
    """Extract common divisors from `polynomials`; new variables are numbered from `first_new`."""
    extraction = _Extraction(first_new, policy)
    for polynomial in polynomials:
        extraction.append(polynomial)
    if not policy.expanded:
        extraction.run()
    sums = tuple(extraction.sums)
    is_final = (
        len(sums) == len(polynomials)
        and not (policy.fused or policy.expanded or extraction.has_common_numbers)
        and best_divisor(extraction.sums) is None
    )
    return Factored(sums, len(polynomials), first_new, tuple(extraction.numbers), is_final)


def _size(value: Rational) -> Rational:
    return value if value > 0 else -value


def _common(a: Cube, b: Cube) -> tuple[Cube, Cube, Cube]:
    """Return the common factor of two cubes, and both cofactors."""
    i = j = 0
    if a and b and (a[-1] < b[0] or b[-1] < a[0]):
        return (), a, b
    shared: list[int] = []
    left: list[int] = []
    right: list[int] = []
    while i < len(a) and j < len(b):
        if a[i] == b[j]:
            shared.append(a[i])
            i += 1
            j += 1
        elif a[i] < b[j]:
            left.append(a[i])
            i += 1
        else:
            right.append(b[j])
            j += 1
    return tuple(shared), (*left, *a[i:]), (*right, *b[j:])


SumKey = tuple[Cube, Cube, int]
PairKey = tuple[Literal, Literal]
Place = tuple[int, Cube, Cube]


class _Extraction:
    def __init__(self, first_new: int, policy: Policy) -> None:
        self.sums: list[Sum] = []
        self._groups: list[dict[Rational, list[tuple[Cube, Rational]]]] = []
        self.numbers: list[Fraction] = []
        self.has_common_numbers = False
        self._next = first_new
        self._rank = (1, 0) if policy.prefer_products else (0, 1)
        self._split = policy.split_numbers and not policy.expanded
        self._fused = int(policy.fused)
        self._long_sums_first = policy.long_sums_first
        self._literal_of: dict[Fraction, Literal] = {}
        self._places: dict[SumKey, dict[Place, int]] = defaultdict(dict)
        self._saved: dict[SumKey, int] = defaultdict(int)
        self._uses: dict[PairKey, dict[tuple[int, Cube], int]] = defaultdict(dict)
        self._count: dict[PairKey, int] = defaultdict(int)
        self._heap: list[tuple[int, int, tuple[object, ...], bool]] = []
        self._known_pairs: dict[tuple[Cube, Cube], tuple[Cube, Cube, int, int]] = {}

    def append(self, polynomial: Polynomial) -> None:
        """Append a sum for a polynomial."""
        self.sums.append({})
        self._groups.append({})
        sizes: Counter[Rational] = Counter(_size(value) for value in polynomial.terms.values())
        self.has_common_numbers |= any(size != 1 and count > 1 for size, count in sizes.items())
        for monomial, value in polynomial.key:
            size = _size(value)
            if self._split and size != 1 and sizes[size] > 1:
                self._groups[-1].setdefault(size, []).append((monomial, value))
            else:
                self._add(len(self.sums) - 1, monomial, value)

    def run(self) -> None:
        """Extract divisors until none saves an operation."""
        for index, groups in enumerate(self._groups):
            for size, terms in sorted(groups.items()):
                variable = self._define({})
                for monomial, value in terms:
                    self._add(len(self.sums) - 1, monomial, 1 if value > 0 else -1)
                self._add(index, (variable,), size)
        while self._long_sums_first and (found := best_divisor(self.sums)):
            divisor, places = found
            variable = self._define({})
            for cube, sign in divisor:
                self._add(len(self.sums) - 1, cube, sign)
            for index, cofactor, sign in places:
                for cube, _ in divisor:
                    self._remove(index, tuple(sorted((*cofactor, *cube))))
                self._add(index, tuple(sorted((*cofactor, variable))), sign)
        while self._heap:
            value, rank, key, checked = heappop(self._heap)
            if rank == self._rank[0]:
                self._try_sum(-value, rank, key, checked)  # type: ignore[arg-type]
            else:
                self._try_product(-value, key)  # type: ignore[arg-type]

    # -- terms ------------------------------------------------------------------------------------------------------

    def _number(self, value: Fraction) -> Literal:
        if value not in self._literal_of:
            self._literal_of[value] = _NUMBER + len(self.numbers)
            self.numbers.append(value)
        return self._literal_of[value]

    def _add(self, index: int, cube: Cube, value: Rational) -> None:
        """Add ``value * cube`` to a sum; signs are kept separate from magnitudes."""
        size = _size(value)
        if size != 1:
            cube = tuple(sorted((*cube, self._number(Fraction(size)))))
        sign = 1 if value > 0 else -1
        present = self.sums[index].get(cube)
        if present is not None:
            self._remove(index, cube)
            if present == sign:
                self._add(index, cube, 2 * sign)
            return
        self._register(index, cube, sign, 1)
        self.sums[index][cube] = sign

    def _remove(self, index: int, cube: Cube) -> None:
        sign = self.sums[index].pop(cube)
        self._register(index, cube, sign, -1)

    def _register(self, index: int, cube: Cube, sign: int, change: int) -> None:
        """Register or unregister every divisor that this term forms with the other terms of its sum."""
        places, saved, heap, rank = self._places, self._saved, self._heap, self._rank[0]
        known = self._known_pairs
        for other, other_sign in self.sums[index].items():
            both = (cube, other) if cube < other else (other, cube)
            found = known.get(both)
            if found is None:
                found = known[both] = self._divisor(*both)
            left, right, saving, definition = found
            key = (left, right, sign * other_sign)
            if change > 0:
                places[key][(index, *both)] = saving
            else:
                del places[key][(index, *both)]
            total = saved[key] + change * saving
            saved[key] = total
            if total > definition:
                heappush(heap, (definition - total, rank, key, False))
        for x, y, times in _literal_pairs(cube) if len(cube) > 2 * self._fused else ():
            pair = (x, y)
            if change > 0:
                self._uses[pair][(index, cube)] = times
            else:
                del self._uses[pair][(index, cube)]
            self._count[pair] += change * times
            if self._count[pair] > 1:
                heappush(self._heap, (1 - self._count[pair], self._rank[1], pair, False))

    def _divisor(self, a: Cube, b: Cube) -> tuple[Cube, Cube, int, int]:
        """Return the sum that divides ``a + b``, what each of its uses saves, and what it costs to compute it once."""
        fused = self._fused
        shared, left, right = _common(a, b)
        if (len(right), right) < (len(left), left):
            left, right = right, left
        saving = max(1, len(a) - fused) + max(1, len(b) - fused) - max(1, len(shared) + 1 - fused)
        return left, right, saving, self._definition(left, right)

    def _definition(self, left: Cube, right: Cube) -> int:
        return max(1, len(left) - self._fused) + max(1, len(right) - self._fused) - 1

    # -- divisors ---------------------------------------------------------------------------------------------------

    def _try_sum(self, value: int, rank: int, key: SumKey, checked: bool) -> None:
        left, right, relative = key
        definition = self._definition(left, right)
        if not checked and value != self._saved[key] - definition:
            return
        chosen = self._disjoint(key)
        actual = sum(saving for _, saving in chosen) - definition
        if actual <= 0 or (checked and actual != value):
            return
        if actual < value and self._heap and -self._heap[0][0] > actual:
            heappush(self._heap, (-actual, rank, key, True))
            return
        variable = self._define({left: 1, right: relative})
        for (index, a, b), _ in chosen:
            shared, a_left, _ = _common(a, b)
            sign = self.sums[index][a if a_left == left else b]
            self._remove(index, a)
            self._remove(index, b)
            self._add(index, tuple(sorted((*shared, variable))), sign)

    def _disjoint(self, key: SumKey) -> list[tuple[Place, int]]:
        """Return occurrences that share no term, in order of decreasing savings."""
        chosen = []
        taken: set[tuple[int, Cube]] = set()
        for place, saving in sorted(self._places[key].items(), key=lambda item: (-item[1], item[0])):
            index, a, b = place
            if (index, a) in taken or (index, b) in taken:
                continue
            taken |= {(index, a), (index, b)}
            chosen.append((place, saving))
        return chosen

    def _try_product(self, value: int, pair: PairKey) -> None:
        if value != self._count[pair] - 1:
            return
        places = sorted(self._uses[pair].items())
        variable = self._define({pair: 1})
        for (index, cube), times in places:
            rest = list(cube)
            for _ in range(times):
                rest.remove(pair[0])
                rest.remove(pair[1])
            sign = self.sums[index][cube]
            self._remove(index, cube)
            self._add(index, tuple(sorted(rest + [variable] * times)), sign)

    def _define(self, terms: Sum) -> int:
        variable = self._next
        self._next += 1
        self.sums.append({})
        for cube, sign in terms.items():
            self.sums[-1][cube] = sign
        return variable


def _literal_pairs(cube: Cube) -> list[tuple[Literal, Literal, int]]:
    """Return the distinct pairs of literals in a cube, and the number of disjoint copies of each."""
    count: dict[int, int] = {}
    for literal in cube:
        count[literal] = count.get(literal, 0) + 1
    literals = list(count)
    pairs = [(x, x, count[x] // 2) for x in literals if count[x] > 1]
    pairs += [(x, y, min(count[x], count[y])) for i, x in enumerate(literals) for y in literals[i + 1 :]]
    return pairs
