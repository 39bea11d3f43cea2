"""Layers as operators of torch and functions of jax."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.linalg import block_diag

from algorithms.learning import Algebra, Gate, GradeLinear, GradeProduct, Interaction, Invariants, Linear, Split
from algorithms.learning.frameworks import jax_function, torch_module, torch_operator

pytestmark = pytest.mark.peers
LAYERS = [Linear(2), GradeProduct(), Gate(), Split("silu"), Invariants(), Interaction(2, steps=2, hidden=(4,))]


def given(layer: Any) -> tuple[Any, list[Any], Any]:
    random = np.random.default_rng(0)
    x, parameters = random.normal(size=(5, 4, 8)), layer.initial(Algebra(3), 4, random)
    return x, parameters, layer.value(Algebra(3), x, parameters)


@pytest.mark.parametrize("layer", LAYERS, ids=str)
def test_torch(layer: Any) -> None:
    torch = pytest.importorskip("torch")
    x, parameters, y = given(layer)
    run = torch_operator(layer, "G(3)", 4)
    tensors = [torch.tensor(a, requires_grad=True) for a in (x, *parameters)]

    def function(x: Any, *own: Any) -> Any:
        return run(x, list(own))

    assert torch.autograd.gradcheck(function, tensors)
    assert np.allclose(function(*tensors).detach(), y)
    graph = torch.compile(lambda *a: 2 * torch.sin(function(*a)), fullgraph=True, backend="aot_eager")
    assert np.allclose(graph(*tensors).detach(), 2 * np.sin(y))
    many = torch.vmap(lambda x: function(x, *tensors[1:]))(torch.stack([tensors[0], 2 * tensors[0]]))
    assert np.allclose(many[0].detach(), y)


@pytest.mark.parametrize("layer", LAYERS, ids=str)
def test_jax(layer: Any) -> None:
    jax = pytest.importorskip("jax")
    x, parameters, y = given(layer)
    with jax.enable_x64(True):
        function = jax_function(layer, "G(3)", 4)
        value, pull = jax.vjp(jax.jit(function), x, *parameters)
        dx, others = layer.pull(Algebra(3), x, parameters, y, np.cos(y))
        assert np.allclose(value, y, atol=1e-12)
        for found, expected in zip(pull(jax.numpy.cos(value)), (dx, *others), strict=True):
            assert np.allclose(found, expected, atol=1e-10)
        many = jax.jit(jax.vmap(lambda x: function(x, *parameters)))(np.stack([x, 2 * x]))
        assert np.allclose(many[0], y) and np.allclose(many[1], layer.value(Algebra(3), 2 * x, parameters))


def turned(x: Any) -> Any:
    """Coefficients after a rotation of space, for blades in the order of their grades."""
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    pairs = ((0, 1), (0, 2), (1, 2))
    minors = [[np.linalg.det(turn[np.ix_(a, b)]) for b in pairs] for a in pairs]
    return x @ block_diag(1, turn, minors, 1).T


def test_modules_learn_and_commute_with_rotations() -> None:
    """The product of two vectors, learned from samples; a module whose weights got no gradient would not."""
    torch = pytest.importorskip("torch")
    torch.manual_seed(0)
    net = torch_module([GradeLinear(4), GradeProduct(), Gate(), GradeLinear(1)], "G(3)", 2).double()
    random = np.random.default_rng(1)
    x = np.zeros((2, 16, 2, 8))
    x[..., 1:4] = random.normal(size=(2, 16, 2, 3))
    target = torch.tensor((x[..., 0, :] * x[..., 1, :]).sum(-1))  # the scalar product
    given, optimiser = torch.tensor(x), torch.optim.Adam(net.parameters(), lr=0.05)

    def loss() -> Any:
        return (net(given)[..., 0, 0] - target).square().mean()

    first = loss().item()
    for _ in range(60):
        optimiser.zero_grad()
        loss().backward()
        optimiser.step()
    assert loss().item() < 0.1 * first
    assert np.allclose(net(torch.tensor(turned(x))).detach(), turned(net(given).detach().numpy()), atol=1e-12)
    again = torch_module([GradeLinear(4), GradeProduct(), Gate(), GradeLinear(1)], "G(3)", 2, seed=5).double()
    again.load_state_dict(net.state_dict())
    assert torch.equal(again(given), net(given))
    with pytest.raises(ValueError, match=r"GradeLinear.*shape \(2, 16, 2, 4\); expected \(..., 2, 8\)"):
        net(given[..., :4])
