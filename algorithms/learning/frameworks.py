"""Layers for torch and jax, which call the same kernels on the CPU. Both libraries are optional."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..extras import extra
from .algebra import Algebra
from .base import Defined, Layer
from .framework_functions import arrays_of, jax_functions, one_by_one, torch_functions

_numbers = itertools.count()


def _checks(layer: Layer, algebra: Algebra, channels: int) -> Callable[[Any, Sequence[Any]], None]:
    """Return a function that raises an error for arguments of other shapes, or another number of parameters."""
    count = len(layer.initial(algebra, channels, np.random.default_rng()))

    def check(x: Any, parameters: Sequence[Any]) -> None:
        if x.ndim != 3 or tuple(x.shape[1:]) != (channels, algebra.size) or len(parameters) != count:
            found = f"x has shape {tuple(x.shape)}, and there are {len(parameters)} parameters"
            expected = f"(batch, {channels}, {algebra.size}), channels and blades, and {count}"
            raise ValueError(f"{layer}: {found}; expected {expected}")

    return check


def _type_error(layer: Layer, given: Sequence[Any]) -> TypeError:
    found = ", ".join(str(one.dtype) for one in given)
    return TypeError(f"{layer}: x and parameters of {found}; expected one floating-point type")


def torch_operator(layer: Layer, algebra: str | Algebra, channels: int) -> Callable[..., Any]:
    """Return a layer as a function for torch, of x (batch, channels, blades) and a list of parameters.

    It has derivatives, is batched by ``torch.vmap``, and does not break graphs of ``torch.compile``. Equivariant layers
    consist of functions of torch and of products, and have derivatives of every order. Other layers are operators.
    """
    with extra("peers", "algorithms.learning.frameworks"):
        import torch
    algebra = Algebra.of(algebra)
    (after, out), name = layer.output(algebra, channels), f"geometric::{type(layer).__name__.lower()}_{next(_numbers)}"
    check = _checks(layer, algebra, channels)
    if isinstance(layer, Defined):
        functions = torch_functions()(algebra)

        def defined(x: Any, parameters: Sequence[Any]) -> Any:
            check(x, parameters)
            return layer.definition(functions, algebra, x, parameters)

        return defined

    def tensor_of(result: Any, given: Any, dtype: Any) -> Any:
        """Return a result as a tensor of its own memory."""
        own = np.ascontiguousarray(result, given[0].dtype)
        own = own.copy() if any(np.may_share_memory(own, one) for one in given) else own
        return torch.from_numpy(own).to(dtype)

    def value(x: torch.Tensor, parameters: list[torch.Tensor]) -> torch.Tensor:
        (given,), own = arrays_of([x]), arrays_of(parameters)
        return tensor_of(layer.value(algebra, given, own), [given], x.dtype)

    def pull(x: torch.Tensor, parameters: list[torch.Tensor], y: torch.Tensor, d: torch.Tensor) -> list[torch.Tensor]:
        given, result, cotangent = arrays_of([x, y, d])
        dx, others = layer.pull(algebra, given, arrays_of(parameters), result, cotangent)
        return [tensor_of(one, [given, result, cotangent], x.dtype) for one in (dx, *others)]

    # Annotations are read by torch, which needs types instead of their names.
    tensor, tensors = torch.Tensor, list[torch.Tensor]
    value.__annotations__ = {"x": tensor, "parameters": tensors, "return": tensor}
    pull.__annotations__ = {"x": tensor, "parameters": tensors, "y": tensor, "d": tensor, "return": tensors}
    run: Any = torch.library.custom_op(name, value, mutates_args=())
    back: Any = torch.library.custom_op(name + "_pull", pull, mutates_args=())
    run.register_fake(lambda x, parameters: x.new_empty((x.shape[0], out, after.size)))
    back.register_fake(lambda x, parameters, y, d: [torch.empty_like(one) for one in (x, *parameters)])

    def setup(ctx: Any, inputs: Any, output: Any) -> None:
        ctx.save_for_backward(inputs[0], *inputs[1], output)

    def backward(ctx: Any, d: Any) -> Any:
        x, *parameters, y = ctx.saved_tensors
        dx, *others = back(x, parameters, y, d)
        return dx, others

    run.register_autograd(backward, setup_context=setup)

    for operator in (run, back):
        operator.register_vmap(one_by_one(operator))
    base: Any = torch.autograd.Function

    class Function(base):  # type: ignore[misc]
        """The same outside of graphs, where calls of registered operators take longer than narrow layers."""

        @staticmethod
        def forward(x: Any, *parameters: Any) -> Any:
            return value(x, list(parameters))

        @staticmethod
        def setup_context(ctx: Any, inputs: Any, output: Any) -> None:
            ctx.save_for_backward(*inputs, output)

        @staticmethod
        def backward(ctx: Any, d: Any) -> Any:
            x, *parameters, y = ctx.saved_tensors
            return tuple((back if d.requires_grad else pull)(x, parameters, y, d))

        @staticmethod
        def vmap(info: Any, dims: Any, *given: Any) -> Any:
            return one_by_one(lambda x, *own: run(x, list(own)))(info, dims, *given)

    def called(x: Any, parameters: Sequence[Any]) -> Any:
        check(x, parameters)
        if not all(one.is_floating_point() and one.dtype == x.dtype for one in (x, *parameters)):
            raise _type_error(layer, (x, *parameters))
        return run(x, list(parameters)) if torch.compiler.is_compiling() else Function.apply(x, *parameters)

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
        the default type of torch; ``module.double()`` converts them. Values are computed on the CPU.

    Raises
    ------
    ValueError
        If there is no layer, or one that `equivariant` refuses. A call raises it for an x with other numbers of
        channels or blades.
    """
    with extra("peers", "algorithms.learning.frameworks"):
        import torch
    stages = [layers] if isinstance(layers, Layer) else list(layers)
    if not stages:
        raise ValueError("torch_module: no layers; expected at least one")
    algebra, random = Algebra.of(algebra), np.random.default_rng(seed)

    class Module(torch.nn.Module):  # type: ignore[misc]
        def __init__(self, layer: Layer, algebra: Algebra, channels: int) -> None:
            super().__init__()
            self.layer, self.algebra, self.shape = layer, algebra, (channels, algebra.size)
            self.weights = torch.nn.ParameterList(
                torch.nn.Parameter(torch.tensor(own, dtype=torch.get_default_dtype()))
                for own in layer.initial(algebra, channels, random)
            )
            self._run = torch_operator(layer, algebra, channels)
            self._functions = torch_functions()(algebra), torch_functions()(algebra, training=True)

        def forward(self, x: torch.Tensor) -> torch.Tensor:
            """Compute the results of the layer."""
            if tuple(x.shape[-2:]) != self.shape:
                found, expected = tuple(x.shape), "(..., {}, {})".format(*self.shape)
                raise ValueError(f"{self.layer}: x has shape {found}; expected {expected}, channels and blades")
            given, weights = x.reshape(-1, *self.shape), list(self.weights)
            if isinstance(self.layer, Defined):
                y: Any = self.layer.definition(self._functions[self.training], self.algebra, given, weights)
            else:
                y = self._run(given, weights)
            return y.reshape(*x.shape[:-2], *y.shape[1:])

        def extra_repr(self) -> str:
            """Return the layer with the numbers of channels and blades that it takes."""
            return f"{self.layer}, channels={self.shape[0]}, blades={self.shape[1]}"

    modules = []
    for layer in stages:
        if equivariant:
            layer.symmetry(algebra)
        modules.append(Module(layer, algebra, channels))
        algebra, channels = layer.output(algebra, channels)
    return modules[0] if isinstance(layers, Layer) else torch.nn.Sequential(*modules)


def jax_function(layer: Layer, algebra: str | Algebra, channels: int) -> Callable[..., Any]:
    """Return a layer as a function of jax, of x (batch, channels, blades) and parameters, with reverse derivatives.

    It can be compiled and batched; it calls the kernels by ``jax.pure_callback``. Equivariant layers have derivatives
    of every order, and take ``key``, a key of random numbers, for the choices of `Dropout` in training.
    """
    with extra("peers", "algorithms.learning.frameworks"):
        import jax
    algebra = Algebra.of(algebra)
    after, out = layer.output(algebra, channels)
    check_shapes = _checks(layer, algebra, channels)

    def check(x: Any, own: Sequence[Any]) -> None:
        check_shapes(x, own)
        if not all(jax.numpy.issubdtype(one.dtype, jax.numpy.floating) for one in (x, *own)):
            raise _type_error(layer, (x, *own))

    if isinstance(layer, Defined):
        functions = jax_functions()

        def defined(x: Any, *own: Any, key: Any = None) -> Any:
            check(x, own)
            return layer.definition(functions(algebra, key), algebra, x, own)

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
