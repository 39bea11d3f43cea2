"""Rewriting to saturation: the rules are exact, and the result does not depend on their order."""

from __future__ import annotations

from random import Random

import pytest

from gacompiler import Kernel, dual, kernel, norm, norm_squared, polarity, sandwich
from gacompiler.algebra.catalog import PGA3, VGA3
from gacompiler.algebra.layout import SCALAR
from gacompiler.frontend.kernel import trace
from gacompiler.passes.prove import same
from gacompiler.passes.rules import RULES
from gacompiler.passes.samples import meaning, sample
from gacompiler.passes.saturate import cost_of, saturate
from tests.support.all_cases import all_cases

MOTOR, POINT = PGA3.MOTOR, PGA3.POINT
ROTOR, VECTOR = VGA3.ROTOR, VGA3.VECTOR


@kernel(m=MOTOR, a=POINT, b=POINT, c=POINT)
def join_of_moved(m, a, b, c):
    return sandwich(m, a) & sandwich(m, b) & sandwich(m, c)


@kernel(m=MOTOR, n=MOTOR, o=MOTOR, v=SCALAR, w=SCALAR, p=POINT)
def blend(m, n, o, v, w, p):
    return v * sandwich(m, p) - sandwich(n, p) * w + sandwich(o, p)


@kernel(m=MOTOR, a=MOTOR, b=MOTOR)
def relative(m, a, b):
    return ~(m * a) * (m * b)


@kernel(m=MOTOR, a=POINT, b=POINT)
def moved_back(m, a, b):
    return sandwich(~m, sandwich(m, a) & sandwich(m, b))


@kernel(m=MOTOR)
def fifth_power(m):
    return m * m * m * m * m


@kernel(r=ROTOR, a=VECTOR, b=VECTOR)
def dual_of_rotated(r, a, b):
    return dual(sandwich(r, a) ^ sandwich(r, b))


@kernel(r=ROTOR, a=VECTOR, b=VECTOR)
def polarity_of_rotated(r, a, b):
    return polarity(sandwich(r, a)) ^ sandwich(r, b)


@kernel(m=MOTOR, a=POINT, b=POINT)
def distance_of_moved(m, a, b):
    return norm(sandwich(m, a) & sandwich(m, b))


@kernel(m=MOTOR, w=SCALAR, a=POINT)
def scaled(m, w, a):
    return sandwich(m, w * a) + sandwich(m, a)


@kernel(n=PGA3.UNIT_PLANE, a=POINT, b=POINT, c=POINT)
def join_of_mirrored(n, a, b, c):
    return sandwich(n, a) & sandwich(n, b) & sandwich(n, c)


@kernel(n=PGA3.UNIT_PLANE, a=POINT, b=POINT)
def distance_of_mirrored(n, a, b):
    return norm(sandwich(n, a) & sandwich(n, b))


@kernel(n=VGA3.UNIT_VECTOR, a=VECTOR, b=VECTOR, c=VECTOR)
def volume_of_mirrored(n, a, b, c):
    return sandwich(n, a) ^ sandwich(n, b) ^ sandwich(n, c)


TEXTS = {
    join_of_moved: "sandwich(m, (a & (b & c)))",
    relative: "(~a * b)",
    moved_back: "(a & b)",
    dual_of_rotated: "sandwich(r, dual((a ^ b)))",
    distance_of_moved: "norm((a & b))",
    distance_of_mirrored: "norm(-(a & b))",
    volume_of_mirrored: "-(a ^ (b ^ c))",
}
KERNELS = (*TEXTS, join_of_mirrored, blend, fifth_power, polarity_of_rotated, scaled)
every = pytest.mark.parametrize("each", KERNELS, ids=lambda each: each.name)


@every
def test_rewritten_expressions_are_equal_and_cheaper(each: Kernel) -> None:
    given = trace(each).expressions
    found = saturate(given)
    assert cost_of(found[0]) < cost_of(given[0])
    random = Random(3)
    for _ in range(3):
        inputs = sample(each, random)
        (a,), (b,) = meaning(given, inputs), meaning(found, inputs)
        assert all(same(a.terms.get(k, 0), b.terms.get(k, 0)) for k in {*a.terms, *b.terms})


@every
def test_the_order_of_the_rules_has_no_influence(each: Kernel) -> None:
    given = trace(each).expressions
    found = saturate(given)
    for seed in range(3):
        assert saturate(given, Random(seed).sample(RULES, len(RULES))) == found


@all_cases("each", TEXTS)
def test_expected_forms(each: Kernel) -> None:
    assert str(saturate(trace(each).expressions)[0]) == TEXTS[each]


@kernel(m=MOTOR, s=SCALAR)
def square_of_moved_number(m, s):
    return norm_squared(sandwich(m, s))


def test_numbers_are_not_replaced_by_multivectors_of_the_same_value() -> None:
    """The rules make ``sandwich(m, s)`` and `s` equal, and the square of a number knows no other algebra."""
    given = trace(square_of_moved_number).expressions
    inputs = sample(square_of_moved_number, Random(5))
    (value,) = meaning(saturate(given), inputs)
    assert value.terms == {0: inputs["s"] ** 2}


@kernel(m=PGA3.even, a=MOTOR, b=MOTOR)
def relative_to_any_even(m, a, b):
    return ~(m * a) * (m * b)


@kernel(m=PGA3.even, a=POINT, b=POINT)
def join_moved_by_any_even(m, a, b):
    return sandwich(m, a) & sandwich(m, b)


@pytest.mark.parametrize("each", [relative_to_any_even, join_moved_by_any_even], ids=lambda each: each.name)
def test_rules_for_unit_versors_need_unit_versors(each: Kernel) -> None:
    """Both would lose the factor ``m ~m``, which is not 1."""
    given = trace(each).expressions
    found = saturate(given)
    inputs = sample(each, Random(4))
    (a,), (b,) = meaning(given, inputs), meaning(found, inputs)
    assert all(same(a.terms.get(k, 0), b.terms.get(k, 0)) for k in {*a.terms, *b.terms})
    assert "m" in str(found[0])
