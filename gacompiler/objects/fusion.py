"""Fusion of the operations that a program performs: one kernel for each call of a function and each statement.

A recorder sees the operations in order. It recognises results by their memory, so it knows which operations use them.
The operations of one call of a function of the program form a kernel, named after the function; operations outside of
functions form a kernel for each statement. Inputs are the values that come from elsewhere; results are the values that
no other operation of the kernel uses, or that still exist after the call.

Numbers are not recognised, since Python copies them. After an operation has returned a number, the first operation with
a new number therefore begins another kernel: the number may have been computed from the result.
"""

from __future__ import annotations

import ast
import itertools
import keyword
import re
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np

from ..algebra.algebra import Algebra
from ..algebra.layout import Layout
from ..errors import GacError
from ..frontend.kernel import Kernel, Parameter, trace
from ..passes.decide import decide
from ..passes.rewrite import rewrite
from .definitions import Applied, Definition

MOST = 60
"""The number of operations of a call above which its statements form separate kernels, such as those of loops."""

_CONSTRUCTORS = frozenset(f"{name}.py" for name in ("checks", "conformal", "constructors", "euclidean", "projective"))
"""Files of this package whose functions perform operations on behalf of constructors."""

Memory = tuple[int, tuple[int, ...], tuple[int, ...], str]
"""Address, shape, strides and type of an array: two existing arrays with the same ones hold the same numbers."""


def _memory(array: np.ndarray[Any, Any]) -> Memory:
    return array.__array_interface__["data"][0], array.shape, array.strides, array.dtype.str


@dataclass(frozen=True, slots=True)
class Step:
    """An operation: its operands are inputs (negative: ``~k`` for input k) or results of earlier steps."""

    definition: Definition
    layouts: tuple[Layout, ...]
    operands: tuple[int, ...]
    result: Layout

    @property
    def algebra(self) -> Algebra:
        """The algebra whose name the text of the definition uses."""
        return self.definition.algebra_of(self.layouts)

    def text(self, names: Callable[[int], str], algebra: str) -> str:
        """Return the definition in terms of names of the operands."""
        tree = ast.parse(self.definition.expression(algebra), mode="eval")
        renamed = dict(zip(self.definition.parameters, map(names, self.operands), strict=True))
        for each in ast.walk(tree):
            if isinstance(each, ast.Name) and each.id in renamed:
                each.id = renamed[each.id]
        return ast.unparse(tree)


