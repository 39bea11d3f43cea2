"""Multivector expressions: the values that a kernel's function returns when it is called on symbols.

An expression is a node with an operation, arguments and an algebra. Products, sandwiches and duals are kept as nodes
and are not expanded into coefficients. `evaluate` computes the value of an expression over any ring with the operations
of the algebra layer. Nodes, their evaluation and their text are in one file because each uses the others.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from fractions import Fraction
from functools import lru_cache
from typing import Any
from weakref import WeakValueDictionary

from ..algebra.algebra import Algebra
from ..algebra.coefficients import as_exact, scalar_function
from ..algebra.immutable import Immutable
from ..algebra.layout import SCALARS, Layout
from ..algebra.meanings import ARITHMETIC, MEANINGS, arithmetic
from ..algebra.methods import WithCoefficients
from ..algebra.multivector import Multivector, integer_power
from ..algebra.operations import Kind, Operation
from ..errors import KernelError, shortened
from ..ir.scalar import Graph
from .latex import latex_of
from .operands import is_operand, own_operations, without_values
from .rows import Array

LONGEST, BRIEF = 10_000, 300
"""Maximum number of characters of the text of an expression, and of its representation and in messages."""
IN_FUNCTION: ContextVar[bool] = ContextVar("in_function", default=False)
"""Whether the function of a kernel without loops is being called on symbols."""


@contextmanager
def outside_functions() -> Iterator[None]:
    """Compile another kernel while the function of a kernel is being called."""
    token = IN_FUNCTION.set(False)
    try:
        yield
    finally:
        IN_FUNCTION.reset(token)


class Expression(Immutable, WithCoefficients):
    """A symbolic multivector expression, a node of an immutable graph.

    Attributes
    ----------
    operation : Operation
    arguments : tuple of Expression
    data : object
        Additional data of the operation: the `Input` of an input, the `Multivector` of a constant, grades, or a blade.
    algebra : Algebra
        The algebra of the result.
    """

    __slots__ = ("__weakref__", "_blades", "algebra", "arguments", "data", "operation")

    _takes_over_multivector = True
    __array_ufunc__ = None  # so that a numpy number as the left operand defers to the expression
    operation: Operation
    arguments: tuple[Expression, ...]
    data: Any
    algebra: Algebra
    _blades: frozenset[int] | None

    def __new__(
        cls, operation: Operation, arguments: tuple[Expression, ...], data: Any, algebra: Algebra
    ) -> Expression:
        """Return the unique node with this content: equal expressions are the same object."""
        content = data
        if data is not None:
            content = data.key if isinstance(data, Input) else data
            if isinstance(data, Multivector):
                content = tuple(sorted(data.terms.items()))
        key = (operation, tuple(map(id, arguments)), content, algebra)
        known = _NODES.get(key)
        if known is None:
            known = _NODES[key] = super().__new__(cls)
            known.operation, known.arguments, known.data, known.algebra = operation, arguments, data, algebra
            known._blades = None
        return known

    @property
    def blades(self) -> frozenset[int]:
        """Bitmaps of the blades that can occur in this expression, determined from its structure."""
        if self._blades is None:
            self._blades = _possible_blades(self)
        return self._blades

    @property
    def is_scalar(self) -> bool:
        """Whether only the scalar part can occur."""
        return self.algebra is SCALARS or self.blades <= {0}

    def grade(self, *grades: int) -> Expression:
        """Return the part of the given grades."""
        return Expression(Operation.GRADE, (self,), grades, self.algebra)

    def __getitem__(self, blade: str) -> Expression:
        """Return the coefficient of a blade, given in any spelling, as a scalar."""
        if not isinstance(blade, str):
            raise KernelError("a coefficient in a kernel", f"{self}[{blade}]", "the name of a blade", 'write x["e12"]')
        return Expression(Operation.COEFFICIENT, (self,), self.algebra.blade(blade), SCALARS)

    def coefficient_at(self, bitmap: int) -> Expression:
        """Return the coefficient of a blade, given by its bitmap, as a scalar."""
        return Expression(Operation.COEFFICIENT, (self,), (1, bitmap), SCALARS)

    def __add__(self, other: Any) -> Expression:
        return node(Operation.ADD, self, other)

    def __radd__(self, other: Any) -> Expression:
        return node(Operation.ADD, other, self)

    def __sub__(self, other: Any) -> Expression:
        return node(Operation.SUBTRACT, self, other)

    def __rsub__(self, other: Any) -> Expression:
        return node(Operation.SUBTRACT, other, self)

    def __mul__(self, other: Any) -> Expression:
        return node(Operation.GEOMETRIC_PRODUCT, self, other)

    def __rmul__(self, other: Any) -> Expression:
        return node(Operation.GEOMETRIC_PRODUCT, other, self)

    def __xor__(self, other: Any) -> Expression:
        return node(Operation.OUTER_PRODUCT, self, other)

    def __rxor__(self, other: Any) -> Expression:
        return node(Operation.OUTER_PRODUCT, other, self)

    def __and__(self, other: Any) -> Expression:
        return node(Operation.REGRESSIVE_PRODUCT, self, other)

    def __rand__(self, other: Any) -> Expression:
        return node(Operation.REGRESSIVE_PRODUCT, other, self)

    def __truediv__(self, other: Any) -> Expression:
        return _quotient(self, lift(other))

    def __rtruediv__(self, other: Any) -> Expression:
        return _quotient(lift(other), self)

    def __pow__(self, exponent: Any) -> Expression:
        """Return a product of equal factors, a power of the inverse, or `power` for any other exponent."""
        return integer_power(self, exponent, lift(1))  # type: ignore[no-any-return]

    def __neg__(self) -> Expression:
        return node(Operation.NEGATE, self)

    def __pos__(self) -> Expression:
        return self

    def __invert__(self) -> Expression:
        return node(Operation.REVERSE, self)

    def __abs__(self) -> Any:
        return node(Operation.ABS, self) if self.is_scalar else self.norm()

    def __lt__(self, other: Any) -> Expression:
        return node(Operation.LESS, self, other)

    def __le__(self, other: Any) -> Expression:
        return node(Operation.LESS_EQUAL, self, other)

    def __gt__(self, other: Any) -> Expression:
        return node(Operation.LESS, other, self)

    def __ge__(self, other: Any) -> Expression:
        return node(Operation.LESS_EQUAL, other, self)

    def __eq__(self, other: object) -> bool:
        """Return whether both are the same expression.

        In the function of a kernel, other expressions may have equal values, so that the comparison is an error.
        """
        compares_values = IN_FUNCTION.get() if isinstance(other, Expression) else is_operand(other)
        if self is not other and compares_values:
            raise KernelError("a kernel", shortened(f"{self} == {other}", BRIEF), remedy="use equal(a, b)")
        return self is other

    __hash__ = object.__hash__

    def __setitem__(self, blade: str, value: Any) -> None:
        raise KernelError("a kernel", "an expression cannot be changed", remedy="use assemble(algebra, {'e12': ...})")

    def __float__(self) -> float:
        raise KernelError(
            "a kernel",
            f"float({shortened(str(self), BRIEF)}), whose value is known only when the kernel runs",
            remedy="use functions of gacompiler such as sin(x) instead of those of math and numpy",
        )

    __int__ = __index__ = __round__ = __complex__ = __float__

    def __bool__(self) -> bool:
        raise KernelError(
            "a kernel",
            "an expression has no truth value, since its value is known only when the kernel runs",
            remedy="use select(condition, a, b) instead of if, and, or; minimum(a, b) and maximum(a, b) of min and max",
        )

    def __iter__(self) -> Iterator[Any]:
        raise KernelError("a kernel", "an expression cannot be iterated", remedy='use a coefficient, x["e12"]')

    def __reduce__(self) -> tuple[Any, ...]:
        """Reduce to rows that refer to each other by index, because deep expressions exceed the recursion limit."""
        order = topological([self])
        places = {each: k for k, each in enumerate(order)}
        rows = [(each.operation, [places[a] for a in each.arguments], each.data, each.algebra) for each in order]
        return _restored, (rows,)

    def __str__(self) -> str:
        return text_of(self)

    def __repr__(self) -> str:
        return f"Expression({text_of(self, BRIEF)})"

    def _repr_latex_(self) -> str:
        return f"${latex_of(self)}$"


class Input:
    """The origin of an input: the kernel's argument, its layout, and the names of its coefficients."""

    __slots__ = ("components", "layout", "name")

    def __init__(self, name: str, layout: Layout, components: tuple[str, ...]) -> None:
        self.name, self.layout, self.components = name, layout, components

    @property
    def key(self) -> tuple[Any, ...]:
        """Key that is equal for equal inputs."""
        return self.name, self.components, id(self.layout)


