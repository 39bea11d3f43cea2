"""Random numbers in kernels are those of integer arithmetic, and pass tests that fewer rounds fail."""

from __future__ import annotations

from fractions import Fraction
from functools import cache
from itertools import pairwise
from math import isqrt
from random import Random
from typing import Any

import numpy as np
import pytest
from backend_programs import module_source
from scipy.stats import chi2
from text_mutations import mutations

import gacompiler
from gacompiler import SCALAR, array, floor, jvp, kernel, random_integer, total, uniform
from gacompiler.backends import c_source, python_source
from gacompiler.backends.readers import c_functions, c_programs, python_functions, python_programs
from gacompiler.errors import GacError
from gacompiler.passes.pipeline import compile_kernel
from tests.support.all_cases import all_cases

PRIME = 2**25 - 39
"""The largest prime below 2**25."""
SIGMAS = 5
"""A normally distributed number is farther from its mean with a probability of 6e-7."""
RARE = 1e-6
"""The probability of values of chi-squared that fail a test."""


@kernel(seed=SCALAR, counter=SCALAR, n=SCALAR)
def drawn(seed: Any, counter: Any, n: Any) -> Any:
    """A number and an integer."""
    return uniform(seed, counter), random_integer(seed, counter, n)


@kernel(x=SCALAR, y=SCALAR)
def cells(x: Any, y: Any) -> Any:
    """Places in cells of a grid."""
    return x - floor(x) * y, floor(3 * y + x) * x, floor(floor(x) / 2 - y)


def truth(seed: int, counter: int) -> int:
    """The number of a counter, below the square of the prime, by powers of integers."""
    keys = divmod(seed, PRIME)
    left, right = divmod(counter, PRIME)
    for k, prime in enumerate((2, 3, 5, 7, 11, 13, 17, 19)):
        left, right = right, (left + pow(right + keys[k % 2] + isqrt(prime * PRIME**2), 3, PRIME)) % PRIME
    return left * PRIME + right


@cache
def compiled() -> Any:
    return gacompiler.compile(drawn, effort=0)


def numbers(seed: Any, counter: Any) -> np.ndarray[Any, Any]:
    found: np.ndarray[Any, Any] = compiled()(seed, np.asarray(counter, float), 2.0)[0]
    return found


