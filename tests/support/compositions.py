"""Compositions of catalog kernels: a result is passed to a parameter of the same layout."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from importlib import import_module
from random import Random
from typing import Any

from gacompiler import Kernel, Layout
from gacompiler.frontend.kernel import Parameter, trace
from gacompiler.passes.effort import LEVELS
from gacompiler.passes.pipeline import compile_kernel, decide_results, rewrite_expressions, trace_kernel
from gacompiler.passes.prove import same
from gacompiler.passes.record import Compilation
from gacompiler.passes.samples import meaning, samples


@cache
def alone(kernel: Kernel) -> Compilation:
    """A catalog kernel, compiled by itself."""
    return compile_kernel(kernel, forms=False)


@cache
def layout_of_result(kernel: Kernel) -> Layout | None:
    """The layout of the result, which is decided before programs are searched; None for several results or a number."""
    record = decide_results(rewrite_expressions(trace_kernel(Compilation(kernel, effort=LEVELS[0]))))
    assert record.trace is not None and record.decision is not None
    (output, *others), (layout, *_) = record.trace.outputs, record.decision.layouts
    return None if others or output.outer_shape or layout.is_scalar else layout


@cache
def catalog(spec: str) -> tuple[Kernel, ...]:
    """The kernels of a spec with one multivector as their result, whose parameters are no arrays."""
    found = vars(import_module(f"gacompiler.specs.{spec}")).values()
    kernels = (each for each in found if isinstance(each, Kernel) and not each.has_loops)
    simple = (each for each in kernels if not any(parameter.outer_shape for parameter in each.parameters))
    return tuple(each for each in simple if layout_of_result(each) is not None)


def pairs(spec: str) -> Iterator[tuple[Kernel, int, Kernel]]:
    """All kernels, places of their parameters, and kernels whose result has the layout of the parameter."""
    for outer in catalog(spec):
        for place, parameter in enumerate(outer.parameters):
            for inner in catalog(spec):
                if layout_of_result(inner) == parameter.layout:
                    yield outer, place, inner


def has_the_meaning_of_its_parts(outer: Kernel, place: int, inner: Kernel) -> bool:
    """Whether the composed definition has the value of `outer` at the value of `inner`.

    A logarithm inside `outer`, for example, is that of a unit versor only if its argument is known to be one.
    """
    whole, below, above = trace(composed(outer, place, inner)), trace(inner), trace(outer)
    (inputs, (value,)), *_ = samples(whole.kernel, whole.expressions, Random(3), 1)
    names = [name for parameter in whole.kernel.parameters for name in parameter.components]
    numbers = [inputs[name] for name in names]
    n = sum(len(parameter.components) for parameter in inner.parameters)
    given = dict(zip((name for p in inner.parameters for name in p.components), numbers[:n], strict=True))
    (passed,) = meaning(below.expressions, given)
    slots = outer.parameters[place].layout.stored
    rest = iter(numbers[n:])
    found = {}
    for k, parameter in enumerate(outer.parameters):
        own = [slot.sign * passed.terms.get(slot.blade, 0) for slot in slots] if k == place else rest
        found.update(zip(parameter.components, own, strict=False))
    (expected,) = meaning(above.expressions, found)
    blades = {*value.terms, *expected.terms}
    return all(same(value.terms.get(blade, 0), expected.terms.get(blade, 0)) for blade in blades)


def composed(outer: Kernel, place: int, inner: Kernel) -> Kernel:
    """The kernel that passes the result of `inner` to the parameter at `place` of `outer`."""
    own = [each for k, each in enumerate(outer.parameters) if k != place]
    given = (*inner.parameters, *own)
    n = len(inner.parameters)

    def function(*arguments: Any) -> Any:
        rest = list(arguments[n:])
        rest.insert(place, inner(*arguments[:n]))
        return outer(*rest)

    parameters = tuple(Parameter(f"x{k}", each.type) for k, each in enumerate(given))
    return Kernel(f"{outer.name}_of_{inner.name}", function, parameters, outer.returns, "")