_NODES: WeakValueDictionary[tuple[Any, ...], Expression] = WeakValueDictionary()
"""All expressions that are alive, by content. Keys contain ids of objects that the node keeps alive."""


def lift(value: Any) -> Expression:
    """Return `value` as an expression; numbers and multivectors become constants."""
    if isinstance(value, Expression):
        return value
    if type(value) in _NUMBERS:
        return _number(value)
    if isinstance(value, Multivector):
        return Expression(Operation.CONSTANT, (), value.map(as_exact), value.algebra)
    if isinstance(value, Array):
        value.refuse()
    (value,) = without_values("a constant in a kernel", (value,))
    if own_operations((value,)) is not None and not isinstance(value, float):
        return lift(_constant_of(value))
    return _number.__wrapped__(value)


_NUMBERS = frozenset({int, float, Fraction})


@lru_cache(maxsize=1000, typed=True)
def _number(value: Any) -> Expression:
    """Return a number as an expression. Kernels of matrices use the same ones in many thousands of operations."""
    number = Graph().lift(value).value
    return Expression(Operation.CONSTANT, (), SCALARS.scalar(_int_if_whole(number)), SCALARS)


def _constant_of(value: Any) -> Multivector:
    """Return a single numeric object as a multivector over the rationals, by the decimal form of its coefficients."""
    if value.shape:
        raise KernelError(
            "a constant in a kernel", f"an array of shape {value.shape}", "a single object", "make it a parameter"
        )
    element: Multivector = value.layout.element([as_exact(x) for x in value.values.tolist()])
    return element


