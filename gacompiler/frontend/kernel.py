"""Declaration of kernels: names, layouts and results. No work is done before a kernel is compiled."""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from keyword import iskeyword
from typing import Any

from ..algebra.immutable import Immutable
from ..algebra.layout import Layout
from ..algebra.multivector import Multivector
from ..algebra.operations import Operation
from ..errors import GacError, KernelError
from .calls import Call, record_call, recorded_calls
from .expression import IN_FUNCTION, Expression, lift
from .names import found_in
from .operands import EXPECTED, is_operand, without_values
from .parameters import ArrayOf as ArrayOf
from .parameters import Parameter as Parameter
from .parameters import Type as Type
from .parameters import array as array
from .parameters import index as index
from .rows import Array, IndexOf, RowsOf
from .traced import Traced, leaves


@dataclass(frozen=True, slots=True, repr=False)
class Kernel(Immutable):
    """The definition of a kernel. Call it on expressions or multivectors to use it inside another kernel.

    Kernels can be pickled. A kernel that is an attribute of its module under the name of its function is unpickled as
    that object. Any other kernel (of a lambda, defined inside a function, or a derivative) is pickled with its traced
    expressions in place of the function, which define the same kernel. Kernels with loops have no such expressions and
    are pickled by name only.
    """

    name: str
    function: Callable[..., Any]
    parameters: tuple[Parameter, ...]
    returns: Type | tuple[Type | None, ...] | None
    summary: str
    result_names: tuple[str, ...] = ()
    """Names of the results. If given, the results are a named tuple that holds every coefficient except zeros."""
    keeps_loops: bool = False
    """Whether iterations are loops in emitted text although no array has a length that is known only at run time."""

    def __repr__(self) -> str:
        return f"<kernel {self.name}({', '.join(map(str, self.parameters))})>"

    def __call__(self, *arguments: Any) -> Any:
        if len(arguments) != len(self.parameters):
            names = ", ".join(parameter.name for parameter in self.parameters)
            raise KernelError(
                f"kernel {self.name}", f"called with {len(arguments)} arguments", f"{len(self.parameters)}: {names}"
            )
        arguments = without_values(self.where, arguments)
        for parameter, argument in zip(self.parameters, arguments, strict=True):
            known = (Expression, Multivector, Array)
            if not all(
                isinstance(leaf, known) or (is_operand(leaf) and not isinstance(parameter.type, RowsOf))
                for leaf in leaves(argument)
            ):
                remedy = f"compile it, as in `f = gacompiler.compile({self.name})`, and call the result"
                raise KernelError(self.where, f"called with {type(argument).__name__}", EXPECTED, remedy)
        value = self.function(*arguments)
        if not self.has_loops:
            record_call(self, arguments, value)
        return value

    def traced(self) -> Kernel:
        """Return this kernel with its traced expressions in place of the function."""
        if isinstance(self.function, Traced):
            return self
        symbols = tuple(parameter.symbols() for parameter in self.parameters)
        return replace(self, function=Traced(symbols, self.function(*symbols)))

    def documented(self, summary: str) -> Kernel:
        """Return this kernel with another docstring, for a member of a family whose shared docstring is incomplete."""
        return replace(self, summary=inspect.cleandoc(summary))

    def __reduce__(self) -> tuple[Any, ...]:
        if isinstance(self.function, Traced):
            return type(self), tuple(getattr(self, name) for name in self.__dataclass_fields__)
        module, name = self.function.__module__, self.function.__qualname__
        if self.has_loops:
            if found_in(module, name) is not self:
                raise KernelError(
                    self.where,
                    "a kernel with loops that is not an attribute of its module under the name of its function",
                    "a kernel that is defined in a module, outside of functions",
                )  # fmt: skip
            return _restored, (module, name, None)
        if found_in(module, name) is not self:
            traced = self.traced()
            return type(traced), tuple(getattr(traced, name) for name in traced.__dataclass_fields__)
        return _restored, (module, name, self.traced() if module == "__main__" else None)

    @property
    def has_loops(self) -> bool:
        """Whether the kernel takes arrays whose lengths are known only when it runs, or keeps iterations as loops."""
        return self.keeps_loops or any(parameter.has_rows for parameter in self.parameters)

    @property
    def where(self) -> str:
        """File and line of the definition, for messages."""
        return _where(self.function, self.name)

    def place_of(self, error: BaseException) -> str:
        """Return the last line of the author's file that led to an error, and the kernel; empty without a file."""
        code = getattr(self.function, "__code__", None)
        if code is None or code.co_filename == "<string>":
            return ""
        line, trace = code.co_firstlineno, error.__traceback__
        while trace is not None:
            if trace.tb_frame.f_code.co_filename == code.co_filename:
                line = trace.tb_lineno
            trace = trace.tb_next
        return f"{code.co_filename}:{line}: kernel {self.name}"


