"""Conversion of sympy formulas to kernels, and of kernels to sympy formulas."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from keyword import iskeyword
from typing import Any

import sympy

from ..algebra.layout import SCALAR, SCALARS, Layout
from ..algebra.multivector import Multivector
from ..algebra.operations import Operation
from ..errors import KernelError
from ..frontend import operations as scalar
from ..frontend.expression import Expression, evaluate, lift, node
from ..frontend.kernel import Kernel, Parameter, trace
from ..rings.symbolic import Expanded
from .construct import symbols
from .multivector import SymbolicMultivector, symbolic
from .printing import latex


def to_kernel(
    formula: Any,
    *arguments: Any,
    name: str = "formula",
    returns: Layout | tuple[Layout, ...] | None = None,
    summary: str = "",
) -> Kernel:
    """Convert a derived formula to a kernel that `gacompiler.compile` accepts.

    Parameters
    ----------
    formula : SymbolicMultivector, sympy expression, matrix or array, or tuple of them
        The results. Multivectors that were derived by operations of the algebra are replayed as these operations.
        Multivectors whose coefficients were changed individually are used in their current form. In both cases the
        compiler searches for cheaper forms, modulo the relations of the arguments. Matrices and arrays of sympy, such
        as those of a `Chart`, become their entries, row by row. A multivector whose metric has symbols becomes the
        coefficients of all blades of its grades, in the order of `Algebra.blades`.
    *arguments : SymbolicMultivector or Symbol
        The arguments of the kernel, in order: multivectors made by `symbols`, and scalar symbols.
    name : str
    returns : Layout or tuple of Layout, optional
        The layouts of the results. By default they are inferred.
    summary : str
        The docstring of the compiled function.

    Raises
    ------
    KernelError
        When a symbol of the formula belongs to no argument, or a function has no counterpart in kernels.

    Examples
    --------
    ``move = gacompiler.compile(to_kernel(m * p * ~m, m, p, name="move"))``
    """
    given = tuple(formula) if isinstance(formula, (tuple, list)) else (formula,)
    results = tuple(value for result in given for value in _results_of(result))
    many = isinstance(formula, (tuple, list)) or len(results) > 1
    _check_name("to_kernel()", name)
    parameters = tuple(_parameter(name, argument) for argument in arguments)
    _check_components(name, parameters)
    known = _component_symbols(arguments)
    needed = {symbol for result in results for symbol in _free_symbols(result)}
    missing = sorted(str(symbol) for symbol in needed if symbol not in known)
    if missing:
        raise KernelError(
            f"to_kernel({name})",
            f"the formula contains {' '.join(missing)}, which no argument contains",
            "every symbol of the formula in one of the arguments",
            "add the missing symbols or their multivectors to the arguments, or substitute values with subs()",
        )

    def function(*inputs: Expression) -> Any:
        values: dict[Any, Expression] = {}
        whole: dict[str, Expression] = {}
        for argument, value in zip(arguments, inputs, strict=True):
            values |= _entries(argument, value)
            if isinstance(argument, SymbolicMultivector):
                whole[str(argument.name)] = value
        replay = _Replay(values, whole)
        made = tuple(map(replay.expression, results))
        return made if many else made[0]

    function.__name__ = name
    return Kernel(name, function, parameters, returns, summary)


def _results_of(result: Any) -> list[Any]:
    """Return what a kernel returns of a result: itself, or scalars where it has no layout."""
    if isinstance(result, Multivector):
        made = symbolic(result)
        names = (made.algebra.spelling(blade)[1] for blade in made.algebra.blades(*made.grades))
        return [made[name] for name in names] if made.grades and made.algebra.has_symbolic_metric else [made]
    if isinstance(result, (sympy.MatrixBase, sympy.NDimArray)):
        return list(sympy.flatten(result.tolist()))
    return [result]


def _parameter(where: str, argument: Any) -> Parameter:
    if isinstance(argument, SymbolicMultivector) and argument.layout is not None and argument.name is not None:
        _check_name(f"to_kernel({where})", argument.name)
        return Parameter(argument.name, argument.layout)
    if isinstance(argument, sympy.Symbol):
        _check_name(f"to_kernel({where})", argument.name)
        return Parameter(argument.name, SCALAR)
    raise KernelError(
        f"to_kernel({where})",
        f"argument {argument}",
        "multivectors made by symbols(), and scalar symbols",
        "create a named multivector with symbols() and substitute it into the formula",
    )


def _check_name(where: str, name: str) -> None:
    if not name.isidentifier() or iskeyword(name):
        raise KernelError(where, f"the name {name!r}", "a valid Python identifier that is not a keyword")


def _check_components(where: str, parameters: Sequence[Parameter]) -> None:
    components = [component for parameter in parameters for component in parameter.components]
    twice = sorted({component for component in components if components.count(component) > 1})
    if twice:
        raise KernelError(f"to_kernel({where})", f"{twice[0]} in two arguments", "arguments that share no symbol")


def _component_symbols(arguments: Sequence[Any]) -> set[Any]:
    return {
        symbol
        for argument in arguments
        for symbol in ([argument] if isinstance(argument, sympy.Symbol) else _stored(argument).values())
    }


def _stored(argument: SymbolicMultivector) -> dict[str, Any]:
    assert argument.layout is not None
    return {blade: argument[blade] for blade in argument.layout.blades}


def _entries(argument: Any, value: Expression) -> dict[Any, Expression]:
    if isinstance(argument, sympy.Symbol):
        return {argument: value}
    return {symbol: value[blade] for blade, symbol in _stored(argument).items()}


def _free_symbols(result: Any) -> set[Any]:
    return result.free_symbols if isinstance(result, SymbolicMultivector) else set(sympy.sympify(result).free_symbols)


class _Replay:
    """Conversion of formulas to kernel expressions, using the operations of their derivation where these are known."""

    def __init__(self, values: Mapping[Any, Expression], whole: Mapping[str, Expression]) -> None:
        self._values, self._whole = values, whole
        self._known: dict[int, Any] = {}

    def expression(self, result: Any) -> Any:
        if not isinstance(result, SymbolicMultivector):
            return lift(_scalar(sympy.sympify(result), self._values))
        if id(result) not in self._known:
            self._known[id(result)] = self._made(result)
        return self._known[id(result)]

    def _made(self, result: SymbolicMultivector) -> Any:
        given = self._whole.get(str(result.name)) if result.layout is not None else None
        if given is not None and given.data.layout == result.layout:
            return given
        if result.history is not None:
            operation, operands = result.history
            if operation is Operation.GRADE:
                return self.expression(operands[0]).grade(*operands[1:])
            return node(operation, *map(self.expression, operands))
        named = {name: _scalar(value, self._values) for name, value in result.coefficients.items()}
        if set(named) <= {"1"}:
            return lift(named.get("1", 0))
        return scalar.assemble(result.algebra, named)


_FUNCTIONS: Mapping[Any, Callable[..., Any]] = {
    sympy.sin: scalar.sin,
    sympy.cos: scalar.cos,
    sympy.tan: lambda x: scalar.sin(x) / scalar.cos(x),
    sympy.exp: scalar.exp,
    sympy.log: scalar.log,
    sympy.acos: scalar.acos,
    sympy.asin: lambda x: scalar.atan2(x, scalar.sqrt(1 - x * x)),
    sympy.atan: lambda x: scalar.atan2(x, lift(1)),
    sympy.atan2: scalar.atan2,
    sympy.Abs: scalar.absolute,
    sympy.floor: scalar.floor,
    sympy.sinh: lambda x: (scalar.exp(x) - scalar.exp(-x)) / 2,
    sympy.cosh: lambda x: (scalar.exp(x) + scalar.exp(-x)) / 2,
    sympy.tanh: lambda x: 1 - 2 / (scalar.exp(2 * x) + 1),
    sympy.Min: lambda *x: reduce(scalar.minimum, x),
    sympy.Max: lambda *x: reduce(scalar.maximum, x),
    sympy.StrictLessThan: lambda a, b: a < b,
    sympy.LessThan: lambda a, b: a <= b,
    sympy.StrictGreaterThan: lambda a, b: a > b,
    sympy.GreaterThan: lambda a, b: a >= b,
    sympy.Equality: scalar.equal,
}


def _scalar(value: Any, values: Mapping[Any, Expression]) -> Any:
    """Convert a sympy expression to a kernel expression."""
    if value in values:
        return values[value]
    if value.is_Rational:
        return lift(Expanded.of(value).terms.get((), 0))
    if value is sympy.pi:
        return scalar.acos(lift(-1))
    if value is sympy.E:
        return scalar.exp(lift(1))
    if value.is_Add:
        return reduce(lambda a, b: a + b, (_scalar(part, values) for part in value.args))
    if value.is_Mul:
        return _product(value, values)
    if isinstance(value, sympy.Piecewise):
        return _choice(value, values)
    if value.is_Pow:
        return _power(value.base, value.exp, values)
    function = _FUNCTIONS.get(value.func)
    if function is None:
        remedy = (
            "use a Rational, for example from sympy.nsimplify" if value.is_Float else "rewrite it in these functions"
        )
        found, expected = f"{value} ({type(value).__name__})", "functions that kernels support: sin, sqrt, exp, ..."
        raise KernelError("to_kernel()", found, expected, remedy)
    return function(*(_scalar(argument, values) for argument in value.args))


def _product(value: Any, values: Mapping[Any, Expression]) -> Any:
    above, below = sympy.fraction(value)
    if below != 1:
        return _scalar(above, values) / _scalar(below, values)
    return reduce(lambda a, b: a * b, (_scalar(part, values) for part in value.args))


def _power(base: Any, exponent: Any, values: Mapping[Any, Expression]) -> Any:
    if exponent.is_Rational and exponent < 0:
        return lift(1) / _power(base, -exponent, values) if exponent != -1 else lift(1) / _scalar(base, values)
    if exponent.is_Integer:
        return _scalar(base, values) ** int(exponent)
    if exponent.is_Rational and exponent.q == 2:
        whole, root = int(exponent.p // 2), scalar.sqrt(_scalar(base, values))
        return root * _scalar(base, values) ** whole if whole else root
    return scalar.exp(_scalar(exponent, values) * scalar.log(_scalar(base, values)))


def _choice(value: Any, values: Mapping[Any, Expression]) -> Any:
    *cases, (last, condition) = value.args
    if condition != sympy.true:
        raise KernelError("to_kernel()", f"{value}", "a Piecewise that ends with (value, True)")
    result = _scalar(last, values)
    for each, case in reversed(cases):
        result = scalar.select(_scalar(case, values), _scalar(each, values), result)
    return result


def from_kernel(kernel: Kernel, **assumptions: Any) -> Any:
    """Return the results of a kernel as formulas, exactly as its author wrote them.

    The kernel is evaluated on ``symbols(name, layout)`` with the names and layouts of its declared arguments.

    Returns
    -------
    SymbolicMultivector, sympy expression, or tuple of them
    """
    traced = trace(_kernel("from_kernel()", kernel))
    inputs = {
        component: symbol
        for parameter in kernel.parameters
        for component, symbol in zip(parameter.components, _symbols_of(parameter, assumptions), strict=True)
    }
    lifted = {component: Expanded.of(symbol) for component, symbol in inputs.items()}
    values = [_symbolic(value) for value in evaluate(traced.expressions, lifted, lift=Expanded.of)]
    return values[0] if len(values) == 1 else tuple(values)


def _kernel(where: str, kernel: Any) -> Kernel:
    if not isinstance(kernel, Kernel):
        found, remedy = f"an object of type {type(kernel).__name__}", "convert a formula with to_kernel()"
        raise KernelError(where, found, "a kernel", remedy)
    return kernel


def _symbols_of(parameter: Parameter, assumptions: Mapping[str, Any]) -> list[Any]:
    return [symbols(component, **assumptions) for component in parameter.components]


def _symbolic(value: Multivector) -> Any:
    if value.algebra == SCALARS:
        return Expanded.of(value.scalar).expression
    return SymbolicMultivector(value.algebra, value.terms)


@dataclass(frozen=True)
class DerivedProgram:
    """The optimised program of a kernel as sympy expressions.

    Attributes
    ----------
    temporaries : tuple of (Symbol, sympy expression)
        The temporaries in order. Each expression contains the symbols of the arguments and earlier temporaries.
    results : tuple
        For each result a multivector in its layout, or a sympy expression.
    cost : str
        The operation counts.
    """

    temporaries: tuple[tuple[Any, Any], ...]
    results: tuple[Any, ...]
    cost: str

    def substituted(self) -> tuple[Any, ...]:
        """Return the results in terms of the arguments only."""
        values: dict[Any, Any] = {}
        for target, expression in self.temporaries:
            values[target] = expression.subs(values)
        return tuple(
            result.map(lambda c: c.subs(values)) if isinstance(result, SymbolicMultivector) else result.subs(values)
            for result in self.results
        )

    def __str__(self) -> str:
        lines = [f"{target} = {expression}" for target, expression in self.temporaries]
        return "\n".join([*lines, *map(str, self.results), self.cost])

    def __repr__(self) -> str:
        return str(self)

    def _repr_latex_(self) -> str:
        rows = [f"{latex(target)} &= {latex(expression)}" for target, expression in self.temporaries]
        for k, result in enumerate(self.results):
            name = r"\mathrm{out}" + (f"_{{{k}}}" if len(self.results) > 1 else "")
            whole = isinstance(result, SymbolicMultivector)
            rows.append(f"{name} &= {result._repr_latex_().strip('$') if whole else latex(result)}")
        return "\\begin{align*}\n" + " \\\\\n".join(rows) + "\n\\end{align*}"


def program_of(kernel: Kernel, **assumptions: Any) -> DerivedProgram:
    """Optimise a kernel and return its program, with its temporaries, as sympy expressions with a LaTeX form."""
    from ..ir.interpret import evaluate as meaning
    from ..passes.pipeline import compile_kernel

    record = compile_kernel(_kernel("program_of()", kernel))
    assert record.decision is not None and record.trace is not None
    known = {
        component: symbol
        for parameter in kernel.parameters
        for component, symbol in zip(parameter.components, _symbols_of(parameter, assumptions), strict=True)
    }

    def value(operand: Any) -> Any:
        return known[operand] if isinstance(operand, str) else sympy.Rational(operand.numerator, operand.denominator)

    temporaries = []
    for line in record.program.lines:
        known[line.target] = sympy.Symbol(line.target, real=True)
        temporaries.append((known[line.target], sympy.sympify(meaning(line.op, list(map(value, line.operands))))))
    results = tuple(
        element
        for output, layout, result in zip(
            record.trace.outputs, record.decision.layouts, record.program.results, strict=True
        )
        for element in _elements(layout, len(output.expressions), list(map(value, result.operands)))
    )
    return DerivedProgram(tuple(temporaries), results, str(record.cost))


def _elements(layout: Layout, n: int, flat: Sequence[Any]) -> list[Any]:
    if layout.is_scalar:
        return list(flat)
    return [
        SymbolicMultivector(layout.algebra, layout.element(flat[k * layout.size : (k + 1) * layout.size]).terms)
        for k in range(n)
    ]