def _int_if_whole(number: Any) -> Any:
    return number.numerator if number.denominator == 1 else number


def _quotient(a: Expression, b: Expression) -> Expression:
    """Return the quotient by a scalar, or the product with the inverse."""
    if b.is_scalar:
        return node(Operation.DIVIDE, a, b)
    return node(Operation.GEOMETRIC_PRODUCT, a, node(Operation.INVERSE, b))


def node(operation: Operation, *arguments: Any) -> Expression:
    """Return the expression ``operation(arguments)``.

    Raises
    ------
    KernelError
        If the algebras of the arguments differ, or an argument that must be a scalar is not.
    """
    lifted = tuple([each if isinstance(each, Expression) else lift(each) for each in arguments])
    algebra = SCALARS
    if all([argument.algebra is SCALARS for argument in lifted]):
        return Expression(operation, lifted, None, SCALARS)
    for argument in lifted:
        if argument.algebra is not SCALARS and argument.algebra != algebra and argument.algebra != SCALARS:
            if algebra != SCALARS:
                raise KernelError(
                    operation,
                    f"arguments of {algebra.name} and {argument.algebra.name}",
                    "one algebra",
                    'convert coefficients one by one: assemble(algebra, {"e1": x["e1"]})',
                )
            algebra = argument.algebra
    is_scalar = operation.row.kind is Kind.SCALAR
    needs_scalars = lifted if is_scalar else lifted[1:] if operation is Operation.DIVIDE else ()
    for argument in needs_scalars:
        if not argument.is_scalar:
            names = " ".join(argument.algebra.spelling(blade)[1] for blade in sorted(argument.blades))
            raise KernelError(
                operation,
                f"{text_of(argument, BRIEF)}, which can have blades {names}",
                "a scalar",
                "use norm() or a coefficient, as in x.e12",
            )
    return Expression(operation, lifted, None, algebra)


def evaluate(
    expressions: Sequence[Expression],
    inputs: Mapping[str, Any],
    memory: dict[Expression, Multivector] | None = None,
    lift: Callable[[Any], Any] | None = None,
) -> list[Multivector]:
    """Evaluate expressions over the ring of the coefficients in `inputs` (component name -> coefficient).

    `memory` holds the known values of nodes, and receives the values that are computed. `lift` converts exact constants
    to the ring, so that functions of constants are evaluated there: some rings have no square root of 2.
    """
    memory = {} if memory is None else memory
    for expression in topological(expressions, memory):
        values = [memory[argument] for argument in expression.arguments]
        memory[expression] = apply_operation(expression, values, inputs, lift)
    return [memory[expression] for expression in expressions]


def topological(expressions: Sequence[Expression], known: Container[Expression] = ()) -> list[Expression]:
    """Return all nodes of `expressions` that are not `known`, in topological order: arguments first."""
    order: dict[Expression, None] = {}
    stack = list(reversed(expressions))
    while stack:
        expression = stack.pop()
        if expression in order or expression in known:
            continue
        arguments = expression.arguments
        missing = arguments and [each for each in arguments if each not in order and each not in known]
        if missing:
            stack.append(expression)
            stack += reversed(missing)
        else:
            order[expression] = None
    return list(order)


def apply_operation(
    expression: Expression,
    values: list[Multivector],
    inputs: Mapping[str, Any],
    lift: Callable[[Any], Any] | None = None,
) -> Multivector:
    """Evaluate one node, given the values of its arguments; see `evaluate`."""
    value = _apply(expression, values, inputs)
    return value.map(lift) if lift is not None and expression.operation in IS_EXACT else value


IS_EXACT = frozenset({Operation.INPUT, Operation.CONSTANT, Operation.EXP, Operation.COS})
"""Operations with exact results in a ring of inexact numbers: the exponential and the cosine of zero are 1."""