def _restored(module: str, name: str, traced: Kernel | None) -> Kernel:
    """Return the kernel of that name, or `traced` if this process runs another program, without such a kernel."""
    if traced is None:
        importlib.import_module(module)
    found = found_in(module, name)
    if isinstance(found, Kernel) and (traced is None or found.traced() == traced):
        return found
    if traced is None:
        raise KernelError(
            f"unpickling {module}.{name}", "no kernel of that name", "the module that it was pickled with"
        )
    return traced


@dataclass(frozen=True, slots=True)
class Output:
    """One result of a traced kernel: expressions in C order over the outer shape, and the requested layout."""

    name: str
    outer_shape: tuple[int, ...]
    expressions: tuple[Expression, ...]
    layout: Layout | None


@dataclass(frozen=True, slots=True)
class Trace:
    """The result of calling a kernel once on symbols."""

    kernel: Kernel
    outputs: tuple[Output, ...]
    calls: tuple[Call[Kernel], ...] = ()
    """Calls of other kernels, inner calls before outer ones."""

    @property
    def expressions(self) -> tuple[Expression, ...]:
        """The expressions of all outputs, in order."""
        return tuple(expression for output in self.outputs for expression in output.expressions)


def kernel(*wrong: Any, returns: Any = None, **parameters: Any) -> Callable[[Callable[..., Any]], Kernel]:
    """Declare the decorated function as a kernel.

    Parameters
    ----------
    *wrong
        Nothing: the types of the parameters are given by name.
    returns : Layout, ArrayOf or tuple of these, optional
        The layout of the result; inferred by default. A result that does not fit raises an error at compilation.
    **parameters : Layout, ArrayOf or tuple of equal layouts
        The type of each parameter of the function, by name. In addition, ``loops=True`` keeps iterations as loops; by
        default, `iterate` is unrolled in kernels without arrays whose lengths are known only when they run.

    Raises
    ------
    KernelError
        If the names of the types are not those of the parameters, a type is not a layout or array, two parameters have
        an entry of the same name, or the function has no name that generated functions can have.

    Examples
    --------
    >>> from gacompiler.algebra.catalog import PGA3
    >>> @kernel(m=PGA3.MOTOR, p=PGA3.POINT)
    ... def move_point(m, p):
    ...     return m * p * ~m
    """

    if wrong:
        where = _where(wrong[0], getattr(wrong[0], "__name__", ""))
        remedy = "write one layout for each parameter of the function, as in @kernel(m=PGA3.MOTOR, p=PGA3.POINT)"
        raise KernelError(where, "@kernel without the types of the parameters by name", remedy=remedy)

    if keeps_loops := parameters.get("loops") is True:
        del parameters["loops"]

    def declare(function: Callable[..., Any]) -> Kernel:
        where = _where(function, getattr(function, "__name__", "kernel"))
        names = _names_of_parameters(where, function)
        if names != list(parameters):
            raise KernelError(
                where,
                f"parameters ({', '.join(names)}) but types for ({', '.join(parameters)})",
                "the same names in the same order",
            )
        declared = tuple(Parameter(name, _type(where, name, given)) for name, given in parameters.items())
        seen: dict[str, str] = {}
        for parameter in declared:
            for component in () if parameter.has_rows else parameter.components:
                if component in seen:
                    raise KernelError(
                        where,
                        f"{parameter.name} and {seen[component]} both have an entry {component}",
                        remedy="rename one of them",
                    )
                seen[component] = parameter.name
        pinned = returns
        if isinstance(returns, tuple):
            pinned = tuple(_type(where, "returns", each) for each in returns)
        elif returns is not None:
            pinned = _type(where, "returns", returns)
        return Kernel(_name_of(function), function, declared, pinned, inspect.getdoc(function) or "", (), keeps_loops)

    return declare


