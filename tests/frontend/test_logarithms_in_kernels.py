"""Exponentials, logarithms and powers over six to eight vectors in kernels, against exponentials of mpmath."""

from __future__ import annotations

import math
from typing import Any

import mpmath
import numpy as np
import pytest
from many_planes import ANGLES, PI, exact_exp, example, rounded, size

import gacompiler as ga
from gacompiler import SCALAR, Cl
from gacompiler.algebra.algebra import Algebra
from gacompiler.algebra.layout import Layout
from gacompiler.errors import GacError, KernelError
from gacompiler.frontend import many_vectors
from tests.support.all_cases import all_cases
from tests.support.unoptimised import without_optimisation


def bivectors(algebra: Algebra) -> Layout:
    return algebra.layout("bivectors", " ".join(algebra.spelling(blade)[1] for blade in algebra.blades(2)))


@pytest.fixture
def numbers(monkeypatch: pytest.MonkeyPatch) -> Any:
    """The module with loops and selections of floats, so that it runs without compilation."""

    def iterate(body: Any, start: Any, until: Any, at_most: int) -> Any:
        for step in range(1, at_most + 1):
            new = body(start)
            if until(start, new):
                return new, 1, step
            start = new
        return start, 0, at_most

    changed = {
        "iterate": iterate, "select": lambda condition, a, b: a if condition else b, "absolute": abs, "maximum": max,
        "sqrt": lambda x: math.sqrt(x) if x >= 0 else math.nan, "Fraction": lambda a, b=1: a / b, "HUGE": 1e300,
    }  # fmt: skip
    constants = ["SMALL", "SCALED", "HALF", "CONVERGED", "NOISE", "RESIDUAL"]
    changed |= {name: float(getattr(many_vectors, name)) for name in constants}
    for name, value in changed.items():
        monkeypatch.setattr(many_vectors, name, value)
    return many_vectors


@pytest.mark.parametrize("signature", [(6,), (3, 3), (4, 2), (7,), (8,), (4, 4)], ids=str)
@pytest.mark.parametrize("name", ANGLES)
def test_formulas(numbers: Any, signature: tuple[int, ...], name: str) -> None:
    compare(numbers, *example(signature, ANGLES[name]))


def compare(numbers: Any, b: Any, versor: Any) -> None:
    """Compare the logarithm and the exponential with a bivector and its versor, both rounded from many digits."""
    space = numbers.signature_of(versor.algebra)
    spelled = {blade: space.algebra.spelling(blade) for blade in (*space.blades, *space.algebra.blades(2))}
    coefficients = np.array([spelled[k][0] * float(versor[spelled[k][1]]) for k in space.blades])
    known = {k: spelled[k][0] * float(b[spelled[k][1]]) for k in space.algebra.blades(2)}
    logarithm = numbers._bivector_terms(space, numbers._logarithm(space, list(coefficients)))
    # Rounding errors of boosts are relative to the squares of their coefficients.
    limit = 1e-14 * max(size(versor), 1.0) ** 2
    errors = [abs(value - known[1 << i | 1 << j]) for (i, j), value in logarithm.items()]
    assert max(errors) <= limit * max(map(abs, known.values()))
    power = numbers._exponential(space, numbers._matrix_of(space, lambda i, j: known[1 << i | 1 << j]))
    assert np.abs(np.array(power) - coefficients).max() <= limit


@pytest.mark.parametrize("signature", [(6,), (3, 3), (4, 2), (8,), (4, 4)], ids=str)
@pytest.mark.parametrize("lack", ["1e-3", "1e-9", "1e-13"])
def test_nearly_a_whole_turn(numbers: Any, signature: tuple[int, ...], lack: str) -> None:
    """The versor of a turn by 2 pi without a little is the negative of that of the little turn back."""
    others = [0.3, 0.5, -1.0]
    turn = example(signature, [2 * PI - mpmath.mpf(lack), *others])[1]
    b, versor = example(signature, [-mpmath.mpf(lack), *others])
    assert size(turn + versor) <= 1e-14 * max(size(versor), 1.0) ** 2
    compare(numbers, b, versor)
    space = numbers.signature_of(turn.algebra)
    spelled = {blade: space.algebra.spelling(blade) for blade in space.blades}
    found = numbers._logarithm(space, [spelled[k][0] * float(turn[spelled[k][1]]) for k in space.blades])
    errors = [
        abs(value - space.algebra.spelling(1 << i | 1 << j)[0] * float(b[space.algebra.spelling(1 << i | 1 << j)[1]]))
        for (i, j), value in numbers._bivector_terms(space, found).items()
    ]
    assert max(errors) <= 1e-14 * max(size(versor), 1.0) ** 2 * size(b)


