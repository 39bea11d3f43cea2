"""Layers for torch and jax, which call the same kernels on the CPU. Both libraries are optional."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..extras import extra
from .algebra import Algebra
from .base import Defined, Layer
from .framework_functions import check_neighbours, jax_functions, torch_functions, torch_products, type_error


def _checks(layer: Layer, algebra: Algebra, channels: int) -> Callable[[Any, Sequence[Any]], None]:
    """Return a function that raises an error for arguments of other shapes, or another number of parameters."""
    count = len(layer.initial(algebra, channels, np.random.default_rng()))

    def check(x: Any, parameters: Sequence[Any]) -> None:
        if x.ndim != 3 or tuple(x.shape[1:]) != (channels, algebra.size) or len(parameters) != count:
            found = f"x has shape {tuple(x.shape)}, and there are {len(parameters)} parameters"
            expected = f"(batch, {channels}, {algebra.size}), channels and blades, and {count}"
            raise ValueError(f"{layer}: {found}; expected {expected}")

    return check


def torch_operator(layer: Layer, algebra: str | Algebra, channels: int) -> Callable[..., Any]:
    """Return a layer as a function for torch, of x (batch, channels, blades) and a list of parameters.

    It has derivatives, is batched by ``torch.vmap``, and does not break graphs of ``torch.compile``. Equivariant layers
    consist of functions of torch and of products, and have forward and reverse derivatives of every order. Other layers
    are operators with first reverse derivatives.
    """
    with extra("peers", "algorithms.learning.frameworks"):
        from .torch_modules import check_types, operator_of
    algebra = Algebra.of(algebra)
    layer.output(algebra, channels)
    check, functions = _checks(layer, algebra, channels), torch_functions()(torch_products(algebra)[0])
    run = None if isinstance(layer, Defined) else operator_of(layer, algebra, channels)

    def called(x: Any, parameters: Sequence[Any]) -> Any:
        check(x, parameters)
        if run is not None:
            return run(x, parameters)
        check_types(layer, (x, *parameters))
        return layer.definition(functions, algebra, x, parameters)  # type: ignore[attr-defined]

    return called


def torch_module(
    layers: Layer | Sequence[Layer], algebra: str | Algebra, channels: int, seed: int = 0, *, equivariant: bool = False
) -> Any:
    """Return layers, one after the other, as a module of torch with parameters of its own.

    Parameters
    ----------
    layers : Layer or sequence of Layer
        Layers of this package, such as `GradeLinear` and `Gate`.
    algebra : str or Algebra
        The algebra of the first layer.
    channels : int
        The number of channels that the first layer takes.
    seed : int
        Seed of the initial parameters, which are those of `Network`.
    equivariant : bool
        Whether to refuse layers that do not commute with all maps that keep the squares of vectors.

    Returns
    -------
    torch.nn.Module
        It maps x (..., channels, blades) to y (..., channels, blades); leading axes are those of x. Its parameters have
        the default type of torch; ``module.double()`` converts them. Equivariant layers take tensors on
        all devices; on the CPU, their products are those of the generated kernels. The module may also be called with
        integers (2, pairs), neighbours for `Messages` without any: places among all rows (channels, blades) of x that
        get messages, and those that send them. An edge index of PyTorch Geometric has them in the other order.

    Raises
    ------
    ValueError
        If there is no layer, or one that `equivariant` refuses. A call raises it for an x with other numbers of
        channels or blades.
    """
    with extra("peers", "algorithms.learning.frameworks"):
        from .torch_modules import LayerModule, LayerSequence
    stages = [layers] if isinstance(layers, Layer) else list(layers)
    if not stages:
        raise ValueError("torch_module: no layers; expected at least one")
    algebra, random = Algebra.of(algebra), np.random.default_rng(seed)

    modules = []
    for layer in stages:
        if equivariant:
            layer.symmetry(algebra)
        modules.append(LayerModule(layer, algebra, channels, random))
        algebra, channels = layer.output(algebra, channels)
    return modules[0] if isinstance(layers, Layer) else LayerSequence(*modules)


def jax_function(layer: Layer, algebra: str | Algebra, channels: int) -> Callable[..., Any]:
    """Return a layer as a function of jax, of x (batch, channels, blades) and parameters, with reverse derivatives.

    It can be compiled and batched; it calls the kernels by ``jax.pure_callback``. Equivariant layers have derivatives
    of every order, and take ``key``, a key of random numbers, for the choices of `Dropout` in training. They take
    ``neighbours`` (2, pairs) for `Messages` without any, as `torch_module` does.
    """
    with extra("peers", "algorithms.learning.frameworks"):
        import jax
    algebra = Algebra.of(algebra)
    after, out = layer.output(algebra, channels)
    check_shapes = _checks(layer, algebra, channels)

    def check(x: Any, own: Sequence[Any]) -> None:
        check_shapes(x, own)
        if not all(jax.numpy.issubdtype(one.dtype, jax.numpy.floating) for one in (x, *own)):
            raise type_error(layer, (x, *own))

    if isinstance(layer, Defined):
        functions = jax_functions()

        def defined(x: Any, *own: Any, key: Any = None, neighbours: Any = None) -> Any:
            check(x, own)
            if neighbours is not None:
                neighbours = jax.numpy.asarray(neighbours)
                check_neighbours(layer, neighbours, jax.numpy.issubdtype(neighbours.dtype, np.integer))
                known = not isinstance(neighbours, jax.core.Tracer) and neighbours.size
                if known and not 0 <= neighbours.min() <= neighbours.max() < len(x):  # jax would take the nearest row
                    raise ValueError(f"{layer}: neighbours {neighbours}; expected places of {len(x)} rows")
            return layer.definition(functions(algebra, key, neighbours), algebra, x, own)

        return defined

    def result(array: Any, shape: Any = None) -> Any:
        struct: Any = jax.ShapeDtypeStruct
        return struct(array.shape if shape is None else shape, array.dtype)

    def of_numpy(x: Any, *parameters: Any) -> Any:
        given, *own = map(np.asarray, (x, *parameters))
        return np.asarray(layer.value(algebra, given, own), given.dtype)

    def pull_of_numpy(x: Any, y: Any, d: Any, *parameters: Any) -> Any:
        given, value, cotangent, *own = map(np.asarray, (x, y, d, *parameters))
        dx, others = layer.pull(algebra, given, own, value, cotangent)
        return tuple(np.asarray(one, given.dtype) for one in (dx, *others))

    @jax.custom_vjp
    def function(x: Any, *parameters: Any) -> Any:
        shape = result(x, (x.shape[0], out, after.size))
        return jax.pure_callback(of_numpy, shape, x, *parameters, vmap_method="sequential")

    def forward(x: Any, *parameters: Any) -> Any:
        y = function(x, *parameters)
        return y, (x, y, parameters)

    def backward(saved: Any, d: Any) -> Any:
        x, y, parameters = saved
        shapes = tuple(result(one) for one in (x, *parameters))
        return jax.pure_callback(pull_of_numpy, shapes, x, y, d, *parameters, vmap_method="sequential")

    function.defvjp(forward, backward)

    def called(x: Any, *own: Any) -> Any:
        check(x, own)
        return function(x, *own)

    return called
