"""Public values of the packages can be pickled, copied and hashed, independently of earlier calls."""

from __future__ import annotations

import contextlib
import copy
import importlib
import inspect
import json
import multiprocessing
import os
import pickle
import subprocess
import sys
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
import sympy
from example_kernels import move_point
from selection import some_slow

import gacompiler as ga
from gacompiler import calculus, read_cluscript, symbolic
from gacompiler.algebra import catalog
from gacompiler.algebra.algebra import Algebra
from gacompiler.algebra.catalog import CGA3, PGA3, VGA3
from gacompiler.errors import KernelError
from gacompiler.objects import CGA3 as CONFORMAL
from gacompiler.objects import PGA3 as PROJECTIVE
from gacompiler.objects import Space, builds
from gacompiler.robots import Chain
from generated import pga3

ALGEBRAS = [value for value in vars(catalog).values() if isinstance(value, Algebra)]
OWN = Algebra("OWN", "a b c", [1, -1, 0], layouts=lambda algebra: [algebra.layout("VECTOR", "a b c")])


def kernel_without_a_module(**layouts: Any) -> Any:
    @ga.kernel(**layouts)
    def moved(m, p):
        return ga.sandwich(m, p)

    return moved


FAMILY = ga.Family("motions", space="space")


@FAMILY.kernel(m=PGA3.MOTOR, p=PGA3.POINT)
def moved_by_a_family(m, p):
    """The point `p` of {space}, moved."""
    return ga.sandwich(m, p)


MOVE = kernel_without_a_module(m=PGA3.MOTOR, p=PGA3.POINT)
SCRIPT = read_cluscript("m = a * e1 + b * e12;\n?x = m * e2;\n", VGA3, "script")
MODULES = (
    "gacompiler", "gacompiler.objects", "gacompiler.symbolic", "gacompiler.calculus", "gacompiler.cluscript",
    "gacompiler.robots",
)  # fmt: skip


def angle() -> Any:
    return sympy.Symbol("angle", positive=True)


def rotor() -> Any:
    v = symbolic.symbols("v", layout=VGA3.VECTOR)
    return (1 + sympy.sqrt(2) * sympy.cos(angle()) * (v ^ symbolic.multivector(VGA3, {"e1": 1}))).map(sympy.factor)


EXAMPLES: dict[str, Callable[[], Any]] = {
    "Algebra": lambda: OWN,
    "Layout": lambda: OWN.layout("SPHERE", "a b", fixed={"c": Fraction(1, 3)}, unit=True),
    "Multivector": lambda: PGA3.multivector({"1": Fraction(1, 3), "e032": 2, "e01": 0.5}),
    "Kernel": lambda: MOVE.traced(),
    "Family": lambda: FAMILY,
    "MultivectorArray": lambda: PROJECTIVE.random_motor(3, generator=0),
    "Space": lambda: Space(OWN),
    "SymbolicMultivector": rotor,
    "DerivedProgram": lambda: symbolic.program_of(MOVE),
    "Chart": lambda: calculus.spherical(),
    "FieldOperator": lambda: calculus.spherical().grad,
    "LinearFunction": lambda: calculus.linear_function("f", VGA3),
    "Script": lambda: SCRIPT,
    "Drawn": lambda: read_cluscript(":Red;\n:x = e1 + a * e2;\n", VGA3, "drawing").drawn[0],
    "Expression": lambda: ga.exp(MOVE.traced().function.symbols[0].grade(2)),
    "Builds": builds,
    "Chain": lambda: Chain(("revolute",), (-1,), ((1, 0, 0, 0, 0, 0),), 0, (1, 0, 0, 0, 0, 0, 0, 0)),
}
"""An example of each public type whose objects have content."""


def again(value: Any) -> Any:
    return pickle.loads(pickle.dumps(value))


def same(a: Any, b: Any) -> bool:
    """Equality where the type has one, else by what is printed."""
    if type(a) is not type(b):
        return False
    return bool(np.all(a == b)) if type(a).__eq__ is not object.__eq__ else repr(a) == repr(b)


def touch(value: Any) -> None:
    """Access every property, so that cached values are computed."""
    for name in dir(type(value)):
        if not name.startswith("_") and not callable(getattr(type(value), name)):
            with contextlib.suppress(ga.errors.GacError, AttributeError):  # a property that this value does not have
                getattr(value, name)


def test_every_public_type_has_an_example() -> None:
    found = set()
    for module in map(importlib.import_module, MODULES):
        for name in getattr(module, "__all__", dir(module)):
            value = getattr(module, name)
            if (
                inspect.isclass(value)
                and value.__module__.startswith("gacompiler")
                and not issubclass(value, Exception)
            ):
                found.add(name)
    assert len(found) > 10 and found <= EXAMPLES.keys()


@pytest.mark.parametrize("name", EXAMPLES)
def test_round_trip(name: str) -> None:
    value = EXAMPLES[name]()
    for touched in (False, True):
        if touched:
            touch(value)
        for other in (again(value), copy.copy(value), copy.deepcopy(value), copy.deepcopy([value])[0]):
            assert same(other, value) and same(again(other), value)
            assert str(other) == str(value)
            if name != "MultivectorArray":
                assert hash(other) == hash(value)