def operands() -> list[tuple[int, int, int]]:
    """Seeds, counters and numbers of integers of all sizes, with the limits."""
    random = Random(0)
    sizes = [(random.randrange(50), random.randrange(50), random.randrange(1, 26)) for _ in range(500)]
    found = [tuple(random.randrange(1 << k) for k in each) for each in sizes]
    limits = [0, PRIME - 1, PRIME, PRIME + 1, 2 * PRIME - 1, PRIME**2 // 2, 2**49]
    return [(a, b, n + 1) for a, b, n in found] + [(a, b, 2**25) for a in limits for b in limits]


def test_numbers_are_those_of_integer_arithmetic() -> None:
    """Compiled kernels, calls with floats, and calls with exact numbers, which give fractions."""
    given = operands()
    right = [truth(a, b) for a, b, _ in given]
    found, integers = compiled()(*np.array(given, float).T)
    assert np.array_equal(found, [number * (1 / PRIME**2) for number in right])
    assert np.array_equal(integers, [number * n // PRIME**2 for number, (_, _, n) in zip(right, given, strict=True)])
    for (a, b, n), number in list(zip(given, right, strict=True))[::25]:
        assert uniform(a, b) * PRIME**2 == number and random_integer(a, b, n) == number * n // PRIME**2
        assert float(uniform(float(a), float(b))) == number * (1 / PRIME**2)
        assert random_integer(float(a), float(b), float(n)) == number * n // PRIME**2


def test_the_largest_number_is_below_one() -> None:
    assert (PRIME**2 - 1) * (1 / PRIME**2) < 1


@pytest.mark.slow
def test_fractional_parts_are_ignored_and_derivatives_are_zero() -> None:
    assert uniform(3.75, 8.5) == uniform(3.0, 8.0) == float(uniform(3, 8))
    assert gacompiler.compile(jvp(drawn, "counter"))(3.0, 8.0, 5.0, 1.0)[2:] == (0, 0)


def too_rare(counts: np.ndarray[Any, Any]) -> bool:
    """Whether chi-squared of counts with equal expectations is too large or too small."""
    expected = counts.sum() / counts.size
    value = float(((counts - expected) ** 2 / expected).sum())
    return bool(min(chi2.sf(value, counts.size - 1), chi2.cdf(value, counts.size - 1)) < RARE)


@all_cases("kind", ["counters", "large counters", "steps", "seeds"])
def test_frequencies_of_numbers_pairs_and_triples(kind: str) -> None:
    k = np.arange(150000)
    seed, counter = {
        "counters": (1, k),
        "large counters": (2, k + 2.0**48),
        "steps": (3, 2.0**26 * k),
        "seeds": (k.astype(float), 7),
    }[kind]
    found = numbers(seed, counter)
    assert found.min() >= 0 and found.max() < 1 and len(np.unique(found)) == k.size
    cell = (found * 16).astype(int)
    assert not too_rare(np.bincount((found * 1000).astype(int), minlength=1000))
    assert not too_rare(np.bincount(cell[::2] * 16 + cell[1::2], minlength=256))
    assert not too_rare(np.bincount(cell[::3] * 256 + cell[1::3] * 16 + cell[2::3], minlength=4096))
    for distance in (1, 2, 3):
        correlation = np.corrcoef(found[distance:], found[:-distance])[0, 1]
        assert abs(correlation) < SIGMAS / k.size**0.5


@pytest.mark.parametrize("changed", ["seed", "counter"])
def test_every_bit_changes_half_of_the_results(changed: str) -> None:
    """Each of 16 bits of the result flips with a probability of 1/2, whichever of 49 bits of an operand is changed."""
    rng = np.random.default_rng(3)
    n, steps = 400, 1 << np.arange(49)
    seed, counter = rng.integers(0, 2**20, (2, n))
    before = (numbers(seed.astype(float), counter) * 2**16).astype(int)
    own = (seed if changed == "seed" else counter)[None] ^ steps[:, None]
    other = np.broadcast_to(counter if changed == "seed" else seed, own.shape)
    pair = (own, other) if changed == "seed" else (other, own)
    after = (numbers(pair[0].astype(float), pair[1]) * 2**16).astype(int)
    flips = (((after ^ before)[..., None] >> np.arange(16)) & 1).sum(axis=1)
    assert np.abs(flips - n / 2).max() < SIGMAS * (n / 4) ** 0.5


def test_integers_have_equal_frequencies() -> None:
    found = compiled()(5.0, np.arange(70000.0), 7.0)[1]
    assert set(found) == set(range(7)) and not too_rare(np.bincount(found.astype(int)))
    assert not too_rare(np.bincount([int(7 * a + b) for a, b in pairwise(found)][::2], minlength=49))


@pytest.mark.parametrize("definition", [cells, pytest.param(drawn, marks=pytest.mark.slow)], ids=lambda each: each.name)
@pytest.mark.parametrize("language", ["C", "Python"])
def test_changes_of_text_are_detected(definition: Any, language: str) -> None:
    """A changed text is rejected, or gives another program; where remainders may be congruent, with equal numbers."""
    module = module_source("one", compile_kernel(definition).program)
    text, read = (c_source(module), c_functions) if language == "C" else (python_source(module), python_functions)
    points = [(Fraction(7, 3), Fraction(-5, 2), 3), (Fraction(2**49 - 5), Fraction(PRIME**2 - PRIME), 2**20 + 1)]
    points += [(Fraction(a), Fraction(b), n) for a, b, n in operands()[::10]]

    def values(text: str) -> Any:
        if definition is drawn:
            return (c_programs if language == "C" else python_programs)(text)[definition.name]
        function = read(text)[definition.name]
        n = len(definition.parameters)
        return [function(*([x] for x in point[:n])) for point in points]

    right = values(text)
    every = list(mutations(text, definition.name))
    for mutation in Random(1).sample(every, 20):
        try:
            found = values(mutation.text)
        except GacError:
            continue
        assert found != right, (mutation.kind, mutation.line, mutation.changed)


def test_a_parameter_may_be_named_like_the_function() -> None:
    """In Python and C, its name would hide the function."""

    @kernel(floor=SCALAR)
    def above(floor: Any) -> Any:
        """What is above an integer."""
        return floor - gacompiler.floor(floor)

    module = module_source("one", compile_kernel(above).program)
    assert "above(floor_)" in python_source(module)
    for read in (c_functions(c_source(module)), python_functions(python_source(module))):
        assert read["above"]([Fraction(-7, 3)]) == ((Fraction(2, 3),),)
    assert gacompiler.compile(above)(floor=2.75) == 0.75


@pytest.mark.parametrize("dtype", [np.float32, np.int16, np.uint8])
def test_arguments_of_other_types_are_converted_to_doubles(dtype: Any) -> None:
    """Single precision rounds the products, so that its numbers would not be random."""
    counters = np.arange(100, dtype=dtype)
    expected = [truth(3, counter) * (1 / PRIME**2) for counter in range(100)]
    for _ in range(3):  # also in calls that the extension could run
        found, _ = compiled()(dtype(3), counters, dtype(2))
        assert found.dtype == np.float64 and np.array_equal(found, expected)

    @kernel(seed=SCALAR, counters=array(SCALAR, "n"))
    def sum_of_numbers(seed: Any, counters: Any) -> Any:
        """A sum of random numbers."""
        return total(lambda counter: uniform(seed, counter), counters)

    found = gacompiler.compile(sum_of_numbers, effort=0)(dtype(3), counters)
    assert found.dtype == np.float64 and found == pytest.approx(sum(expected), abs=1e-12)