def _apply(expression: Expression, values: list[Multivector], inputs: Mapping[str, Any]) -> Multivector:
    if expression.algebra is SCALARS and expression.operation in ARITHMETIC:
        return arithmetic(expression.operation, values)
    match expression.operation:
        case Operation.INPUT:
            source: Input = expression.data
            return source.layout.element([inputs[name] for name in source.components])
        case Operation.CONSTANT:
            constant: Multivector = expression.data
            return constant
        case Operation.GRADE:
            return values[0].grade(*expression.data)
        case Operation.COEFFICIENT:
            sign, blade = expression.data
            coefficient = values[0].terms.get(blade, 0)
            return SCALARS.scalar(coefficient if sign > 0 else -coefficient)
        case Operation.ASSEMBLE:
            terms = {
                blade: value.scalar if sign > 0 else -value.scalar
                for (sign, blade), value in zip(expression.data, values, strict=True)
            }
            return Multivector(expression.algebra, terms)
        case operation:
            algebra = expression.algebra
            if algebra is SCALARS and operation.row.kind is Kind.SCALAR:
                return SCALARS.scalar(scalar_function(operation.value, *[value.terms.get(0, 0) for value in values]))
            return MEANINGS[operation](*(v if v.algebra is algebra else Multivector(algebra, v.terms) for v in values))


class _Something:
    """An unknown coefficient, an element of a ring in which no sum cancels."""

    is_zero = False

    def scalar_function(self, name: str, arguments: tuple[Any, ...]) -> _Something:
        return self

    def _same(self, other: Any = None) -> _Something:
        return self

    __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = __truediv__ = __rtruediv__ = _same
    __neg__ = _same


SOMETHING = _Something()
_OF_SCALARS = frozenset({0})


def _possible_blades(expression: Expression) -> frozenset[int]:
    if expression.operation is Operation.INPUT:
        support: frozenset[int] = expression.data.layout.support
        return support
    if expression.operation is Operation.CONSTANT:
        return frozenset(expression.data.terms)
    if expression.operation is Operation.INVERSE:
        (argument,) = expression.arguments
        return _powers(argument)
    if expression.algebra is SCALARS and expression.operation in ARITHMETIC:
        some = all if expression.operation is Operation.GEOMETRIC_PRODUCT else any
        return _OF_SCALARS if some(argument.blades for argument in expression.arguments) else frozenset()
    if expression.operation.row.kind is Kind.SCALAR and any(argument.blades for argument in expression.arguments):
        return _OF_SCALARS
    values = [Multivector(a.algebra, dict.fromkeys(a.blades, SOMETHING)) for a in expression.arguments]
    return frozenset(_apply(expression, values, {}).terms)


def _powers(argument: Expression) -> frozenset[int]:
    """Return the blades generated by those of the argument, which polynomials in it and its involutions can have."""
    found = set(argument.blades)
    while True:
        new = {
            c for a in found for b in argument.blades for c in argument.algebra.blade_product(a, b)
        } - found  # fmt: skip
        if not new:
            return frozenset(found)
        found |= new


def _restored(rows: list[tuple[Operation, list[int], Any, Algebra]]) -> Expression:
    made: list[Expression] = []
    for operation, arguments, data, algebra in rows:
        made.append(Expression(operation, tuple(made[k] for k in arguments), data, algebra))
    return made[-1]


def text_of(expression: Expression, longest: int = LONGEST) -> str:
    """Return the expression as Python source text. The text of each subexpression is shortened to `longest` characters,
    because shared subexpressions are repeated, which makes texts of deep expressions exponentially long."""
    texts: dict[Expression, str] = {}
    for each in topological([expression]):
        texts[each] = shortened(_text(each, [texts[argument] for argument in each.arguments]), longest)
    return texts[expression]


def _text(expression: Expression, inner: list[str]) -> str:
    match expression.operation:
        case Operation.INPUT:
            return str(expression.data.components[0] if expression.data.layout.is_scalar else expression.data.name)
        case Operation.CONSTANT:
            text = str(expression.data)
            return f"({text})" if " " in text else text
        case Operation.GRADE:
            return f"{inner[0]}.grade({', '.join(map(str, expression.data))})"
        case Operation.COEFFICIENT:
            sign, blade = expression.data
            return f"{'' if sign > 0 else '-'}{inner[0]}[{expression.arguments[0].algebra.spelling(blade)[1]}]"
        case operation if operation.row.operator and len(inner) == 1:
            return f"{operation.row.operator}{inner[0]}"
        case operation if operation.row.operator:
            return f"({inner[0]} {operation.row.operator} {inner[1]})"
        case operation:
            return f"{operation}({', '.join(inner)})"
