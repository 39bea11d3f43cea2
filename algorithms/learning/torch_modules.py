"""Layers as operators and modules of torch. This module needs torch; `frameworks` imports it when it is called."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import numpy as np
import torch

from .algebra import Algebra
from .base import Defined, Layer
from .framework_functions import (
    arrays_of,
    check_neighbours,
    one_by_one,
    torch_function,
    torch_functions,
    torch_products,
    type_error,
)
from .recorded import Record

_numbers = itertools.count()
_PREPARED = ("_functions", "_product", "_run")
"""Attributes of modules that are made again for copies."""


def check_types(layer: Layer, given: Sequence[torch.Tensor]) -> None:
    """Raise an error for tensors of several types, unless torch chooses the types (`torch.autocast`)."""
    of_one_type = all(one.is_floating_point() and one.dtype == given[0].dtype for one in given)
    if not of_one_type and not torch.is_autocast_enabled(given[0].device.type):
        raise type_error(layer, given)


@cache
def operator_of(layer: Layer, algebra: Algebra, channels: int) -> Callable[..., Any]:
    """Return a layer that is not `Defined` as an operator, which is registered once."""
    (after, out), name = layer.output(algebra, channels), f"geometric::{type(layer).__name__.lower()}_{next(_numbers)}"

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

    def keep(ctx: Any, inputs: Any, output: Any) -> None:
        ctx.save_for_backward(inputs[0], *inputs[1], output)

    def backward_in_graphs(ctx: Any, d: Any) -> Any:
        x, *parameters, y = ctx.saved_tensors
        dx, *others = back(x, parameters, y, d)
        return dx, others

    run.register_autograd(backward_in_graphs, setup_context=keep)
    for each in (run, back):
        each.register_vmap(one_by_one(each))

    # Functions of torch have tensors as arguments, but no lists.
    def refused(ctx: Any, *cotangents: Any) -> Any:
        raise NotImplementedError(f"{layer}: no second derivatives; expected the first, or an equivariant layer")

    count = len(layer.initial(algebra, channels, np.random.default_rng()))
    gradients = torch_function(
        lambda x, *given: tuple(back(x, list(given[:count]), *given[count:])),
        lambda x, *given: tuple(pull(x, list(given[:count]), *given[count:])),
        lambda ctx, inputs, output: None,
        refused,
    )
    function = torch_function(
        lambda x, *given: run(x, list(given)),
        lambda x, *given: value(x, list(given)),
        lambda ctx, inputs, output: ctx.save_for_backward(*inputs, output),
        lambda ctx, d: gradients(*ctx.saved_tensors, d),
    )

    def called(x: Any, parameters: Sequence[Any]) -> Any:
        if x.device.type != "cpu":
            raise ValueError(f"{layer}: x on {x.device}; expected a tensor on the CPU, or an equivariant layer")
        check_types(layer, (x, *parameters))
        return function(x, *parameters)

    return called


class LayerModule(torch.nn.Module):  # type: ignore[misc]
    """A layer with its parameters as a module of torch, which can be copied, pickled and saved.

    Parameters
    ----------
    layer : Layer
    algebra : Algebra
        The algebra of what the layer takes.
    channels : int
        The number of channels that it takes.
    random : numpy.random.Generator
        The generator of the first parameters.
    """

    def __init__(self, layer: Layer, algebra: Algebra, channels: int, random: np.random.Generator) -> None:
        super().__init__()
        layer.output(algebra, channels)  # which raises errors for other numbers of channels
        self.layer, self.algebra, self.shape = layer, algebra, (channels, algebra.size)
        self.weights = torch.nn.ParameterList(
            torch.nn.Parameter(torch.tensor(own, dtype=torch.get_default_dtype()))
            for own in layer.initial(algebra, channels, random)
        )
        self._prepare()

    def _prepare(self) -> None:
        """Make what forward() needs before torch traces it: functions, and properties of the algebra."""
        self._functions, self._product = torch_functions(), torch_products(self.algebra)[0]
        if not isinstance(self.layer, Defined):
            self._run = operator_of(self.layer, self.algebra, self.shape[0])
        else:
            record, random = Record(), np.random.default_rng()
            record.neighbours = np.zeros((2, 1), int)
            arrays = np.zeros((1, *self.shape)), *self.layer.initial(self.algebra, self.shape[0], random)
            x, *parameters = map(record.start, arrays)
            self.layer.definition(record, self.algebra, x, parameters)

    def __getstate__(self) -> dict[str, Any]:
        return {name: own for name, own in self.__dict__.items() if name not in _PREPARED}

    def __setstate__(self, state: dict[str, Any]) -> None:
        super().__setstate__(state)
        self._prepare()

    def forward(self, x: torch.Tensor, neighbours: torch.Tensor | None = None) -> torch.Tensor:
        """Compute the results of the layer; `Messages` may take neighbours (2, pairs) among all rows of x."""
        if tuple(x.shape[-2:]) != self.shape:
            found, expected = tuple(x.shape), "(..., {}, {})".format(*self.shape)
            raise ValueError(f"{self.layer}: x has shape {found}; expected {expected}, channels and blades")
        given, weights = x.reshape(-1, *self.shape), list(self.weights)
        if isinstance(self.layer, Defined):
            check_types(self.layer, (given, *weights))
            if neighbours is not None:
                whole = not (neighbours.is_floating_point() or neighbours.is_complex())
                check_neighbours(self.layer, neighbours, whole and neighbours.dtype != torch.bool)
            functions = self._functions(self._product, self.training, neighbours)
            y: Any = self.layer.definition(functions, self.algebra, given, weights)
        else:
            y = self._run(given, weights)
        return y.reshape(*x.shape[:-2], *y.shape[1:])

    def extra_repr(self) -> str:
        """Return the layer with the numbers of channels and blades that it takes."""
        return f"{self.layer}, channels={self.shape[0]}, blades={self.shape[1]}"


class LayerSequence(torch.nn.Sequential):  # type: ignore[misc]
    """Layers, one after the other, which all take the neighbours of a call."""

    def forward(self, x: torch.Tensor, neighbours: torch.Tensor | None = None) -> torch.Tensor:
        """Compute the results of the last layer."""
        for layer in self:
            x = layer(x, neighbours)
        return x
