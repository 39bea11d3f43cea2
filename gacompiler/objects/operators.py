"""Operations on given layouts, which are compiled on first use and cached until the program ends.

The first use runs the fast stages of the compiler: trace, rewrite, decide, and the choice of the cheapest form of the
expression. The result is proved and runs immediately: line by line in the extension (`interpreted.py`), or as Python
code. Meanwhile a C compiler builds one small function of the same program (`native.py`), which replaces it when it is
ready. After enough work on arrays to justify the cost, another process compiles the operation in the same manner as
generated modules (`modules.py`).
"""

from __future__ import annotations

import keyword
import math
import re
import sys
import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from random import Random
from typing import Any

import numpy as np

from ..algebra.layout import Layout
from ..backends.python_text import function_text
from ..backends.transcendental import is_transcendental
from ..errors import KernelError, SpecError
from ..frontend.expression import evaluate, outside_functions
from ..frontend.facts import is_unit
from ..frontend.kernel import Kernel, Parameter, trace
from ..gac_runtime.arrays import PATIENCE
from ..ir.cost import cost
from ..ir.program import Argument, Program
from ..ir.scalar import Graph
from ..passes.accuracy import Gate
from ..passes.candidate import Candidate
from ..passes.decide import Decision, decide
from ..passes.interruption import is_interrupted
from ..passes.lower import Slot, pick
from ..passes.prove import prove_program
from ..passes.record import Compilation
from ..passes.rewrite import rewrite
from ..passes.samples import samples
from ..passes.schedule import schedule
from .background import QUEUE, Job
from .caches import key_of
from .definitions import Definition
from .interpreted import Interpreted, flat_form, is_interpreted
from .kept_programs import Kept, place_of
from .layouts import chosen_layout
from .library import LIBRARY, NUMPY
from .modules import load_made, module_job
from .native import Build, Native, extension, is_wanted

ENOUGH_WORK = 500_000_000
"""Number of scalar operations on arrays after which an operation is compiled as a generated module, which takes about
as long as this work."""

FEW = 1000
"""Number of elements that an operation with transcendental functions computes in Python before it checks again whether
the compiled function is ready."""

MANY_OPERATIONS = 1000
"""Number of operations above which an expression is computed as written. Examining other forms would double the time,
and pays off only for operations that are called so often that they are compiled as generated modules."""

WORTH_A_PROOF = 0.75
"""Another form of an expression is used only if it has at most this fraction of the operations, because proving it
takes as long as all other stages."""
_CLEARLY = 1e-6
"""A difference, relative to the largest coefficient, that cannot be a rounding error."""

OBSERVERS: list[Callable[[Operator, Sequence[np.ndarray[Any, Any]], np.ndarray[Any, Any]], None]] = []
"""Functions that are called after every operation on arrays, with its operands and result; ``gac record`` adds one."""


