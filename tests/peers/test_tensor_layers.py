"""Equivariant layers in torch and jax are those of networks, commute with versors, and have second derivatives."""

from __future__ import annotations

import copy
import io
import pickle
from collections.abc import Callable, Iterator
from itertools import product
from typing import Any

import numpy as np
import pytest

from algorithms.learning import (
    Algebra,
    Attention,
    Bounded,
    Dropout,
    Each,
    Gate,
    GradeLinear,
    GradeProduct,
    Invariants,
    Layer,
    Linear,
    Messages,
    Norm,
    Residual,
    Rotor,
    Split,
)
from algorithms.learning.base import Defined
from algorithms.learning.framework_functions import by_blades
from algorithms.learning.frameworks import jax_function, torch_module, torch_operator
from tests.support.equivariant_layers import LAYERS, RING, given, reflections

pytestmark = pytest.mark.peers
ALGEBRAS = ["G(3)", "G(1,3)", "G(4,1)", "G(3,0,1)"]


@pytest.mark.parametrize("name", ALGEBRAS)
def test_modules(name: str) -> None:
    """Values of networks, and values of turned inputs, to 1e-12 of what is rounded."""
    torch, algebra = pytest.importorskip("torch"), Algebra.of(name)
    turn = reflections(algebra, 2, seed=2)
    for layer in LAYERS:
        x, parameters = given(layer, algebra)
        module = torch_module(layer, algebra, 6).double()
        for own, numbers in zip(module.weights, parameters, strict=True):
            own.data[:] = torch.tensor(numbers)
        y, turned = (module(torch.tensor(one)).detach().numpy() for one in (x, x @ turn.T))
        assert np.abs(y - layer.value(algebra, x, parameters)).max() < 1e-12 * np.abs(y).max(), layer
        assert np.abs(turned - y @ turn.T).max() < 1e-12 * np.linalg.norm(turn) * np.abs(turned).max(), layer


@pytest.mark.parametrize("name", ALGEBRAS)
def test_second_derivatives(name: str) -> None:
    """Against differences, along random directions."""
    torch, algebra = pytest.importorskip("torch"), Algebra.of(name)
    for layer in [*LAYERS, Invariants()]:
        x, parameters = given(layer, algebra)
        run = torch_operator(layer, algebra, 6)
        tensors = [torch.tensor(0.3 * one, requires_grad=True) for one in (x[:1], *parameters)]

        def function(x: Any, *own: Any, run: Any = run) -> Any:
            return run(x, list(own))

        assert torch.autograd.gradcheck(function, tensors, fast_mode=True), layer
        assert torch.autograd.gradgradcheck(function, tensors, fast_mode=True), layer


@pytest.fixture
def doubles() -> Iterator[Any]:
    """Return jax, with double precision in all threads, those of callbacks included."""
    jax = pytest.importorskip("jax")
    before = jax.config.jax_enable_x64
    jax.config.update("jax_enable_x64", True)
    yield jax
    jax.config.update("jax_enable_x64", before)


@pytest.mark.parametrize("name", ALGEBRAS)
def test_functions_of_jax(name: str, doubles: Any) -> None:
    """Values and gradients of networks; second derivatives are those of torch."""
    jax, torch, algebra = doubles, pytest.importorskip("torch"), Algebra.of(name)
    for layer in (Norm(), Residual((GradeProduct(), Gate())), Attention(3, heads=2), Messages(3, RING), Invariants()):
        x, parameters = given(layer, algebra)
        function, expected = jax_function(layer, algebra, 6), layer.value(algebra, x, parameters)
        along = np.random.default_rng(4).normal(size=x.shape)

        @jax.jit
        def cost(*arrays: Any, function: Any = function) -> Any:
            y = function(*arrays)
            return jax.numpy.sum(jax.numpy.sin(y)), y

        gradient = jax.jit(jax.grad(cost, argnums=tuple(range(1 + len(parameters))), has_aux=True))
        found, y = gradient(x, *parameters)
        assert np.allclose(y, expected, rtol=1e-11, atol=1e-11), layer
        dx, others = layer.pull(algebra, x, parameters, expected, np.cos(expected))
        for one, wanted in zip(found, (dx, *others), strict=True):
            assert np.abs(one - wanted).max() <= 1e-10 * np.abs(wanted).max() + 1e-12, layer
        if isinstance(layer, Messages):
            run, own = torch_operator(layer, algebra, 6), [torch.tensor(one) for one in parameters]
            second = jax.jit(jax.grad(lambda x: (gradient(x, *parameters)[0][0] * along).sum()))(x)  # noqa: B023
            vhp = torch.autograd.functional.vhp
            _, wanted = vhp(lambda x: run(x, own).sin().sum(), torch.tensor(x), torch.tensor(along))  # noqa: B023
            assert np.abs(second - wanted.numpy()).max() < 1e-10 * np.abs(second).max()


