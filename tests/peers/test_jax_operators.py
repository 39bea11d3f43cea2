"""Kernels as operators of jax: derivatives by differences, batches, compiled programs, types and messages."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from operator_kernels import SHAPES, arm, compile_quickly, move_point, picked, polynomial

import gacompiler
from gacompiler.errors import KernelError

pytestmark = pytest.mark.peers

jax = pytest.importorskip("jax")

from jax.test_util import check_grads  # noqa: E402

from gacompiler.jax import operator  # noqa: E402

BOTH = ["fwd", "rev"]


@pytest.fixture(autouse=True)
def _quickly_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    compile_quickly(monkeypatch)


@pytest.fixture(autouse=True)
def _doubles() -> Iterator[None]:
    with jax.enable_x64(True):
        yield


def arrays(*shapes: tuple[int, ...], dtype: Any = float) -> list[Any]:
    rng = np.random.default_rng(0)
    return [jax.numpy.asarray(rng.normal(size=shape), dtype) for shape in shapes]


@pytest.mark.parametrize(("definition", "shapes"), SHAPES, ids=lambda x: getattr(x, "name", None))
def test_derivatives(definition: Any, shapes: Any) -> None:
    """Against differences, in both directions, with broadcast arguments and compiled.

    Second derivatives in all pairs of directions are compared with differences in `test_derivatives_of_loops`, and
    those of these kernels in `test_torch_operators.py`.
    """
    given = arrays(*shapes)
    check_grads(operator(definition), given, order=1, modes=BOTH)
    check_grads(jax.jit(operator(definition)), given, order=1, modes=BOTH)


def test_derivatives_of_loops() -> None:
    """Second derivatives are those of a loop that compiles fast; `test_torch_operators.py` has those of the arm."""
    check_grads(operator(arm), arrays((2, 3), (3, 3), (4,)), order=1, modes=BOTH)
    check_grads(operator(polynomial), arrays((2, 4), ()), order=2, modes=BOTH)


def test_values_are_those_of_the_kernel() -> None:
    m, p = arrays((8,), (50, 3))
    m = m / jax.numpy.linalg.norm(m[:4])
    m = m.at[7].set((m[1] * m[6] - m[2] * m[5] + m[3] * m[4]) / m[0])  # a unit motor
    wanted = gacompiler.compile(move_point)(np.asarray(m), np.asarray(p))
    for function in (operator(move_point), jax.jit(operator(move_point))):
        assert np.allclose(function(m, p), wanted, atol=1e-12)


def test_tables_of_rows_have_no_gradient() -> None:
    (x,), rows = arrays((6, 2)), np.array([5, 0, 0, 3])
    found = jax.grad(lambda x: operator(picked)(x, rows).sum())(x)
    wanted = np.zeros((6, 2))
    for row in rows:
        wanted[row] += np.asarray(x[row])[::-1]
    assert np.allclose(found, wanted, rtol=1e-13)


def test_transforms() -> None:
    """vmap over either argument and both, with leading axes of their own; all second derivatives agree."""
    g = operator(move_point)
    m, p = arrays((7, 8), (4, 3))
    rows = np.stack([g(one, p) for one in m])
    for function in (jax.vmap(g, (0, None)), jax.jit(jax.vmap(g, (0, None)))):
        assert np.allclose(function(m, p), rows, rtol=1e-13, atol=1e-13)
    assert np.allclose(jax.vmap(g, (1, None))(m.T, p), rows, rtol=1e-13, atol=1e-13)
    assert np.allclose(jax.vmap(jax.vmap(g, (None, 0)), (0, None))(m, p), rows, rtol=1e-13, atol=1e-13)

    def cost(x: Any) -> Any:
        return (g(x, p) ** 2).sum()

    second = jax.hessian(cost)(m[0])
    assert np.allclose(second, jax.jacrev(jax.jacrev(cost))(m[0]), atol=1e-12)
    assert np.allclose(second, second.T, atol=1e-12)
    each = jax.vmap(jax.grad(cost))(m)
    assert np.allclose(each, np.stack([jax.grad(cost)(one) for one in m]), rtol=1e-13, atol=1e-13)


@pytest.mark.parametrize(("kind", "error"), [("float32", 1e-5), ("bfloat16", 0.1), ("float16", 0.02)])
def test_narrow_types(kind: str, error: float) -> None:
    m, p = arrays((20, 8), (20, 3), dtype=kind)
    found = operator(move_point)(m, p)
    exact = operator(move_point)(m.astype(float), p.astype(float))
    assert found.dtype == kind
    assert abs(found.astype(float) - exact).max() / abs(exact).max() < error


def test_arrays_of_numpy_and_empty_batches() -> None:
    m, p = (np.asarray(x) for x in arrays((6, 8), (6, 3)))
    g = operator(move_point)
    assert np.array_equal(g(np.asfortranarray(m), p[::-1][::-1]), g(m, p))
    empty = g(m[:0], p[:0])
    assert empty.shape == (0, 3)
    assert not jax.grad(lambda p: g(m[:0], p).sum())(p[0]).any()


def test_messages() -> None:
    g = operator(move_point)
    m, p = arrays((8,), (3,))
    with pytest.raises(KernelError, match=r"move_point: p: float32.*float64"):
        g(m, p.astype("float32"))
    with pytest.raises(KernelError, match=r"1 of 2 arguments.*m, p"):
        g(m)
    with pytest.raises(KernelError, match=r"move_point: m: shape \(7,\); expected \(..., 8\)"):
        g(m[:7], p)
    with pytest.raises(KernelError, match=r"arrays of type int.*real"):
        g(m.astype(int), p.astype(int))
    with pytest.raises(KernelError, match=r"an object of type int.*@kernel"):
        operator(3)
