"""Scalar expressions: a closed set of operations and one type of node, shared by construction.

A `Graph` owns its nodes. The same operation on the same arguments returns the same node, so common subexpressions are
found during construction. Constructors simplify only by identities that hold in every ring (``x + 0``, ``x * 1``,
``-(-x)``). Constants are exact rationals.
"""

from __future__ import annotations

from enum import Enum
from fractions import Fraction
from typing import Any

from ..algebra.coefficients import EXACT, as_exact, is_representable
from ..errors import InexactError, KernelError, ZeroDivisorError

Rational = int | Fraction


class Op(Enum):
    """The operations of the scalar language. The values are the names used throughout the package."""

    __hash__ = object.__hash__  # That of Enum is a function in Python, and every node of a graph is looked up by it.

    CONSTANT = "constant"
    VARIABLE = "variable"
    # ring
    ADD = "add"
    SUBTRACT = "subtract"
    MULTIPLY = "multiply"
    NEGATE = "negate"
    # field and functions
    DIVIDE = "divide"
    SQRT = "sqrt"
    SIN = "sin"
    COS = "cos"
    ATAN2 = "atan2"
    ACOS = "acos"
    EXP = "exp"
    LOG = "log"
    # Piecewise operations; comparisons return 1 or 0.
    ABS = "abs"
    FLOOR = "floor"
    MINIMUM = "minimum"
    MAXIMUM = "maximum"
    LESS = "less"
    LESS_EQUAL = "less_equal"
    EQUAL = "equal"
    SELECT = "select"

    # Members are unique objects. The hash of an enumeration, a function in Python, is needed for every node of a graph.
    __hash__ = object.__hash__


LEAVES = (Op.CONSTANT, Op.VARIABLE)
COMMUTATIVE = (Op.ADD, Op.MULTIPLY, Op.EQUAL, Op.MINIMUM, Op.MAXIMUM)
RING = (Op.ADD, Op.SUBTRACT, Op.MULTIPLY, Op.NEGATE)
ARITY: dict[Op, int] = {
    Op.CONSTANT: 0, Op.VARIABLE: 0, Op.NEGATE: 1, Op.SQRT: 1, Op.SIN: 1, Op.COS: 1, Op.ACOS: 1, Op.EXP: 1, Op.LOG: 1,
    Op.ABS: 1, Op.FLOOR: 1, Op.ADD: 2, Op.SUBTRACT: 2, Op.MULTIPLY: 2, Op.DIVIDE: 2, Op.ATAN2: 2, Op.MINIMUM: 2,
    Op.MAXIMUM: 2, Op.LESS: 2, Op.LESS_EQUAL: 2, Op.EQUAL: 2, Op.SELECT: 3,
}  # fmt: skip


_set = object.__setattr__


class Scalar:
    """An immutable node of a `Graph`. Equal nodes are identical."""

    __slots__ = ("arguments", "graph", "index", "op", "value")

    graph: Graph
    op: Op
    arguments: tuple[Scalar, ...]
    value: Rational | str
    index: int

    def __init__(self, graph: Graph, op: Op, arguments: tuple[Scalar, ...], value: Rational | str, index: int) -> None:
        _set(self, "graph", graph)
        _set(self, "op", op)
        _set(self, "arguments", arguments)
        _set(self, "value", value)
        _set(self, "index", index)

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"a Scalar is immutable; cannot set {name}")

    @property
    def is_constant(self) -> bool:
        """Whether this node is an exact number."""
        return self.op is Op.CONSTANT

    @property
    def is_zero(self) -> bool:
        """Whether this node is the number 0."""
        return self.op is Op.CONSTANT and self.value == 0

    def scalar_function(self, name: str, arguments: tuple[Any, ...]) -> Scalar:
        """Apply a named function; `gacompiler.algebra.coefficients.scalar_function` calls this method."""
        return self.graph.apply(Op(name), *arguments)

    def __add__(self, other: Any) -> Scalar:
        return self.graph.binary(Op.ADD, self, other)

    def __radd__(self, other: Any) -> Scalar:
        return self.graph.binary(Op.ADD, other, self)

    def __sub__(self, other: Any) -> Scalar:
        return self.graph.binary(Op.SUBTRACT, self, other)

    def __rsub__(self, other: Any) -> Scalar:
        return self.graph.binary(Op.SUBTRACT, other, self)

    def __mul__(self, other: Any) -> Scalar:
        return self.graph.binary(Op.MULTIPLY, self, other)

    def __rmul__(self, other: Any) -> Scalar:
        return self.graph.binary(Op.MULTIPLY, other, self)

    def __truediv__(self, other: Any) -> Scalar:
        return self.graph.binary(Op.DIVIDE, self, other)

    def __rtruediv__(self, other: Any) -> Scalar:
        return self.graph.binary(Op.DIVIDE, other, self)

    def __neg__(self) -> Scalar:
        return self.graph.apply(Op.NEGATE, self)

    def __repr__(self) -> str:
        if self.op in LEAVES:
            return str(self.value)
        return f"{self.op.value}({', '.join(map(repr, self.arguments))})"


