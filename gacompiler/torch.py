"""Kernels as operators of torch, with derivatives of every order, on the compiled text of the CPU.

    import gacompiler.torch
    move = gacompiler.torch.operator(move_point)
    loss = (move(motors, points) - targets).square().sum()
    loss.backward()

The C library reads and writes tensors in place. The operators are batched by `torch.vmap`, differentiated by
`torch.func`, and do not break graphs of `torch.compile`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache, cached_property
from typing import Any

from .differentiable import Differentiable, with_free_parameters
from .errors import KernelError
from .frontend.kernel import Kernel

try:
    import torch
except ModuleNotFoundError:
    raise ImportError("gacompiler.torch needs torch; run: pip install torch") from None

_registered: dict[str, Any] = {}
"""The registered operators by name."""


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
    found = _Operator(with_free_parameters(kernel, "gacompiler.torch.operator()"))
    found.definition = kernel
    return found


class _Operator(Differentiable):
    """A kernel of free parameters, registered with torch."""

    def __init__(self, kernel: Kernel) -> None:
        super().__init__(kernel)
        self.registered = self._custom_operator()
        self._differentiable = _function_of(self)

    def __call__(self, *tensors: torch.Tensor) -> Any:
        """Evaluate the kernel."""
        ready = self._of_one_type(tensors)
        # Graphs of torch.compile need a registered operator; torch.func needs a function with its own context, because
        # registered operators have no forward derivatives: they would be zero without an error.
        in_graph = torch.compiler.is_compiling() and torch._C._functorch.maybe_current_level() is None
        return (self.registered if in_graph else self._differentiable.apply)(*ready)

    def __reduce__(self) -> tuple[Any, ...]:
        return operator, (self.definition,)

    def _of_one_type(self, given: Sequence[Any]) -> list[torch.Tensor]:
        """Check the arguments; where torch chooses types (`torch.autocast`), narrow ones become float32."""
        self.check_number(given)
        found: list[torch.Tensor] = []
        for x, parameter in zip(given, self.kernel.parameters, strict=True):
            if not isinstance(x, torch.Tensor) or x.layout != torch.strided:
                is_tensor, kind = isinstance(x, torch.Tensor), type(x).__name__
                wrong = f"the layout {x.layout}" if is_tensor else f"an object of type {kind}"
                raise KernelError(f"{self.kernel.name}: {parameter.name}", wrong, "a dense tensor of torch")
            narrow = x.is_floating_point() and x.element_size() < 4
            found.append(x.float() if narrow and torch.is_autocast_enabled(x.device.type) else x)
        first = next(x for place, x in enumerate(found) if not self.is_index(place))
        for place, x in enumerate(found):
            is_index = self.is_index(place)
            whole = not (x.is_floating_point() or x.is_complex() or x.dtype == torch.bool)
            if (whole if is_index else x.is_floating_point() and x.dtype == first.dtype) and x.device == first.device:
                continue
            kind = "integers" if is_index else f"{first.dtype}" if first.is_floating_point() else "real numbers"
            expected = f"{kind} on {first.device}, as the first tensor that is no table of rows"
            raise KernelError(
                f"{self.kernel.name}: {self.kernel.parameters[place].name}", f"{x.dtype} on {x.device}", expected
            )
        return found

    def _custom_operator(self) -> Any:
        names = ", ".join(f"Tensor {parameter.name}" for parameter in self.kernel.parameters)
        many = ", ".join(["Tensor"] * len(self.results))
        schema = f"({names}) -> " + (f"({many})" if len(self.results) > 1 else many)

        def fake(*tensors: torch.Tensor) -> Any:
            return self.one_or_all([tensors[0].new_empty(s) for s in self.result_shapes([x.shape for x in tensors])])

        # The digest of the emitted text is part of the name, since torch stores graphs on disk by the names in them.
        name = "gacompiler::" + self.identity
        if name in _registered:
            return _registered[name]
        found = _registered[name] = torch.library.custom_op(name, self.value, mutates_args=(), schema=schema)
        found.register_fake(fake)
        found.register_autograd(self.cotangents, setup_context=self.saved)
        return found

    def value(self, *tensors: torch.Tensor) -> Any:
        """Return the results for tensors of one type."""
        kind, device = next(x.dtype for x in tensors if x.is_floating_point()), tensors[0].device
        narrow = kind not in (torch.float32, torch.float64)
        ready = [(x.float() if narrow and x.is_floating_point() else x).detach() for x in tensors]
        if device.type not in ("cpu", "cuda"):
            raise KernelError(self.kernel.name, f"tensors on {device}", "tensors on the CPU or on CUDA")
        found = (self.on_processor if device.type == "cpu" else self.on_device)(ready)
        return self.one_or_all([each.to(kind) for each in found])

    def on_processor(self, tensors: Sequence[torch.Tensor]) -> Sequence[torch.Tensor]:
        """Return the results for tensors on the CPU, which the C library reads and writes in place."""
        return [torch.from_numpy(each) for each in self.evaluated([x.numpy(force=True) for x in tensors])]

    def on_device(self, tensors: Sequence[torch.Tensor]) -> Sequence[torch.Tensor]:
        """Return the results for tensors on a device."""
        return self._device_function(tensors)

    @cached_property
    def _device_function(self) -> Callable[[Sequence[torch.Tensor]], Sequence[torch.Tensor]]:
        from .torch_devices import on_device

        return on_device(self.kernel, self.function)

    def saved(self, ctx: Any, inputs: Any, output: Any) -> None:
        """Store what `cotangents` needs."""
        ctx.save_for_backward(*inputs)
        ctx.save_for_forward(*inputs)
        ctx.outputs = [(each.shape, each.dtype) for each in (output if len(self.results) > 1 else (output,))]

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
            self.push(k)(*ctx.saved_tensors, tangent)[len(self.results) :]
            for k, tangent in enumerate(given)
            if tangent is not None
        ]
        return self.one_or_all([sum(part[1:], part[0]) for part in zip(*parts, strict=True)])

    def batched(self, dims: Sequence[int | None], tensors: Sequence[torch.Tensor]) -> tuple[Any, Any]:
        """Return the results with a batch as their first axis, and its place."""
        ranks = self.ranks_of_batches([x.ndim - (dim is not None) for x, dim in zip(tensors, dims, strict=True)])
        moved = [
            x if dim is None else x.movedim(dim, 0)[(slice(None), *[None] * n, ...)]
            for x, dim, n in zip(tensors, dims, ranks, strict=True)
        ]
        return self(*moved), (0,) * len(self.results) if len(self.results) > 1 else 0

    def gradient(self, place: int, tensors: Sequence[torch.Tensor], cotangents: Sequence[torch.Tensor]) -> Any:
        """Return the gradient with respect to one argument, summed over the axes along which it was broadcast."""
        *_, found = self.pull(place)(*tensors, *cotangents)
        if self.has_rows_of_one_number(place):
            found = found.squeeze(-1)
        return found.sum_to_size(tensors[place].shape)


def _function_of(operator: _Operator) -> Any:
    """Return an operator as a function that `torch.func` differentiates and batches."""

    class Function(torch.autograd.Function):  # type: ignore[misc]
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

    return Function
