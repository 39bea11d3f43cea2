"""Kernels as operators of torch: derivatives by differences, batches, graphs, types and messages."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from typing import Any

import pytest
from operator_kernels import SHAPES, arm, compile_quickly, move_point, picked

import gacompiler
from gacompiler import SCALAR, array, kernel
from gacompiler.algebra.catalog import VGA3
from gacompiler.errors import KernelError

pytestmark = pytest.mark.peers

torch = pytest.importorskip("torch")

from gacompiler.torch import operator  # noqa: E402


@pytest.fixture(autouse=True)
def _quickly_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    compile_quickly(monkeypatch)


def tensors(*shapes: tuple[int, ...], dtype: Any = None) -> list[Any]:
    torch.manual_seed(0)
    return [torch.randn(shape, dtype=dtype or torch.float64, requires_grad=True) for shape in shapes]


@pytest.mark.parametrize(("definition", "shapes"), SHAPES, ids=lambda x: getattr(x, "name", None))
def test_derivatives_of_both_orders(definition: Any, shapes: Any) -> None:
    """Against differences, with broadcast arguments; motors are off their manifold, where values count too."""
    given = tensors(*shapes)
    assert torch.autograd.gradcheck(operator(definition), given)
    assert torch.autograd.gradgradcheck(operator(definition), given)


def test_derivatives_of_loops() -> None:
    given = tensors((2, 3), (3, 3), (4,))
    assert torch.autograd.gradcheck(operator(arm), given)
    q, axes, tool = (x.detach() for x in given)
    one = q.clone().requires_grad_()  # second derivatives by one argument: each pair is a kernel to compile
    assert torch.autograd.gradgradcheck(lambda x: operator(arm)(x, axes, tool), one)


def test_values_are_those_of_the_kernel() -> None:
    m, p = tensors((8,), (50, 3))
    m = m.detach() / torch.linalg.norm(m[:4].detach())
    m[7] -= (m[7] * m[0] - m[1] * m[6] + m[2] * m[5] - m[3] * m[4]) / m[0]  # a unit motor
    found = operator(move_point)(m, p)
    wanted = gacompiler.compile(move_point)(m.numpy(), p.detach().numpy())
    assert torch.allclose(found, torch.from_numpy(wanted), atol=1e-12)


def test_tables_of_rows_have_no_gradient() -> None:
    (x,) = tensors((6, 2))
    rows = torch.tensor([5, 0, 0, 3])
    operator(picked)(x, rows).backward()
    wanted = torch.zeros(6, 2, dtype=torch.float64)
    for row in rows:
        wanted[row] += x.detach()[row].flip(0)
    assert torch.allclose(x.grad, wanted)


def same(a: Any, b: Any) -> bool:
    return bool(torch.allclose(a, b, rtol=1e-13, atol=1e-13))


def test_transforms() -> None:
    """vmap over either argument and both, with leading axes of their own; jacrev, jacfwd and hessian agree."""
    g = operator(move_point)
    m, p = tensors((7, 8), (4, 3))
    rows = torch.stack([g(one, p) for one in m])
    assert same(torch.vmap(g, in_dims=(0, None))(m, p), rows)
    assert same(torch.vmap(g, in_dims=(1, None))(m.T, p), rows)
    assert same(torch.vmap(torch.vmap(g, in_dims=(None, 0)), in_dims=(0, None))(m, p), rows)
    back, ahead = (transform(lambda x: g(x, p))(m[0]) for transform in (torch.func.jacrev, torch.func.jacfwd))
    assert torch.allclose(back, ahead, atol=1e-13)

    def cost(x: Any) -> Any:
        return (g(x, p) ** 2).sum()

    second = torch.func.hessian(cost)(m[0])
    assert torch.allclose(second, torch.func.jacrev(torch.func.jacrev(cost))(m[0]), atol=1e-12)
    assert torch.allclose(second, second.T, atol=1e-12)


def test_graphs_without_breaks() -> None:
    g = operator(move_point)

    def cost(m: Any, p: Any) -> Any:
        return (g(m.sin(), p) ** 2).sum()

    compiled: Callable[..., Any] = torch.compile(cost, fullgraph=True, backend="aot_eager")
    for shape in ((5, 8), (9, 8)):
        (one,), p = tensors(shape), torch.ones(3, dtype=torch.float64)
        other = one.detach().clone().requires_grad_()
        cost(one, p).backward()
        compiled(other, p).backward()
        assert torch.allclose(one.grad, other.grad, rtol=1e-13)
    for transform in (torch.func.jacfwd, torch.func.grad, torch.func.hessian):  # which break them, or are eager
        transformed = transform(lambda m: cost(m, p))
        given = one.detach()
        assert torch.allclose(torch.compile(transformed, backend="aot_eager")(given), transformed(given), rtol=1e-13)
    torch.library.opcheck(g.registered, tuple(tensors((5, 8), (3,))))


@pytest.mark.parametrize(("kind", "error"), [("float32", 1e-5), ("bfloat16", 0.1), ("float16", 0.02)])
def test_narrow_types(kind: str, error: float) -> None:
    dtype = getattr(torch, kind)
    m, p = tensors((20, 8), (20, 3))
    found = operator(move_point)(m.to(dtype), p.to(dtype))
    exact = operator(move_point)(m.to(dtype).double(), p.to(dtype).double())
    assert found.dtype == dtype
    assert ((found.double() - exact).abs().max() / exact.abs().max()) < error


def test_autocast_and_copies() -> None:
    """Narrow tensors that torch chooses become float32; copies and pickles of operators are the operators."""
    g = operator(move_point)
    m, p = tensors((5, 8), (5, 3), dtype=torch.float32)
    with torch.autocast("cpu", dtype=torch.bfloat16):
        narrow = m @ torch.eye(8)
        found = g(narrow, p)
    assert narrow.dtype == torch.bfloat16 and found.dtype == torch.float32
    assert torch.equal(found, g(narrow.float(), p))
    found.sum().backward()
    assert m.grad.dtype == torch.float32 and m.grad.any()
    assert copy.deepcopy(g) is copy.copy(g) is g
    assert pickle.loads(pickle.dumps(g)) is g


@kernel(x=array(SCALAR, 3), v=VGA3.VECTOR)
def cubed(x, v):
    """Scale a vector by numbers of a fixed array."""
    return x[0] * x[1] * x[1] * x[2] * v


def test_arrays_of_fixed_length() -> None:
    """Their gradients are rows of one number; those of vectors of coefficients are such arrays, too."""
    given = tensors((2, 3), (4, 1, 3))
    assert torch.autograd.gradcheck(operator(cubed), given)
    assert torch.autograd.gradgradcheck(operator(cubed), given)
    (m, v, p) = (x.detach() for x in tensors((8,), (8,), (4, 3)))

    def cost(x: Any) -> Any:
        return (operator(move_point)(x, p) ** 2).sum()

    product = torch.autograd.functional.hvp(cost, m, v)[1]
    assert torch.allclose(product, torch.func.hessian(cost)(m) @ v, rtol=1e-11)


def test_memory_orders_and_empty_batches() -> None:
    m, p = tensors((6, 8), (6, 3))
    g = operator(move_point)
    wanted = g(m, p)
    assert same(g(m.T.contiguous().T, torch.cat([p, p], 1)[:, :3]), wanted)
    assert same(g(m, p[0].expand(6, 3)), g(m, p[0]))
    empty = g(m[:0], p[:0])
    assert empty.shape == (0, *wanted.shape[1:])
    empty.sum().backward()
    assert not m.grad.any()


def test_messages() -> None:
    g = operator(move_point)
    m, p = tensors((8,), (3,))
    with pytest.raises(KernelError, match=r"move_point: p.*float32 on cpu.*float64"):
        g(m, p.float())
    with pytest.raises(KernelError, match=r"1 of 2 arguments.*m, p"):
        g(m)
    with pytest.raises((ValueError, TypeError), match="m"):
        g(m[:7], p)
    with pytest.raises(KernelError, match=r"move_point: m.*an object of type ndarray.*a dense tensor of torch"):
        g(m.detach().numpy(), p)
    with pytest.raises(KernelError, match=r"move_point: p.*the layout torch.sparse_coo.*a dense tensor of torch"):
        g(m, p.detach().to_sparse())
    for kind in (torch.int64, torch.bool, torch.complex128):
        with pytest.raises(KernelError, match=rf"move_point: m: {kind} on cpu; expected real numbers"):
            g(m.detach().to(kind), p.detach().to(kind))
    with pytest.raises(KernelError, match=r"move_point: p.*float64 on meta; expected torch.float64 on cpu"):
        g(m, p.to("meta"))
    with pytest.raises(KernelError, match=r"picked: rows.*float64 on cpu; expected integers"):
        operator(picked)(p[None], m)
    with pytest.raises(KernelError, match=r"an object of type int.*@kernel"):
        operator(3)
