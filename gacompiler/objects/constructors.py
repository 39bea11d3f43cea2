"""Constructors of the plane and of space, with the same argument forms in projective and conformal algebra.

Points and directions are objects or coordinates. Arguments that match no form raise an error with the name of the
constructor. Degenerate objects, such as a line through two equal points or a rotor about a zero axis, raise an error
too; in an array such elements are NaN.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from functools import cached_property, partial, reduce
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np

from ..algebra.layout import Layout
from ..algebra.multivector import Multivector
from ..errors import LayoutError
from ..frontend.expression import Expression
from .arrays import MultivectorArray, from_exact, wrap
from .checks import largest, refuse, require_blade, require_finite
from .direct import quickly
from .expressions import built, is_symbolic
from .expressions import coordinates as coordinates_of
from .forms import COEFFICIENTS, Form, Given, SquaredRadius, forms_of
from .poses import Poses
from .spaces import Argument, M, Space, array_of, is_element, numbers, of_floats, single_of_numbers, stacked

_KNOWN: dict[tuple[Any, ...], Form] = {}
"""The form that was found for arguments that look alike."""
_EXACT = 1 << 53
"""Integers below are doubles."""
_EPSILON = float(np.finfo(np.float64).eps)


class Rigid(Poses[M], Space[M]):
    """Common base of the spaces of algebras with points, rotors and translators."""

    _names: tuple[str, ...]
    """The blades of a direction, in the order of coordinates."""
    _direction_layout: Layout
    """The layout of directions that are joined with points."""

    if TYPE_CHECKING:  # what each space defines
        direction: Callable[..., Any]
        coordinates: Callable[..., Any]
        rotor: Callable[..., Any]
        _kind: Callable[..., str]
        _scaled: Callable[..., Any]
        _components: Callable[..., Any]
        _spanned: Callable[..., Any]
        _along: Callable[..., Any]
        _along_names: tuple[str, ...]
        _translator: Callable[..., Any]
        _rotate: Callable[..., Any]
        _rotate_about: Callable[..., Any]
        _screw: Callable[..., Any]

    @property
    def _d(self) -> int:
        return len(self._names)

    @cached_property
    def _point_layout(self) -> Layout:
        return self.algebra.POINT

    @cached_property
    def _origin(self) -> Any:
        return self.point(np.zeros(self._d))

    def point(self, *coordinates: Argument[M]) -> M:
        """Create points from coordinates, or from an array with these along its last axis; also accepts points."""
        single = single_of_numbers(self._point_layout, coordinates)
        if single is not None:
            return single
        if len(coordinates) == 1 and isinstance(coordinates[0], (MultivectorArray, Expression)):
            return self._object("point", self._given("point", coordinates[0]))
        return self.of(self._point_layout, *coordinates)

    def line(self, *arguments: Argument[M], direction: Argument[M] | None = None) -> M:
        """Create the line through two points, through a point along a direction, or from coefficients.

        Parameters
        ----------
        *arguments
            One of three forms. Two points: objects or coordinates. A point and a direction: the direction is an object,
            or coordinates if the point is an object. Coefficients: in the plane those of ``a x + b y + c = 0``; in
            space the six of a line of PGA3, ``e12 e13 e23 e01 e02 e03``.
        direction : optional
            Coordinates of the direction if the point is given by coordinates.

        Raises
        ------
        LayoutError
            If the points coincide or the direction is 0; in arrays such lines are NaN.
        AlgebraError
            If six coefficients describe a screw instead of a line, whose direction is orthogonal to its moment.
        """
        if direction is not None:
            arguments = (*arguments, self._along_coordinates(direction))
        elif len(arguments) == 2 and not is_element(arguments[1]) and is_element(arguments[0]):
            # Coordinates after an object are a direction; coordinates after coordinates are a point.
            arguments = arguments[0], self._along_coordinates(arguments[1])
        return self._construct("line", arguments)

    def translator(self, *coordinates: Argument[M]) -> M:
        """Create the translator by coordinates or by a direction."""
        if len(coordinates) == self._d and all(type(x) is float or type(x) is int for x in coordinates):
            return self._construct("translator", (coordinates,))
        return self._construct("translator", (self._shift("translator", coordinates),))

    def random_motor(
        self, shape: int | tuple[int, ...] = (), spread: float = 1.0, generator: np.random.Generator | int | None = None
    ) -> M:
        """Generate random motors with uniform rotations and signs, and normally distributed translations.

        Parameters
        ----------
        shape : int or tuple of int
        spread : float
            The standard deviation of each coordinate of the translation, which follows the rotation.
        generator : optional
            A `numpy.random.Generator`, or a seed for one.

        Returns
        -------
        MultivectorArray
            Unit motors of this shape.
        """
        random, d = np.random.default_rng(generator), self._d
        leading = np.broadcast_shapes(shape)
        if d == 2:
            rotor = self.rotor(random.uniform(-2 * np.pi, 2 * np.pi, leading))
        else:
            q = random.normal(size=(*leading, 4))
            rotor = self.rotor(q[..., 1:], 2 * np.arctan2(np.linalg.norm(q[..., 1:], axis=-1), q[..., 0]))
        return self.translator(spread * random.normal(size=(*leading, d))) * rotor

    def _along_coordinates(self, x: Any) -> Any:
        """Convert the direction of a line."""
        given = self._given("line", x)
        if not self._plays("direction", given, 0, 0):
            raise LayoutError("line", f"{given.text()} as direction", f"a direction, or {self._d} coordinates")
        return self._object("direction", given)

    def _moved_by(self, shift: tuple[Any, ...], distance: Any, translation: Any) -> Any:
        """Return the part of a motor after its rotation: a distance along its axis, or a translation."""
        found = [x for x in (distance, translation) if x is not None]
        if len(found) + bool(shift) > 1:
            raise LayoutError("motor", "more than one translation", "a distance, or a translation")
        if translation is not None:
            return self._shift("motor", (translation,))
        if len(shift) > 1:
            return self._shift("motor", shift)
        return (*found, *shift, 0.0)[0]

    def _construct(self, name: str, arguments: Sequence[Any]) -> Any:
        """Create an object by the first matching form of the table."""
        made = quickly(self, name, arguments)
        if made is not None:
            return made
        symbolic = is_symbolic(arguments)
        given = [self._given(name, each) for each in arguments]
        forms = forms_of(name, self._d)
        key = (type(self), name, *[each.look for each in given])
        form = _KNOWN.get(key)
        if form is None:
            form = next((each for each in forms if self._fits(each, given)), None)
        if form is not None:
            _KNOWN[key] = form
            parts = self._parts(form, given)
            if symbolic:
                return built(self, name, form.builder, parts)
            made = getattr(self, form.builder)(name, *parts)
            return require_finite(name, made, [each.value for each in given])
        raise LayoutError(
            f"{self.algebra.name}.{name}", f"({', '.join(each.text() for each in given)})",
            "coefficients, or objects to join: " * (name in ("line", "plane")) + " or ".join(f.text() for f in forms),
            f"points and directions are objects, or {self._d} coordinates along the last axis",
        )  # fmt: skip

    def _given(self, name: str, x: Any) -> Given:
        if type(x) is float or (type(x) is int and abs(x) < _EXACT):
            return Given("numbers", float(x), 0)
        if isinstance(x, Multivector):
            x = from_exact(x)
        if (found := self._element_in(name, x)) is not None:
            return Given(self._kind(found), found, found.ndim + 1)
        if isinstance(x, SquaredRadius):
            return Given("squared radius", x.value, 0 if is_symbolic(x.value) else np.ndim(x.value))
        if is_symbolic(x):
            return self._symbolic(x)
        array = array_of(name, x)
        return Given("numbers", array, array.ndim)

    def _symbolic(self, x: Any) -> Given:
        """Return an expression, or coordinates with expressions, as an argument."""
        if not isinstance(x, Expression):
            return Given("numbers", coordinates_of(x), 1)
        return Given("numbers", x, 0) if x.is_scalar else Given(self._kind(x), x, 1)

    def _fits(self, form: Form, given: Sequence[Given]) -> bool:
        if form.takes == ("coefficients",):
            count = len(COEFFICIENTS[form.constructor, self._d])
            return all(each.kind == "numbers" for each in given) and (
                len(given) == count or (len(given) == 1 and given[0].axes > 0)
            )
        if len(given) != len(form.takes):
            return False
        axes = max(each.axes for each in given)
        return all(self._plays(role, each, axes, len(given)) for role, each in zip(form.takes, given, strict=True))

    def _plays(self, role: str, given: Given, axes: int, count: int) -> bool:
        if role in ("point", "direction"):
            is_coordinates = given.kind == "numbers" and given.axes > 0 and given.value.shape[-1] == self._d
            return given.kind == role or is_coordinates
        if role == "radius":
            # In three arguments, a third one with as many axes as the others is a point, not an array of radii.
            is_number = given.kind == "numbers" and (count == 2 or given.axes < axes)
            return given.kind == "squared radius" or is_number
        return given.kind == ("numbers" if role == "number" else role)

    def _parts(self, form: Form, given: Sequence[Given]) -> list[Any]:
        if form.takes == ("coefficients",):
            names = COEFFICIENTS[form.constructor, self._d]
            values = tuple(each.value for each in given)
            if any(map(is_symbolic, values)):
                return [values[0] if len(values) == 1 else coordinates_of(values)]
            return [stacked(form.constructor, names, values)]
        parts = []
        for role, each in zip(form.takes, given, strict=True):
            if role == "radius":
                parts.append(_squared(form.constructor, each))
            else:
                parts.append(each.value if role in ("number", "line", "plane") else self._object(role, each))
        return parts

    def _object(self, role: str, given: Given) -> Any:
        """Convert an argument to a point of weight 1, or to a direction in the layout in which it is joined."""
        if given.kind == "numbers":
            return getattr(self, role)(given.value)
        if given.kind != role:
            raise LayoutError(role, f"a {given.kind}", f"a {role}, or coordinates")
        if isinstance(given.value, Expression):
            return self._scaled(role, given.value)
        layout = self._point_layout if role == "point" else self._direction_layout
        if given.value.layout is layout or given.value.layout == layout:
            return given.value
        if role == "point":
            return self.point(self.coordinates(given.value))
        return wrap(layout, self._components(given.value))

    def _shift(self, name: str, coordinates: tuple[Any, ...]) -> Any:
        """Convert a translation to a direction."""
        if len(coordinates) == 1 and isinstance(coordinates[0], Expression):
            return coordinates[0]
        if len(coordinates) == 1 and (found := self._element_in(name, coordinates[0])) is not None:
            return found
        if any(map(is_symbolic, coordinates)):
            return self.direction(*coordinates)
        if all(type(x) is float or type(x) is int for x in coordinates) and len(coordinates) == self._d:
            return self.direction(*coordinates)
        return self.direction(stacked(name, self._names, coordinates))

    def _unchanged(self, name: str, x: Any) -> Any:
        return x

    def _flat(self, name: str, *parts: Any) -> Any:
        """Create the line or plane through points, or through a point along a direction."""
        made = self._spanned(*parts)
        if all(self._kind(each) == "point" for each in parts):
            return self._independent(name, made, parts)
        if not made.shape:
            return refuse(
                name, made, not any(parts[-1].values.tolist()), "a direction of length 0", "a nonzero direction"
            )
        is_zero = np.broadcast_to(np.all(parts[-1].values == 0, axis=-1), made.shape)
        return refuse(name, made, is_zero, "a direction of length 0", "a nonzero direction")

    def _independent(self, name: str, made: Any, points: Sequence[Any]) -> Any:
        """Return an object spanned by points, unless the points are degenerate."""
        is_double = made.values.dtype == np.float64
        bad = _is_degenerate(points, 8 * (_EPSILON if is_double else float(np.finfo(made.values.dtype).eps)))
        words = ("coincide", "are on one line", "are in one plane")[len(points) - 2]
        return refuse(name, made, bad, f"points that {words}", f"points that span a {name.replace('_', ' ')}")

    def _axis(self, name: str, line: Any) -> Any:
        """Check that a line can be an axis, a blade that is not at infinity, and scale its direction to about 1."""
        if isinstance(line, Expression):
            return line
        require_blade(name, line)
        if not line.shape and line.values.dtype == np.float64:
            found, size = max(abs(getattr(line, each)) for each in self._along_names), largest(line.values)
            if 8 * _EPSILON * size < found < math.inf:
                return of_floats(line, [x / found for x in line.values.tolist()])
        weight = np.abs(self._along(line)).max(axis=-1)
        rounding = 8 * np.finfo(line.values.dtype).eps
        bad = weight <= rounding * np.abs(line.values).max(axis=-1, initial=0.0)
        scaled = wrap(line.layout, line.values / np.where(weight > 0, weight, 1.0)[..., None])
        return refuse(name, scaled, bad, "an axis that is 0 or at infinity", "a line with a direction")

    def _rotate_and_translate(self, name: str, *parts: Any) -> Any:
        """Create the rotation by the first arguments, followed by the translation by the last."""
        *rotation, shift = parts
        is_line = self._d == 3 and self._kind(rotation[0]) == "line"
        rotated = (self._rotate_about if is_line else self._rotate)(name, *rotation)
        return self._translator(name, shift) * rotated

    def _screw_along(self, name: str, axis: Any, angle: Any, distance: Any) -> Any:
        return self._screw(name, self._spanned(self._origin, axis), angle, distance)


def given_of(*arguments: Any) -> tuple[Any, ...]:
    """Return the arguments without defaults that are None."""
    return tuple(each for each in arguments if each is not None)


def round_arguments(name: str, arguments: tuple[Any, ...], radius_squared: Any, least: int) -> tuple[Any, ...]:
    """Return the arguments of a circle or sphere including its radius; `least` arguments precede the radius."""
    found = given_of(*arguments)
    if radius_squared is not None:
        if len(found) > least:
            raise LayoutError(name, "two radii", "a radius, or radius_squared=")
        is_known = not is_symbolic(radius_squared)
        squared = numbers(f"{name}: radius_squared", radius_squared) if is_known else radius_squared
        return (*found, SquaredRadius(squared))
    if len(found) == least:
        raise LayoutError(name, "no radius", "a radius, or radius_squared=; or only points")
    return found


def _is_degenerate(points: Sequence[Any], rounding: float) -> Any:
    """Whether points are degenerate: the height of their simplex is within rounding error."""
    is_single = not any(each.shape for each in points)
    first, *others = (each.values.tolist() if is_single else np.moveaxis(each.values, -1, 0) for each in points)
    largest = max if is_single else partial(reduce, np.maximum)
    with nullcontext() if is_single else np.errstate(all="ignore"):
        size = rounding * largest([abs(x) for each in (first, *others) for x in each])
        edges = [[x - y for x, y in zip(each, first, strict=True)] for each in others]
        lengths = [_length(each) for each in edges]
        if len(edges) == 1:
            return lengths[0] <= size
        faces = [_cross(a, b) for a, b in combinations(edges, 2)]
        areas = [_length(each) for each in faces]
        if len(edges) == 2:
            return areas[0] <= size * largest(lengths)
        (xy, xz, yz), (x, y, z) = faces[0], edges[2]
        volume = xy * z - xz * y + yz * x
        return abs(volume) <= size * largest(areas)


def _length(vector: Sequence[Any]) -> Any:
    return sum(abs(x) ** 2 for x in vector) ** 0.5


def _cross(a: Sequence[Any], b: Sequence[Any]) -> list[Any]:
    return [a[i] * b[k] - a[k] * b[i] for i, k in combinations(range(len(a)), 2)]


def _squared(name: str, given: Given) -> Any:
    if given.kind == "squared radius":
        return given.value
    r = given.value
    if isinstance(r, Expression):
        return r * r
    if np.any(np.real(r) < 0):
        raise LayoutError(name, f"a radius of {np.min(r):.6g}", "0 or more, or radius_squared= of an imaginary one")
    return r * r
