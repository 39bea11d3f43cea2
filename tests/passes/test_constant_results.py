"""Constants of results are proved independently of other results, and once for equal definitions."""

from __future__ import annotations

import pytest

from gacompiler import SCALAR, cos, exp, kernel, sin, sqrt
from gacompiler.algebra.catalog import PGA3, VGA3
from gacompiler.frontend.kernel import trace
from gacompiler.passes import decide as module
from gacompiler.passes.decide import decide
from gacompiler.passes.lower import Lowering

E1, E2, _ = VGA3.basis()


@kernel(m=PGA3.MOTOR, x=PGA3.even, y=PGA3.even)
def large_and_constant(m, x, y):
    power = x
    for _ in range(6):
        power = power * y * x
    return power, m * ~m


def test_a_large_result_does_not_prevent_the_proof_of_a_constant() -> None:
    traced = trace(large_and_constant)
    found = decide(traced, [traced.expressions]).constants
    assert found[1, 0] == 1
    assert all(found[1, blade] == 0 for k, blade in found if k == 1 and blade)


@pytest.mark.parametrize("function", [
    lambda a: sin(a) * sin(a) + cos(a) * cos(a),
    lambda a: sqrt(a * a + 1) * sqrt(a * a + 1) - a * a,
    lambda a: exp(E1 * E2 * a) * ~exp(E1 * E2 * a),
])  # fmt: skip
def test_identities_of_functions_are_constants(function) -> None:
    """Values of functions are no rational numbers, but their constants are recognized."""

    @kernel(a=SCALAR)
    def one_and_more(a):
        return function(a) + E1 * a

    traced = trace(one_and_more)
    assert decide(traced, [traced.expressions]).constants[0, 0] == 1


def test_equal_definitions_are_proved_once(monkeypatch) -> None:
    made = []

    def counted(*arguments, **options):
        made.append(arguments)
        return Lowering(*arguments, **options)

    monkeypatch.setattr(module, "Lowering", counted)
    module._proved.cache_clear()
    traced = trace(large_and_constant)
    first = decide(traced, [traced.expressions]).constants
    n = len(made)
    assert n > 0
    assert decide(trace(large_and_constant), [traced.expressions]).constants == first
    assert len(made) == n


@kernel(a=PGA3.MOTOR, x=PGA3.even, y=PGA3.even)
def not_constant(a, x, y):
    return x * y, a


@pytest.mark.parametrize(("whole", "fewest", "most"), [(1, 1, 1), (800_000, 2, 4)])
def test_all_proofs_together_have_a_bound(monkeypatch: pytest.MonkeyPatch, whole: int, fewest: int, most: int) -> None:
    """The work of an attempt counts also if it found a polynomial: none follows when the bound is reached."""
    made = []

    def counted(*arguments, **options):
        made.append(arguments)
        # One attempt may use more than what is left of all work, so that it finds a polynomial.
        return Lowering(*arguments, **{**options, "effort": 400_000})

    monkeypatch.setattr(module, "Lowering", counted)
    monkeypatch.setattr(module, "WHOLE_EFFORT", whole)
    wrong = (((0, 0), 0),)
    assert module._proved.__wrapped__(not_constant.parameters, wrong, (trace(not_constant).expressions,)) == {}
    assert fewest <= len(made) <= most
