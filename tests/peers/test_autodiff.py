"""Kernels on torch tensors and jax arrays: their derivatives by the frameworks equal those of our own kernels.

What torch and jax differentiate is the array text of the generated modules; `vjp` and `jvp` of the same definitions are
compiled on their own, without a search: tests of derivatives compile others with one, and in C. Arguments with
relations (unit motors) vary along the manifold alone: off it, a kernel may be any other extension of the same function.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from random import Random
from typing import Any

import numpy as np
import pytest

import gacompiler
from gacompiler import SCALAR, absolute, atan2, jvp, kernel, maximum, minimum, select, sqrt, vjp
from gacompiler.algebra.layout import Layout
from gacompiler.algebra.multivector import Multivector
from gacompiler.frontend.kernel import Kernel
from gacompiler.passes.samples import sample
from generated import pga3, vga3

pytestmark = pytest.mark.peers

torch = pytest.importorskip("torch")
jax = pytest.importorskip("jax")
jnp = jax.numpy

N = 6
"""Elements of a batch."""
CASES = [
    "pga3.move_point m",  # a motor on a point
    "vga3.rotate_vector r",  # sandwiches
    "cga3.move_sphere x",
    "pga3.join_three_points b",  # join and meet
    "pga3.motor_exponential b",  # functions, with branches
    "pga3.motor_logarithm m",
    "pga3.motor_power t",
    "pga3.even_inverse x",  # inverse and normalisation
    "pga3.normalize_motor x",
    "pga3.distance_point_line p",  # a number as result
]


@pytest.fixture(autouse=True)
def _doubles() -> Iterator[None]:
    with jax.enable_x64(True):
        yield


@dataclass(frozen=True)
class Case:
    """Arguments in a batch, and derivatives by our kernels: the value, its slope along one tangent of the argument at
    `place`, and the gradient of ``cotangent . value`` times every tangent, shape (N, K)."""

    kernel: Any
    place: int
    arguments: list[np.ndarray[Any, Any]]
    tangents: np.ndarray[Any, Any]
    cotangent: np.ndarray[Any, Any]
    value: np.ndarray[Any, Any]
    slope: np.ndarray[Any, Any]
    projected: np.ndarray[Any, Any]

    def of(self, x: Any, *others: Any) -> Any:
        """The kernel as a function of the one argument."""
        return self.kernel(*others[: self.place], x, *others[self.place :])

    def split(self, dtype: Any) -> tuple[Any, list[Any], Any, Any]:
        """The one argument, the others, the first tangent and the cotangent."""
        arrays = [array.astype(dtype) for array in self.arguments]
        x = arrays.pop(self.place)
        return x, arrays, self.tangents[:, 0].reshape(x.shape).astype(dtype), self.cotangent.astype(dtype)

    def check_gradient(self, gradient: Any, dtype: Any = np.float64) -> None:
        gradient = np.asarray(gradient)
        assert gradient.dtype == dtype
        close(np.einsum("nk,ntk->nt", gradient.reshape(N, -1), self.tangents), self.projected, dtype)


def close(found: Any, right: np.ndarray[Any, Any], dtype: Any = np.float64) -> None:
    """Element by element, to some rounding errors of its largest entry."""
    found = np.asarray(found).reshape(N, -1)
    right = right.reshape(N, -1)
    error = np.abs(found - right).max(axis=1) / (1 + np.abs(right).max(axis=1))
    assert error.max() < 2000 * np.finfo(dtype).eps


def tangents_of(layout: Layout, x: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Directions, in rows, in which an element may move: every one, or every bivector times a unit versor."""
    if not layout.has_relations:
        return np.eye(layout.size)
    versor = layout.element(list(x))
    moved = [Multivector(layout.algebra, {blade: 1.0}) * versor for blade in layout.algebra.blades(2)]
    return np.array([[slot.sign * element.terms.get(slot.blade, 0.0) for slot in layout.stored] for element in moved])


@pytest.fixture(scope="module", params=CASES)
def case(request: pytest.FixtureRequest) -> Case:
    path, wrt = request.param.split()
    module, name = path.split(".")
    definition = getattr(importlib.import_module(f"gacompiler.specs.{module}"), name)
    assert isinstance(definition, Kernel)
    function = getattr(importlib.import_module(f"generated.{module}"), name)
    random, rng = Random(name), np.random.default_rng(len(name))
    drawn = [sample(definition, random) for _ in range(N)]
    arguments = [np.array([[float(at[c]) for c in p.components] for at in drawn]) for p in definition.parameters]
    place = [p.name for p in definition.parameters].index(wrt)
    layout = definition.parameters[place].layout
    tangents = np.array([tangents_of(layout, x) for x in arguments[place]])
    arguments = [x[:, 0] if p.layout.is_scalar else x for p, x in zip(definition.parameters, arguments, strict=True)]
    value = function(*arguments)
    cotangent = rng.normal(size=value.shape)
    along = tangents[:, 0].reshape(arguments[place].shape)
    _, gradient = gacompiler.compile(vjp(definition, wrt), "arrays", effort=0)(*arguments, cotangent)
    _, slope = gacompiler.compile(jvp(definition, wrt), "arrays", effort=0)(*arguments, along)
    projected = np.einsum("nk,ntk->nt", gradient, tangents)
    assert np.isfinite(projected).all() and np.abs(projected).max() > 1e-3
    return Case(function, place, arguments, tangents, cotangent, value, slope, projected)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_torch_backward(case: Case, dtype: Any) -> None:
    x, others, _, cotangent = case.split(dtype)
    variable = torch.tensor(x, requires_grad=True)
    value = case.of(variable, *map(torch.tensor, others))
    close(value.detach(), case.value, dtype)
    value.backward(torch.tensor(cotangent))
    case.check_gradient(variable.grad, dtype)