class Operator:
    """An operation on elements of given layouts.

    Attributes
    ----------
    definition : Definition
    kernel : Kernel
        The operation as a kernel of a spec.
    result : Layout
    program : Program
    """

    def __init__(self, definition: Definition, layouts: tuple[Layout, ...]) -> None:
        self.definition = definition
        place = place_of(definition, layouts)
        kept = place and place.get()
        if kept:
            self.program, self.result = kept.program, kept.result
            kernel = _kernel(definition, layouts)
            self.kernel = replace(kernel, returns=kept.result) if kept.declares else kernel
        else:
            record = compiled(definition, layouts)
            assert record.decision is not None
            (self.result,) = record.decision.layouts
            self.kernel, self.program = record.kernel, record.program
            if place and not is_interrupted():
                place.put(Kept(self.program, self.result, self.kernel.returns is not None))
        self._native: Native | None = None
        self._call: Any = None
        self._interpreted: Any = None
        self._flat = flat_form(self.program, extension())
        self._build = Build(self.program) if is_wanted() else None
        self._shapes = [argument.shape for argument in self.program.arguments]
        self._is_exact = not is_transcendental(self.program)
        self._operations = max(1, cost(self.program).total)
        self._out = self.program.results[0].shape
        self._python: dict[bool, Callable[..., None]] = {}
        self._module: Any = None
        self._module_job: Job | None = None
        self._work = 0

    def __call__(self, arrays: Sequence[np.ndarray[Any, Any]]) -> np.ndarray[Any, Any]:
        """Compute the result on arrays with blades along the last axis (numbers have none); leading axes broadcast."""
        out = self._computed(arrays)
        for observer in OBSERVERS:
            observer(self, arrays, out)
        return out

    def _computed(self, arrays: Sequence[np.ndarray[Any, Any]]) -> np.ndarray[Any, Any]:
        if self._module is not None and not any(a.dtype.kind == "c" for a in arrays):
            return np.asarray(self._module(*arrays))
        if self._flat is not None:
            found = self._flat(*arrays)
            if found is not None:
                return np.asarray(found)
        calls = self._call or self._interpreter()
        if calls is not None:
            out: np.ndarray[Any, Any] | None = calls.attempt(*arrays)
            if out is not None:
                self._count(out.size // math.prod(self._out))
                return out
        leadings = [a.shape[: a.ndim - len(shape)] for a, shape in zip(arrays, self._shapes, strict=True)]
        try:
            leading = leadings[0] if len(set(leadings)) == 1 else np.broadcast_shapes(*leadings)
        except ValueError:
            shapes = " and ".join(map(str, leadings))
            raise ValueError(f"{self.definition.name}: shapes {shapes} do not broadcast") from None
        is_double = not any(a.dtype != np.float64 for a in arrays)
        if self._native is not None:  # for arrays that the extension does not read, or without it
            self._count(math.prod(leading))
        in_chunks = is_double and not self._is_exact and self.state not in ("text", "failed")
        return (self._in_chunks if in_chunks else self._in_python)(arrays, leading)

    def _count(self, n_elements: int) -> None:
        """Count the work on arrays, and compile the operation as a generated module when it was enough."""
        self._work += self._operations * n_elements
        if self._work > ENOUGH_WORK:
            self._begin_module()

    def _interpreter(self) -> Any:
        """Return what runs the operation on arrays in the extension: the compiled function if it is ready."""
        if self._has_call():
            return self._call
        calls = extension()
        if self._interpreted is None and calls is not None and is_interpreted(self.program, calls):
            self._interpreted = Interpreted(self.program, calls)
        return self._interpreted

    def _has_call(self) -> bool:
        """Whether the extension can run the compiled function on arrays, which it reads directly."""
        found, calls = self.native, extension()
        if found is not None and calls is not None:
            call = calls.Call()
            loops = (found.loop, 0, 0), (0, 0, 0)
            patience = PATIENCE // (4 * self._operations)
            if call._bind(tuple(self._shapes), (self._out,), 0, loops, sys.maxsize, patience):
                self._call = call
        return self._call is not None

    @property
    def state(self) -> str:
        """The state of the compiled function.

        ``"ready"``; ``"running"`` while the C compiler builds it; ``"waiting"`` for a processor; ``"failed"`` if the C
        compiler reported an error; ``"text"`` if there is no C compiler. The operation can be used in all states.
        """
        if self.native is not None:
            return "ready"
        if self._build is None:
            return "text"
        return self._build.state

    @property
    def native(self) -> Native | None:
        """The compiled function if it is ready, else None.

        This does not wait for it, because results are the same with and without it.
        """
        if self._native is None and self._build is not None:
            self._native = self._build.poll()
        return self._native

    def wait(self) -> Native | None:
        """Wait for the compiled function and return it; None without a compiler."""
        if self._native is None and self._build is not None:
            self._native = self._build.wait()
        return self._native

    def _begin_module(self) -> None:
        """Start compiling the operation as a generated module in the background, or load the module if it is ready."""
        if self._module_job is None:
            try:
                self._module_job = module_job(self)
            except SpecError:  # the operation cannot be described to another process
                return self.build()
            QUEUE.add(self._module_job)
        if self._module_job.is_done:
            self._module = load_made(self._module_job, self.kernel.name)
        elif self._module_job.failure:
            self.build()
        else:
            QUEUE.start()

    def build(self) -> None:
        """Compile the operation as a generated module, for large arrays, and wait for the result."""
        if self._module is None and self.wait() is not None:
            from ..runtime import compile  # not at the start, since it loads all stages and printers

            self._module = compile(self.kernel, "c")

    def _in_chunks(self, arrays: Sequence[np.ndarray[Any, Any]], leading: tuple[int, ...]) -> np.ndarray[Any, Any]:
        """Compute in Python with the functions of the C library, in chunks, until the compiled function is ready.

        This avoids waiting for the compiler, and the results do not depend on how fast it is.
        """
        n = math.prod(leading)
        flat = [np.broadcast_to(a, leading + s).reshape(n, *s) for a, s in zip(arrays, self._shapes, strict=True)]
        out = np.empty((n, *self._out))
        for start in range(0, n, FEW):
            if self._has_call():
                rest = self._call.attempt(*(a[start:] for a in flat))
                if rest is not None:
                    out[start:] = rest
                    break
            stop = min(n, start + FEW)
            out[start:stop] = self._in_python([a[start:stop] for a in flat], (stop - start,))
        return out.reshape(leading + self._out)

    def _in_python(self, arrays: Sequence[np.ndarray[Any, Any]], leading: tuple[int, ...]) -> np.ndarray[Any, Any]:
        dtype = np.result_type(np.float32, *(array.dtype for array in arrays))
        few = dtype == np.float64 and not self._is_exact and math.prod(leading) <= FEW
        if few not in self._python:
            names: dict[str, Any] = dict(LIBRARY if few else NUMPY)
            exec("\n".join(function_text(self.program)), names)
            self._python[few] = names[self.program.name]
        if dtype.kind == "c" and not self.program.is_rational:
            raise TypeError(
                f"{self.definition.name}: complex coefficients; expected real ones, since the operation has roots, "
                "absolute values or transcendental functions"
            )
        # As np.moveaxis, which takes longer than a short operation.
        parts = [
            a.astype(dtype, copy=False).transpose(a.ndim - 1, *range(a.ndim - 1)) if shape else a.astype(dtype)
            for a, shape in zip(arrays, self._shapes, strict=True)
        ]
        # Each column is in one piece of memory, as the next operation reads it.
        columns = np.empty((self._out or (1,)) + leading, dtype)
        with np.errstate(all="ignore"):
            found: Any = self._python[few](*parts)
        for k, entry in enumerate(found if self._out else (found,)):
            columns[k] = entry
        if not self._out:
            return columns[0]
        return columns.transpose(*range(1, columns.ndim), 0) if leading else columns


_OPERATORS: dict[Any, Operator] = {}
_BY_IDENTITY: dict[tuple[int, ...], tuple[Operator, Definition, tuple[Layout, ...]]] = {}
"""The same by the identities of definition and layouts, because comparing layouts is slow; entries keep them alive."""
_LOCK = threading.RLock()


def operator_of(definition: Definition, layouts: tuple[Layout, ...]) -> Operator:
    """Return the operation on these layouts, compiling it on first use.

    Raises
    ------
    KernelError
        If it is not defined for these layouts: the algebra lacks a function, or a divisor is not a scalar.
    """
    identity = (id(definition), *map(id, layouts))
    known = _BY_IDENTITY.get(identity)
    if known is not None:
        return known[0]
    key = key_of((definition, layouts))
    with _LOCK:
        if key not in _OPERATORS:
            with outside_functions():  # constants of a kernel are computed while its function is called
                _OPERATORS[key] = Operator(definition, layouts)
        _BY_IDENTITY[identity] = _OPERATORS[key], definition, layouts
        return _OPERATORS[key]


def operators() -> tuple[Operator, ...]:
    """Return all operations that were used so far, in the order of first use."""
    return tuple(_OPERATORS.values())


def build() -> None:
    """Compile all operations that were used so far as generated modules, so that large arrays run at full speed.

    Otherwise an operation is compiled in this manner after enough work. Each takes about a second, once: the results
    are stored in the cache.
    """
    for operator in list(_OPERATORS.values()):
        operator.build()


def compiled(definition: Definition, layouts: tuple[Layout, ...]) -> Compilation:
    """Run the fast stages of the compiler on an operation, and choose a named layout for the result if possible."""
    kernel = _kernel(definition, layouts)
    kept = None if definition.keeps is None else layouts[definition.keeps]
    if kept is not None and kept.implied and not _is_refuted(kernel, kept):
        try:
            return _finished(*_decided(replace(kernel, returns=kept)))
        except KernelError:
            pass
    record, variants = _decided(kernel)
    decision, traced = record.decision, record.trace
    assert decision is not None and traced is not None
    (found,) = decision.layouts
    # Equal constants are one expression, whose algebra may be an equal one with other names that was used before.
    layout = found if found.is_scalar else replace(found, algebra=definition.algebra_of(layouts))
    known = is_unit(traced.expressions[0]) or (definition.unit is not None and definition.unit(layouts))
    wanted = chosen_layout(layout, known)
    if wanted != found or wanted.algebra is not found.algebra:
        slots = tuple(Slot(0, slot.blade, slot.sign) for slot in wanted.stored)
        decision = Decision((wanted,), (slots,), decision.constants, (wanted.unit,))
        kernel = replace(kernel, returns=wanted)
        record = replace(record, kernel=kernel, decision=decision, trace=trace(kernel))
    return _finished(record, variants)


def _is_refuted(kernel: Kernel, layout: Layout) -> bool:
    """Whether a numeric sample shows that a result is not of a layout, which is faster than a failing proof."""
    for _, (value,) in samples(kernel, trace(kernel).expressions, Random(7), 1):
        found = {blade: float(x) for blade, x in value.terms.items()}
        stored = {slot.name: slot.sign * found.get(slot.blade, 0.0) for slot in layout.stored}
        wanted = {slot.blade: slot.sign * float(x) for slot, x in layout.fixed}
        wanted |= {slot.blade: slot.sign * float(function(stored)) for slot, function in layout.implied}
        size = max(map(abs, (*found.values(), *wanted.values())), default=0.0)
        return any(abs(found.get(blade, 0.0) - x) > _CLEARLY * size for blade, x in wanted.items())
    return False


def _kernel(definition: Definition, layouts: tuple[Layout, ...]) -> Kernel:
    algebra = definition.algebra_of(layouts)
    parameters = tuple(Parameter(n, layout) for n, layout in zip(definition.parameters, layouts, strict=True))
    name = "_".join([definition.name, *(_word(layout) for layout in layouts)])
    summary = f"``{definition.expression(algebra.name)}``"
    return Kernel(name, definition.function(algebra), parameters, None, summary)


def _word(layout: Layout) -> str:
    """Return the form of a layout's name that is used in names of kernels."""
    if layout.name.isidentifier() and not keyword.iskeyword(layout.name):
        return layout.name.lower()
    text = re.sub(r"\W+", "_", layout.name).strip("_")
    return text if len(text) <= 24 else f"{layout.size}_blades"


def _decided(kernel: Kernel) -> tuple[Compilation, dict[str, tuple[Any, ...]]]:
    traced = trace(kernel)
    variants = rewrite(traced.expressions)
    return Compilation(kernel, traced, variants, decide(traced, tuple(variants.values()))), variants


def _finished(record: Compilation, variants: dict[str, tuple[Any, ...]]) -> Compilation:
    """Choose the cheapest accurate form of the expression, and prove it if it is not the definition itself."""
    assert record.decision is not None
    (slots,), (layout,) = record.decision.slots, record.decision.layouts
    shape = () if layout.is_scalar else (layout.size,)
    arguments = tuple(Argument(p.name, p.shape, p.components) for p in record.kernel.parameters)
    candidates = []
    for name, expressions in variants.items():
        graph = Graph()
        inputs = {c: graph.variable(c) for parameter in record.kernel.parameters for c in parameter.components}
        scalars = pick(evaluate(expressions, inputs, lift=graph.lift), slots, graph)
        program: Program = schedule(record.kernel.name, arguments, (("out", shape, scalars),))
        candidates.append(Candidate((name,), program, cost(program)))
        if candidates[0].cost.total > MANY_OPERATIONS:
            break
    by_cost = sorted(candidates, key=lambda candidate: candidate.cost.total)
    record = replace(record, candidates=tuple(candidates), best=candidates[0])
    if by_cost[0].cost.total < WORTH_A_PROOF * candidates[0].cost.total:
        gate = Gate(record.kernel, candidates[0].program)
        best = next((each for each in by_cost if gate.accepts(each.program)), candidates[0])
        record = replace(record, gate=gate, best=best)
        if best is not candidates[0]:
            record = prove_program(record)
    return record
