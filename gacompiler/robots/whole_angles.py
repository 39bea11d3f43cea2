"""Rotations by rotors whose planes are constant, written with sines and cosines of whole angles.

A rotor has the sine and cosine of half its angle. What it rotates has products of two of them, which are those of the
whole angle: where ``B`` is a constant with ``B B = -1``, and x' the part of x that does not commute with it,

    R x ~R = (x - x') + cos(2 h) x' + sin(2 h) (x B - B x) / 2    for R = cos(h) - sin(h) B.

A rotation by a product of such rotors is linear in what is rotated. It is written as a matrix, by what it makes of each
basis line, and everything that the same product rotates shares that.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from ..algebra.multivector import Multivector
from ..algebra.operations import Operation
from ..frontend.expression import Expression, evaluate, lift, node, topological
from ..frontend.operations import commutator, cos, sin
from ..frontend.recorded import is_constant
from .frames import LINE

Turn = tuple[Expression, Expression, Multivector]
"""Cosine and sine of an angle, and the plane B."""

_NEARLY = Fraction(1, 10**12)
"""The square of a plane of rounded decimals is so near to -1."""


def by_whole_angles(expressions: Sequence[Expression]) -> list[Expression]:
    """The expressions with every line that is rotated in constant planes written by whole angles."""
    rotations = _Rotations()
    known: dict[Expression, Expression] = {}
    for each in topological(expressions):
        arguments = tuple(known[argument] for argument in each.arguments)
        same = all(a is b for a, b in zip(arguments, each.arguments, strict=True))
        found = each if same else Expression(each.operation, arguments, each.data, each.algebra)
        if found.operation is Operation.SANDWICH and _is_line(found.arguments[1]):
            rotor, line = found.arguments
            found = rotations.image(rotor, line) if rotations.knows(rotor) else found
        known[each] = found
    return [known[expression] for expression in expressions]


class _Rotations:
    """What rotors make of lines, and of each basis line once."""

    def __init__(self) -> None:
        self._turns: dict[Expression, Turn | None] = {}
        self._images: dict[tuple[Expression, str], Expression] = {}

    def knows(self, rotor: Expression) -> bool:
        """Whether a rotor is a product of rotors in constant planes."""
        if is_constant(rotor) or self._turn(rotor) is not None:
            return True
        factors = _factors(rotor)
        return factors is not None and all(map(self.knows, factors))

    def image(self, rotor: Expression, line: Expression) -> Expression:
        """What a rotor makes of a line."""
        if is_constant(rotor):
            (value,) = evaluate([rotor], {})
            return line if dict(value.terms) == {0: 1} else node(Operation.SANDWICH, lift(value), line)
        turn = self._turn(rotor)
        if turn is not None:
            return _turned(*turn, line)
        found: Expression | None = None
        for name in LINE:
            if line.algebra.blade(name)[1] in line.blades:
                term = line[name] * self._of_basis(rotor, name, line)
                found = term if found is None else found + term
        return line if found is None else found

    def _of_basis(self, rotor: Expression, name: str, line: Expression) -> Expression:
        if (rotor, name) not in self._images:
            factors = _factors(rotor)
            assert factors is not None  # `knows` says so
            outer, inner = factors
            self._images[rotor, name] = self.image(outer, self.image(inner, lift(line.algebra.multivector({name: 1}))))
        return self._images[rotor, name]

    def _turn(self, rotor: Expression) -> Turn | None:
        if rotor not in self._turns:
            self._turns[rotor] = _turn_of(rotor)
        return self._turns[rotor]


def _is_line(x: Expression) -> bool:
    return x.blades <= {x.algebra.blade(name)[1] for name in LINE} if x.algebra.dimension == 4 else False


def _factors(rotor: Expression) -> tuple[Expression, Expression] | None:
    """The factors of a product, or of the reverse of one."""
    if rotor.operation is Operation.GEOMETRIC_PRODUCT:
        first, second = rotor.arguments
        return first, second
    if rotor.operation is Operation.REVERSE and rotor.arguments[0].operation is Operation.GEOMETRIC_PRODUCT:
        first, second = rotor.arguments[0].arguments
        return ~second, ~first
    return None


def _turn_of(rotor: Expression) -> Turn | None:
    """The whole angle and the plane of ``cos(h) - sin(h) B``, or of the reverse of it."""
    if rotor.operation is Operation.REVERSE:
        turn = _turn_of(rotor.arguments[0])
        return None if turn is None else (turn[0], -turn[1], turn[2])
    if rotor.operation is not Operation.SUBTRACT or rotor.arguments[1].operation is not Operation.GEOMETRIC_PRODUCT:
        return None
    cosine, (sine, plane) = rotor.arguments[0], rotor.arguments[1].arguments
    if cosine.operation is not Operation.COS or sine.operation is not Operation.SIN or not is_constant(plane):
        return None
    (value,) = evaluate([plane], {})
    square = dict((value * value).terms)
    if sine.arguments != cosine.arguments or set(square) != {0} or abs(square[0] + 1) > _NEARLY:
        return None
    angle = 2 * cosine.arguments[0]
    return cos(angle), sin(angle), value


def _turned(cosine: Expression, sine: Expression, plane: Multivector, line: Expression) -> Expression:
    x = evaluate([line], {})[0] if is_constant(line) else line
    moved = commutator(commutator(plane, x), plane)
    if isinstance(moved, Multivector) and not moved.terms:
        return line
    return lift((x - moved) + cosine * moved + sine * commutator(x, plane))