def test_torch_transforms(case: Case) -> None:
    """Forward mode, and both modes of one element under vmap."""
    x, others, along, cotangent = (torch.tensor(a) if isinstance(a, np.ndarray) else a for a in case.split(np.float64))
    others = [torch.tensor(array) for array in others]
    close(torch.func.jvp(lambda x: case.of(x, *others), (x,), (along,))[1], case.slope)

    def gradient(x: Any, cotangent: Any, *others: Any) -> Any:
        return torch.func.vjp(lambda x: case.of(x, *others), x)[1](cotangent)[0]

    def slope(x: Any, along: Any, *others: Any) -> Any:
        return torch.func.jvp(lambda x: case.of(x, *others), (x,), (along,))[1]

    case.check_gradient(torch.vmap(gradient)(x, cotangent, *others))
    close(torch.vmap(slope)(x, along, *others), case.slope)


def test_jax_of_a_batch(case: Case) -> None:
    check_jax(case, np.float64)


@pytest.mark.parametrize("case", ["pga3.move_point m", "pga3.motor_power t"], indirect=True)
def test_jax_in_single_precision(case: Case) -> None:
    """With and without branches; `test_torch_backward` runs the texts of all kernels in single precision."""
    check_jax(case, np.float32)


def check_jax(case: Case, dtype: Any) -> None:
    """Compare the value of a batch and its derivatives in both directions."""
    x, others, along, cotangent = case.split(dtype)
    value, pull = jax.vjp(lambda x: case.of(x, *others), jnp.asarray(x))
    assert value.dtype == dtype
    close(value, case.value, dtype)
    case.check_gradient(pull(jnp.asarray(cotangent))[0], dtype)
    close(jax.jvp(lambda x: case.of(x, *others), (jnp.asarray(x),), (jnp.asarray(along),))[1], case.slope, dtype)


def test_jax_jit_and_vmap(case: Case) -> None:
    x, others, along, cotangent = case.split(np.float64)

    def gradient(x: Any, cotangent: Any, *others: Any) -> Any:
        return jax.vjp(lambda x: case.of(x, *others), x)[1](cotangent)[0]

    def slope(x: Any, along: Any, *others: Any) -> Any:
        return jax.jvp(lambda x: case.of(x, *others), (x,), (along,))[1]

    case.check_gradient(jax.jit(gradient)(x, cotangent, *others))
    case.check_gradient(jax.jit(jax.vmap(gradient))(x, cotangent, *others))
    close(jax.jit(jax.vmap(slope))(x, along, *others), case.slope)
    close(jax.jit(case.kernel)(*case.arguments), case.value)


def test_matrices() -> None:
    """A kernel that gives a matrix, by the derivatives of the columns: the rotated basis vectors."""
    definition = importlib.import_module("gacompiler.specs.vga3").rotate_vector
    column = gacompiler.compile(jvp(definition, "r"), "arrays", effort=0)
    r = vga3.rotor_exponential(np.random.default_rng(1).normal(size=(N, 3)))
    along = vga3.rotor_product(r, vga3.rotor_exponential([np.pi / 2, 0, 0]))  # r times e12, a tangent
    right = np.stack([column(r, axis, along)[1] for axis in np.eye(3)], -1)
    close(jax.jvp(vga3.rotor_to_matrix, (jnp.asarray(r),), (jnp.asarray(along),))[1], right)
    close(torch.func.jvp(vga3.rotor_to_matrix, (torch.tensor(r),), (torch.tensor(along),))[1], right)


# Places where there is no derivative, or two.


def gradients(function: Callable[..., Any], *arguments: Any) -> list[list[np.ndarray[Any, Any]]]:
    """The gradient of the sum of what a kernel gives, by every argument, by torch and by jax."""
    tensors = [torch.tensor(x, dtype=torch.float64, requires_grad=True) for x in arguments]
    function(*tensors).sum().backward()
    pulled = jax.grad(lambda arrays: function(*arrays).sum())([jnp.asarray(x, np.float64) for x in arguments])
    return [[tensor.grad.numpy() for tensor in tensors], [np.asarray(array) for array in pulled]]


@kernel(x=SCALAR, y=SCALAR)
def switches(x, y):
    """A sum of all functions with branches, distinguished by powers of ten."""
    choice = select(x < y, 10000 * x, 2000 * x) + select(x <= y, 300000 * x, 40000 * x)
    return absolute(x) + 10 * minimum(x, y) + 100 * maximum(x, y) + choice