class Graph:
    """The nodes of one kernel, numbered in the order of creation, so that numbering is deterministic."""

    def __init__(self) -> None:
        self._nodes: dict[tuple[Any, ...], Scalar] = {}

    def constant(self, value: Rational) -> Scalar:
        """Return the node of an exact number.

        Raises
        ------
        KernelError
            When the number exceeds the range of double precision.
        """
        known = self._nodes.get((Op.CONSTANT, value))
        if known is not None:
            return known
        if not is_representable(value):
            raise KernelError(
                "constant in a kernel", "a number outside the range of double precision", "numbers up to 1.8e308"
            )
        return self._node(Op.CONSTANT, (), Fraction(value))

    def variable(self, name: str) -> Scalar:
        """Return the node of an input, or of a name that the program defines elsewhere."""
        return self._node(Op.VARIABLE, (), name)

    def lift(self, value: Any) -> Scalar:
        """Return `value` as a node of this graph. A float becomes the fraction equal to its shortest decimal form."""
        if isinstance(value, Scalar):
            if value.graph is not self:
                raise KernelError("scalar expression", "nodes of two graphs", "nodes of one graph")
            return value
        value = as_exact(value)
        if isinstance(value, (int, Fraction)) and not isinstance(value, bool):
            return self.constant(value)
        raise KernelError(
            "constant in a kernel",
            f"{value!r} of type {type(value).__name__}",
            "an exact number: int, Fraction, or float (used as its decimal form)",
            "write a comparison as equal(a, b) or a < b",
        )

    def binary(self, op: Op, a: Any, b: Any) -> Scalar:
        """Apply an operator, or return NotImplemented for operands of other types, which may implement it."""
        if type(a) is Scalar and type(b) is Scalar and a.graph is b.graph and _is_never_folded(a, b):
            return self._pair(op, a, b)
        if isinstance(a, _OPERANDS) and isinstance(b, _OPERANDS):
            return self.apply(op, a, b)
        return NotImplemented  # type: ignore[no-any-return]

    def apply(self, op: Op, *arguments: Any) -> Scalar:
        """Return the node ``op(arguments)``, folded if this is exact."""
        lift = self.lift
        nodes = tuple([a if type(a) is Scalar and a.graph is self else lift(a) for a in arguments])
        folded = _fold(self, op, nodes)
        if folded is not None:
            return folded
        return self._pair(op, *nodes) if len(nodes) == 2 else self._node(op, nodes, "")

    def negative(self, node: Scalar) -> Scalar:
        """Return the negation of a node, also of a difference, which `apply` replaces by the opposite difference."""
        return self._node(Op.NEGATE, (node,), "")

    def _pair(self, op: Op, a: Scalar, b: Scalar) -> Scalar:
        """Return the node of an operation on two nodes, in the order of their indices if it is commutative."""
        i, j = a.index, b.index
        if i > j and op in COMMUTATIVE:
            a, b, i, j = b, a, j, i
        key = (op, "", i, j)
        node = self._nodes.get(key)
        if node is None:
            node = self._nodes[key] = Scalar(self, op, (a, b), "", len(self._nodes))
        return node

    def _node(self, op: Op, arguments: tuple[Scalar, ...], value: Rational | str) -> Scalar:
        key = (op, value, *[argument.index for argument in arguments])
        node = self._nodes.get(key)
        if node is None:
            node = self._nodes[key] = Scalar(self, op, arguments, value, len(self._nodes))
        return node


_OPERANDS = (Scalar, int, float, Fraction)
_FOLDED = (Op.CONSTANT, Op.NEGATE)
"""Operands without which no operation on two different nodes is folded."""


def _is_never_folded(a: Scalar, b: Scalar) -> bool:
    """Return whether no operation on two nodes is folded."""
    return a is not b and a.op not in _FOLDED and b.op not in _FOLDED