_KINDS: dict[str, Callable[[Any], bool]] = {
    "a class": inspect.isclass,
    "an async function": inspect.iscoroutinefunction,
    "a function with yield": inspect.isgeneratorfunction,
    "an async function with yield": inspect.isasyncgenfunction,
}
"""Objects with a call that cannot be the body of a kernel."""


def _names_of_parameters(where: str, function: Callable[..., Any]) -> list[str]:
    """Return the names of the parameters of an ordinary function."""
    for kind, is_kind in _KINDS.items():
        if is_kind(function):
            raise KernelError(where, kind, "an ordinary function that returns expressions", "write def and return")
    parameters = inspect.signature(function).parameters.values()
    for each in parameters:
        if each.kind in (each.VAR_POSITIONAL, each.VAR_KEYWORD):
            raise KernelError(where, f"the parameter {each}", "named parameters", "use array(layout, n) for several")
    return [each.name for each in parameters]


def _name_of(function: Callable[..., Any]) -> str:
    """Return the name of a kernel's function, which the generated functions in C and Python will have."""
    name = getattr(function, "__name__", None)
    if not isinstance(name, str):
        raise KernelError("kernel", f"an object of type {type(function).__name__}", "a function with a name")
    if not name.isidentifier() or iskeyword(name):
        raise KernelError(
            _where(function, name), "not a valid function name", "letters, digits and _, and no keyword of Python",
            "define it with def, or set its __name__",
        )  # fmt: skip
    return name


def _where(function: Callable[..., Any], name: str) -> str:
    """Return the file and line of a function, for messages."""
    code = getattr(function, "__code__", None)
    return f"{code.co_filename}:{code.co_firstlineno}: kernel {name}" if code else f"kernel {name}"


def _type(where: str, name: str, given: Any) -> Type:
    if isinstance(given, (Layout, ArrayOf, RowsOf, IndexOf)):
        if isinstance(given, Layout) and given.algebra.has_symbolic_metric:
            raise KernelError(
                where, f"{name} is of {given.algebra.name}, whose metric has symbols", "a metric of numbers",
                "derive with gacompiler.symbolic, and convert scalars with to_kernel()",
            )  # fmt: skip
        return given
    if isinstance(given, tuple) and given and all(isinstance(each, Layout) for each in given):
        if len(set(given)) == 1:
            return ArrayOf(given[0], (len(given),))
        raise KernelError(
            where, f"{name} is a tuple of different layouts", "equal layouts", "make them separate parameters"
        )
    raise KernelError(
        where, f"{name} is declared as {given!r}", "a layout such as PGA3.MOTOR, SCALAR, or array(layout, n)"
    )


def trace(definition: Kernel) -> Trace:
    """Call the function of a kernel without loops on symbols.

    Raises
    ------
    GacError
        If the function raises an error, or its results do not match `returns`.
    """
    if definition.has_loops:
        raise KernelError(definition.where, "it contains loops over arrays of any length", "a kernel without loops")
    with recorded_calls() as calls:
        value = _called(definition, [parameter.symbols() for parameter in definition.parameters])
    if value is None:
        raise KernelError(definition.where, "the function returns nothing", "an expression, or a tuple of them")
    pinned = definition.returns
    if isinstance(value, tuple) and not isinstance(pinned, ArrayOf):
        if not value:
            raise KernelError(definition.where, "the function returns an empty tuple", "at least one result")
        types: tuple[Type | None, ...] = pinned if isinstance(pinned, tuple) else (pinned,) * len(value)
        if len(types) != len(value):
            raise KernelError(definition.where, f"{len(value)} results", f"{len(types)} as specified by returns=")
        names = _result_names(definition, len(value))
        outputs = tuple(_output(definition, n, v, t) for n, v, t in zip(names, value, types, strict=True))
    elif isinstance(pinned, tuple):
        raise KernelError(definition.where, "one result", f"a tuple of {len(pinned)} as specified by returns=")
    else:
        outputs = (_output(definition, "out", value, pinned),)
    _check_inputs(definition, outputs)
    return Trace(definition, outputs, tuple(calls))


