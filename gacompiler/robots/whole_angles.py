"""Rewrite rotations by rotors with constant planes in terms of sines and cosines of the whole angle.

A rotor contains the sine and cosine of half its angle. Rotated elements contain products of these, which can be
expressed by the sine and cosine of the whole angle. If ``B`` is a constant with ``B B = -1``, and x' is the part of x
that does not commute with it,

    R x ~R = (x - x') + cos(2 h) x' + sin(2 h) (x B - B x) / 2    for R = cos(h) - sin(h) B.

The rotation by a product of such rotors is a linear map. It is written as a matrix, the images of the basis lines. All
elements that are rotated by the same product share this matrix.
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

PlaneRotation = tuple[Expression, Expression, Multivector]
"""The cosine and the sine of the angle, and the plane B."""

_NEARLY = Fraction(1, 10**12)
"""Tolerance for the square of a plane given in rounded decimals, which should be -1."""


def by_whole_angles(expressions: Sequence[Expression]) -> list[Expression]:
    """Rewrite all rotations of lines in constant planes in terms of whole angles."""
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
    """Images of lines under rotors, with those of the basis lines cached."""

    def __init__(self) -> None:
        self._plane_rotations: dict[Expression, PlaneRotation | None] = {}
        self._images: dict[tuple[Expression, str], Expression] = {}

    def knows(self, rotor: Expression) -> bool:
        """Whether a rotor is a product of rotors in constant planes."""
        if is_constant(rotor) or self._in_plane(rotor) is not None:
            return True
        factors = _factors(rotor)
        return factors is not None and all(map(self.knows, factors))

    def image(self, rotor: Expression, line: Expression) -> Expression:
        """Return the image of a line under a rotor."""
        if is_constant(rotor):
            (value,) = evaluate([rotor], {})
            return line if dict(value.terms) == {0: 1} else node(Operation.SANDWICH, lift(value), line)
        rotation = self._in_plane(rotor)
        if rotation is not None:
            return _rotated(*rotation, line)
        found: Expression | None = None
        for name in LINE:
            if line.algebra.blade(name)[1] in line.blades:
                term = line[name] * self._of_basis(rotor, name, line)
                found = term if found is None else found + term
        return line if found is None else found

    def _of_basis(self, rotor: Expression, name: str, line: Expression) -> Expression:
        if (rotor, name) not in self._images:
            factors = _factors(rotor)
            assert factors is not None  # ensured by `knows`
            outer, inner = factors
            self._images[rotor, name] = self.image(outer, self.image(inner, lift(line.algebra.multivector({name: 1}))))
        return self._images[rotor, name]

    def _in_plane(self, rotor: Expression) -> PlaneRotation | None:
        if rotor not in self._plane_rotations:
            self._plane_rotations[rotor] = _plane_rotation(rotor)
        return self._plane_rotations[rotor]


def _is_line(x: Expression) -> bool:
    return x.blades <= {x.algebra.blade(name)[1] for name in LINE} if x.algebra.dimension == 4 else False


def _factors(rotor: Expression) -> tuple[Expression, Expression] | None:
    """Return the factors of a product or of the reverse of a product."""
    if rotor.operation is Operation.GEOMETRIC_PRODUCT:
        first, second = rotor.arguments
        return first, second
    if rotor.operation is Operation.REVERSE and rotor.arguments[0].operation is Operation.GEOMETRIC_PRODUCT:
        first, second = rotor.arguments[0].arguments
        return ~second, ~first
    return None


def _plane_rotation(rotor: Expression) -> PlaneRotation | None:
    """Return the rotation by the whole angle for a rotor ``cos(h) - sin(h) B`` or its reverse."""
    if rotor.operation is Operation.REVERSE:
        rotation = _plane_rotation(rotor.arguments[0])
        return None if rotation is None else (rotation[0], -rotation[1], rotation[2])
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


def _rotated(cosine: Expression, sine: Expression, plane: Multivector, line: Expression) -> Expression:
    x = evaluate([line], {})[0] if is_constant(line) else line
    moved = commutator(commutator(plane, x), plane)
    if isinstance(moved, Multivector) and not moved.terms:
        return line
    return lift((x - moved) + cosine * moved + sine * commutator(x, plane))