@pytest.mark.parametrize("algebra", some_slow(ALGEBRAS, catalog.CCGA), ids=str)
def test_the_catalog_comes_back_as_itself(algebra: Algebra) -> None:
    space = Space(algebra)
    for touched in (False, True):
        if touched and algebra.dimension < 8:
            touch(algebra)
            assert algebra.pseudoscalar and algebra.full
        for value in (algebra, *algebra.layouts.values(), algebra.UNIT_EVEN):
            for other in (again(value), copy.copy(value), copy.deepcopy(value)):
                assert other is value and hash(other) == hash(value)
        for vector in algebra.basis():
            assert again(vector) == vector and hash(again(vector)) == hash(vector) and copy.deepcopy(vector) == vector
        for other in (again(space), copy.copy(space), copy.deepcopy(space)):
            assert other == space and hash(other) == hash(space) and other.algebra is algebra
    for own in (CONFORMAL, PROJECTIVE):
        assert again(own) == own != Space(own.algebra) and type(again(own)) is type(own)


def has_norm_one(x: Any) -> Any:
    """Return ``x ~x - 1``, as relations that are a function."""
    return x * ~x - 1


def test_layouts_of_functions_keep_their_meaning() -> None:
    """A conformal point computes its last coefficient, a unit number and a layout of one's own have relations."""
    point = again(CGA3.POINT).element([1, 2, 3])
    assert point * point == 0 and point["einf"] == 7
    assert again(catalog.COMPLEX.UNIT_NUMBER).relations(catalog.COMPLEX.NUMBER.element([3, 4])) == (24, 24)
    own = OWN.layout("DOUBLE", "a", implied={"b": catalog.HalfSquare(("a",))}, relations=has_norm_one)
    assert again(own) == own and again(own).element([4]) == own.element([4])
    assert again(OWN).VECTOR == OWN.VECTOR and again(again(OWN)) is again(OWN)


def test_equal_values_have_one_hash() -> None:
    exact = VGA3.multivector({"1": 2, "e12": Fraction(1, 2)})
    assert hash(exact) == hash(symbolic.multivector(VGA3, {"1": 2, "e12": sympy.Rational(1, 2)}))
    assert hash(VGA3.scalar(3)) == hash(3) == hash(symbolic.multivector(VGA3, {"1": 3})) and hash(exact * 0) == hash(0)
    assert len({exact, exact * 1, exact * 2, 2 * exact}) == 2


@pytest.mark.slow
def test_long_derivations_have_no_limit() -> None:
    v = symbolic.symbols("v", layout=VGA3.VECTOR)
    total, expression = v, MOVE.parameters[1].symbols()
    for k in range(1500):
        total, expression = total + v, expression + k
    assert again(total) == total and again(expression) is expression
    assert again(total).history[0] == "add" and copy.deepcopy(expression) is expression


def test_kernels() -> None:
    """Kernels of modules are identical after a round trip, others equal; a pickled closed form rejects other blades."""
    assert again(move_point) is move_point
    derivative = ga.jacobian(move_point, "m")
    for kernel in (MOVE, derivative, SCRIPT):
        other = again(kernel)
        assert copy.copy(kernel) is copy.deepcopy(kernel) is kernel and again(other) == other
        assert other.traced().function.value == kernel.traced().function.value
    m, p = PGA3.multivector({"e12": 1}), PGA3.multivector({"e123": 1, "e032": Fraction(1, 3), "e021": 2})
    assert again(MOVE)(m, p) == MOVE(m, p) == m * p * ~m

    @ga.kernel(b=VGA3.BIVECTOR)
    def turn(b):
        return ga.exp(b)

    with pytest.raises(KernelError, match=r"blades of VGA3\.BIVECTOR"):
        again(turn)(VGA3.multivector({"e123": 1}))


MOTOR, POINT = np.array([0.6, 0.8, 0, 0, 1, 2, 3, 0.5]), np.array([1.0, 2, 3])


def elsewhere(kernel: Any) -> Any:
    """Call a kernel in another process; return its result and the kernel."""
    return kernel(MOTOR, POINT), kernel


def turned(value: Any) -> Any:
    touch(value)
    return str(value), value


def other_symbols() -> None:
    """A process that has met other symbols first, so that none has the number it has here."""
    for name in "zyxwvu":
        symbolic.multivector(VGA3, {"e1": sympy.Symbol(name)})


@pytest.mark.slow
def test_another_process() -> None:
    backends = ["arrays", "numba"] + ["c"] * bool(ga.runtime.find_compiler())
    compiled = [ga.compile(MOVE, backend=backend) for backend in backends]
    with multiprocessing.get_context("spawn").Pool(1, other_symbols) as pool:
        for kernel in (*compiled, pga3.move_point):
            moved, back = pool.apply(elsewhere, (kernel,))
            np.testing.assert_array_equal(moved, kernel(MOTOR, POINT))
            assert back is kernel and again(kernel) is kernel is copy.copy(kernel) is copy.deepcopy(kernel)
        assert pool.apply(turned, (move_point,))[1] is move_point
        for name, make in EXAMPLES.items():
            value = make()
            text, back = pool.apply(turned, (value,))
            assert same(back, value) and text == str(value), name


@pytest.mark.slow
def test_compiled_kernels_where_there_are_no_files(tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """A process that shares nothing with this one compiles the definition that the pickle carries."""
    code = "import pickle, sys\ncall, *given = pickle.load(sys.stdin.buffer)\nprint(call(*given).tolist())"
    kernel = kernel_without_a_module(m=PGA3.ROTOR, p=PGA3.DIRECTION)
    data = pickle.dumps((ga.compile(kernel, backend="arrays"), MOTOR[:4], POINT))
    monkeypatch.setenv("GAC_CACHE", str(tmp_path))
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, sys.path)))
    done = subprocess.run([sys.executable, "-c", code], input=data, capture_output=True, check=True)
    np.testing.assert_allclose(
        json.loads(done.stdout), ga.compile(kernel, backend="arrays")(MOTOR[:4], POINT), 0, 1e-15
    )
    assert len(list((tmp_path / "modules").iterdir())) == 1