def _called(definition: Kernel, symbols: list[Any]) -> Any:
    """Call the author's function on symbols, and add the place to any error that it raises.

    Raises
    ------
    GacError
        The error that the function raises; a `KernelError` in place of any other exception.
    """
    token = IN_FUNCTION.set(not definition.has_loops)
    try:
        return definition.function(*symbols)
    except GacError as error:
        place = definition.place_of(error)
        if not place or place in str(error):
            raise
        raise error.at(place)  # noqa: B904
    except RecursionError as error:
        remedy = "use fold, scan or iterate for repetition, which a kernel cannot express by calling itself"
        raise KernelError(definition.where, "calls itself without an end", remedy=remedy) from error
    except Exception as error:  # whatever the author's code may raise
        found = f"{type(error).__name__}: {error}"
        remedy = _OF_EXPRESSIONS if "Expression" in found else ""
        raise KernelError(definition.place_of(error) or definition.where, found, remedy=remedy) from error
    finally:
        IN_FUNCTION.reset(token)


_OF_EXPRESSIONS = (
    "an expression has no value before the kernel runs: use its operators and methods, and the functions of gacompiler "
    "in place of those of Python, math and numpy"
)


def _result_names(definition: Kernel, n: int) -> list[str]:
    """Return the names of several results: the given ones, with a suffix where an argument has the same name."""
    taken = {parameter.name for parameter in definition.parameters}
    given = definition.result_names
    return [f"{name}_out" if name in taken else name for name in given] if given else [f"out_{k}" for k in range(n)]


def _output(definition: Kernel, name: str, value: Any, pinned: Type | None) -> Output:
    if isinstance(pinned, ArrayOf):
        flat = _flatten(definition, name, value, pinned.shape)
        return Output(name, pinned.shape, tuple(_lifted(definition, each) for each in flat), pinned.layout)
    if isinstance(pinned, (RowsOf, IndexOf)):
        raise KernelError(definition.where, f"{name} is an array over named lengths", "a parameter with such a length")
    if isinstance(value, (tuple, list)):
        raise KernelError(definition.where, f"{name} is a nested tuple", remedy="declare returns=array(layout, n, ...)")
    return Output(name, (), (_lifted(definition, value),), pinned)


def _lifted(definition: Kernel, value: Any) -> Expression:
    try:
        return lift(value)
    except GacError as error:
        raise error.at(f"{definition.where}: result")  # noqa: B904


def _flatten(definition: Kernel, name: str, value: Any, shape: tuple[int, ...]) -> list[Any]:
    if not shape:
        return [value]
    if not isinstance(value, (tuple, list)) or len(value) != shape[0]:
        found = f"a sequence of {len(value)}" if isinstance(value, (tuple, list)) else type(value).__name__
        raise KernelError(definition.where, f"{name} is {found}", f"{shape[0]} entries as specified by returns=")
    return [entry for each in value for entry in _flatten(definition, name, each, shape[1:])]


def _check_inputs(definition: Kernel, outputs: tuple[Output, ...]) -> None:
    """Raise an error for inputs that belong to another kernel, which would be undefined here."""
    own: Mapping[str, str] = {c: p.name for p in definition.parameters for c in p.components}
    todo = [expression for output in outputs for expression in output.expressions]
    seen: set[Expression] = set()
    while todo:
        expression = todo.pop()
        if expression in seen:
            continue
        seen.add(expression)
        if expression.operation is Operation.INPUT and any(c not in own for c in expression.data.components):
            raise KernelError(
                definition.where, f"uses {expression.data.name}, an input of another kernel", "its own parameters"
            )
        todo.extend(expression.arguments)