@pytest.mark.parametrize("signature", [(3, 3), (4, 2), (4, 4)], ids=str)
@pytest.mark.parametrize("scale", [1e-9, 1.0, 3.0])
def test_null_bivectors(numbers: Any, signature: tuple[int, ...], scale: float) -> None:
    """Bivectors of two null vectors and of a null and a unit vector, with and without a boost, and a boost alone."""
    algebra = Cl(*signature).algebra
    e, p = algebra.basis(), signature[0]
    null, other = e[0] + e[p], e[1] + e[p + 1]
    boost = e[2] ^ e[algebra.dimension - 1]
    for exact in (null ^ other, null ^ e[2], (null ^ other) + boost, boost):
        with mpmath.workdps(40):
            known = exact.map(lambda value: mpmath.mpf(value) * mpmath.mpf(scale))
            b = rounded(algebra, known, algebra.blades(2))
            versor = rounded(algebra, exact_exp(known), algebra.even.support)
        compare(numbers, b, versor)


def test_turns_with_boosts_of_their_planes(numbers: Any) -> None:
    """The matrix has the eigenvalues exp(+-a +-i t): two planes of any metric are turned by t and stretched by a."""
    algebra = Cl(3, 3).algebra
    e = algebra.basis()
    turn, stretch, boost = (e[0] ^ e[1]) - (e[3] ^ e[4]), (e[0] ^ e[3]) + (e[1] ^ e[4]), e[2] ^ e[5]
    for t, a, c in ((2.946, 1.094, 1.436), (2.9, 0.3, 0.0), (1.0, 2.0, 0.5)):
        with mpmath.workdps(40):
            exact = (
                scaled(turn, mpmath.mpf(t) / 2) + scaled(stretch, mpmath.mpf(a) / 2) + scaled(boost, mpmath.mpf(c) / 2)
            )
            b = rounded(algebra, exact, algebra.blades(2))
            versor = rounded(algebra, exact_exp(exact), algebra.even.support)
        matrix = np.array([[float(((exact * y - y * exact) * x).scalar * (x * x).scalar) for y in e] for x in e])
        assert np.abs(np.abs(np.linalg.eigvals(matrix).imag).max() - t) < 1e-6
        compare(numbers, b, versor)


def motion(n: int, angles: list[Any], shift: float) -> tuple[Any, Any]:
    """Return a bivector of G(n, 0, 1) and its exponential, written with e0 = e+ + e- in G(n + 1, 1).

    These are rotations, a translation along the last vector if it is in none of their planes, all of them turned and
    moved. The factors commute, so that the exponential is their product.
    """
    with mpmath.workdps(40):
        algebra = Cl(n + 1, 1).algebra
        e, one = algebra.basis(), algebra.scalar(mpmath.mpf(1))
        e0 = e[n] + e[n + 1]
        parts = [(e[2 * k] * e[2 * k + 1], mpmath.mpf(angle) / 2) for k, angle in enumerate(angles)]
        b, versor = algebra.scalar(0), one
        for blade, half in parts:
            b = b + scaled(blade, half)
            versor = versor * (scaled(one, mpmath.cos(half)) + scaled(blade, mpmath.sin(half)))
        if 2 * len(angles) < n:
            translation = scaled(e[n - 1] * e0, mpmath.mpf(shift))
            b, versor = b + translation, versor * (one + translation)
        mover = one
        for k in range(n):
            mover = mover + scaled(e[k] * e0, mpmath.mpf(shift) * (k + 1) / 7)
        mover = mover * exact_exp(scaled(e[0] * e[2], mpmath.mpf(1) / 7)) * exact_exp(scaled(e[1] * e[3], 0.2))
        return (mover * b * ~mover).grade(2), mover * versor * ~mover


def scaled(x: Any, factor: Any) -> Any:
    return x.map(lambda value: value * factor)


@pytest.mark.parametrize("shift", [0.0, 10.0])
@pytest.mark.parametrize("angles", [[1.0, 0.5], [1.0, 1.0], [1e-9, 2e-9], [PI - mpmath.mpf("1e-13"), 0.3]], ids=str)
@pytest.mark.parametrize("n", [5, 6])
def test_degenerate_metrics_within_one_more_vector(numbers: Any, n: int, angles: list[Any], shift: float) -> None:
    """What is refused over G(n, 0, 1) has the logarithm that the error message leads to."""
    b, versor = motion(n, [*angles, 0.7] if n == 6 else angles, shift)
    space = numbers.signature_of(b.algebra)
    found = numbers._logarithm(space, [float(versor.terms.get(blade, 0)) for blade in space.blades])
    known = {blade: float(b.terms.get(blade, 0)) for blade in b.algebra.blades(2)}
    size = max(abs(float(x)) for x in versor.terms.values())
    errors = [abs(x - known[1 << i | 1 << j]) for (i, j), x in numbers._bivector_terms(space, found).items()]
    assert max(errors) <= 1e-14 * size**2 * max(map(abs, known.values()))