def _fold(graph: Graph, op: Op, nodes: tuple[Scalar, ...]) -> Scalar | None:
    """Return a simpler node that equals ``op(nodes)`` in every ring, or None."""
    if len(nodes) == 2 and _is_never_folded(*nodes):
        return None  # most nodes
    match op:
        case Op.ADD:
            return _fold_add(graph, *nodes)
        case Op.SUBTRACT:
            return _fold_subtract(graph, *nodes)
        case Op.MULTIPLY:
            return _fold_multiply(graph, *nodes)
        case Op.NEGATE:
            return _fold_negate(graph, *nodes)
        case Op.DIVIDE:
            return _fold_divide(graph, *nodes)
        case Op.SELECT:
            return _fold_select(*nodes)
        case _:
            return _fold_function(graph, op, nodes)


def _number(node: Scalar) -> Fraction | None:
    return node.value if node.op is Op.CONSTANT else None  # type: ignore[return-value]


def _fold_add(graph: Graph, a: Scalar, b: Scalar) -> Scalar | None:
    x, y = _number(a), _number(b)
    if x is not None and y is not None:
        return graph.constant(x + y)
    if x == 0:
        return b
    if y == 0:
        return a
    if b.op is Op.NEGATE:
        return graph.apply(Op.SUBTRACT, a, b.arguments[0])
    if a.op is Op.NEGATE:
        return graph.apply(Op.SUBTRACT, b, a.arguments[0])
    return None


def _fold_subtract(graph: Graph, a: Scalar, b: Scalar) -> Scalar | None:
    x, y = _number(a), _number(b)
    if x is not None and y is not None:
        return graph.constant(x - y)
    if a is b:
        return graph.constant(0)
    if y == 0:
        return a
    if x == 0:
        return graph.apply(Op.NEGATE, b)
    if b.op is Op.NEGATE:
        return graph.apply(Op.ADD, a, b.arguments[0])
    if a.op is Op.NEGATE:
        return graph.apply(Op.NEGATE, graph.apply(Op.ADD, a.arguments[0], b))
    return None


def _fold_multiply(graph: Graph, a: Scalar, b: Scalar) -> Scalar | None:
    x, y = _number(a), _number(b)
    if x is not None and y is not None:
        return graph.constant(x * y)
    if y is not None:
        a, b, x, y = b, a, y, x
    if x == 0:
        return a
    if x == 1:
        return b
    if x == -1:
        return graph.apply(Op.NEGATE, b)
    if a.op is Op.NEGATE:
        return graph.apply(Op.NEGATE, graph.apply(Op.MULTIPLY, a.arguments[0], b))
    if b.op is Op.NEGATE:
        return graph.apply(Op.NEGATE, graph.apply(Op.MULTIPLY, a, b.arguments[0]))
    if x is not None and x < 0:
        return graph.apply(Op.NEGATE, graph.apply(Op.MULTIPLY, graph.constant(-x), b))
    if x is not None and b.op is Op.MULTIPLY:
        for factor, other in (b.arguments, b.arguments[::-1]):
            y = _number(factor)
            if y is not None:
                return graph.apply(Op.MULTIPLY, graph.constant(x * y), other)
    return None


def _fold_negate(graph: Graph, a: Scalar) -> Scalar | None:
    x = _number(a)
    if x is not None:
        return graph.constant(-x)
    if a.op is Op.NEGATE:
        return a.arguments[0]
    if a.op is Op.SUBTRACT:
        return graph.apply(Op.SUBTRACT, a.arguments[1], a.arguments[0])
    return None


def _fold_divide(graph: Graph, a: Scalar, b: Scalar) -> Scalar | None:
    x, y = _number(a), _number(b)
    if y == 0:
        raise ZeroDivisorError("division", "the divisor is identically zero", "a divisor that can differ from zero")
    if y is not None:
        return graph.apply(Op.MULTIPLY, a, graph.constant(1 / y))
    if x == 0:
        return a
    if a.op is Op.NEGATE:
        return graph.apply(Op.NEGATE, graph.apply(Op.DIVIDE, a.arguments[0], b))
    return None


def _fold_select(condition: Scalar, a: Scalar, b: Scalar) -> Scalar | None:
    x = _number(condition)
    if x is not None:
        return a if x else b
    return a if a is b else None


def _fold_function(graph: Graph, op: Op, nodes: tuple[Scalar, ...]) -> Scalar | None:
    """Fold a function of constants if its value is rational (``sqrt(4)``, ``cos(0)``)."""
    numbers = [_number(node) for node in nodes]
    if any(number is None for number in numbers):
        return None
    try:
        return graph.constant(EXACT[op.value](*numbers))
    except InexactError:
        return None
