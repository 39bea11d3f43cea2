"""Exponentials, logarithms and roots: inverse to each other, and equal to matrix functions of other libraries."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from functools import cache
from typing import Any

import mpmath
import numpy as np
import pytest
from exact_elements import name_of
from scipy.linalg import expm
from selection import some_slow

import gacompiler as ga
from gacompiler import SCALAR, Layout, jvp, kernel
from gacompiler.algebra.algebra import Algebra
from gacompiler.algebra.catalog import (
    CGA2,
    CGA3,
    COMPLEX,
    DOUBLE_NUMBERS,
    DUAL_NUMBERS,
    G33,
    PGA2,
    PGA3,
    QUATERNIONS,
    STA,
    VGA2,
    VGA3,
    orthogonal,
)  # fmt: skip
from gacompiler.algebra.multivector import Multivector
from gacompiler.algebra.signs import inertia
from gacompiler.errors import KernelError
from gacompiler.frontend.kernel import Kernel
from tests.support.all_cases import all_cases

N = 20_000
CATALOG = (VGA2, VGA3, PGA2, PGA3, CGA2, CGA3, STA)
FOUR, FIVE, SPLIT, TWO_TIMES, SPACETIME, TWO_NULL = (
    orthogonal(*signature) for signature in ((4,), (5,), (2, 2), (3, 2), (3, 1, 1), (3, 0, 2))
)
OTHERS = (FOUR, FIVE, SPLIT, TWO_TIMES, SPACETIME, TWO_NULL)
UP_TO_FIVE = (*CATALOG, *OTHERS)
LONG = (CGA2, FOUR, CGA3, STA, FIVE, SPLIT, TWO_TIMES, SPACETIME, TWO_NULL)
"""Algebras whose functions take seconds to compile."""
PLANES: dict[Algebra, tuple[tuple[str, ...], ...]] = {
    VGA2: (("e12",),),
    VGA3: (("e12",),),
    PGA2: (("e12",), ("e20",)),
    PGA3: (("e12", "e03"), ("e01",)),
    CGA2: (("e12", "e0inf"), ("e1inf",), ("e0inf",)),
    CGA3: (("e12", "e3inf/2 - e30"), ("e12", "e0inf"), ("e12", "e3inf"), ("e1inf",), ("e0inf",)),
    STA: (("g12", "g30"), ("g10 + g12",), ("g30",)),
    FOUR: (("e12", "e34"),),
    SPLIT: (("e12", "e34"), ("e13", "e24"), ("e12 - e23",)),
}
"""Commuting simple bivectors: rotations, boosts, translations and null rotations, alone and in pairs."""
ANGLES = (0.0, 1e-12, 1e-9, 1e-5, 0.3, 0.9, *(np.pi / 2 + d for d in (-1e-12, 0, 1e-12)), 2.5)
ANGLES = (*ANGLES, *(np.pi + d for d in (-1e-12, 0.0, 1e-12)))
Array = np.ndarray[Any, Any]
Function = Callable[..., Array]


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(11)


def bivectors(algebra: Algebra) -> Layout:
    return algebra.layout("BIVECTORS", " ".join(algebra.spelling(blade)[1] for blade in algebra.blades(2)))


@cache
def functions(algebra: Algebra) -> tuple[Function, Function, Function]:
    """exp, log and sqrt of one algebra: those of STA in C, otherwise by numpy."""

    @kernel(b=bivectors(algebra), returns=algebra.even)
    def exponential(b):  # type: ignore[no-untyped-def]
        return ga.exp(b)

    @kernel(r=algebra.UNIT_EVEN, returns=bivectors(algebra))
    def logarithm(r):  # type: ignore[no-untyped-def]
        return ga.log(r)

    @kernel(r=algebra.UNIT_EVEN, returns=algebra.even)
    def root(r):  # type: ignore[no-untyped-def]
        return ga.sqrt(r)

    backend = None if algebra in (CGA3, STA) else "arrays"
    return later(exponential, backend), later(logarithm, backend), later(root, backend)


def later(definition: Kernel, backend: str | None) -> Function:
    """A kernel that is compiled when it is called, without a search for cheaper forms, which other tests compare."""
    return lambda *arguments: ga.compile(definition, backend=backend, effort=0)(*arguments)


@cache
def table(algebra: Algebra) -> Array:
    """Structure constants of the even subalgebra in the order of its layout: ``(a b)_k = a_i b_j table[i, j, k]``."""
    slots = algebra.even.stored
    place = {slot.blade: (k, slot.sign) for k, slot in enumerate(slots)}
    found = np.zeros((len(slots),) * 3)
    for i, a in enumerate(slots):
        for j, b in enumerate(slots):
            for blade, value in algebra.blade_product(a.blade, b.blade).items():
                k, sign = place[blade]
                found[i, j, k] += float(value) * a.sign * b.sign * sign
    return found


def product(algebra: Algebra, a: Array, b: Array) -> Array:
    """Products of even elements."""
    return np.einsum("...i,...j,ijk->...k", a, b, table(algebra), optimize=True)


def even(algebra: Algebra, b: Array) -> Array:
    """Bivectors as even elements."""
    found = np.zeros((*b.shape[:-1], algebra.even.size))
    places = [k for k, slot in enumerate(algebra.even.stored) if slot.blade.bit_count() == 2]
    found[..., places] = b
    return found


def grade_2(algebra: Algebra, x: Array) -> Array:
    return x[..., [k for k, slot in enumerate(algebra.even.stored) if slot.blade.bit_count() == 2]]


def reverse(algebra: Algebra, x: Array) -> Array:
    return x * np.array([-1 if slot.blade.bit_count() & 2 else 1 for slot in algebra.even.stored])


def difference(a: Array, b: Array) -> Array:
    """The difference of each element, relative to its largest coefficient."""
    return np.abs(a - b).max(axis=-1) / np.maximum(np.abs(b).max(axis=-1), 1e-300)


def up_to_sign(a: Array, b: Array) -> Array:
    return np.minimum(difference(a, b), difference(a, -b))


def parse(algebra: Algebra, text: str) -> Array:
    """An even element from a sum of blades."""
    found = algebra.scalar(0)
    for term in text.replace("- ", "+ -").split(" + "):
        name, _, divisor = term.lstrip("-").partition("/")
        value = (-1.0 if term.startswith("-") else 1.0) / float(divisor or 1)
        found = found + algebra.multivector({name: value})
    return np.array([float(c) for c in algebra.even.coefficients(found)])


def simple_exponential(algebra: Algebra, plane: Array, size: Array) -> Array:
    """``exp(size plane)`` by the square of `plane`, 1, 0 or -1."""
    square = product(algebra, plane, plane)[0]
    c, s = {-1: (np.cos(size), np.sin(size)), 0: (np.ones_like(size), size), 1: (np.cosh(size), np.sinh(size))}[
        round(square)
    ]
    return c[:, None] * np.eye(algebra.even.size)[0] + s[:, None] * plane


def special(algebra: Algebra, rng: np.random.Generator) -> tuple[Array, Array, Array]:
    """Difficult bivectors, moved by random versors, and their exponentials as products over commuting parts.

    The last array is false for two simultaneous half turns up to rounding, which have no unique logarithm.
    """
    bs, versors, single = [], [], []
    sizes = np.array([*ANGLES, *(a + 1e-9 for a in ANGLES), *rng.uniform(0, 3, 12)])
    for planes in PLANES[algebra]:
        chosen = [parse(algebra, plane) for plane in planes]
        grid = np.array(np.meshgrid(*[sizes] * len(chosen))).reshape(len(chosen), -1)
        b = sum(angle[:, None] * plane for angle, plane in zip(grid, chosen, strict=True))
        r = simple_exponential(algebra, chosen[0], grid[0])
        for angle, plane in zip(grid[1:], chosen[1:], strict=True):
            r = product(algebra, r, simple_exponential(algebra, plane, angle))
        squares = [product(algebra, plane, plane)[0] for plane in chosen]
        cosines = [np.cos(angle) ** (square < -0.5) for angle, square in zip(grid, squares, strict=True)]
        single.append(np.abs(cosines).max(axis=0) > 1e-13)
        v = functions(algebra)[0](0.4 * rng.normal(size=(len(b), len(algebra.blades(2)))))
        bs.append(product(algebra, product(algebra, v, b), reverse(algebra, v)))
        versors.append(product(algebra, product(algebra, v, r), reverse(algebra, v)))
    return grade_2(algebra, np.concatenate(bs)), np.concatenate(versors), np.concatenate(single)


def left_matrix(algebra: Algebra, b: Array) -> Array:
    """The matrix of the product with a bivector from the left."""
    return np.einsum("i,ijk->kj", even(algebra, b), table(algebra))


def random_bivectors(algebra: Algebra, rng: np.random.Generator, largest: float) -> Array:
    """Random bivectors with norms from 1e-14 to `largest`."""
    n = N if algebra in CATALOG else N // 2
    found = rng.normal(size=(n, len(algebra.blades(2))))
    found /= np.linalg.norm(found, axis=1)[:, None]
    return found * largest * np.where(np.arange(n) % 2, 1, 10 ** rng.uniform(-14, 0, n))[:, None]


@pytest.mark.parametrize("algebra", some_slow(UP_TO_FIVE, *LONG), ids=name_of)
def test_functions_are_inverse_to_each_other(algebra: Algebra, rng: np.random.Generator) -> None:
    exponential, logarithm, root = functions(algebra)
    b = random_bivectors(algebra, rng, 1.2)
    r = exponential(b)
    assert difference(logarithm(r), b).max() < 1e-14
    assert difference(exponential(logarithm(-r)), r).max() < 1e-14
    half = root(r)
    few = slice(None, None, 20)
    assert difference(product(algebra, half[few], half[few]), r[few]).max() < 1e-14
    assert difference(half, exponential(b / 2)).max() < 1e-14


@pytest.mark.parametrize("algebra", some_slow(PLANES, CGA2, FOUR, CGA3, STA, SPLIT), ids=name_of)
def test_hard_versors(algebra: Algebra, rng: np.random.Generator) -> None:
    """Nearly the identity, nearly half turns, equal angles, boosts, translations, null rotations, in moved frames.

    A versor with large coefficients determines its action and its logarithm only up to an error with their square.
    """
    exponential, logarithm, root = functions(algebra)
    b, r, chosen = special(algebra, rng)
    condition = np.abs(r).max(axis=1) ** 2 + np.abs(b).max(axis=1) ** 2
    assert (difference(exponential(b), r) / condition).max() < 1e-14
    r, condition = r[chosen], condition[chosen]
    found, half = logarithm(r), root(r)
    condition_of_log = np.maximum(condition, np.abs(found).max(axis=1) ** 2)
    assert (up_to_sign(exponential(found), r) / condition_of_log).max() < 1e-14
    assert (up_to_sign(product(algebra, half, half), r) / condition).max() < 1e-14


@pytest.mark.parametrize("algebra", some_slow(UP_TO_FIVE, *LONG), ids=name_of)
def test_equal_to_functions_of_matrices(algebra: Algebra, rng: np.random.Generator) -> None:
    exponential, logarithm, _ = functions(algebra)
    b = random_bivectors(algebra, rng, 2.0)[1::2][:20]
    truth = np.array([expm(left_matrix(algebra, each))[:, 0] for each in b])
    assert difference(exponential(b), truth).max() < 1e-13
    back = np.array([expm(left_matrix(algebra, each))[:, 0] for each in logarithm(truth)])
    assert up_to_sign(back, truth).max() < 1e-12
    with mpmath.workdps(50):
        for each in b[:2]:
            column = mpmath.expm(mpmath.matrix(left_matrix(algebra, each).tolist()))[:, 0]
            assert difference(exponential(each), np.array([float(value) for value in column])) < 2e-15


@pytest.mark.parametrize(
    "algebra", some_slow([CGA3, FOUR, SPLIT, TWO_TIMES, TWO_NULL], CGA3, SPLIT, TWO_TIMES, TWO_NULL), ids=name_of
)
@pytest.mark.slow
def test_values_are_numbers_everywhere(algebra: Algebra) -> None:
    """Functions are defined at 0, on basis blades and sums of two with any squares, and for large arguments."""
    exponential, logarithm, root = functions(algebra)
    blades = np.eye(len(algebra.blades(2)))
    sums = (blades[:, None] + blades).reshape(-1, len(blades))
    b = np.concatenate([0 * blades[:1], *(size * sums for size in (1e-300, 1e-9, 1, 1.5))])
    r = exponential(b)
    assert np.isfinite(r).all() and np.isfinite(logarithm(r)).all() and np.isfinite(root(r)).all()
    assert np.isfinite(exponential(100 * sums)).all()


def test_two_half_turns_at_once_have_no_logarithm() -> None:
    with np.errstate(invalid="ignore", divide="ignore"):
        assert np.isnan(functions(FOUR)[1](np.eye(8)[-1])).any()


@pytest.mark.parametrize("algebra", some_slow([VGA3, PGA3, STA, CGA2], STA, CGA2), ids=name_of)
def test_derivatives_equal_those_of_the_series(algebra: Algebra, rng: np.random.Generator) -> None:
    """Derivatives along tangents, also at 0 and null elements, are blocks of the exponential of a larger matrix."""

    @kernel(b=bivectors(algebra), returns=algebra.even)
    def exponential(b):  # type: ignore[no-untyped-def]
        return ga.exp(b)

    derived = ga.compile(jvp(exponential, "b"), backend="arrays", effort=0)
    n = len(algebra.blades(2))
    special_ones = [grade_2(algebra, parse(algebra, planes[0])) for planes in PLANES[algebra]]
    for b in (np.zeros(n), *special_ones, *rng.normal(size=(5, n))):
        tangent = rng.normal(size=n)
        a, da = left_matrix(algebra, b), left_matrix(algebra, tangent)
        truth = expm(np.block([[a, da], [0 * a, a]]))[: len(a), len(a)]
        value, slope = derived(b, tangent)
        assert difference(slope, truth) < 1e-13
        assert difference(value, functions(algebra)[0](b)) < 1e-15


@pytest.mark.slow
def test_derivatives_of_logarithm_and_exponential_are_inverse(rng: np.random.Generator) -> None:
    @kernel(b=STA.BIVECTOR)
    def both(b):  # type: ignore[no-untyped-def]
        return ga.log(ga.exp(b), unit=True)

    b, tangent = 0.5 * rng.normal(size=(2, 50, 6))
    value, slope = ga.compile(jvp(both, "b"), backend="arrays", effort=0)(b, tangent)
    assert np.abs(value - b).max() < 1e-14 and np.abs(slope - tangent).max() < 1e-12


def numbers(algebra: Algebra, layout: Layout, along: Any = None) -> tuple[Function, Function, Function]:
    @kernel(a=layout, returns=layout)
    def exponential(a):  # type: ignore[no-untyped-def]
        return ga.exp(a)

    @kernel(a=layout, returns=layout)
    def logarithm(a):  # type: ignore[no-untyped-def]
        return ga.log(a, along=along)

    @kernel(a=layout, returns=layout)
    def root(a):  # type: ignore[no-untyped-def]
        return ga.sqrt(a, along=along)

    return later(exponential, "arrays"), later(logarithm, "arrays"), later(root, "arrays")


def test_complex_numbers(rng: np.random.Generator) -> None:
    exponential, logarithm, root = numbers(COMPLEX, COMPLEX.NUMBER)
    a = np.concatenate([rng.normal(size=(1000, 2)), [[-1, 0], [1, 0], [0, 1], [0, -2], [-3, 1e-14]]])
    z = a @ [1, 1j]
    assert np.abs(exponential(a) @ [1, 1j] - np.exp(z)).max() < 1e-14
    assert np.abs(logarithm(a) @ [1, 1j] - np.log(z)).max() < 1e-14
    assert np.abs(root(a) @ [1, 1j] - np.sqrt(z)).max() < 1e-14
    assert root(np.zeros(2)).tolist() == [0, 0] and exponential(np.zeros(2)).tolist() == [1, 0]


@pytest.mark.slow
def test_dual_and_double_numbers(rng: np.random.Generator) -> None:
    """A function of a dual number has its value and derivative, that of a double number has two values."""
    exponential, logarithm, root = numbers(DUAL_NUMBERS, DUAL_NUMBERS.NUMBER)
    x, y = rng.uniform(0.1, 3, size=(2, 1000))
    a = np.stack([x, y], axis=-1)
    for function, value, slope in (
        (exponential, np.exp, np.exp), (logarithm, np.log, lambda x: 1 / x), (root, np.sqrt, lambda x: 0.5 / np.sqrt(x))
    ):  # fmt: skip
        assert np.abs(function(a) - np.stack([value(x), y * slope(x)], axis=-1)).max() < 1e-13
    both = np.array([[0.5, 0.5], [0.5, -0.5]])
    for function, value in zip(numbers(DOUBLE_NUMBERS, DOUBLE_NUMBERS.NUMBER), (np.exp, np.log, np.sqrt), strict=True):
        alike = np.stack([x, x * (1 + 10 ** rng.uniform(-14, 0, 1000))], axis=-1)
        for values in (a, alike):
            assert np.abs(function(values @ both) - value(values) @ both).max() < 1e-13
    with np.errstate(invalid="ignore"):
        assert np.isnan(numbers(DOUBLE_NUMBERS, DOUBLE_NUMBERS.NUMBER)[1](np.array([-2.0, 1.0]))).any()


@pytest.mark.parametrize(
    ("algebra", "layout"),
    some_slow([(QUATERNIONS, QUATERNIONS.QUATERNION), (VGA3, VGA3.EVEN), (VGA2, VGA2.full)], (VGA2, VGA2.full)),
    ids=str,
)
@pytest.mark.slow
def test_numbers_of_more_dimensions(algebra: Algebra, layout: Layout, rng: np.random.Generator) -> None:
    exponential, logarithm, root = numbers(algebra, layout)
    a = rng.normal(size=(1000, layout.size)) * 10 ** rng.uniform(-8, 0, size=(1000, layout.size))
    if algebra is VGA2:  # two vectors have positive squares, so not all elements have logarithms
        a[:, 0] = 1 + np.abs(a).sum(axis=1)
    a = np.concatenate([a, np.eye(layout.size)[:1], -np.eye(layout.size)[:1]])
    assert difference(exponential(logarithm(a)), a).max() < 1e-14
    half = [algebra.full.coefficients(layout.element(list(row))) for row in root(a).tolist()]
    for row, original in zip(half, a.tolist(), strict=True):
        square = algebra.full.element(row) * algebra.full.element(row) - layout.element(original)
        assert max(map(abs, square.terms.values()), default=0) < 1e-14 * max(map(abs, original))


def test_numbers_with_null_parts() -> None:
    """In VGA2, the matrices of two rows, numbers with one negative eigenvalue have neither a root nor a logarithm."""
    _, logarithm, root = numbers(VGA2, VGA2.full)
    of = {  # 1, e1, e2, e12: the eigenvalues are w + u and w - u with u**2 = e1**2 + e2**2 - e12**2
        "one, twice, and a nilpotent part": [1.0, 1, 0, 1], "1 and 3": [2.0, 0.6, 0.8, 0], "complex": [-2, 0.1, 0.5, 2],
        "-1, without other part": [-1.0, 0, 0, 0],
        "0 and 2": [1.0, 0, 1, 0],
    }  # fmt: skip
    for name, a in of.items():
        square = VGA2.full.element(root(np.array(a)).tolist())
        assert difference(np.array(VGA2.full.coefficients(square * square), float), np.array(a)) < 1e-15, name
    without = [[-1.0, 1, 0, 1], [0, 1, 0, 1], [-1, -1, -1, -1], [-3, 0.6, 0.8, 0], [1, 2, 0, 0]]
    with np.errstate(all="ignore"):
        assert np.isnan(root(np.array(without))).any(-1).all()
        assert not np.isfinite(logarithm(np.array([*without, of["0 and 2"]]))).all(-1).any()


def test_six_dimensions(rng: np.random.Generator) -> None:
    for algebra in (G33, orthogonal(6)):
        b = rng.normal(size=15)
        b *= 4 / np.abs(np.linalg.eigvals(left_matrix(algebra, b))).max()
        element = bivectors(algebra).element(b.tolist())
        value = np.array([float(c) for c in algebra.even.coefficients(ga.exp(element))])
        assert difference(value, expm(left_matrix(algebra, b))[:, 0]) < 1e-13
        with pytest.raises(KernelError, match="up to five basis vectors"):
            ga.log(ga.exp(element))


def test_on_numbers_and_multivectors() -> None:
    assert ga.exp(0) == 1 and ga.log(1) == 0 and ga.sqrt(4) == 2 and ga.power(2.0, 3) == pytest.approx(8)
    e12 = PGA3.multivector({"e12": 0.5, "e03": 2.0})
    motor = ga.exp(e12)
    assert isinstance(motor, Multivector) and motor["1"] == pytest.approx(np.cos(0.5))
    assert ga.log(motor)["e03"] == pytest.approx(2) and ga.power(motor, 3)["1"] == pytest.approx(np.cos(1.5))
    assert max(map(abs, (ga.sqrt(motor) * ga.sqrt(motor) - motor).terms.values())) < 1e-15


def test_errors_of_elements_without_a_logarithm() -> None:
    e1, e2, e3 = VGA3.basis()
    for wrong in (e1, e1 + e2 * e3, 1 + e1 + e1 * e2 * e3 + e2 * e3):
        with pytest.raises(KernelError, match="expected a scalar"):
            ga.log(wrong)


def turning(algebra: Algebra) -> list[int]:
    """The indices of the basis bivectors that generate rotations, which have a nonzero square."""
    return [k for k, blade in enumerate(algebra.blades(2)) if algebra.blade_product(blade, blade).get(0)]


@cache
def powers(layout: Layout) -> Function:
    """Powers of unit versors, or of numbers."""

    @kernel(a=layout, t=SCALAR, returns=layout)
    def part(a, t):  # type: ignore[no-untyped-def]
        return ga.power(a, t)

    return later(part, "arrays")


@pytest.mark.parametrize("algebra", some_slow([*CATALOG, FOUR], CGA2, FOUR, CGA3, STA), ids=name_of)
def test_power_is_a_part_of_the_motion(algebra: Algebra, rng: np.random.Generator) -> None:
    exponential, _, _ = functions(algebra)
    b, t = 0.3 * rng.normal(size=(100, len(algebra.blades(2)))), rng.normal(size=100)
    for sign in (1, -1):
        assert (
            difference(powers(algebra.UNIT_EVEN)(sign * exponential(b), t), exponential(t[:, None] * b)).max() < 1e-14
        )


@all_cases("algebra", [VGA2, VGA3, PGA2, PGA3])
@all_cases("size", [0.0, 1e-20, 1e-15, 1e-9, 1e-6, 1e-3, 0.5, 1.57])
def test_large_powers_of_small_turns(algebra: Algebra, size: float, rng: np.random.Generator) -> None:
    """As exact as the exponential of the large angle, from the identity to nearly a half turn; `size` is angle / 2.

    The cosine of a small angle does not determine the angle, so the sine must not be computed from it.
    """
    exponential, _, _ = functions(algebra)
    b = rng.normal(size=(200, len(algebra.blades(2))))
    b[:, turning(algebra)] *= (size / np.linalg.norm(b[:, turning(algebra)], axis=-1))[:, None]
    for t in (0.0, 0.3, -1.0, 7.0, 1e4, 1e6):
        expected = exponential(t * b)
        error = difference(powers(algebra.UNIT_EVEN)(exponential(b), t), expected)
        assert error.max() < 1e-15 * (2 + abs(t) * size)


@pytest.mark.parametrize("t", some_slow([0.5, 3.0, 1000.0], 3.0, 1000.0))
@pytest.mark.parametrize("algebra", some_slow([VGA3, PGA2, PGA3], PGA2, PGA3), ids=name_of)
@pytest.mark.slow
def test_derivatives_of_parts_of_small_turns(algebra: Algebra, t: float, rng: np.random.Generator) -> None:
    """Compare with ``exp(t b)`` along a change of `b`: derivatives of a quotient divide by the squared sine."""
    unit = algebra.UNIT_EVEN

    @kernel(b=bivectors(algebra), returns=unit)
    def exponential(b):  # type: ignore[no-untyped-def]
        return ga.exp(b)

    @kernel(r=unit, t=SCALAR, returns=unit)
    def part(r, t):  # type: ignore[no-untyped-def]
        return ga.power(r, t)

    @kernel(a=unit, b=unit, t=SCALAR, returns=unit)
    def between(a, b, t):  # type: ignore[no-untyped-def]
        return ga.interpolate(a, b, t)

    grow, grow_part, grow_between = (
        ga.compile(jvp(definition, wrt), backend="arrays", effort=0)
        for definition, wrt in ((exponential, "b"), (part, "r"), (between, "b"))
    )
    b, change = rng.normal(size=(2, 400, len(algebra.blades(2))))
    b[:, turning(algebra)] *= 10 ** rng.uniform(-18, -1, size=(400, 1))
    (r, step), (_, expected) = grow(b, change), grow(t * b, t * change)
    one = np.eye(r.shape[-1])[0]
    for found in (grow_part(r, t, step)[1], grow_between(one, r, t, step)[1]):
        assert (np.abs(found - expected).max(-1) / np.abs(expected).max(-1)).max() < 3e-7 * (1 + t)


@pytest.mark.parametrize("number", [COMPLEX.NUMBER, QUATERNIONS.QUATERNION, VGA3.EVEN], ids=str)
def test_powers_of_numbers_that_rotate(number: Layout, rng: np.random.Generator) -> None:
    """Compare with powers of complex numbers in the plane of the part that is not a scalar."""
    power = powers(number)
    a, t = rng.normal(size=(1000, number.size)), rng.normal(size=1000)
    a[::2, 1:] *= 10 ** rng.uniform(-12, 0, size=(500, 1))
    length = np.linalg.norm(a[:, 1:], axis=-1)
    expected = (a[:, 0] + 1j * length) ** t
    found, scale = power(a, t), np.abs(expected)
    assert np.abs((found[:, 0] - expected.real) / scale).max() < 1e-14
    assert np.abs((found[:, 1:] - expected.imag[:, None] * a[:, 1:] / length[:, None]) / scale[:, None]).max() < 1e-14
    special = np.zeros((3, number.size))
    special[:, 0] = 1, -4, 4
    special[2, 1] = 1e-200
    one, imaginary, nearly_real = power(special, 0.5)
    assert one.tolist() == [1] + [0] * (number.size - 1)
    assert imaginary @ imaginary == pytest.approx(4) and abs(imaginary[0]) < 1e-15
    assert nearly_real[0] == pytest.approx(2) and nearly_real[1] == pytest.approx(0.25e-200, abs=0)


@pytest.mark.parametrize(
    "number", some_slow([DOUBLE_NUMBERS.NUMBER, DUAL_NUMBERS.NUMBER], DOUBLE_NUMBERS.NUMBER), ids=str
)
def test_powers_of_numbers_that_do_not_rotate(number: Layout, rng: np.random.Generator) -> None:
    @kernel(a=number, t=SCALAR, returns=number)
    def by_logarithm(a, t):  # type: ignore[no-untyped-def]
        return ga.exp(t * ga.log(a))

    a, t = rng.normal(size=(1000, 2)), rng.normal(size=1000)
    a[:, 0] = 1 + np.abs(a[:, 1])
    assert np.array_equal(powers(number)(a, t), later(by_logarithm, "arrays")(a, t))


@pytest.mark.parametrize("algebra", some_slow([VGA2, VGA3, PGA2, PGA3], PGA3), ids=name_of)
def test_interpolation_moves_at_constant_speed(algebra: Algebra, rng: np.random.Generator) -> None:
    """Test angles from zero to nearly a half turn; sizes are half the angle."""
    unit = algebra.UNIT_EVEN

    @kernel(a=unit, b=unit, t=SCALAR, returns=unit)
    def between(a, b, t):  # type: ignore[no-untyped-def]
        return ga.interpolate(a, b, t)

    @kernel(a=unit, b=unit, returns=unit)
    def product(a, b):  # type: ignore[no-untyped-def]
        return a * b

    run, times = later(between, "arrays"), later(product, "arrays")
    exponential, _, _ = functions(algebra)
    sizes = np.repeat([0.0, 1e-12, 1e-8, 3e-8, 1e-6, 1e-3, 0.5, 1.57], 100)
    start, step = rng.normal(size=(2, len(sizes), len(algebra.blades(2))))
    step *= (sizes / np.linalg.norm(step, axis=-1))[:, None]
    t, a = rng.normal(size=len(sizes)), exponential(start / 2)
    b = times(a, exponential(step))
    expected = times(a, exponential(t[:, None] * step))
    for sign in (1, -1):
        assert difference(run(a, sign * b, t), expected).max() < 1e-14
        assert difference(run(a, sign * b, 0.0), a).max() < 1e-14
        assert difference(run(a, sign * b, 1.0), b).max() < 1e-14


@all_cases("algebra", UP_TO_FIVE)
def test_interpolation_of_multivectors_in_any_metric(algebra: Algebra, rng: np.random.Generator) -> None:
    """Interpolate by sums or by powers of the ratio, for even and odd versors, and where there is no interpolation."""

    def bivector(size: float, blades: Any) -> Multivector:
        return Multivector(algebra, dict(zip(blades, map(float, size * rng.normal(size=len(blades))), strict=True)))

    t, vector = 0.3, next(v for v in algebra.basis() if abs((v * v)["1"]) == 1)
    for blades in (algebra.blades(2), algebra.blades(2)[:1]):
        a, step = ga.exp(bivector(0.3, blades)), bivector(0.2, blades)
        for start in (a, vector * a):
            found = ga.interpolate(start, start * ga.exp(step), t, unit=True)
            wanted = start * ga.exp(t * step)
            assert max(map(abs, (found - wanted).terms.values()), default=0) < 1e-13
            assert max(map(abs, (ga.interpolate(start, start, t, unit=True) - start).terms.values()), default=0) < 1e-14


def test_inertia() -> None:
    assert inertia([[0, 1], [1, 0]]) == (1, 1, 0)
    assert inertia([[1, 1], [1, 1]]) == (1, 0, 1)
    assert inertia([[0, 0, 1], [0, 0, 0], [1, 0, Fraction(-1, 2)]]) == (1, 1, 1)
    assert inertia([]) == (0, 0, 0)
