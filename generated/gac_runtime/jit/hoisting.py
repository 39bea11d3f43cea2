"""Separate the operations of a kernel that only depend on arguments which are the same for all elements of a batch.

The function of a kernel is called once on symbols that record its operations. The recorded operations are written as
two functions: one computes the values that do not change, the other computes the results from these values and the
other arguments. The operations and their operands are those of the kernel, so that every result has the same bits.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import Any

from ..functions import SCALAR_FUNCTIONS, bound

Shape = tuple[int, ...]


class _Symbol:
    """A value: a component of an argument, or the result of an operation, whose text is recorded."""

    def __init__(self, lines: list[_Symbol], name: str, text: str = "", operands: Sequence[_Symbol] = ()) -> None:
        self.lines, self.name, self.text, self.operands = lines, name, text, operands

    def __add__(self, other: Any) -> _Symbol:
        return _recorded(self.lines, "{} + {}", self, other)

    def __radd__(self, other: Any) -> _Symbol:
        return _recorded(self.lines, "{} + {}", other, self)

    def __sub__(self, other: Any) -> _Symbol:
        return _recorded(self.lines, "{} - {}", self, other)

    def __rsub__(self, other: Any) -> _Symbol:
        return _recorded(self.lines, "{} - {}", other, self)

    def __mul__(self, other: Any) -> _Symbol:
        return _recorded(self.lines, "{} * {}", self, other)

    def __rmul__(self, other: Any) -> _Symbol:
        return _recorded(self.lines, "{} * {}", other, self)

    def __truediv__(self, other: Any) -> _Symbol:
        return _recorded(self.lines, "{} / {}", self, other)

    def __rtruediv__(self, other: Any) -> _Symbol:
        return _recorded(self.lines, "{} / {}", other, self)

    def __neg__(self) -> _Symbol:
        return _recorded(self.lines, "-{}", self)


def _recorded(lines: list[_Symbol], text: str, *operands: Any) -> _Symbol:
    """Record an operation; `text` has a place for each operand."""
    names = [operand.name if isinstance(operand, _Symbol) else f"({operand!r})" for operand in operands]
    symbols = [operand for operand in operands if isinstance(operand, _Symbol)]
    lines.append(_Symbol(lines, f"t{len(lines)}", text.format(*names), symbols))
    return lines[-1]


@functools.cache
def hoisted(
    function: Callable[..., Any],
    inputs: tuple[tuple[str, Shape], ...],
    outputs: tuple[Shape, ...],
    same: frozenset[str],
) -> tuple[Callable[..., Any], Callable[..., Any], int]:
    """Return the functions of both steps of a kernel's form, and the number of values that the first one prepares.

    Parameters
    ----------
    function : callable
        The function of the kernel on one element.
    inputs : tuple of (str, tuple of int)
        The names and shapes of its arguments.
    outputs : tuple of tuple of int
        The shapes of its results.
    same : frozenset of str
        The names of the arguments that are the same for all elements.
    """
    lines: list[_Symbol] = []
    arguments = [_argument(lines, f"x{k}", shape) for k, (_, shape) in enumerate(inputs)]
    calls = {
        name: functools.partial(_recorded, lines, f"{name}({', '.join('{}' for _ in range(_arity(scalar)))})")
        for name, scalar in SCALAR_FUNCTIONS.items()
    }
    found = bound(function, calls)(
        *(_nested(iter(flat), shape) for flat, (_, shape) in zip(arguments, inputs, strict=True))
    )
    results = [_flat(each, shape) for each, shape in zip(found if len(outputs) > 1 else [found], outputs, strict=True)]
    known = {symbol for flat, (name, _) in zip(arguments, inputs, strict=True) if name in same for symbol in flat}
    once, each = list[_Symbol](), list[_Symbol]()
    for line in lines:
        if known.issuperset(line.operands):
            known.add(line)
            once.append(line)
        else:
            each.append(line)
    read = [
        *(operand for line in each for operand in line.operands),
        *(entry for result in results for entry in result),
    ]
    prepared = list(dict.fromkeys(entry for entry in read if isinstance(entry, _Symbol) and entry in known))
    names = [symbol.name for symbol in prepared]
    kept = [(flat, shape) for flat, (name, shape) in zip(arguments, inputs, strict=True) if name in same]
    rest = [(flat, shape) for flat, (name, shape) in zip(arguments, inputs, strict=True) if name not in same]
    texts = [_text(flat, shape) for flat, shape in zip(results, outputs, strict=True)]
    held = ([_Symbol(lines, name) for name in names], (len(names),))
    label = f"_{function.__name__}_{{}}_{'_'.join(name for name, _ in inputs if name in same)}"
    return (
        _function(function, label.format("prepare"), kept, once, _tuple(names)),
        _function(function, label.format("apply"), [held, *rest], each, texts[0] if len(texts) == 1 else _tuple(texts)),
        len(names),
    )


def _arity(scalar: Callable[..., Any]) -> int:
    """Return the number of arguments of a function of a kernel's text; those of the library have one, except atan2."""
    code = getattr(scalar, "__code__", None)
    return int(code.co_argcount) if code else 2 if scalar is SCALAR_FUNCTIONS["atan2"] else 1


def _argument(lines: list[_Symbol], name: str, shape: Shape) -> list[_Symbol]:
    """Return the components of an argument, which is named after the number of the argument."""
    size = functools.reduce(int.__mul__, shape, 1)
    return [_Symbol(lines, f"{name}_{k}" if shape else name) for k in range(size)]


def _nested(flat: Any, shape: Shape) -> Any:
    """Arrange values in C order in nested tuples."""
    return tuple(_nested(flat, shape[1:]) for _ in range(shape[0])) if shape else next(flat)


def _flat(value: Any, shape: Shape) -> list[Any]:
    return [entry for part in value for entry in _flat(part, shape[1:])] if shape else [value]


def _text(flat: Sequence[Any], shape: Shape) -> str:
    """Return the text of nested tuples of values."""
    names = iter([entry.name if isinstance(entry, _Symbol) else f"({entry!r})" for entry in flat])

    def text(nested: Any) -> str:
        return _tuple(list(map(text, nested))) if isinstance(nested, tuple) else str(nested)

    return text(_nested(names, shape))


def _tuple(texts: Sequence[str]) -> str:
    return f"({''.join(f'{text}, ' for text in texts)})"


def _function(
    kernel: Callable[..., Any],
    name: str,
    arguments: Sequence[tuple[Sequence[_Symbol], Shape]],
    lines: Sequence[_Symbol],
    result: str,
) -> Callable[..., Any]:
    """Compile the function of one step, as if it were in the file of the kernel."""
    heads = [flat[0].name if not shape else f"a{k}" for k, (flat, shape) in enumerate(arguments)]
    body = [f"{_text(flat, shape)} = {head}" for head, (flat, shape) in zip(heads, arguments, strict=True) if shape]
    body += [*(f"{line.name} = {line.text}" for line in lines), f"return {result}"]
    text = "\n    ".join([f"def {name}({', '.join(heads)}):", *body])
    names: dict[str, Any] = {}
    exec(compile(text, kernel.__code__.co_filename, "exec"), names)
    return names[name]  # type: ignore[no-any-return]
