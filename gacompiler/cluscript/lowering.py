"""Lowering of the syntax tree to expressions: the meaning of a script's statements in its algebra, for any inputs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any, NamedTuple

from ..algebra.coefficients import is_representable
from ..algebra.layout import SCALARS
from ..algebra.multivector import Multivector
from ..algebra.operations import Operation
from ..errors import AlgebraError, GacError
from ..frontend.expression import Expression
from ..frontend.operations import apply
from .calls import Macros
from .dialects import Dialect
from .division import quotient, zero_divisors
from .functions import FUNCTIONS
from .syntax import (
    Argument,
    Assignment,
    Binary,
    Call,
    Colour,
    Declaration,
    Macro,
    Mark,
    Name,
    Node,
    NullSpace,
    Number,
    Statement,
    Unary,
)
from .tokens import Place, ScriptError
from .values import length

OPERATIONS = {
    "+": Operation.ADD, "-": Operation.SUBTRACT, "*": Operation.GEOMETRIC_PRODUCT, "^": Operation.OUTER_PRODUCT,
    ".": Operation.HESTENES_PRODUCT,
}  # fmt: skip


class Drawing(NamedTuple):
    """An object to be drawn: its name, its value, and the preceding settings."""

    name: str
    value: Any
    colour: tuple[Any, ...] | None
    null_space: str | None


@dataclass
class Meaning:
    """The results of a script.

    Attributes
    ----------
    values : dict
        Global variables, and outputs of macros by their external names.
    outputs : list of str
        Marked with ``?``, in order.
    drawings : list of Drawing
    inputs : dict of str to Place
        Free identifiers and the places of their first use.
    background : tuple, optional
    evaluated : list of str
        Marked with ``!``.
    """

    values: dict[str, Any] = field(default_factory=dict)
    outputs: list[str] = field(default_factory=list)
    drawings: list[Drawing] = field(default_factory=list)
    inputs: dict[str, Place] = field(default_factory=dict)
    background: tuple[Any, ...] | None = None
    evaluated: list[str] = field(default_factory=list)


@dataclass
class _Frame:
    """The scope of a macro that is being expanded."""

    macro: Macro
    arguments: Sequence[Any]
    locals: dict[str, Any] = field(default_factory=dict)
    read: dict[str, Place] = field(default_factory=dict)
    names: dict[str, str] = field(default_factory=dict)


class Lowering:
    """Evaluation of statements, once, on values of any kind.

    Parameters
    ----------
    script : str
        Name of the script in error messages.
    dialect : Dialect
    macros : mapping
        Macros of the script, which take precedence over those of the dialect.
    normalize_from : Place, optional
        Outputs assigned after this place are divided by their length.
    variable : callable
        Returns the value of an input by its name.
    assigned : set of str
        Names that the script assigns anywhere.
    """

    def __init__(
        self,
        script: str,
        dialect: Dialect,
        macros: Macros,
        normalize_from: Place | None,
        variable: Callable[[str], Any],
        assigned: frozenset[str],
    ) -> None:
        self._script, self._dialect, self._macros = script, dialect, macros
        self._normalize_from, self._variable, self._assigned = normalize_from, variable, assigned
        self._colour: tuple[Any, ...] | None = None
        self._null_space: str | None = None
        self._places: dict[str, Place] = {}
        self._counts: dict[str, int] = {}
        self._divisors: list[tuple[Expression, Place]] = []
        self.meaning = Meaning()

    def run(self, statements: Sequence[Statement]) -> Meaning:
        """Return the meaning of a script's statements."""
        for statement in statements:
            match statement:
                case Assignment():
                    self._assign(statement, None)
                case Colour():
                    components = tuple(self._value(each, None) for each in statement.components)
                    if statement.is_background:
                        self.meaning.background = components
                    else:
                        self._colour = components
                case NullSpace():
                    self._null_space = statement.name
                case Macro() | Declaration():
                    pass
        self._refuse_zero_divisors()
        return self.meaning

    def _fail(self, place: Place, found: str, expected: str = "", remedy: str = "") -> ScriptError:
        return ScriptError(self._script, place, found, expected, remedy)

    def _assign(self, statement: Assignment, frame: _Frame | None) -> None:
        target, name = statement.target, statement.target.text
        if statement.value is None:
            value = self._name(target, frame)
        else:
            self._may_be_assigned(target, frame)
            value = self._value(statement.value, frame)
            if self._is_read(name, frame) is not None:
                self._may_be_assigned(target, frame)
            after = self._normalize_from
            if statement.mark is Mark.OUTPUT and frame is None and after is not None and after < statement.place:
                value = self._guarded(statement.place, lambda: quotient(value, length(value)))
            if frame is None:
                self.meaning.values[name], self._places[name] = value, target.place
            else:
                frame.locals[name] = value
        outer = name if frame is None else self._name_outside(name, frame)
        if statement.mark is Mark.OUTPUT:
            self.meaning.values.setdefault(outer, value)
            if outer not in self.meaning.outputs:
                self.meaning.outputs.append(outer)
        elif statement.mark is Mark.DRAW:
            self.meaning.drawings.append(Drawing(outer, value, self._colour, self._null_space))
        elif statement.mark is Mark.EVALUATE:
            self.meaning.evaluated.append(outer)

    def _name_outside(self, name: str, frame: _Frame) -> str:
        """Return the external name of a macro's local variable: ``macro_Motor_t``, ``macro_Motor_t1``, ..."""
        if name not in frame.names:
            stem = f"macro_{frame.macro.name}_{name}"
            count = self._counts[stem] = self._counts.get(stem, -1) + 1
            frame.names[name] = f"{stem}{count or ''}"
        return frame.names[name]

    def _is_read(self, name: str, frame: _Frame | None) -> Place | None:
        """Return the place at which a name was read before it was assigned."""
        return frame.read.get(name) if frame is not None else self.meaning.inputs.get(name)

    def _may_be_assigned(self, target: Name, frame: _Frame | None) -> None:
        name = target.text
        if name in self._dialect.algebra.vectors:
            what = f"{name} is a basis vector of {self._dialect.algebra.name}"
            raise self._fail(target.place, what, "another name")
        if frame is not None and target.is_global:
            raise self._fail(target.place, f"::{name} assigned in a macro", "variables of its own")
        known = frame.locals if frame is not None else self.meaning.values
        if name in known:
            first = self._places.get(name)
            where = f" in line {first.line}" if frame is None and first else ""
            raise self._fail(
                target.place, f"{name} was already assigned{where}", "a new name", "variables cannot be reassigned"
            )
        place = self._is_read(name, frame)
        if place is not None:
            found = f"{name} was read in line {place.line}, before it was assigned"
            raise self._fail(target.place, found, "a new name")

    def _guarded(self, place: Place, function: Callable[[], Any]) -> Any:
        """Return a value, adding the place in the script to errors."""
        try:
            value = function()
            self._refuse_large(value, place)
            return value
        except ScriptError:
            raise
        except GacError as error:
            raise self._fail(place, error.found, error.expected, error.remedy) from error
        except ZeroDivisionError as error:
            raise self._fail(place, "a division by zero", "a divisor other than zero") from error

    def _refuse_large(self, value: Any, place: Place) -> None:
        """Refuse exact numbers beyond the range of doubles, since they grow with every product."""
        numbers = value.terms.values() if isinstance(value, Multivector) else (value,)
        if any(isinstance(each, (int, Fraction)) and not is_representable(each) for each in numbers):
            raise self._fail(place, "a number out of the range of doubles", "numbers up to 1.8e308")

    def _value(self, node: Node, frame: _Frame | None) -> Any:
        match node:
            case Number():
                return node.value
            case Name():
                return self._name(node, frame)
            case Argument():
                assert frame is not None
                return frame.arguments[node.index - 1]
            case Unary():
                operand = self._value(node.operand, frame)
                if node.operator == "*":
                    return self._call("Dual", (operand,), node.place)
                return self._guarded(
                    node.place, lambda: apply(Operation.NEGATE if node.operator == "-" else Operation.REVERSE, operand)
                )
            case Binary():
                return self._binary(node, frame)
            case Call():
                if node.name.lower() == "coefficient" and ("coefficient", 2) not in self._macros:
                    return self._coefficient(node, frame)
                return self._call(node.name, tuple(self._value(each, frame) for each in node.arguments), node.place)

    def _binary(self, node: Binary, frame: _Frame | None) -> Any:
        chain = [node]
        while isinstance(chain[-1].left, Binary):  # long sums are deep on the left
            chain.append(chain[-1].left)
        value = self._value(chain[-1].left, frame)
        for each in reversed(chain):
            right, left = self._value(each.right, frame), value
            if each.operator == "/":
                self._note_divisor(right, each.place)
                value = self._guarded(each.place, lambda left=left, right=right: quotient(left, right))  # type: ignore[misc]
            else:
                name = OPERATIONS[each.operator]
                value = self._guarded(each.place, lambda n=name, left=left, right=right: apply(n, left, right))  # type: ignore[misc]
        return value

    def _note_divisor(self, divisor: Any, place: Place) -> None:
        grades = {blade.bit_count() for blade in divisor.blades} if isinstance(divisor, Expression) else None
        if grades in ({0}, {1}):
            self._divisors.append((divisor, place))

    def _refuse_zero_divisors(self) -> None:
        divisors = [divisor for divisor, _ in self._divisors]
        for is_zero, (divisor, place) in zip(zero_divisors(divisors), self._divisors, strict=False):
            if is_zero:
                raise self._fail(place, f"a division by {divisor}, which is zero", "a divisor other than zero")

    def _name(self, node: Name, frame: _Frame | None) -> Any:
        name = node.text
        if frame is not None and not node.is_global:
            if name in frame.locals:
                return frame.locals[name]
            frame.read.setdefault(name, node.place)
        if name in self.meaning.values:
            return self.meaning.values[name]
        if name in self._dialect.constants and (name not in self._assigned or name in self._dialect.algebra.vectors):
            return self._dialect.constants[name]
        if name not in self._assigned and (blade := self._blade(name)) is not None:
            return blade
        first = self.meaning.inputs.get(name)
        self.meaning.inputs[name] = node.place if first is None else min(first, node.place)
        return self._variable(name)

    def _blade(self, name: str) -> Multivector | None:
        """Return ``e12`` as ``e1 ^ e2``; a name of one basis vector is not a blade."""
        if not name.startswith(tuple({vector[0] for vector in self._dialect.algebra.vectors})):
            return None
        try:
            sign, blade = self._dialect.algebra.blade(name)
        except AlgebraError:
            return None
        return Multivector(self._dialect.algebra, {blade: sign}) if blade.bit_count() > 1 else None

    def _call(self, name: str, arguments: tuple[Any, ...], place: Place) -> Any:
        key = (name, len(arguments))
        if key in self._macros:
            return self._expanded(self._macros[key], arguments, place)
        exact = tuple(Fraction(a) if isinstance(a, int) else a for a in arguments)
        if key in self._dialect.macros:
            return self._guarded(place, lambda: self._dialect.macros[key](*exact))
        if name == "Dual":
            what = f"a dual, but {self._dialect.algebra.name} has no macro Dual"
            raise self._fail(place, what, "Dual = { _P(1) * ... }", "define it")
        return self._guarded(place, lambda: FUNCTIONS[name.lower()][1](*exact))

    def _expanded(self, macro: Macro, arguments: tuple[Any, ...], place: Place) -> Any:
        if macro.value is None:
            raise self._fail(place, f"macro {macro.name} has no value", "an expression before its '}'")
        frame = _Frame(macro, arguments)
        for statement in macro.body:
            self._assign(statement, frame)
        return self._value(macro.value, frame)

    def _coefficient(self, node: Call, frame: _Frame | None) -> Any:
        value, blade = (self._value(each, frame) for each in node.arguments)
        terms = {0: blade} if not isinstance(blade, (Expression, Multivector)) else getattr(blade, "terms", {})
        if len(terms) != 1 or next(iter(terms.values())) not in (1, -1):
            raise self._fail(node.place, "a coefficient of what is not a basis blade", "coefficient(x, e1^e2)")
        ((bitmap, sign),) = terms.items()
        if isinstance(value, (Expression, Multivector)) and (bitmap == 0 or value.algebra != SCALARS):
            found = self._guarded(node.place, lambda: value.coefficient_at(bitmap))
        elif isinstance(value, Expression):
            found = Fraction(0)
        else:
            found = value if bitmap == 0 else Fraction(0)
        return found if sign == 1 else -found
