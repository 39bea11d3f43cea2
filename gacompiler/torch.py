"""Kernels as operators of torch, with derivatives of every order, on the compiled text of the CPU.

    import gacompiler.torch
    move = gacompiler.torch.operator(move_point)
    loss = (move(motors, points) - targets).square().sum()
    loss.backward()

The C library reads and writes tensors in place. The operators are batched by `torch.vmap`, differentiated by
`torch.func`, and do not break graphs of `torch.compile`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from .algebra.layout import Layout
from .derivatives.derived_kernels import jvp, vjp
from .derivatives.results import (
    differentiated,
    elements,
    free,
    layout_of_type,
    multivector,
    numbers,
    over,
    tangent_type,
)
from .errors import KernelError
from .frontend.expression import lift
from .frontend.kernel import Kernel, Parameter
from .frontend.rows import IndexOf
from .runtime import compile

try:
    import torch
except ModuleNotFoundError:
    raise ImportError("gacompiler.torch needs torch; run: pip install torch") from None

_registered: dict[str, Any] = {}
"""The registered operators by name."""
_Shapes = tuple[tuple[int | str, ...], ...]


@cache
def operator(kernel: Kernel) -> Callable[..., Any]:
    """Return a kernel as an operator of torch.

    Parameters
    ----------
    kernel : Kernel
        A function decorated with ``@kernel``, with or without loops.

    Returns
    -------
    callable
        A function of as many tensors as the kernel has parameters, and with as many results. Leading axes broadcast.
        Tensors are float32 or float64, all of the same type, on the CPU; bfloat16 and float16 are computed in float32.

    Raises
    ------
    KernelError
        If the argument is not a kernel, or the kernel cannot be compiled. A call raises it for tensors of other types
        or on other devices, and the backward pass if a derivative does not exist.

    Notes
    -----
    Coefficients are independent variables: relations such as ``m ~m = 1`` of unit motors are not assumed, so that
    derivatives are those of the values for every tensor, on the manifold and off it. On the manifold, values are those
    of the compiled kernel. The derivative by a parameter is compiled when it is first needed, from `vjp`; it is an
    operator, too, which gives derivatives of higher orders.
    """
    if not isinstance(kernel, Kernel):
        found = type(kernel).__name__
        raise KernelError(
            "gacompiler.torch.operator()", f"an object of type {found}", "a function decorated with @kernel"
        )
    return _Operator(_with_free_parameters(kernel))


class _Operator:
    """A kernel of free parameters, and its derivatives."""

    def __init__(self, kernel: Kernel) -> None:
        self.kernel, self._function = kernel, compile(kernel)
        self.shapes: tuple[_Shapes, _Shapes] = _shapes(self._function.signature)
        self._derivatives: dict[tuple[Any, int], _Operator] = {}
        self.registered = self._custom_operator()
        self._differentiable = _differentiable(self)

    def __call__(self, *tensors: torch.Tensor) -> Any:
        """Evaluate the kernel."""
        if len(tensors) != len(self.kernel.parameters):
            names = ", ".join(parameter.name for parameter in self.kernel.parameters)
            raise KernelError(self.kernel.name, f"called with {len(tensors)} tensors", names)
        # Graphs of torch.compile need a registered operator; torch.func needs a function with a context of its own.
        return (self.registered if torch.compiler.is_compiling() else self._differentiable.apply)(*tensors)

    def _custom_operator(self) -> Any:
        given, results = self.shapes
        names = ", ".join(f"Tensor {parameter.name}" for parameter in self.kernel.parameters)
        many = ", ".join(["Tensor"] * len(results))
        schema = f"({names}) -> " + (f"({many})" if len(results) > 1 else many)

        def fake(*tensors: torch.Tensor) -> Any:
            leading, lengths = _axes(self.kernel, given, tensors)
            shapes = ([lengths.get(size, size) for size in shape] for shape in results)
            return self.one_or_all([tensors[0].new_empty((*leading, *shape)) for shape in shapes])

        # The digest of the emitted text is part of the name, since torch stores graphs on disk by the names in them.
        name = "gacompiler::" + self._function.__module__.rpartition("._gac_")[2]
        if name in _registered:
            return _registered[name]
        found = _registered[name] = torch.library.custom_op(name, self.value, mutates_args=(), schema=schema)
        found.register_fake(fake)
        found.register_autograd(self.cotangents, setup_context=self.saved)
        return found

    def one_or_all(self, results: Sequence[Any]) -> Any:
        """Return the only result, or a tuple of several."""
        return tuple(results) if len(self.shapes[1]) > 1 else results[0]

    def value(self, *tensors: torch.Tensor) -> Any:
        """Return the results for tensors of one type."""
        return self.one_or_all(self.evaluated(tensors))

    def saved(self, ctx: Any, inputs: Any, output: Any) -> None:
        """Store what `cotangents` needs."""
        ctx.save_for_backward(*inputs)
        ctx.save_for_forward(*inputs)
        ctx.outputs = [(each.shape, each.dtype) for each in (output if len(self.shapes[1]) > 1 else (output,))]

    def cotangents(self, ctx: Any, *given: Any) -> tuple[Any, ...]:
        """Return the gradients with respect to all arguments that need one."""
        tensors = ctx.saved_tensors
        filled = [
            tensors[0].new_zeros(shape, dtype=dtype) if d is None else d
            for d, (shape, dtype) in zip(given, ctx.outputs, strict=True)
        ]
        needed = ctx.needs_input_grad
        return tuple(self.gradient(k, tensors, filled) if needed[k] else None for k in range(len(tensors)))

    def tangents(self, ctx: Any, *given: Any) -> Any:
        """Return the derivatives of all results along tangents of the arguments."""
        parts = [
            self.push(k)(*ctx.saved_tensors, tangent)[len(self.shapes[1]) :]
            for k, tangent in enumerate(given)
            if tangent is not None
        ]
        return self.one_or_all([sum(part[1:], part[0]) for part in zip(*parts, strict=True)])

    def batched(self, dims: Sequence[int | None], tensors: Sequence[torch.Tensor]) -> tuple[Any, Any]:
        """Return the results with a batch as their first axis, and its place."""
        given, results = self.shapes
        own = [x.ndim - len(shape) - (dim is not None) for x, dim, shape in zip(tensors, dims, given, strict=True)]
        moved = [
            x if dim is None else x.movedim(dim, 0)[(slice(None), *[None] * (max(own) - n), ...)]
            for x, dim, n in zip(tensors, dims, own, strict=True)
        ]
        return self(*moved), (0,) * len(results) if len(results) > 1 else 0

    def evaluated(self, tensors: Sequence[torch.Tensor]) -> list[torch.Tensor]:
        """Return the results for tensors of one type."""
        kind = next(x.dtype for x in tensors if x.is_floating_point())
        narrow = kind not in (torch.float32, torch.float64)
        arrays = []
        for x, parameter in zip(tensors, self.kernel.parameters, strict=True):
            is_index = isinstance(parameter.type, IndexOf)
            if x.device.type != "cpu" or (x.is_floating_point() == is_index or (not is_index and x.dtype != kind)):
                expected = "integers" if is_index else f"{kind}, the type of the first tensor, which is real"
                raise KernelError(
                    f"{self.kernel.name}: {parameter.name}", f"{x.dtype} on {x.device}", f"{expected}, on the CPU"
                )
            arrays.append((x.float() if narrow and not is_index else x).detach().numpy())
        found = self._function(*arrays)
        results = found if len(self.shapes[1]) > 1 else (found,)
        return [torch.from_numpy(np.asarray(each)).to(kind) for each in results]

    def gradient(self, place: int, tensors: Sequence[torch.Tensor], cotangents: Sequence[torch.Tensor]) -> Any:
        """Return the gradient with respect to one argument, summed over the axes along which it was broadcast."""
        *_, found = self.pull(place)(*tensors, *cotangents)
        if self.shapes[0][place] == () and self.pull(place).shapes[1][-1] == (1,):
            found = found.squeeze(-1)
        return found.sum_to_size(tensors[place].shape)

    def pull(self, place: int) -> _Operator:
        """Return the operator of `vjp` with respect to one parameter."""
        return self._derivative(vjp, place)

    def push(self, place: int) -> _Operator:
        """Return the operator of `jvp` with respect to one parameter."""
        return self._derivative(jvp, place)

    def _derivative(self, transform: Callable[[Kernel, str], Kernel], place: int) -> _Operator:
        key = transform, place
        if key not in self._derivatives:
            self._derivatives[key] = _Operator(transform(self.kernel, self.kernel.parameters[place].name))
        return self._derivatives[key]


def _differentiable(operator: _Operator) -> Any:
    """Return an operator as a function that `torch.func` differentiates and batches."""

    class Differentiable(torch.autograd.Function):  # type: ignore[misc]
        @staticmethod
        def forward(*tensors: torch.Tensor) -> Any:
            return operator.registered(*tensors)

        @staticmethod
        def setup_context(ctx: Any, inputs: Any, output: Any) -> None:
            operator.saved(ctx, inputs, output)

        @staticmethod
        def backward(ctx: Any, *given: Any) -> Any:
            return operator.cotangents(ctx, *given)

        @staticmethod
        def jvp(ctx: Any, *given: Any) -> Any:
            return operator.tangents(ctx, *given)

        @staticmethod
        def vmap(info: Any, dims: Any, *tensors: torch.Tensor) -> Any:
            return operator.batched(dims, tensors)

    return Differentiable


def _shapes(signature: str) -> tuple[_Shapes, _Shapes]:
    """Return the last axes of arguments and results: numbers, and names of lengths."""
    given, results = (
        tuple(
            tuple(int(size) if size.isdigit() else size for size in shape.split(",") if size)
            for shape in re.findall(r"\(([^)]*)\)", side)
        )
        for side in signature.split("->")
    )
    return given, results


def _axes(kernel: Kernel, shapes: _Shapes, tensors: Sequence[torch.Tensor]) -> tuple[tuple[int, ...], dict[Any, int]]:
    """Return the broadcast leading axes, and the lengths by name."""
    leading, lengths = [], dict[Any, int]()
    for x, shape, parameter in zip(tensors, shapes, kernel.parameters, strict=True):
        n = x.ndim - len(shape)
        own = tuple(x.shape[n:]) if n >= 0 else ()
        if n < 0 or any(isinstance(size, int) and size != found for size, found in zip(shape, own, strict=True)):
            raise KernelError(f"{kernel.name}: {parameter.name}", f"shape {tuple(x.shape)}", f"(..., {shape})")
        lengths.update({name: size for name, size in zip(shape, own, strict=True) if isinstance(name, str)})
        leading.append(x.shape[:n])
    return tuple(torch.broadcast_shapes(*leading)), lengths


def _with_free_parameters(kernel: Kernel) -> Kernel:
    """Return the kernel without relations between the coefficients of its parameters, and with the same results.

    What relations imply of a result, such as the weight 1 of a moved point, is left out.
    """
    parameters = tuple(map(_free, kernel.parameters))
    if parameters == kernel.parameters:
        return kernel
    d = differentiated(kernel, next(p.name for p in kernel.parameters if not isinstance(p.type, IndexOf)))
    results = tuple(map(tangent_type, d.results))

    def function(*arguments: Any) -> Any:
        found = kernel.function(*arguments)
        rebuilt = []
        for value, result in zip(found if len(results) > 1 else (found,), d.results, strict=True):
            layout = layout_of_type(result)
            rebuilt.append(over(value, [multivector(numbers(lift(e), layout), free(layout)) for e in elements(value)]))
        return tuple(rebuilt) if len(rebuilt) > 1 else rebuilt[0]

    return replace(
        kernel, parameters=parameters, function=function, returns=results if len(results) > 1 else results[0]
    )


def _free(parameter: Parameter) -> Parameter:
    if isinstance(parameter.type, IndexOf) or parameter.layout.implied or not parameter.layout.has_relations:
        return parameter
    layout = replace(parameter.layout, unit=False, user_relations=None)
    given: Any = parameter.type
    return replace(parameter, type=layout if isinstance(given, Layout) else replace(given, layout=layout))
