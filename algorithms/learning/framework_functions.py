"""The functions in which layers are defined, for torch and jax: theirs, and products by the generated kernels.

A weighted product is linear in both factors and in the weights, so that all derivatives of all orders are products and
gradients of products. Both are operators here, and each is the derivative of the other.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import numpy as np

from ..extras import extra
from .algebra import Algebra
from .recorded import Functions, weighted_pull

Product = Callable[..., Any]


def pull_of_pull(product: Product, pull: Product, given: Sequence[Any], cotangents: Sequence[Any]) -> tuple[Any, ...]:
    """Return the gradients of the sum of cotangents times the results of `pull` by its arguments a, b, w and d."""
    (a, b, w, d), (ca, cb, cw) = given, cotangents
    along_a, along_b, along_w = pull(ca, b, w, d), pull(a, cb, w, d), pull(a, b, cw, d)
    return (
        along_b[0] + along_w[0],
        along_a[1] + along_w[1],
        along_a[2] + along_b[2],
        product(ca, b, w) + product(a, cb, w) + product(a, b, cw),
    )


def pushed(function: Product, given: Sequence[Any], tangents: Sequence[Any]) -> Any:
    """Return the derivative of a function that is linear in each argument; arguments without a tangent have None."""
    along = [
        function(*given[:k], tangent, *given[k + 1 :]) for k, tangent in enumerate(tangents) if tangent is not None
    ]
    return sum(along[1:], along[0])


def push_of_pull(pull: Product, given: Sequence[Any], tangents: Sequence[Any]) -> tuple[Any, ...]:
    """Return the derivatives of the results of `pull`, each of which does not depend on its own argument."""
    import torch

    found = [torch.zeros_like(x) for x in given[:3]]
    for k, tangent in enumerate(tangents):
        if tangent is not None:
            along = pull(*given[:k], tangent, *given[k + 1 :])
            found = [one if j == k else one + along[j] for j, one in enumerate(found)]
    return tuple(found)


def type_error(layer: object, given: Sequence[Any]) -> TypeError:
    """Return the error for an input and parameters that are not of one floating-point type."""
    found = ", ".join(str(one.dtype) for one in given)
    return TypeError(f"{layer}: x and parameters of {found}; expected one floating-point type")


def check_neighbours(layer: object, neighbours: Any, is_whole: bool) -> None:
    """Raise an error unless neighbours of a call are None or pairs of whole numbers."""
    if neighbours is None or (is_whole and neighbours.ndim == 2 and neighbours.shape[0] == 2):
        return
    found = f"neighbours of {neighbours.dtype} with shape {tuple(neighbours.shape)}"
    raise ValueError(f"{layer}: {found}; expected integers with shape (2, pairs), receivers and senders")


def _algebra_name(algebra: Algebra) -> str:
    own = f"_{id(algebra.module)}" if algebra.module is not None else ""
    return "_".join(map(str, algebra.signature)) + own


def arrays_of(tensors: Sequence[Any]) -> list[Any]:
    """Return tensors as arrays; bfloat16, which numpy has not, and float16 become float32."""
    wide = (x.float() if x.is_floating_point() and x.element_size() < 4 else x for x in tensors)
    return [np.ascontiguousarray(x.detach().numpy()) for x in wide]


def by_blades(algebra: Algebra, a: Any, b: Any, w: Any) -> Any:
    """Return weighted products of tensors as expressions of torch, on any device."""
    import torch

    blades = np.arange(algebra.size)
    place = algebra.targets  # blades k of the product and i of the first factor to that of the second: i ^ k
    path = {tuple(row): k for k, row in enumerate(algebra.paths.tolist())}
    signs = algebra.signs[blades, place]
    grades = np.stack(np.broadcast_arrays(algebra.grades, algebra.grades[place], algebra.grades[:, None]), -1)
    paths = np.array([[path.get(tuple(row), 0) for row in rows] for rows in grades.tolist()])
    index, part = (torch.as_tensor(each, device=b.device) for each in (place, paths))
    factors = w[..., part] * torch.as_tensor(signs, dtype=w.dtype, device=w.device)
    return ((b[..., index] * factors) @ a[..., None])[..., 0]


@cache
def torch_products(algebra: Algebra) -> tuple[Product, Product]:
    """Return weighted products, and their gradients, as operators of torch with derivatives of every order."""
    with extra("peers", "algorithms.learning.frameworks"):
        import torch
    name = f"geometric::weighted_{_algebra_name(algebra)}"

    def value(a: Any, b: Any, w: Any) -> Any:
        return torch.from_numpy(np.asarray(algebra.weighted(*arrays_of((a, b, w))))).to(a.dtype)

    def gradients(a: Any, b: Any, w: Any, d: Any) -> Any:
        found = weighted_pull(algebra, *arrays_of((a, b, w, d)))
        return tuple(torch.from_numpy(one).to(a.dtype) for one in found)

    in_graphs: Any = torch.library.custom_op(
        name, value, mutates_args=(), schema="(Tensor a, Tensor b, Tensor w) -> Tensor"
    )
    pull_in_graphs: Any = torch.library.custom_op(
        f"{name}_pull",
        gradients,
        mutates_args=(),
        schema="(Tensor a, Tensor b, Tensor w, Tensor d) -> (Tensor, Tensor, Tensor)",
    )
    in_graphs.register_fake(lambda a, b, w: a.new_empty(a.shape))
    pull_in_graphs.register_fake(lambda a, b, w, d: (a.new_empty(a.shape), b.new_empty(b.shape), w.new_empty(w.shape)))

    def keep(ctx: Any, inputs: Any, output: Any) -> None:
        ctx.save_for_backward(*inputs)
        ctx.save_for_forward(*inputs)

    def backward(ctx: Any, d: Any) -> Any:
        return pull(*ctx.saved_tensors, d)

    def backward_of_pull(ctx: Any, *cotangents: Any) -> Any:
        filled = [
            torch.zeros_like(x) if c is None else c for c, x in zip(cotangents, ctx.saved_tensors[:3], strict=True)
        ]
        return pull_of_pull(product, pull, ctx.saved_tensors, filled)

    in_graphs.register_autograd(backward, setup_context=keep)
    pull_in_graphs.register_autograd(backward_of_pull, setup_context=keep)
    for each in (in_graphs, pull_in_graphs):
        each.register_vmap(one_by_one(each))
    product = torch_function(
        in_graphs, value, keep, backward, lambda ctx, *along: pushed(product, ctx.saved_tensors, along)
    )
    pull = torch_function(
        pull_in_graphs, gradients, keep, backward_of_pull,
        lambda ctx, *along: push_of_pull(pull, ctx.saved_tensors, along),
    )  # fmt: skip
    return product, pull


def torch_function(
    in_graphs: Any, value: Product, keep: Product, backward: Product, forward: Product | None = None
) -> Product:
    """Return a function that `torch.func` differentiates and batches, and that is a registered operator in graphs.

    Parameters
    ----------
    in_graphs : callable
        The operator, which `torch.compile` needs. It is not called outside of graphs, since `torch.func` refuses it.
    value, keep, backward : callable
        The values, what they store for derivatives, and the reverse derivative.
    forward : callable, optional
        The forward derivative.
    """
    import torch

    class Function(torch.autograd.Function):  # type: ignore[misc]
        """The parts as torch names them."""

        @staticmethod
        def vmap(info: Any, dims: Any, *given: Any) -> Any:
            return one_by_one(call)(info, dims, *given)

    for name, method in (("forward", value), ("setup_context", keep), ("backward", backward), ("jvp", forward)):
        if method is not None:
            setattr(Function, name, staticmethod(method))

    def call(*given: Any) -> Any:
        # Registered operators have no forward derivatives, which would be zero without an error.
        transformed = torch._C._functorch.maybe_current_level() is not None
        return in_graphs(*given) if torch.compiler.is_compiling() and not transformed else Function.apply(*given)

    return call


def one_by_one(operator: Any) -> Callable[..., Any]:
    """Return the rule of `torch.vmap` that calls an operator for each entry of a batch."""
    import torch

    def run_batch(info: Any, dims: Any, *given: Any) -> Any:
        def part(value: Any, dim: Any, k: int) -> Any:
            if isinstance(value, (list, tuple)):
                return [part(one, own, k) for one, own in zip(value, dim, strict=True)]
            return value if dim is None else value.select(dim, k)

        found = [
            operator(*(part(value, dim, k) for value, dim in zip(given, dims, strict=True)))
            for k in range(info.batch_size)
        ]
        if isinstance(found[0], (list, tuple)):
            kind = type(found[0])
            return kind([torch.stack(rows) for rows in zip(*found, strict=True)]), kind([0] * len(found[0]))
        return torch.stack(found), 0

    return run_batch


@cache
def torch_functions() -> Callable[..., Functions]:
    """Return the class of the functions of torch, made from products, the mode and the neighbours of a call."""
    with extra("peers", "algorithms.learning.frameworks"):
        import torch

    class TorchFunctions(Functions):
        def __init__(self, product: Product, training: bool = False, neighbours: Any = None) -> None:
            self._product, self.training, self.neighbours = product, training, neighbours

        exp, log1p, arcsinh = map(staticmethod, (torch.exp, torch.log1p, torch.arcsinh))
        tanh, reshape, matmul = map(staticmethod, (torch.tanh, torch.reshape, torch.matmul))
        swapped = staticmethod(torch.transpose)

        def softmax(self, x: Any) -> Any:
            return torch.softmax(x, -1)

        def sum(self, x: Any, axis: int) -> Any:
            return x.sum(axis, keepdim=True)

        def linear(self, x: Any, matrix: Any) -> Any:
            return x @ torch.as_tensor(matrix, dtype=x.dtype, device=x.device)

        def rows(self, x: Any, index: Any) -> Any:
            return x.index_select(1, torch.as_tensor(index, device=x.device))

        def sum_rows(self, x: Any, index: Any, count: int) -> Any:
            places = torch.as_tensor(index, device=x.device)
            return x.new_zeros((len(x), count, *x.shape[2:])).index_add(1, places, x)

        def mixed(self, algebra: Algebra, w: Any, x: Any) -> Any:
            return torch.einsum("oik,nik->nok", w[..., torch.as_tensor(algebra.grades, device=w.device)], x)

        def weighted(self, algebra: Algebra, a: Any, b: Any, w: Any) -> Any:
            return self._product(a, b, w) if a.device.type == "cpu" else by_blades(algebra, a, b, w)

        def kept(self, x: Any, rate: float, seed: int) -> Any:
            if not self.training or rate == 0:
                return x
            return x * (torch.rand((*x.shape[:2], 1), dtype=x.dtype, device=x.device) >= rate) / (1 - rate)

    return TorchFunctions


@cache
def jax_products(algebra: Algebra) -> tuple[Product, Product]:
    """Return weighted products, and their gradients, as functions of jax with reverse derivatives of every order."""
    with extra("peers", "algorithms.learning.frameworks"):
        import jax

    def called(function: Callable[..., Any], shapes: Any, given: Sequence[Any]) -> Any:
        def on_host(*arrays: Any) -> Any:
            """Compute in single precision where numbers are narrower, which kernels do not take."""
            narrow = arrays[0].dtype.itemsize < 4
            found = function(*(np.ascontiguousarray(array, np.float32 if narrow else None) for array in arrays))
            return jax.tree_util.tree_map(lambda one, like: np.asarray(one, like.dtype), found, shapes)

        return jax.pure_callback(on_host, shapes, *given, vmap_method="sequential")

    def shape(x: Any) -> Any:
        return jax.ShapeDtypeStruct(x.shape, x.dtype)

    @jax.custom_vjp
    def product(a: Any, b: Any, w: Any) -> Any:
        return called(algebra.weighted, shape(a), (a, b, w))

    @jax.custom_vjp
    def pull(a: Any, b: Any, w: Any, d: Any) -> Any:
        own = lambda *given: weighted_pull(algebra, *given)  # noqa: E731
        return called(own, (shape(a), shape(b), shape(w)), (a, b, w, d))

    product.defvjp(lambda *given: (product(*given), given), lambda given, d: pull(*given, d))
    pull.defvjp(
        lambda *given: (pull(*given), given), lambda given, cotangents: pull_of_pull(product, pull, given, cotangents)
    )
    return product, pull


@cache
def jax_functions() -> Callable[..., Functions]:
    """Return the class of the functions of jax, made for an algebra."""
    with extra("peers", "algorithms.learning.frameworks"):
        import jax
    jnp = jax.numpy

    class JaxFunctions(Functions):
        def __init__(self, algebra: Algebra, key: Any = None, neighbours: Any = None) -> None:
            self._product, self.key, self.neighbours = jax_products(algebra)[0], key, neighbours

        exp, log1p, arcsinh = map(staticmethod, (jnp.exp, jnp.log1p, jnp.arcsinh))
        tanh, reshape, matmul = map(staticmethod, (jnp.tanh, jnp.reshape, jnp.matmul))
        swapped, softmax = map(staticmethod, (jnp.swapaxes, jax.nn.softmax))

        def sum(self, x: Any, axis: int) -> Any:
            return x.sum(axis, keepdims=True)

        def linear(self, x: Any, matrix: Any) -> Any:
            return x @ jnp.asarray(matrix, x.dtype)

        def rows(self, x: Any, index: Any) -> Any:
            return x[:, index]

        def sum_rows(self, x: Any, index: Any, count: int) -> Any:
            return jnp.zeros((len(x), count, *x.shape[2:]), x.dtype).at[:, index].add(x)

        def mixed(self, algebra: Algebra, w: Any, x: Any) -> Any:
            return jnp.einsum("oik,nik->nok", w[..., algebra.grades], x)

        def weighted(self, algebra: Algebra, a: Any, b: Any, w: Any) -> Any:
            return self._product(a, b, w)

        def kept(self, x: Any, rate: float, seed: int) -> Any:
            if self.key is None or rate == 0:
                return x
            own = jax.random.fold_in(self.key, seed)
            return x * jax.random.bernoulli(own, 1 - rate, (*x.shape[:2], 1)) / (1 - rate)

    return JaxFunctions