def test_one_has_the_logarithm_zero(numbers: Any) -> None:
    space = numbers.signature_of(Cl(6).algebra)
    one = [float(blade == 0) for blade in space.blades]
    for sign in (1, -1):
        assert not np.any(np.array(numbers._logarithm(space, [sign * x for x in one]), float))


@all_cases("function", [ga.log, ga.sqrt, lambda r: ga.power(r, 0.3), ga.exp])
def test_kernels_without_loops_are_refused(function: Any) -> None:
    algebra = Cl(6).algebra
    layout = bivectors(algebra) if function is ga.exp else algebra.UNIT_EVEN

    @ga.kernel(r=layout)
    def of_versor(r: Any) -> Any:
        return function(r)

    with pytest.raises(KernelError, match=r"6 basis vectors in a kernel without loops.*loops=True") as refused:
        ga.compile(of_versor)
    assert len(str(refused.value)) < 320 and "\n" not in str(refused.value)


@all_cases("options", [{"unit": False}, {"along": 1}])
@all_cases("function", [ga.log, ga.sqrt])
def test_options_of_numbers_are_refused(function: Any, options: dict[str, Any]) -> None:
    @ga.kernel(r=Cl(6).algebra.UNIT_EVEN, loops=True)
    def of_versor(r: Any) -> Any:
        return function(r, **options)

    with pytest.raises(GacError, match="a unit versor"):
        ga.compile(of_versor)


@pytest.mark.slow
@without_optimisation()
def test_compiled() -> None:
    """Kernels agree with mpmath, also in batches; where there is no logarithm the result is NaN.

    The logarithm is built in C. Formulas in other algebras are compared in `test_formulas`.
    """
    signature = 4, 2
    algebra = Cl(*signature).algebra

    @ga.kernel(r=algebra.UNIT_EVEN, loops=True)
    def logarithm(r: Any) -> Any:
        return ga.log(r)

    @ga.kernel(b=bivectors(algebra), t=SCALAR, loops=True)
    def exponential(b: Any, t: Any) -> Any:
        return ga.exp(t * b)

    log, exp = ga.compile(logarithm, effort=0), ga.compile(exponential, "arrays", effort=0)
    examples = [example(signature, angles) for angles in ANGLES.values()]
    planes = np.array([b.as_layout(bivectors(algebra)).values for b, _ in examples])
    versors = np.array([versor.as_layout(algebra.even).values for _, versor in examples])
    limits = 1e-14 * np.maximum(np.abs(versors).max(-1), 1) ** 2
    assert (np.abs(log(versors) - planes).max(-1) <= limits * np.abs(planes).max(-1)).all()
    assert (np.abs(exp(planes, 1.0) - versors).max(-1) <= limits).all()
    half = np.eye(algebra.even.size)[algebra.even.blades.index("e1234")]
    spoiled = log(np.array([versors[1], half, np.nan * half]))
    assert np.isnan(spoiled).all(-1).tolist() == [False, True, True]


@pytest.mark.slow
def test_compiled_powers() -> None:
    """Powers are those of mpmath near zero and pi and for equal angles; errors grow with exponents and boosts."""
    signature, limit = (4, 2), 1e-14
    algebra = Cl(*signature).algebra

    @ga.kernel(r=algebra.UNIT_EVEN, t=SCALAR, loops=True)
    def power(r: Any, t: Any) -> Any:
        return ga.power(r, t)

    compiled = ga.compile(power, "arrays", effort=0)
    versors = np.array([example(signature, angles)[1].as_layout(algebra.even).values for angles in ANGLES.values()])
    for t in (0.3, -1.0, 0.5, 2.5, -7.0):
        turned = [[mpmath.mpf(t) * angle for angle in angles] for angles in ANGLES.values()]
        known = np.array([example(signature, angles)[1].as_layout(algebra.even).values for angles in turned])
        sizes = np.maximum(np.abs(known).max(-1), 1) * np.maximum(np.abs(versors).max(-1), 1) ** 2
        assert (np.abs(compiled(versors, t) - known).max(-1) <= limit * (1 + abs(t)) * sizes).all(), t
    half = np.eye(algebra.even.size)[algebra.even.blades.index("e1234")]
    assert np.isnan(compiled(half, 0.5)).all()
