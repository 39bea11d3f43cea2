"""Kernels as operators of jax, with derivatives of every order, on the compiled text of the CPU.

    import gacompiler.jax
    move = gacompiler.jax.operator(move_point)
    gradient = jax.jit(jax.grad(lambda m: ((move(m, points) - targets) ** 2).sum()))

The operators are primitives of jax with rules for `jit`, `vmap`, forward and reverse derivatives. The program that jax
compiles calls the C library through a callback, which passes the numbers without a copy and copies the results.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import numpy as np

from .differentiable import Differentiable, with_free_parameters
from .errors import KernelError
from .frontend.kernel import Kernel

try:
    import jax
    from jax.extend.core import Primitive
    from jax.interpreters import ad, batching, mlir
except ModuleNotFoundError:
    raise ImportError("gacompiler.jax needs jax; run: pip install jax") from None


@cache
def operator(kernel: Kernel) -> Callable[..., Any]:
    """Return a kernel as an operator of jax.

    Parameters
    ----------
    kernel : Kernel
        A function decorated with ``@kernel``, with or without loops.

    Returns
    -------
    callable
        A function of as many arrays as the kernel has parameters, and with as many results. Leading axes broadcast.
        Arrays are float32 or float64, all of the same type; bfloat16 and float16 are computed in float32.

    Raises
    ------
    KernelError
        If the argument is not a kernel, or the kernel cannot be compiled. A call raises it for arrays of other types
        or shapes, and a derivative if it does not exist.

    Notes
    -----
    Coefficients are independent variables: relations such as ``m ~m = 1`` of unit motors are not assumed, so that
    derivatives are those of the values for every array, on the manifold and off it. On the manifold, values are those
    of the compiled kernel. The derivative by a parameter is compiled when it is first needed, from `jvp` and `vjp`; it
    is an operator, too, which gives derivatives of higher orders.
    """
    found = _Operator(with_free_parameters(kernel, "gacompiler.jax.operator()"))
    found.definition = kernel
    return found


class _Operator(Differentiable):
    """A kernel of free parameters as a primitive, and its derivative along each parameter as another."""

    def __init__(self, kernel: Kernel) -> None:
        super().__init__(kernel)
        self.primitive = _primitive(self, self.identity, self.evaluated)
        ad.primitive_jvps[self.primitive] = self._tangents
        self._linear: dict[int, Any] = {}

    def __call__(self, *arrays: Any) -> Any:
        """Evaluate the kernel."""
        self.check_number(arrays)
        return self.one_or_all(self.primitive.bind(*self._of_one_type(arrays)))

    def __reduce__(self) -> tuple[Any, ...]:
        return operator, (self.definition,)

    def _of_one_type(self, arrays: Sequence[Any]) -> list[Any]:
        ready = [jax.numpy.asarray(x) for x in arrays]
        kind = next(x.dtype for place, x in enumerate(ready) if not self.is_index(place))
        for place, x in enumerate(ready):
            is_index = self.is_index(place)
            if not jax.numpy.issubdtype(x.dtype, np.integer) if is_index else x.dtype != kind:
                expected = "integers" if is_index else f"{kind}, the type of the first real array"
                raise KernelError(f"{self.kernel.name}: {self.kernel.parameters[place].name}", f"{x.dtype}", expected)
        if not jax.numpy.issubdtype(kind, np.floating):
            raise KernelError(self.kernel.name, f"arrays of type {kind}", "real numbers")
        return ready

    def _tangents(self, primals: Sequence[Any], tangents: Sequence[Any]) -> tuple[Any, Any]:
        found = self.primitive.bind(*primals)
        along = [
            self.linear(place).bind(*primals, tangent)
            for place, tangent in enumerate(tangents)
            if not isinstance(tangent, ad.Zero)
        ]
        return found, _sums(along)

    def linear(self, place: int) -> Any:
        """Return the primitive of arguments and a tangent of one of them, which is linear in the tangent."""
        if place in self._linear:
            return self._linear[place]
        push, n = self.push(place), len(self.results)
        primitive = _primitive(push, f"{push.identity}_linear", lambda arrays: push.evaluated(arrays)[n:], n)
        self._linear[place] = primitive

        def tangents(primals: Sequence[Any], given: Sequence[Any]) -> tuple[Any, Any]:
            *arguments, own = primals
            along = [] if isinstance(given[-1], ad.Zero) else [primitive.bind(*arguments, given[-1])]
            along += [
                push.linear(k).bind(*arguments, own, tangent)[n:]
                for k, tangent in enumerate(given[:-1])
                if not isinstance(tangent, ad.Zero)
            ]
            return primitive.bind(*primals), _sums(along)

        def transpose(cotangents: Sequence[Any], *arguments: Any) -> list[Any]:
            own = arguments[-1].aval
            filled = [jax.numpy.zeros(c.aval.shape, c.aval.dtype) if isinstance(c, ad.Zero) else c for c in cotangents]
            return [None] * (len(arguments) - 1) + [self._gradient(place, arguments[:-1], filled, own)]

        ad.primitive_jvps[primitive] = tangents
        ad.primitive_transposes[primitive] = transpose
        return primitive

    def _gradient(self, place: int, arguments: Sequence[Any], cotangents: Sequence[Any], like: Any) -> Any:
        """Return the gradient with respect to one argument, summed over the axes along which it was broadcast."""
        *_, found = self.pull(place)(*arguments, *cotangents)
        if self.has_rows_of_one_number(place):
            found = found.squeeze(-1)
        extra = found.ndim - len(like.shape)
        found = found.sum(tuple(range(extra)))
        stretched = tuple(k for k, size in enumerate(like.shape) if size == 1 and found.shape[k] != 1)
        return found.sum(stretched, keepdims=True)


def _sums(parts: Sequence[Sequence[Any]]) -> list[Any]:
    """Return the sums of the derivatives along several arguments, one for each result."""
    return [sum(part[1:], part[0]) for part in zip(*parts, strict=True)]


def _primitive(kernel: _Operator, name: str, evaluate: Callable[[Sequence[Any]], list[Any]], skipped: int = 0) -> Any:
    """Return a primitive that evaluates a kernel, without its first results, in compiled programs as a callback."""
    primitive = Primitive(name)
    primitive.multiple_results = True

    def kind_of(arrays: Sequence[Any]) -> Any:
        return next(x.dtype for place, x in enumerate(arrays) if not kernel.is_index(place))

    def on_host(*arrays: Any) -> list[Any]:
        ready = [np.asarray(x) for x in arrays]
        kind = kind_of(ready)
        if kind not in (np.float32, np.float64):
            ready = [x if kernel.is_index(place) else x.astype(np.float32) for place, x in enumerate(ready)]
        return [each.astype(kind, copy=False) for each in evaluate(ready)]

    def shaped(*arrays: Any) -> list[Any]:
        shapes = kernel.result_shapes([x.shape for x in arrays])[skipped:]
        return [jax.core.ShapedArray(shape, kind_of(arrays)) for shape in shapes]

    def lowered(*arrays: Any) -> Any:
        results = [jax.ShapeDtypeStruct(each.shape, each.dtype) for each in shaped(*arrays)]
        return jax.pure_callback(on_host, results, *arrays)

    def batched(arrays: Sequence[Any], dims: Sequence[Any]) -> tuple[Any, list[int]]:
        is_batched = [dim is not None for dim in dims]
        ranks = kernel.ranks_of_batches([x.ndim - one for x, one in zip(arrays, is_batched, strict=True)])
        moved = [
            jax.numpy.moveaxis(x, dim, 0)[(slice(None), *[None] * n, ...)] if one else x
            for x, dim, one, n in zip(arrays, dims, is_batched, ranks, strict=True)
        ]
        found = primitive.bind(*moved)
        return found, [0] * len(found)

    primitive.def_impl(jax.jit(lowered))
    primitive.def_abstract_eval(shaped)
    mlir.register_lowering(primitive, mlir.lower_fun(lowered, multiple_results=True))
    batching.primitive_batchers[primitive] = batched
    return primitive