@dataclass(frozen=True)
class Fused:
    """Operations that form a kernel. Two of them with equal steps and results are the same kernel.

    Attributes
    ----------
    name : str
    inputs : tuple of Layout
    steps : tuple of Step
    results : tuple of int
        The steps whose results are those of the kernel.
    has_layouts : bool
        Whether the results have the layouts that the operations gave them, which must be provable.
    """

    name: str = field(compare=False)
    inputs: tuple[Layout, ...]
    steps: tuple[Step, ...]
    results: tuple[int, ...]
    has_layouts: bool = True

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The names of the inputs, after their layouts."""
        names: list[str] = []
        for layout in self.inputs:
            word = "number" if layout.is_scalar else re.sub(r"\W+", "_", layout.name).strip("_").lower()
            word = word if word.isidentifier() and not keyword.iskeyword(word) and word != "ga" else "element"
            count = sum(re.fullmatch(rf"{word}(_\d+)?", name) is not None for name in names)
            names.append(f"{word}_{count + 1}" if count else word)
        return tuple(names)

    def name_of(self, operand: int) -> str:
        """Return the name of an input or of the result of a step."""
        return self.names[~operand] if operand < 0 else f"x{operand + 1}"

    def function(self, *given: Any) -> Any:
        """Compute the results on expressions."""
        found: list[Any] = []
        for step in self.steps:
            operands = [given[~k] if k < 0 else found[k] for k in step.operands]
            found.append(step.definition.function(step.algebra)(*operands))
        results = tuple(found[k] for k in self.results)
        return results if len(results) > 1 else results[0]

    @cached_property
    def kernel(self) -> Kernel:
        """The kernel of a spec."""
        parameters = tuple(Parameter(n, layout) for n, layout in zip(self.names, self.inputs, strict=True))
        return Kernel(self.name, self.function, parameters, self.returns, self.summary)

    @property
    def returns(self) -> Layout | tuple[Layout, ...] | None:
        """The layouts of the results; None if the compiler chooses them."""
        layouts = tuple(self.steps[k].result for k in self.results)
        return None if not self.has_layouts else layouts if len(layouts) > 1 else layouts[0]

    @property
    def summary(self) -> str:
        """The operations in order."""
        words = [step.definition.name.replace("_", " ") for step in self.steps]
        shown = ", ".join(words[:4]) + (f" and {len(words) - 4} more" if len(words) > 4 else "")
        return f"Compute {len(words)} operation{'s' * (len(words) > 1)}: {shown}."

    @property
    def is_valid(self) -> bool:
        """Whether the compiler accepts the expressions, and proves the layouts of the results."""
        try:
            traced = trace(self.kernel)
            decide(traced, tuple(rewrite(traced.expressions).values()))
        except GacError:
            return False
        return True


@dataclass
class _Event:
    """An operation as it happened, with the array that holds its result."""

    operator: Applied
    operands: tuple[Memory | None, ...]
    """The memory of arrays; None for numbers, which have none of their own."""
    numbers: tuple[float, ...]
    out: np.ndarray[Any, Any]
    line: int
    is_internal: bool
    """Whether a constructor performed it, which may only check its arguments."""


@dataclass
class _Call:
    """The operations of one call of a function, or of one statement outside of functions."""

    frame: FrameType
    name: str
    line: int
    """The line of a statement outside of functions, otherwise 0."""
    events: list[_Event] = field(default_factory=list)
    kept: list[np.ndarray[Any, Any]] = field(default_factory=list)
    """Inputs, so that their memory is not used again while the call is recorded."""
    results: set[Memory] = field(default_factory=set)
    """The memory of the results of the events."""


class Recorder:
    """Receives the operations of a program; `kernels` are those that compute them.

    Parameters
    ----------
    script : str
        The file of the program. Operations in other files belong to the function of the program that called them.
    """

    def __init__(self, script: str) -> None:
        self._script = script
        self._calls: list[_Call] = []
        self._kernels: dict[Fused, tuple[int, ...]] = {}
        """For each kernel, whose numbers are all separate inputs, the first input that had the same number in every
        call."""
        self._valid: dict[Fused, Fused | None] = {}
        """The form of each kernel that the compiler accepts; None if its operations form separate kernels."""
        self._targets = _targets(Path(script))

    def __call__(self, operator: Applied, arrays: Iterable[np.ndarray[Any, Any]], out: np.ndarray[Any, Any], /) -> None:
        """Receive an operation after it has been performed."""
        stack = [frame for frame in _frames() if frame.f_code.co_filename == self._script]
        named = [frame for frame in stack if not frame.f_code.co_name.startswith("<") or frame is stack[-1]]
        if not named:
            return
        frame = named[0]
        line = 0 if frame is not stack[-1] else frame.f_lineno
        while self._calls and not any(
            self._calls[-1].frame is each and self._calls[-1].line in (0, each.f_lineno) for each in named
        ):
            self._finish(self._calls.pop())
        call = next((c for c in reversed(self._calls) if c.frame is frame and c.line == line), None)
        if call is None:
            name = frame.f_code.co_name if not line else self._targets.get(line, f"line_{line}")
            call = _Call(frame, name, line)
            self._calls.append(call)
        given = tuple(arrays)
        operands = tuple(_memory(array) if array.ndim else None for array in given)
        # Views of results are not kept: they would count as values that outlive the call.
        call.kept += [
            array
            for array, place in zip(given, operands, strict=True)
            if place is not None and place not in call.results
        ]
        numbers = tuple(float(array) for array in given if not array.ndim)
        callers = itertools.takewhile(lambda each: each is not stack[0], _frames())
        is_internal = any(Path(each.f_code.co_filename).name in _CONSTRUCTORS for each in callers)
        call.events.append(_Event(operator, operands, numbers, out, frame.f_lineno, is_internal))
        call.results.add(_memory(out))

    @property
    def kernels(self) -> tuple[Fused, ...]:
        """The kernels, in the order in which their calls ended; call this when the program has ended."""
        while self._calls:
            self._finish(self._calls.pop())
        found = (_needed(_merged(fused, same)) for fused, same in self._kernels.items())
        return tuple(dict.fromkeys(found))

    def _finish(self, call: _Call) -> None:
        """Add the kernels of a call that has ended."""
        if not call.line:
            with suppress(RuntimeError):  # it has not ended
                call.frame.clear()  # so that values that only its variables hold are no results
        for name, events in _parts(call):
            self._add(name, events)

    def _add(self, name: str, events: list[_Event]) -> None:
        fused, numbers = _fused(name, events)
        if fused not in self._valid:
            forms = (fused, replace(fused, has_layouts=False))
            self._valid[fused] = next((each for each in forms if each.is_valid), forms[1] if len(events) == 1 else None)
        valid = self._valid[fused]
        if valid is not None:
            fused = valid
            labels = tuple(zip(self._kernels.get(fused, [0] * len(numbers)), numbers, strict=True))
            self._kernels[fused] = tuple(map(labels.index, labels))
            return
        for event in events:
            self._add(name, [event])


def _frames() -> Iterator[FrameType]:
    frame: FrameType | None = sys._getframe(2)
    while frame is not None:
        yield frame
        frame = frame.f_back


def _parts(call: _Call) -> Iterator[tuple[str, list[_Event]]]:
    """Divide the operations of a call: by lines if there are many, and where a new number follows one returned."""
    lines: list[list[_Event]] = [call.events]
    if len(call.events) > MOST:
        lines = []
        for event in call.events:
            if not lines or lines[-1][-1].line != event.line or len(lines[-1]) >= MOST:
                lines.append([])
            lines[-1].append(event)
    for events in lines:
        part: list[_Event] = []
        seen: set[float] = set()
        has_number = False
        for event in events:
            if has_number and not seen.issuperset(event.numbers):
                yield call.name, part
                part, seen, has_number = [], set(), False
            part.append(event)
            seen.update(event.numbers)
            has_number = has_number or event.operator.result.is_scalar
        yield call.name, part


def _fused(name: str, events: list[_Event]) -> tuple[Fused, list[object]]:
    """Return the kernel of operations, and for each input its number; those of arrays are all different."""
    place: dict[Memory, int] = {}
    inputs: list[Layout] = []
    given: list[object] = []
    steps: list[Step] = []
    for event in events:
        numbers = iter(event.numbers)
        layouts = tuple(parameter.layout for parameter in event.operator.kernel.parameters)
        operands = []
        for memory, layout in zip(event.operands, layouts, strict=True):
            found = None if memory is None else place.get(memory)
            if found is None:
                found = ~len(inputs)
                given.append(next(numbers) if memory is None else object())
                inputs.append(layout)
                if memory is not None:
                    place[memory] = found
            operands.append(found)
        steps.append(Step(event.operator.definition, layouts, tuple(operands), event.operator.result))
        if event.out.ndim:
            place[_memory(event.out)] = len(steps) - 1
    used = {k for step in steps for k in step.operands}
    # Only the event and the argument of getrefcount refer to a result that no other object holds, and only the result
    # and the argument to its memory, if that is another array, to which parts of the result refer.
    held = [
        sys.getrefcount(event.out) > 2 or (event.out.base is not None and sys.getrefcount(event.out.base) > 2)
        for event in events
    ]
    wanted = [k for k, each in enumerate(events) if held[k] or (k not in used and not each.is_internal)]
    return Fused(name, tuple(inputs), tuple(steps), tuple(wanted or [len(steps) - 1])), given


def _merged(fused: Fused, same: tuple[int, ...]) -> Fused:
    """Return a kernel in which the first of several inputs with the same numbers replaces the others."""
    steps = (replace(step, operands=tuple(~same[~k] if k < 0 else k for k in step.operands)) for step in fused.steps)
    return replace(fused, steps=tuple(steps))


def _needed(fused: Fused) -> Fused:
    """Return a kernel without the steps and inputs that do not affect its results."""
    needed = set(fused.results)
    for k in reversed(range(len(fused.steps))):
        if k in needed:
            needed.update(fused.steps[k].operands)
    steps, inputs = (sorted(k for k in needed if k >= 0), sorted((k for k in needed if k < 0), reverse=True))
    place = {k: n for n, k in enumerate(steps)} | {k: ~n for n, k in enumerate(inputs)}
    kept = (fused.steps[k] for k in steps)
    return replace(
        fused,
        inputs=tuple(fused.inputs[~k] for k in inputs),
        steps=tuple(replace(step, operands=tuple(place[k] for k in step.operands)) for step in kept),
        results=tuple(place[k] for k in fused.results),
    )


def _targets(script: Path) -> dict[int, str]:
    """Return the name that each statement outside of functions assigns, by its lines."""
    try:
        tree = ast.parse(script.read_text(encoding="utf-8"))
    except (OSError, SyntaxError, UnicodeDecodeError):
        return {}
    found: dict[int, str] = {}
    for statement in ast.walk(tree):
        if isinstance(statement, ast.Assign) and isinstance(statement.targets[0], ast.Name):
            name = statement.targets[0].id
            for line in range(statement.lineno, (statement.end_lineno or statement.lineno) + 1):
                found.setdefault(line, name if not keyword.iskeyword(name) and name != "ga" else f"line_{line}")
    return found
