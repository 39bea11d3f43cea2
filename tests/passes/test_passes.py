"""Every pass preserves the meaning, and the whole pipeline equals the author's definition exactly at random points."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import FrozenInstanceError, fields
from fractions import Fraction
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

import mpmath
import pytest
from exact_elements import NULL_PAIRS, OBLIQUE
from selection import some_slow

from gacompiler import (
    SCALAR,
    absolute,
    acos,
    array,
    assemble,
    atan2,
    clifford_conjugate,
    commutator,
    cos,
    dual,
    exp,
    grade_involution,
    inverse,
    left_contraction,
    log,
    maximum,
    minimum,
    norm,
    norm_squared,
    normalize,
    polarity,
    reverse,
    right_contraction,
    sandwich,
    scalar_product,
    select,
    sin,
    sqrt,
    undual,
)
from gacompiler.algebra.algebra import Algebra
from gacompiler.algebra.catalog import CGA2, CGA3, PGA2, PGA3, QUATERNIONS, STA, VGA2, VGA3, orthogonal
from gacompiler.algebra.operations import Operation
from gacompiler.errors import KernelError
from gacompiler.frontend.expression import Expression, Input, evaluate
from gacompiler.frontend.kernel import ArrayOf, Kernel, Parameter, trace
from gacompiler.ir.cost import cost
from gacompiler.ir.interpret import interpret
from gacompiler.ir.verify import verify
from gacompiler.passes.factor import Policy, factor
from gacompiler.passes.lower import Lowering, Slot, stages
from gacompiler.passes.pipeline import PIPELINE, Compilation, compile_kernel
from gacompiler.passes.rewrite import (
    STRATEGIES,
    divide_by_reversing,
    drop_versor,
    join_sandwich,
    pull_out_versor,
    recognise_sandwich,
    rewrite,
    separate_invariant_grades,
    split_sandwich,
)
from gacompiler.passes.samples import meaning, sample, to_mpmath
from gacompiler.passes.schedule import schedule
from gacompiler.passes.share import share
from gacompiler.passes.shift import shift
from gacompiler.passes.system import System
from gacompiler.rings.points import DIGITS
from gacompiler.rings.polynomial import Polynomial, PolynomialRing
from tests.support.all_cases import all_cases

ROOT = Path(__file__).parents[2]
POLICIES = [Policy(a, b) for a in (False, True) for b in (False, True)]


# Definition of "preserves the meaning"


def check_against_author(record: Compilation, seed: int, points: int = 2) -> None:
    """Interpret the program at points that satisfy the relations and compare with the author's definition."""
    random = Random(seed)
    assert record.trace is not None and record.decision is not None
    definition = record.kernel
    program = verify(record.program)
    for _ in range(points):
        at = sample(definition, random)
        exact = all(isinstance(value, (int, Fraction)) for value in at.values())
        try:
            expected = meaning(record.trace.expressions, at)
        except ZeroDivisionError:
            continue
        exact = exact and all(isinstance(v, (int, Fraction)) for value in expected for v in value.terms.values())
        with mpmath.workdps(DIGITS):
            lifted = at if exact else {name: to_mpmath(value) for name, value in at.items()}
            inputs = {p.name: [lifted[c] for c in p.components] for p in definition.parameters}
            found = interpret(program, inputs, (lambda value: value) if exact else to_mpmath)
            first = 0
            for output, layout in zip(record.trace.outputs, record.decision.layouts, strict=True):
                flat = list(found[output.name])
                for k in range(len(output.expressions)):
                    stored = flat[k * layout.size : (k + 1) * layout.size]
                    mine = layout.element(stored)
                    theirs = expected[first + k]
                    for blade in set(mine.terms) | set(theirs.terms):
                        difference = mine.terms.get(blade, 0) - theirs.terms.get(blade, 0)
                        if exact:
                            assert difference == 0, (definition.name, blade)
                        else:
                            assert abs(difference) < mpmath.mpf(10) ** (-DIGITS // 2), (definition.name, blade)
                first += len(output.expressions)


def compiled(definition: Kernel, seed: int = 0) -> Compilation:
    record = compile_kernel(definition, forms=False)
    check_against_author(record, seed)
    return record


# Factor and share


def random_polynomials(random: Random, ring: PolynomialRing, n: int, count: int) -> list[Polynomial]:
    found = []
    for _ in range(count):
        terms = {}
        for _ in range(random.randint(0, 9)):
            monomial = tuple(sorted(random.choices(range(n), k=random.randint(0, 4))))
            terms[monomial] = random.choice((1, -1, 1, -1, 2, -2, Fraction(1, 2), -3))
        found.append(Polynomial(ring, terms))
    return found


def value_of(polynomial: Polynomial, at: Sequence[Fraction]) -> Fraction:
    total = Fraction(0)
    for monomial, value in polynomial.terms.items():
        term = Fraction(value)
        for variable in monomial:
            term *= at[variable]
        total += term
    return total


def run_shared(system: System, policy: Policy, at: Sequence[Fraction]) -> list[Any]:
    from gacompiler.ir.program import Argument

    names = system.ring.names[: system.n_inputs]
    arguments = tuple(Argument(name, (), (name,)) for name in names)
    outputs = share(system, policy)
    program = schedule("f", arguments, (("out", (len(outputs),), outputs),))
    return list(interpret(program, {name: [value] for name, value in zip(names, at, strict=False)})["out"])


@all_cases("policy", POLICIES)
@all_cases("seed", range(10))
def test_factored_sums_have_the_polynomials_values(seed: int, policy: Policy) -> None:
    random = Random(seed)
    ring = PolynomialRing()
    for k in range(5):
        ring.variable(f"x{k}")
    polynomials = random_polynomials(random, ring, 5, 5)
    system = System(ring, 5, (), tuple(polynomials))
    for _ in range(2):
        at = [Fraction(random.randint(-5, 5), random.randint(1, 3)) for _ in range(5)]
        assert run_shared(system, policy, at) == [value_of(p, at) for p in polynomials]


@all_cases("policy", POLICIES)
def test_extraction_finds_obvious_factors(policy: Policy) -> None:
    """``(a + b) c`` and ``(a + b) d``: one sum; ``a b c`` and ``a b d``: one product."""
    ring = PolynomialRing()
    a, b, c, d = (ring.variable(name) for name in "abcd")
    factored = factor((a * c + b * c, a * d + b * d), 4, policy)
    assert [list(map(len, terms)) for terms in factored.sums[:2]] == [[2], [2]]
    assert factored.sums[2] == {(0,): 1, (1,): 1}
    factored = factor((a * b * c, a * b * d), 4, policy)
    assert factored.sums[2] == {(0, 1): 1}
    factored = factor((a * c - b * c, b * d - a * d), 4, policy)
    assert len(factored.sums) == 3, "a - b and b - a are one divisor"


def test_extraction_never_costs_more() -> None:
    for seed in range(20):
        random = Random(seed)
        ring = PolynomialRing()
        for k in range(5):
            ring.variable(f"x{k}")
        polynomials = random_polynomials(random, ring, 5, 4)
        naive = sum(max(0, len(p.terms) - 1) for p in polynomials)
        naive += sum(max(0, len(m) - 1 + (abs(v) != 1 and bool(m))) for p in polynomials for m, v in p.terms.items())
        from gacompiler.ir.program import Argument

        arguments = tuple(Argument(name, (), (name,)) for name in ring.names)
        for policy in POLICIES[:1] + POLICIES[2:3]:
            outputs = share(System(ring, 5, (), tuple(polynomials)), policy)
            found = cost(schedule("f", arguments, (("out", (4,), outputs),)))
            assert found.mul + found.add <= naive


# Shift


def test_differences_are_found() -> None:
    """The area of a triangle depends only on differences of its corners."""
    ring = PolynomialRing()
    ax, ay, bx, by, cx, cy = (ring.variable(name) for name in ("ax", "ay", "bx", "by", "cx", "cy"))
    area = (bx * cy - cx * by) - (ax * cy - cx * ay) + (ax * by - bx * ay)
    system = System(ring, 6, (), (area, ax - 2 * bx + cx))
    shifted = shift(system)
    assert shifted is not None
    random = Random(2)
    at = [Fraction(random.randint(-9, 9)) for _ in range(6)]
    for policy in POLICIES:
        assert (
            run_shared(shifted, policy, at)
            == run_shared(system, policy, at)
            == [value_of(p, at) for p in system.outputs]
        )
    definitions, _ = shifted.live
    assert len(definitions) == 4


@all_cases("seed", range(10))
def test_shifting_keeps_values(seed: int) -> None:
    """Random polynomials of random differences, with weights, and in several directions at once."""
    random = Random(seed)
    ring = PolynomialRing()
    xs = [ring.variable(f"x{k}") for k in range(6)]
    weights = [random.choice((1, 2, -1, 3)) for _ in range(2)]
    forms = [xs[0] - weights[0] * xs[1], xs[2] + xs[1] * Fraction(1, 2) - xs[0], weights[1] * xs[3] - xs[4]]
    polynomials = []
    for _ in range(3):
        total = ring.constant(random.randint(-2, 2))
        for _ in range(3):
            term = ring.constant(random.choice((1, -1, 2)))
            for _ in range(random.randint(1, 3)):
                term = term * random.choice([*forms, xs[5]])
            total = total + term
        polynomials.append(total)
    system = System(ring, 6, (), tuple(polynomials))
    shifted = shift(system)
    assert shifted is not None
    for _ in range(3):
        at = [Fraction(random.randint(-9, 9), random.randint(1, 3)) for _ in range(6)]
        assert run_shared(shifted, Policy(), at) == [value_of(p, at) for p in polynomials]


def test_nothing_is_shifted_without_a_direction() -> None:
    ring = PolynomialRing()
    x, y = ring.variable("x"), ring.variable("y")
    assert shift(System(ring, 2, (), (x * y + x,))) is None
    assert shift(System(ring, 2, (), (ring.constant(1),))) is None


# Rewrite


def symbol(name: str, layout: Any) -> Expression:
    return Expression(
        Operation.INPUT, (), Input(name, layout, tuple(f"{name}_{b}" for b in layout.blades)), layout.algebra
    )


M, N = symbol("m", PGA3.MOTOR), symbol("n", PGA3.MOTOR)
FREE, ALSO_FREE = symbol("f", PGA3.EVEN), symbol("g", PGA3.EVEN)
P, Q = symbol("p", PGA3.POINT), symbol("q", PGA3.POINT)
PLANE, FULL = symbol("l", PGA3.PLANE), symbol("x", PGA3.full)
WIDE = orthogonal(6)
WIDE_VERSOR, WIDE_VECTOR = symbol("w", WIDE.UNIT_EVEN), symbol("v", WIDE.layout("V", "e1 e2 e3 e4 e5 e6"))


def test_each_rule_on_an_example() -> None:
    assert recognise_sandwich(M * P * ~M) == sandwich(M, P)
    assert recognise_sandwich(M * (P * ~M)) == sandwich(M, P)
    assert recognise_sandwich(FREE * P * ~FREE) == sandwich(FREE, P)
    assert divide_by_reversing(inverse(M)) == ~M
    assert divide_by_reversing(inverse(M * N)) == ~(M * N)
    assert split_sandwich(sandwich(M * N, P)) == sandwich(M, sandwich(N, P))
    assert split_sandwich(sandwich(FREE * ALSO_FREE, P)) == sandwich(FREE, sandwich(ALSO_FREE, P))
    assert join_sandwich(sandwich(M, sandwich(N, P))) == sandwich(M * N, P)
    assert pull_out_versor(sandwich(M, P) & sandwich(M, Q)) == sandwich(M, P & Q)
    assert pull_out_versor(sandwich(M, P) * sandwich(M, Q)) == sandwich(M, P * Q)
    assert pull_out_versor(sandwich(M, P) - sandwich(M, Q)) == sandwich(M, P - Q)
    assert pull_out_versor(reverse(sandwich(M, FULL))) == sandwich(M, reverse(FULL))
    assert pull_out_versor(sandwich(M, FULL).grade(1, 2)) == sandwich(M, FULL.grade(1, 2))
    assert pull_out_versor(norm_squared(sandwich(M, P))) == sandwich(M, norm_squared(P))
    assert drop_versor(sandwich(M, norm_squared(P))) == norm_squared(P)
    assert drop_versor(sandwich(M, P & PLANE)) == (P & PLANE)
    assert separate_invariant_grades(sandwich(M, N)) == N.grade(0, 4) + sandwich(M, N.grade(2))


@all_cases(
    "rule, expression, why",
    [
        (recognise_sandwich, M * P * M, "not reversed"),
        (recognise_sandwich, M * P * ~N, "another versor"),
        (recognise_sandwich, ~M * P * ~M, "both reversed"),
        (recognise_sandwich, PLANE * P * ~PLANE, "odd: the sandwich has a grade involution"),
        (recognise_sandwich, FULL * P * ~FULL, "mixed: no versor"),
        (recognise_sandwich, M ^ P ^ ~M, "not the geometric product"),
        (divide_by_reversing, inverse(FREE), "not unit"),
        (divide_by_reversing, inverse(M * FREE), "one factor not unit"),
        (divide_by_reversing, inverse(M + N), "a sum of units is not unit"),
        (split_sandwich, sandwich((FULL + 1) * M * ~M, P), "odd factor"),
        (split_sandwich, sandwich(M, P), "no product"),
        (split_sandwich, sandwich(M + N, P), "a sum"),
        (join_sandwich, sandwich(PLANE, sandwich(M, P)), "odd"),
        (join_sandwich, sandwich(M, sandwich(PLANE, P)), "odd"),
        (pull_out_versor, sandwich(M, P) & sandwich(N, Q), "different versors"),
        (pull_out_versor, sandwich(FREE, P) & sandwich(FREE, Q), "not unit"),
        (pull_out_versor, sandwich(PLANE, P) & sandwich(PLANE, Q), "odd"),
        (pull_out_versor, sandwich(M, P) & Q, "only one moved"),
        (pull_out_versor, dual(sandwich(M, P)), "the complement is not equivariant"),
        (
            pull_out_versor,
            sandwich(WIDE_VERSOR, WIDE_VECTOR).grade(1),
            "in six dimensions m ~m = 1 does not keep grades",
        ),
        (pull_out_versor, norm_squared(sandwich(FREE, P)), "not unit"),
        (drop_versor, sandwich(FREE, norm_squared(P)), "not unit"),
        (drop_versor, sandwich(M, P), "not invariant"),
        (drop_versor, sandwich(PLANE, norm_squared(P)), "odd and not unit"),
        (separate_invariant_grades, sandwich(FREE, N), "not unit"),
        (separate_invariant_grades, sandwich(M, P), "nothing commutes"),
        (separate_invariant_grades, sandwich(PLANE, N), "odd"),
    ],
)
def test_rules_keep_to_their_preconditions(rule: Callable[..., Any], expression: Expression, why: str) -> None:
    assert rule(expression) is None, why


REWRITABLE: dict[str, tuple[dict[str, Any], Callable[..., Any]]] = {
    "join of moved points": (
        {"m": PGA3.MOTOR, "a": PGA3.POINT, "b": PGA3.POINT},
        lambda m, a, b: sandwich(m, a) & sandwich(m, b),
    ),
    "meet of moved planes": (
        {"m": PGA3.MOTOR, "a": PGA3.PLANE, "b": PGA3.PLANE},
        lambda m, a, b: sandwich(m, a) ^ sandwich(m, b),
    ),
    "by hand": ({"m": PGA3.MOTOR, "a": PGA3.LINE}, lambda m, a: m * a * ~m),
    "by hand, right first": ({"m": PGA3.MOTOR, "a": PGA3.LINE}, lambda m, a: m * (a * ~m)),
    "free versor by hand": ({"m": PGA3.EVEN, "a": PGA3.POINT}, lambda m, a: m * a * ~m),
    "chain": ({"m": PGA3.MOTOR, "n": PGA3.MOTOR, "a": PGA3.POINT}, lambda m, n, a: sandwich(m * n, a)),
    "nested": ({"m": VGA3.ROTOR, "n": VGA3.ROTOR, "a": VGA3.VECTOR}, lambda m, n, a: sandwich(m, sandwich(n, a))),
    "inverse of unit": ({"m": PGA3.MOTOR, "n": PGA3.MOTOR}, lambda m, n: inverse(m) * n),
    "inverse of moved": ({"m": VGA3.ROTOR, "a": VGA3.VECTOR}, lambda m, a: inverse(sandwich(m, a))),
    "length of moved": ({"m": PGA3.MOTOR, "a": PGA3.PLANE}, lambda m, a: norm_squared(sandwich(m, a))),
    "grade of moved": ({"m": VGA3.ROTOR, "a": VGA3.full}, lambda m, a: sandwich(m, a).grade(1, 3)),
    "invariant of moved": (
        {"m": PGA3.MOTOR, "a": PGA3.POINT, "b": PGA3.PLANE},
        lambda m, a, b: sandwich(m, a) ^ sandwich(m, b),
    ),
    "conformal, five dimensions": (
        {"m": CGA3.MOTOR, "a": CGA3.POINT, "b": CGA3.POINT},
        lambda m, a, b: scalar_product(sandwich(m, a), sandwich(m, b)),
    ),
    "spacetime": (
        {"m": STA.ROTOR, "a": STA.VECTOR, "b": STA.VECTOR},
        lambda m, a, b: scalar_product(sandwich(m, a), sandwich(m, b)),
    ),
    "odd versor": ({"v": VGA3.UNIT_VECTOR, "a": VGA3.VECTOR}, lambda v, a: sandwich(v, a)),
    "moved versor": (
        {"m": VGA2.ROTOR, "n": VGA2.ROTOR, "a": VGA2.VECTOR},
        lambda m, n, a: sandwich(sandwich(m, n), sandwich(m, a)),
    ),
    "reversed versor": ({"m": PGA3.MOTOR, "a": PGA3.PLANE}, lambda m, a: ~m * a * m),
    "reflected versor": (
        {"m": PGA2.MOTOR, "a": PGA2.LINE, "b": PGA2.POINT},
        lambda m, a, b: sandwich(m, a * b) & sandwich(m, b),
    ),
}


def declare(name: str, parameters: dict[str, Any], function: Callable[..., Any], returns: Any = None) -> Kernel:
    """A kernel of any function, for any names of its parameters."""
    return Kernel(name, function, tuple(Parameter(key, given) for key, given in parameters.items()), returns, "")


@all_cases("name", REWRITABLE)
def test_every_rewriting_preserves_the_meaning(name: str) -> None:
    definition = declare(name, *REWRITABLE[name])
    expressions = trace(definition).expressions
    variants = rewrite(expressions)
    assert next(iter(variants)) == "as written" and variants["as written"] == expressions
    assert set(variants) <= set(STRATEGIES)
    random = Random(name)
    for _ in range(2):
        at = sample(definition, random)
        expected = evaluate(expressions, at)
        for strategy, variant in variants.items():
            for mine, theirs in zip(evaluate(variant, at), expected, strict=True):
                assert mine.terms == theirs.terms, strategy


QUICK = (
    "free versor by hand",
    "length of moved",
    "invariant of moved",
    "odd versor",
    "moved versor",
    "reversed versor",
)
"""Definitions that take less than half a second to compile."""


@pytest.mark.parametrize("name", some_slow(REWRITABLE, *(REWRITABLE.keys() - set(QUICK))))
def test_rewritten_kernels_equal_their_definition(name: str) -> None:
    compiled(declare(name, *REWRITABLE[name]))


# Lower


@pytest.mark.parametrize("name", ["invariant of moved", "nested", "inverse of moved", "moved versor"])
@pytest.mark.parametrize("reduce", [True, False])
def test_every_choice_of_stages_preserves_the_meaning(name: str, reduce: bool) -> None:
    definition = declare(name, *REWRITABLE[name])
    expressions = trace(definition).expressions
    found = stages(expressions)
    assert found
    at = sample(definition, Random(name))
    expected = evaluate(expressions, at)
    slots = [Slot(0, blade, sign) for blade in expected[0].terms for sign in (1, -1)]
    for cuts in (frozenset(), frozenset(found), *(frozenset([one]) for one in found)):
        system = Lowering(definition, expressions, cuts, reduce).system(slots)
        values = run_shared(system, Policy(), [Fraction(value) for value in at.values()])
        assert values == [slot.sign * expected[0].terms[slot.blade] for slot in slots]


# Decide


def test_zero_coefficients_are_omitted_and_constants_are_proved() -> None:
    record = compiled(declare("moved", {"m": PGA3.MOTOR, "p": PGA3.POINT}, sandwich))
    assert record.decision is not None and record.decision.layouts == (PGA3.POINT,)
    assert record.decision.constants[0, PGA3.blade("e123")[1]] == -1 or record.decision.constants[0, 0b0111] == 1
    record = compiled(declare("unit", {"m": PGA3.MOTOR}, lambda m: m * ~m))
    assert record.program.lines == () and record.program.results[0].operands == (1,)
    record = compiled(declare("identity", {"a": VGA3.VECTOR}, lambda a: a ^ a))
    assert record.program.results[0].operands == (0,)
    record = compiled(declare("pythagoras", {"t": SCALAR}, lambda t: sin(t) * sin(t) + cos(t) * cos(t)))
    assert record.program.results[0].operands == (1,)
    record = compiled(declare("root", {"x": SCALAR}, lambda x: sqrt(x) * sqrt(x) - x))
    assert record.program.results[0].operands == (0,)
    record = compiled(declare("length", {"a": VGA3.VECTOR}, lambda a: norm_squared(normalize(a))))
    assert record.program.results[0].operands == (1,)


def test_coefficients_that_only_seem_constant_are_kept() -> None:
    """Equality at a few points is not a proof: ``min(x, 100)`` is x at every small point."""
    record = compiled(declare("seems", {"x": SCALAR}, lambda x: minimum(x, 100) - x))
    assert record.program.results[0].operands != (0,)
    record = compiled(declare("seems", {"x": SCALAR}, lambda x: select(x < 1000, 1, x)))
    assert record.program.lines


ONLY_E12_E3 = VGA3.layout("ONLY", "e12 e3")


@all_cases(
    "parameters, function, returns, message",
    [
        ({"a": VGA3.VECTOR, "b": VGA3.VECTOR}, lambda a, b: a * b, VGA3.BIVECTOR,
         "the result has blade 1; expected only e12 e13 e23, as specified by returns=VGA3.BIVECTOR"),
        ({"a": VGA3.VECTOR}, lambda a: a, ONLY_E12_E3, "the result has blade e1"),
        ({"p": PGA3.POINT, "q": PGA3.POINT}, lambda p, q: p + q, PGA3.POINT,
         "the coefficient of e123 could not be proved to be 1; expected e123 = 1, as specified by returns=PGA3.POINT"),
        ({"m": PGA3.EVEN, "p": PGA3.POINT}, lambda m, p: m * p * ~m, PGA3.POINT,
         "the coefficient of e123 could not be proved to be 1"),
        ({"a": VGA3.VECTOR}, lambda a: a, PGA3.PLANE,
         "a result of VGA3; expected PGA3.PLANE, as specified by returns="),
        ({"a": VGA3.VECTOR}, lambda a: a, SCALAR, "the result has blade e1"),
        ({"p": CGA3.POINT}, lambda p: p + CGA3.multivector({"einf": 1}), CGA3.POINT, "einf"),
        ({"p": CGA3.POINT}, lambda p: p - CGA3.multivector({"einf": 1}) * p["einf"], CGA3.POINT, "einf"),
    ])  # fmt: skip
def test_a_pinned_layout_that_cannot_hold_the_result(
    parameters: dict[str, Any], function: Callable[..., Any], returns: Any, message: str
) -> None:
    """No coefficient is dropped: an error names the blade and the kernel."""
    with pytest.raises(KernelError) as caught:
        compile_kernel(declare("pinned", parameters, function, returns))
    assert message in str(caught.value) and "kernel pinned" in str(caught.value)


def test_a_pinned_layout_that_holds_the_result() -> None:
    record = compiled(declare("f", {"m": PGA3.MOTOR, "p": PGA3.POINT}, sandwich, PGA3.TRIVECTOR))
    assert record.program.results[0].shape == (4,)
    record = compiled(declare("f", {"m": CGA2.MOTOR, "p": CGA2.POINT}, sandwich, CGA2.POINT))
    assert record.program.results[0].shape == (2,)
    record = compiled(declare("f", {"a": VGA3.VECTOR}, lambda a: a, VGA3.full))
    assert record.program.results[0].operands == (0, "a_e1", "a_e2", "a_e3", 0, 0, 0, 0)


def test_an_inferred_layout_claims_only_what_is_proved() -> None:
    """Layouts with relations are for inputs; a result with the same blades may violate them."""

    def layouts(algebra: Algebra) -> list[Any]:
        return [algebra.layout("ON_THE_CIRCLE", "e1 e2", relations=lambda x: x * x - 1)]

    algebra = Algebra("CIRCLE", "e1 e2", [1, 1], layouts=layouts)
    record = compiled(declare("f", {"a": algebra.layout("V", "e1 e2")}, lambda a: a + a))
    assert record.decision is not None and not record.decision.layouts[0].has_relations
    record = compiled(declare("f", {"a": VGA3.UNIT_VECTOR}, lambda a: a + a))
    assert record.decision is not None and record.decision.layouts == (VGA3.VECTOR,)


# Points outside of the domain must not affect whether a kernel compiles


@pytest.mark.parametrize(
    ("parameters", "function"),
    [
        ({"x": SCALAR}, lambda x: minimum(sqrt(x), 1)),
        ({"x": SCALAR}, lambda x: maximum(acos(x), 1)),
        ({"x": SCALAR}, lambda x: select(log(x) < 1, x, 2)),
        ({"x": SCALAR}, lambda x: atan2(sqrt(x), 1)),
        ({"x": SCALAR}, lambda x: absolute(log(x))),
        ({"x": SCALAR}, lambda x: exp(-x * x) * sin(x)),
        ({"a": VGA3.VECTOR, "b": VGA3.VECTOR}, lambda a, b: atan2(norm(a ^ b), scalar_product(a, b))),
        ({"a": VGA3.VECTOR}, lambda a: select(norm(a) < Fraction(1, 10**9), a, normalize(a))),
    ],
    ids=["min sqrt", "max acos", "log less", "atan2 sqrt", "abs log", "exp sin", "angle", "guarded"],
)
def test_kernels_outside_the_domain_of_a_function(parameters: dict[str, Any], function: Callable[..., Any]) -> None:
    """Kernels compile although random points have negative radicands and arguments of logarithms."""
    record = compile_kernel(declare("f", parameters, function), forms=False)
    random = Random(3)
    assert record.trace is not None
    checked = 0
    for _ in range(20):
        at = {name: abs(value) / 100 for name, value in sample(record.kernel, random).items()}
        with mpmath.workdps(DIGITS):
            lifted = {name: to_mpmath(value) for name, value in at.items()}
            found = interpret(
                record.program, {p.name: [lifted[c] for c in p.components] for p in record.kernel.parameters}
            )
            expected = evaluate(record.trace.expressions, lifted)
            layout = record.decision.layouts[0] if record.decision else None
            assert layout is not None
            mine = layout.element(found["out"])
            for blade in mine.terms:
                assert abs(mine.terms[blade] - expected[0].terms.get(blade, 0)) < mpmath.mpf(10) ** -30
                checked += 1
    assert checked


@pytest.mark.parametrize("offset", range(3))
def test_a_pole_at_a_random_point_is_no_error(offset: int) -> None:
    """``1 / (x - v)`` is a valid kernel even if `v` is a random point that the compiler tries."""
    random = Random(7)
    probe = declare("probe", {"x": SCALAR}, lambda x: x)
    value = [sample(probe, random)["x"] for _ in range(3)][offset]
    record = compile_kernel(declare("pole", {"x": SCALAR}, lambda x: 1 / (x - value)), forms=False)
    (found,) = interpret(record.program, {"x": [value + 2]})["out"]
    assert found == Fraction(1, 2)


# Search


CHOSEN: dict[str, tuple[dict[str, Any], Callable[..., Any]]] = {
    "move_point": ({"m": PGA3.MOTOR, "p": PGA3.POINT}, sandwich),
    "rotate": ({"r": VGA3.ROTOR, "v": VGA3.VECTOR}, sandwich),
    "motor_product": ({"m": PGA3.MOTOR, "n": PGA3.MOTOR}, lambda m, n: m * n),
    "sphere": ({"a": CGA2.POINT, "b": CGA2.POINT, "c": CGA2.POINT}, lambda a, b, c: a ^ b ^ c),
    "unit": ({"a": VGA3.VECTOR}, normalize),
    "reflect": ({"n": VGA3.VECTOR, "v": VGA3.VECTOR}, lambda n, v: n * v * inverse(n)),
}


@cache
def chosen(name: str) -> Compilation:
    return compile_kernel(declare(name, *CHOSEN[name]))


@pytest.mark.parametrize("name", CHOSEN)
def test_the_best_never_costs_more_than_the_author(name: str) -> None:
    record = chosen(name)
    check_against_author(record, 0)
    assert record.candidates[0].origin == "as written"
    totals = [candidate.cost.total for candidate in record.candidates]
    assert record.cost.total == min(totals) <= totals[0]
    assert record.best is record.candidates[totals.index(min(totals))], "the first of the cheapest"
    for candidate in record.candidates:
        check_against_author(Compilation(record.kernel, record.trace, decision=record.decision, best=candidate), 1, 1)
        assert cost(candidate.program) == candidate.cost


def test_known_counts() -> None:
    """Counts are at most the published ones; a higher count fails, and a lower one must be recorded here."""
    known = {"move_point": (21, 18), "rotate": (18, 12), "motor_product": (48, 40)}
    for name, (mul, add) in known.items():
        found = chosen(name).cost
        assert (found.mul, found.add) == (mul, add), name


def test_stages_extend_records_and_modify_none() -> None:
    record = Compilation(declare("f", *CHOSEN["rotate"]))
    names = [field.name for field in fields(Compilation)]
    for stage in PIPELINE:
        before = {name: getattr(record, name) for name in names}
        after = stage(record)
        assert {name: getattr(record, name) for name in names} == before, f"{stage.__name__} changed its input"
        kept = [name for name in names if before[name] not in (None, (), {})]
        assert all(getattr(after, name) is not None for name in kept)
        found = any(getattr(after, name) != before[name] for name in names)
        assert found or stage is PIPELINE[-1], f"{stage.__name__} found nothing, and is not the proof"
        record = after
    with pytest.raises(FrozenInstanceError):
        record.best = None  # type: ignore[misc]


def test_compiling_twice_gives_the_same_program() -> None:
    for name in ("rotate", "sphere", "unit"):
        again = compile_kernel(declare(name, *CHOSEN[name]), forms=False)
        assert str(again.program) == str(chosen(name).program), name


DETERMINISM = """
from gacompiler import *
from gacompiler.algebra.catalog import *
from gacompiler.passes.pipeline import compile_kernel
def named(function):
    function.__name__ = "example"
    return function
definitions = [
    kernel(m=PGA3.MOTOR, p=PGA3.POINT)(named(lambda m, p: sandwich(m, p))),
    kernel(m=PGA2.MOTOR, a=PGA2.POINT, b=PGA2.POINT)(named(lambda m, a, b: sandwich(m, a) & sandwich(m, b))),
    kernel(a=CGA2.POINT, b=CGA2.POINT, c=CGA2.POINT)(named(lambda a, b, c: a ^ b ^ c)),
    kernel(a=VGA3.VECTOR, t=SCALAR)(named(lambda a, t: (normalize(a) * sin(t), norm(a), cos(t) / norm_squared(a)))),
    kernel(a=PGA3.EVEN)(named(lambda a: inverse(a))),
    kernel(r=STA.ROTOR, f=STA.VECTOR)(named(lambda r, f: sandwich(r, f))),
]
for definition in definitions:
    record = compile_kernel(definition)
    print(record.program)
    print([(candidate.origin, candidate.cost.total) for candidate in record.candidates])
"""


@pytest.mark.slow
def test_programs_do_not_depend_on_hash_seeds() -> None:
    texts = []
    for seed in ("1", "4242"):
        environment = {**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": str(ROOT)}
        done = subprocess.run(
            [sys.executable, "-c", DETERMINISM], capture_output=True, text=True, env=environment, cwd=ROOT, check=True
        )
        texts.append(done.stdout)
    assert texts[0] == texts[1] and len(texts[0].splitlines()) > 50


# Random kernels


FUZZ_ALGEBRAS = (VGA3, PGA3, CGA2, STA, NULL_PAIRS, OBLIQUE, PGA2)


def random_layout(random: Random, algebra: Algebra, name: str) -> Any:
    """A named layout of the algebra, or a sparse one with a fixed coefficient, with random orientation and order."""
    if algebra.layouts and random.random() < 0.5:
        return random.choice([layout for layout in algebra.layouts.values() if layout.size <= 8])
    blades = random.sample(algebra.blades(), random.randint(1, min(4, len(algebra.blades()))))
    names = []
    for blade in blades:
        vectors = [v for k, v in enumerate(algebra.vectors) if blade >> k & 1]
        random.shuffle(vectors)
        names.append("^".join(vectors) or "1")
    fixed = {names.pop(): random.choice((1, -1, 2, Fraction(1, 2)))} if len(names) > 1 and random.random() < 0.4 else {}
    return algebra.layout(name, "@".join(names).replace("@", " "), fixed=fixed)


def random_expression(random: Random, leaves: list[Any], depth: int) -> Any:
    if depth == 0 or random.random() < 0.15:
        return random.choice(leaves)
    binary = [
        lambda a, b: a * b, lambda a, b: a * b, lambda a, b: a ^ b, lambda a, b: a & b, lambda a, b: a + b,
        lambda a, b: a - b, left_contraction, right_contraction, commutator, scalar_product,
    ]  # fmt: skip
    unary = [reverse, grade_involution, clifford_conjugate, dual, undual, lambda a: -a, lambda a: a * Fraction(-3, 2),
             lambda a: a.grade(1, 2), lambda a: a + 1, norm_squared]  # fmt: skip
    if random.random() < 0.25:
        return random.choice(unary)(random_expression(random, leaves, depth - 1))
    if random.random() < 0.2:
        x, versor = random_expression(random, leaves, depth - 1), random.choice(leaves)
        return versor * x * ~versor
    left, right = (random_expression(random, leaves, depth - 1) for _ in range(2))
    return random.choice(binary)(left, right)


@pytest.mark.parametrize("seed", some_slow(range(49), *(set(range(49)) - {0, 8, 16, 45, 32, 40, 48})))
def test_random_kernels_equal_their_definition(seed: int) -> None:
    """Programs of random products of random sparse layouts equal the author's definition exactly.

    The quick cases are one of each algebra.
    """
    random = Random(seed)
    algebra = FUZZ_ALGEBRAS[seed % len(FUZZ_ALGEBRAS)]
    count = random.randint(1, 3)
    layouts = {name: random_layout(random, algebra, f"L{k}") for k, name in enumerate("abc"[:count])}
    state = random.getstate()

    def body(*inputs: Any) -> Any:
        random.setstate(state)
        results = tuple(random_expression(random, list(inputs), 3) for _ in range(random.randint(1, 2)))
        return results if len(results) > 1 else results[0]

    functions = {1: lambda a: body(a), 2: lambda a, b: body(a, b), 3: lambda a, b, c: body(a, b, c)}
    definition = declare(f"random_{seed}", layouts, functions[count])
    record = compile_kernel(definition, forms=False)
    check_against_author(record, seed, 3)


SPECIFIC: dict[str, tuple[dict[str, Any], Callable[..., Any]]] = {
    "array of points": ({"p": array(PGA3.POINT, 3)}, lambda p: p[0] & p[1] & p[2]),
    "matrix": (
        {"m": array(SCALAR, 2, 2), "v": VGA2.VECTOR},
        lambda m, v: assemble(
            VGA2, {"e1": m[0][0] * v["e1"] + m[0][1] * v["e2"], "e2": m[1][0] * v["e1"] + m[1][1] * v["e2"]}
        ),
    ),
    "inverse of even": ({"a": PGA3.EVEN}, inverse),
    "inverse of full": ({"a": VGA3.full}, inverse),
    "inverse of oblique": ({"a": OBLIQUE.full}, inverse),
    "inverse of spacetime even": ({"a": STA.EVEN}, inverse),
    "quotient": (
        {"a": VGA3.VECTOR, "b": VGA3.VECTOR},
        lambda a, b: a / scalar_product(b, b) + b / scalar_product(a, b),
    ),
    "nested quotients": ({"x": SCALAR, "y": SCALAR}, lambda x, y: 1 / (x + 1 / (y + x)) + 1 / (y + x)),
    "roots": (
        {"x": SCALAR, "y": SCALAR},
        lambda x, y: sqrt(x * x + y * y) / sqrt(x * x + y * y + 1) + 1 / sqrt(x * x + y * y),
    ),
    "polarity": ({"a": STA.BIVECTOR}, polarity),
    "constants": ({"a": VGA3.VECTOR}, lambda a: a * VGA3.multivector({"e12": Fraction(2, 3), "1": 1})),
    "oblique constants": ({"a": OBLIQUE.full}, lambda a: OBLIQUE.basis()[0] * a * OBLIQUE.basis()[1]),
    "select of multivectors": ({"a": VGA3.VECTOR, "b": VGA3.ROTOR, "s": SCALAR}, lambda a, b, s: select(s < 1, a, b)),
    "shared results": ({"a": VGA3.VECTOR, "b": VGA3.VECTOR}, lambda a, b: (a * b, b * a, a ^ b)),
    "same twice": ({"a": VGA3.VECTOR}, lambda a: (a, a, -a)),
    "powers": ({"a": VGA3.EVEN}, lambda a: a**3),
    "quaternion product": ({"p": QUATERNIONS.QUATERNION, "q": QUATERNIONS.QUATERNION}, lambda p, q: p * q),
    "quaternion inverse": ({"q": QUATERNIONS.QUATERNION}, inverse),
    "spheres": ({"a": CGA3.SPHERE, "b": CGA3.SPHERE}, lambda a, b: a & b),
    "distance": ({"a": CGA3.POINT, "b": CGA3.POINT}, lambda a, b: sqrt(-2 * scalar_product(a, b))),
    "piecewise": ({"x": SCALAR, "y": SCALAR}, lambda x, y: minimum(x, y) + maximum(x, y) - absolute(x - y)),
    "half turn guard": ({"r": VGA3.ROTOR, "s": VGA3.ROTOR}, lambda r, s: select(scalar_product(r, ~s) < 0, -r, r)),
    "translator product": ({"s": PGA3.TRANSLATOR, "t": PGA3.TRANSLATOR}, lambda s, t: s * t),
    "null pairs": ({"a": NULL_PAIRS.BIVECTOR, "v": NULL_PAIRS.VECTOR}, commutator),
    "dilator": ({"d": CGA3.DILATOR, "p": CGA3.POINT}, sandwich),
}


FOUR = orthogonal(4)
SPECIFIC |= {
    "root of a constant": ({"p": PGA3.POINT}, lambda p: p * sqrt(norm_squared(p) + 1)),
    "constant minus root": ({"x": SCALAR}, lambda x: Fraction(1, 3) - sqrt(x * x)),
    "too large to expand": ({"a": FOUR.full, "b": FOUR.full}, lambda a, b: norm_squared(a * b * a * b) * a),
    "too large, unit": (
        {"a": FOUR.UNIT_EVEN, "b": FOUR.UNIT_EVEN},
        lambda a, b: sqrt(norm_squared(a * b * a * b + a)) * a,
    ),
}


SLOW = ("inverse of oblique", "inverse of full", "inverse of spacetime even", "too large, unit", "too large to expand")


@pytest.mark.parametrize("name", some_slow(SPECIFIC, *SLOW))
def test_kernels_of_every_kind_equal_their_definition(name: str) -> None:
    record = compile_kernel(declare(name, *SPECIFIC[name]), forms=False)
    check_against_author(record, 11, 3)


def test_inverses_of_unit_quaternions() -> None:
    """``inverse(q)`` of a unit quaternion negates i, j and k."""
    record = compile_kernel(declare("f", {"q": QUATERNIONS.UNIT_QUATERNION}, inverse))
    values = [Fraction(1, 2), Fraction(1, 2), Fraction(-1, 2), Fraction(1, 2)]
    assert record.decision is not None
    found = record.decision.layouts[0].element(interpret(record.program, {"q": values})["out"])
    assert found == QUATERNIONS.QUATERNION.element([values[0], -values[1], -values[2], -values[3]])


@pytest.mark.slow
def test_long_sums_compile() -> None:
    """Sums of hundreds of terms are common, for example a weighted mean of a hundred points."""
    layout = ArrayOf(SCALAR, (500,))
    record = compile_kernel(declare("f", {"x": layout}, lambda x: sum(x)))
    assert interpret(record.program, {"x": list(range(500))})["out"] == (124750,)