@pytest.mark.parametrize(
    ("x", "y", "by_x", "by_y"),
    [
        (0.0, 0.0, -1 + 2000 + 300000, 10 + 100),  # of abs the negative side, else the second
        (2.0, 2.0, 1 + 2000 + 300000, 10 + 100),
        (-1.0, 2.0, -1 + 10 + 10000 + 300000, 100),
        (3.0, 2.0, 1 + 100 + 2000 + 40000, 10),
    ],
)
def test_at_the_switch(x: float, y: float, by_x: float, by_y: float) -> None:
    for k, (name, right) in enumerate((("x", by_x), ("y", by_y))):
        assert gacompiler.compile(vjp(switches, name))(x, y, 1.0)[1] == [right]
        for found in gradients(gacompiler.compile(switches), x, y):
            assert found[k] == right


def test_where_formulas_change() -> None:
    """Exponentials and logarithms around 1 are smooth, and so are the text's other branches there."""
    weights = np.arange(1.0, 9.0)
    cases: list[tuple[Any, Any, Any]] = [
        (pga3.motor_exponential, np.zeros(6), np.eye(8)[[1, 2, 3, 4, 5, 6]] @ weights),
        (pga3.motor_logarithm, np.eye(8)[0], [0, 1, 2, 3, 4, 5, 6, 0]),
        (vga3.rotor_exponential, np.zeros(3), weights[1:4]),
        (vga3.rotor_logarithm, np.eye(4)[0], [0, 1, 2, 3]),
    ]
    for function, x, right in cases:
        for (found,) in gradients(lambda x, f=function: f(x) * type_of(x)(weights[: f.definition.out_shapes[0][0]]), x):
            np.testing.assert_allclose(found, right, 1e-15)


def type_of(x: Any) -> Callable[[Any], Any]:
    return torch.tensor if isinstance(x, torch.Tensor) else jnp.asarray


@kernel(x=SCALAR)
def guarded_root(x):
    """A root that is chosen only where it has a derivative."""
    return select(x > 0, sqrt(x), 3 * x)


@kernel(y=SCALAR, x=SCALAR)
def angle(y, x):
    return atan2(y, x)


def test_differences_between_the_frameworks() -> None:
    """As in docs/scaling.md: a branch that is not taken, with an infinite derivative; the angle of zero."""
    assert gacompiler.compile(vjp(guarded_root, "x"))(0.0, 1.0)[1] == [3.0]
    assert all(np.isnan(found[0]) for found in gradients(gacompiler.compile(guarded_root), 0.0))
    assert np.isnan(gacompiler.compile(vjp(angle, "y"))(0.0, 0.0, 1.0)[1])
    by_torch, by_jax = gradients(gacompiler.compile(angle), 0.0, 0.0)
    assert by_torch[0] == 0 and np.isnan(by_jax[0])


# Arguments of several kinds.


@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_numbers_and_lists_together_with_tensors(dtype: str) -> None:
    """Numbers and lists have the precision of the tensors and do not widen results; numpy arrays keep their dtype."""
    axis, angle = [0.1, 0.2, 0.3], 0.1
    right = vga3.rotor_from_axis_angle(np.array(axis, dtype), np.array(angle, dtype))
    for array in (torch.tensor, jnp.asarray):
        own, kind = array(np.array(axis, dtype)), array(np.array(angle, dtype))
        for found in (vga3.rotor_from_axis_angle(own, angle), vga3.rotor_from_axis_angle(axis, kind)):
            assert found.dtype == own.dtype
            np.testing.assert_allclose(found, right, 4 * np.finfo(dtype).eps)
        assert vga3.rotor_from_axis_angle(array(np.array([0, 0, 1])), 0.5).shape == (4,)
        wide = vga3.rotate_vector(array(np.eye(4, dtype=np.float32)[0]), np.ones((5, 3))[::-1])
        assert wide.dtype == array(np.zeros(1)).dtype
        assert vga3.rotate_vector(array(np.eye(4)[0]), np.empty((0, 3))).shape == (0, 3)


def test_read_only_arrays_together_with_tensors() -> None:
    p = np.ones((4, 3))
    p.flags.writeable = False
    m = torch.tensor(np.eye(8)[0])
    np.testing.assert_array_equal(pga3.move_point(m, p), p)
    np.testing.assert_array_equal(pga3.move_point(m, p[::-1]), p)


def test_torch_compile_goes_around_kernels() -> None:
    """A kernel breaks the graph of torch.compile; the values and derivatives are the same."""
    m = torch.tensor(np.eye(8)[0])
    p = torch.rand(5, 3, dtype=torch.float64, requires_grad=True)
    found = torch.compile(lambda m, p: 2 * pga3.move_point(m, p), backend="eager")(m, p)
    found.sum().backward()
    np.testing.assert_allclose(found.detach(), 2 * p.detach(), 1e-15)
    np.testing.assert_allclose(p.grad, np.full((5, 3), 2.0), 1e-15)