def test_graphs_and_batches() -> None:
    torch, algebra = pytest.importorskip("torch"), Algebra(3)
    layers = (
        GradeProduct(),
        Gate(),
        Attention(3),
        Messages(3, RING),
        Residual((GradeProduct(), Dropout(0.5))),
        Linear(2),
    )
    for layer in layers:
        x, _ = given(layer, algebra)
        module, tensor = torch_module(layer, algebra, 6).double().eval(), torch.tensor(x)
        compiled = torch.compile(module, fullgraph=True, backend="aot_eager")
        eager = module(tensor)
        assert torch.allclose(compiled(tensor), eager, rtol=1e-13)
        gradients = [torch.autograd.grad(f(tensor).sin().sum(), list(module.weights)) for f in (module, compiled)]
        assert all(torch.allclose(a, b, rtol=1e-12, atol=1e-12) for a, b in zip(*gradients, strict=True))
        many = torch.vmap(module)(torch.stack([tensor, 2 * tensor]))
        assert torch.allclose(many[0], eager)


def test_transforms() -> None:
    """Derivatives of `torch.func` are those of backward() and of differences, also along parameters."""
    torch, algebra = pytest.importorskip("torch"), Algebra(3)
    for layer in (GradeLinear(2), GradeProduct(), Attention(3), Messages(3, RING), Residual((Norm(), GradeProduct()))):
        x, _ = given(layer, algebra)
        module, tensor = torch_module(layer, algebra, 6).double(), torch.tensor(x)
        names = dict(module.named_parameters())
        along = {name: torch.randn_like(own) for name, own in names.items()}

        def run(own: Any, x: Any, module: Any = module) -> Any:
            return torch.func.functional_call(module, own, (x,)).sin()

        _, pushed = torch.func.jvp(run, (names, tensor), (along, tensor.cos()))
        ahead, behind = (
            run({name: own + h * along[name] for name, own in names.items()}, tensor + h * tensor.cos())
            for h in (1e-5, -1e-5)
        )
        assert torch.allclose(pushed, (ahead - behind) / 2e-5, rtol=1e-6, atol=1e-6), layer
        each = torch.vmap(torch.func.grad(lambda own, x: run(own, x[None]).sum()), in_dims=(None, 0))(names, tensor)
        run(names, tensor).sum().backward()
        for name, own in names.items():
            assert torch.allclose(each[name].sum(0), own.grad, rtol=1e-11, atol=1e-11), layer

        def cost(x: Any) -> Any:
            return run(names, x).square().sum()  # noqa: B023

        second = torch.func.hessian(cost)(tensor[:1])  # forward over reverse
        assert torch.allclose(second, torch.autograd.functional.hessian(cost, tensor[:1]), rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("name", ALGEBRAS)
def test_products_on_other_devices(name: str) -> None:
    """Products as expressions of torch are those of the kernels; on a device without numbers, they have shapes."""
    torch, algebra = pytest.importorskip("torch"), Algebra.of(name)
    random = np.random.default_rng(0)
    a, b = random.normal(size=(2, 5, 3, algebra.size))
    w = random.normal(size=(3, len(algebra.paths)))
    found = by_blades(algebra, *map(torch.tensor, (a, b, w))).numpy()
    expected = np.zeros_like(a)
    path = {tuple(row): k for k, row in enumerate(algebra.paths.tolist())}
    for i, j in np.argwhere(algebra.signs):
        k = algebra.targets[i, j]
        weight = w[:, path[tuple(algebra.grades[[i, j, k]].tolist())]]
        expected[..., k] += algebra.signs[i, j] * weight * a[..., i] * b[..., j]
    assert np.abs(found - expected).max() < 1e-12 * np.abs(expected).max()
    module = torch_module([layer for layer in LAYERS if layer.output(algebra, 6) == (algebra, 6)], name, 6)
    assert module.to("meta")(torch.ones(4, 6, algebra.size, device="meta")).shape == (4, 6, algebra.size)
    with pytest.raises(ValueError, match=r"Rotor\(channels=2\): x on meta; expected a tensor on the CPU, or an equi"):
        torch_module(Rotor(2), name, 6).to("meta")(torch.ones(4, 6, algebra.size, device="meta"))


@pytest.mark.parametrize("name", ALGEBRAS)
def test_neighbours_of_calls(name: str) -> None:
    """Each sample with its own graph, one of them without pairs, beside layers that have the graph of one sample."""
    torch, algebra = pytest.importorskip("torch"), Algebra.of(name)
    random, turn = np.random.default_rng(5), reflections(algebra, 2, seed=2)
    graphs: list[tuple[tuple[int, int], ...]] = [((0, 1), (1, 0), (0, 2)), ((3, 1), (3, 3), (3, 1)), (), ((2, 0),)]
    module = torch_module(Messages(), name, 2).double()
    x = random.normal(size=(len(graphs), 4, 2, algebra.size))
    pairs = [(4 * k + to, 4 * k + sender) for k, graph in enumerate(graphs) for to, sender in graph]
    neighbours = torch.tensor(pairs).T
    found = module(torch.tensor(x), neighbours)
    parameters = [own.detach().numpy() for own in module.weights]
    for k, graph in enumerate(graphs):
        flat, rows = x[k].reshape(1, 8, algebra.size), found[k].detach().numpy()
        if graph:
            expected = Messages(4, graph).value(algebra, flat, parameters)[0].reshape(rows.shape)
            assert np.abs(rows - expected).max() < 1e-12 * np.abs(expected).max()
        else:
            assert np.array_equal(module(torch.tensor(x[k]), neighbours[:, :0]).detach().numpy(), rows)
    turned = module(torch.tensor(x @ turn.T), neighbours).detach().numpy()
    wanted = found.detach().numpy() @ turn.T
    assert np.abs(turned - wanted).max() < 1e-12 * np.linalg.norm(turn) * np.abs(turned).max()
    order = torch.tensor(random.permutation(16))
    moved = module(torch.tensor(x).reshape(16, 2, -1)[order], torch.argsort(order)[neighbours])
    assert torch.allclose(moved, found.reshape(16, 2, -1)[order], rtol=1e-12, atol=1e-12)
    few = torch.tensor(0.3 * x[0, :, :1].repeat(2, 1)[:3], requires_grad=True)
    assert torch.autograd.gradcheck(lambda x: module(x, neighbours[:, :3]), few, fast_mode=True)
    assert torch.autograd.gradgradcheck(lambda x: module(x, neighbours[:, :3]), few, fast_mode=True)


def test_neighbours_in_graphs_and_in_jax(doubles: Any) -> None:
    jax, torch = doubles, pytest.importorskip("torch")
    net = torch_module([Residual((Norm(), Messages())), GradeLinear(1)], "G(3)", 2).double()
    x, pairs = torch.tensor(np.random.default_rng(0).normal(size=(6, 2, 8))), torch.tensor([[0, 1, 5, 0], [1, 2, 0, 0]])
    compiled = torch.compile(net, fullgraph=True, dynamic=True, backend="aot_eager")
    for count in (4, 2, 0):
        assert torch.allclose(compiled(x, pairs[:, :count]), net(x, pairs[:, :count]), rtol=1e-13)
    layer, parameters = net[0].layer, [own.detach().numpy() for own in net[0].weights]
    function = jax_function(layer, "G(3)", 2)
    for call in (function, jax.jit(function)):
        found = call(x.numpy(), *parameters, neighbours=pairs.numpy())
        assert np.abs(found - net[0](x, pairs).detach().numpy()).max() < 1e-12
    for wrong in ([[0], [6]], [[-1], [0]]):
        with pytest.raises(RuntimeError, match="out of DATA bounds"):
            net(x, torch.tensor(wrong))
        with pytest.raises(ValueError, match="expected places of 6 rows"):
            function(x.numpy(), *parameters, neighbours=wrong)
    for bad in (pairs.T, pairs.double()):
        with pytest.raises(ValueError, match=r"expected integers with shape \(2, pairs\), receivers and senders"):
            net(x, bad)
        with pytest.raises(ValueError, match=r"expected integers with shape \(2, pairs\), receivers and senders"):
            function(x.numpy(), *parameters, neighbours=bad.numpy())
    with pytest.raises(ValueError, match=r"Messages.*: no neighbours; expected them in the layer, or in a call"):
        net(x)
    with pytest.raises(ValueError, match="Messages: no neighbours of 3 items; expected pairs of numbers"):
        Messages(3)


def test_layers_with_first_derivatives() -> None:
    torch, algebra = pytest.importorskip("torch"), Algebra(3)
    for layer in (Linear(2), Rotor(2), Split("tanh")):
        module, x = torch_module(layer, algebra, 6).double(), torch.tensor(given(layer, algebra)[0], requires_grad=True)
        module(x).square().sum().backward()
        found = torch.func.grad(lambda x: module(x).square().sum())(x.detach())  # noqa: B023
        each = torch.vmap(torch.func.grad(lambda x: module(x[None]).square().sum()))(x.detach())  # noqa: B023
        assert torch.allclose(found, x.grad, rtol=1e-13) and torch.allclose(each, x.grad, rtol=1e-12, atol=1e-12)
        (gradient,) = torch.autograd.grad(module(x).square().sum(), x, create_graph=True)
        with pytest.raises(NotImplementedError, match=r"no second derivatives; expected the first, or an equivariant"):
            gradient.sum().backward()


@pytest.mark.parametrize("layer", [Residual((Norm(), GradeProduct())), Messages(3, RING), Rotor(2)], ids=str)
def test_copies_of_modules(layer: Layer) -> None:
    """Copies, pickles and saved modules have the parameters of the module and their own memory."""
    torch = pytest.importorskip("torch")
    module, x = torch_module([layer, Split("tanh")], "G(3)", 6).double(), torch.tensor(given(layer, Algebra(3))[0])
    for own in module.parameters():
        own.data += 0.1
    file = io.BytesIO()
    torch.save(module, file)
    file.seek(0)
    copies = copy.deepcopy(module), pickle.loads(pickle.dumps(module)), torch.load(file, weights_only=False)
    before = module(x)
    assert all(torch.equal(other(x), before) for other in copies)
    other = torch_module([layer, Split("tanh")], "G(3)", 6, seed=1).double()
    assert not torch.equal(other(x), before)
    other.load_state_dict(module.state_dict())
    assert torch.equal(other(x), before)
    next(module.parameters()).data += 1
    assert all(torch.equal(each(x), before) for each in (*copies, other)) and not torch.equal(module(x), before)


def test_autocast() -> None:
    """Inputs that torch made narrow meet parameters in single precision, whose gradients are in their type."""
    torch = pytest.importorskip("torch")
    for layer in (GradeProduct(), Attention(3), Messages(3, RING), Linear(2), Rotor(2)):
        x = torch.tensor(given(layer, Algebra(3))[0], dtype=torch.float32, requires_grad=True)
        module = torch_module(layer, "G(3)", 6)
        with torch.autocast("cpu", dtype=torch.bfloat16):
            y = module(x @ torch.eye(8))
        y.float().sum().backward()
        assert {x.grad.dtype, *(own.grad.dtype for own in module.parameters())} == {torch.float32}
        assert (y.float() - module(x)).abs().max() < 0.05 * y.abs().max()  # eight bits, some roundings


@pytest.mark.parametrize("layer", LAYERS, ids=str)
def test_numbers_of_arrays(layer: Layer) -> None:
    assert isinstance(layer, Defined) and layer.arrays == len(given(layer, Algebra(3))[1])


def test_narrow_types() -> None:
    """Products of bfloat16 and float16 are computed in single precision."""
    torch, algebra = pytest.importorskip("torch"), Algebra(3)
    layers = Messages(3, RING), Linear(2), Rotor(2), Split("tanh"), Bounded()
    for layer, (kind, error) in product(layers, (("bfloat16", 0.05), ("float16", 0.01))):
        x, dtype = torch.tensor(given(layer, algebra)[0]), getattr(torch, kind)
        module = torch_module(layer, algebra, 6)
        expected = module(x.float())
        narrow = x.to(dtype).requires_grad_()
        found = module.to(dtype)(narrow)
        found.sum().backward()
        assert found.dtype == narrow.grad.dtype == dtype
        assert (found.float() - expected).abs().max() < error * expected.abs().max(), layer


@pytest.mark.parametrize("layer", [Linear(2), Split("tanh"), Bounded(), Gate(), GradeProduct()], ids=str)
def test_types_are_not_mixed(layer: Layer) -> None:
    """Integers would truncate the results."""
    torch = pytest.importorskip("torch")
    module, whole = torch_module(layer, "G(3)", 6), torch.ones(4, 6, 8, dtype=torch.int64)
    with pytest.raises(TypeError, match=r"torch.int64.*; expected one floating-point type"):
        module(whole)
    if list(module.parameters()):
        with pytest.raises(TypeError, match=r"torch.float64, torch.float32"):
            module(whole.double())


def test_narrow_types_of_jax() -> None:
    jax, algebra = pytest.importorskip("jax"), Algebra(3)
    for layer in (GradeProduct(), Messages(3, RING), Linear(2)):
        x, parameters = given(layer, algebra)
        function, expected = jax_function(layer, algebra, 6), layer.value(algebra, x, parameters)
        narrow = [jax.numpy.asarray(one, jax.numpy.bfloat16) for one in (x, *parameters)]
        found = function(*narrow)
        gradient = jax.grad(lambda x, own: function(x, *own).sum())(narrow[0], narrow[1:])  # noqa: B023
        assert found.dtype == gradient.dtype == jax.numpy.bfloat16
        assert np.abs(np.asarray(found, float) - expected).max() < 0.05 * np.abs(expected).max()


@pytest.mark.parametrize("layer", [Invariants(), Dropout(0.1), Norm(), Split("tanh"), Linear(2)], ids=str)
def test_shapes_are_checked(layer: Layer) -> None:
    """Functions of single coefficients or channels would take any shape."""
    torch, algebra = pytest.importorskip("torch"), Algebra(3)
    pytest.importorskip("jax")
    x, parameters = given(layer, algebra)
    run, function = torch_operator(layer, algebra, 6), jax_function(layer, algebra, 6)
    calls: tuple[Callable[..., Any], ...] = (
        lambda x, *own: run(torch.tensor(x), [torch.tensor(one) for one in own]),
        lambda x, *own: function(x.astype(np.float32), *(one.astype(np.float32) for one in own)),
    )
    for call in calls:
        for wrong in (x[:, :4], x[..., :4], x[0]):
            with pytest.raises(ValueError, match=r"x has shape .*; expected \(batch, 6, 8\), channels and blades"):
                call(wrong, *parameters)
        with pytest.raises(ValueError, match=f"there are {len(parameters) + 1} parameters; .* {len(parameters)}$"):
            call(x, *parameters, x)
    with pytest.raises(TypeError, match=r"int.*; expected one floating-point type"):
        function(np.ones(x.shape, np.int32), *parameters)


def test_dropout_in_training_only() -> None:
    torch, jax = pytest.importorskip("torch"), pytest.importorskip("jax")
    torch.manual_seed(0)
    module, x = torch_module(Dropout(0.25), "G(3)", 3), torch.ones(4000, 3, 8)
    kept = module(x)
    assert torch.equal(module.eval()(x), x)
    function = jax_function(Dropout(0.25), "G(3)", 3)
    drawn = np.asarray(function(x.numpy(), key=jax.random.key(0)))
    assert np.array_equal(function(x.numpy()), x)
    for y in (kept.numpy(), drawn):
        dropped = ~y.any(-1)
        assert abs(dropped.mean() - 0.25) < 5 * np.sqrt(0.25 * 0.75 / dropped.size)
        assert np.allclose(y[~dropped], 1 / 0.75)


def test_messages_of_errors() -> None:
    pytest.importorskip("torch")
    with pytest.raises(ValueError, match="7 channels; expected a multiple of items = 3"):
        torch_module(Each(3, Gate()), "G(3)", 7)
    with pytest.raises(ValueError, match=r"Split\(function='tanh'\): does not commute"):
        torch_module([Residual((Gate(),)), Split()], "G(3)", 2, equivariant=True)
