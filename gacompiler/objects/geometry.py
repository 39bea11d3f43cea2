"""What elements of the plane and of space are: centres, radii, directions, normals, axes, and a line of words.

The formulas are vector algebra on coefficients by the names of blades. Elements of projective and conformal space share
those of motors, whose coefficients are the same numbers.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..errors import AlgebraError

_ROUNDING = 1e-9
"""Coefficients below this, relative to the largest, are rounding errors of some thousand operations."""
SPACES: dict[str, Any] = {}
"""The spaces by the names of their algebras, which add themselves when they are imported."""
_PLANE, _SPACE = ("PGA2", "CGA2", "VGA2"), ("PGA3", "CGA3", "VGA3", "QUATERNIONS")


class Screw(NamedTuple):
    """A rigid motion of space: a turn about an axis, and a shift along it; or a shift alone."""

    turn: Any
    """(..., 3) The unit axis times the angle in radians, which is in [0, pi]."""
    through: Any
    """(..., 3) The point of the axis that is nearest to the origin; NaN without a turn."""
    shift: Any
    """(..., 3) The translation along the axis, or of a translation."""


def _parts(x: Any, *names: str) -> Any:
    """Return coefficients by the names of their blades, a leading ``-`` changes the sign, along the last axis."""
    found = [np.asarray(-x[name[1:]] if name.startswith("-") else x[name]) for name in names]
    return np.stack(np.broadcast_arrays(*found), -1)


def _unit(v: Any) -> Any:
    with np.errstate(all="ignore"):
        return v / np.linalg.norm(v, axis=-1, keepdims=True)


def kind_of(x: Any) -> str:
    """Return the kind of elements by their layout and coefficients; ``multivector`` for all else."""
    algebra, used = x.algebra.name, _used(x)
    grades = {blade.bit_count() for blade in used}
    if not used:
        return "zero"
    if algebra == "QUATERNIONS":
        return "quaternion"
    if grades == {0}:
        return "scalar"
    (grade, *more) = sorted(grades)
    flat = algebra.startswith("CGA") and all(name.endswith("inf") for name in _names(x, used))
    if not more:
        kinds = {
            "VGA2": ("", "vector", "bivector"), "VGA3": ("", "vector", "bivector", "pseudoscalar"),
            "PGA2": ("", "line", "point"), "PGA3": ("", "plane", "line", "point"),
            "CGA2": ("", "vector", "point pair", "circle"), "CGA3": ("", "vector", "point pair", "circle", "sphere"),
        }.get(algebra, ())  # fmt: skip
        kind = kinds[grade] if grade < len(kinds) else "multivector"
        if kind == "vector" and algebra.startswith("CGA"):
            is_point = np.all(np.abs(np.asarray((x * x).norm() if hasattr(x * x, "norm") else x * x)) < _ROUNDING)
            return "point" if is_point and np.all(x["e0"]) else "dual of a sphere or plane"
        if flat:
            return {"circle": "line", "sphere": "plane", "point pair": "flat point"}.get(kind, kind)
        if kind == "point" and not np.any(x["e123" if algebra == "PGA3" else "e12"]):
            return "direction"
        if algebra == "PGA3" and kind == "line" and not _is_simple(x):
            return "screw"
        return kind
    if grades <= {0, 2, 4} and algebra in (*_PLANE, *_SPACE) and np.all(np.asarray(_is_one(x * ~x))):
        names = _names(x, used)
        euclidean = {"1", "e12", "e13", "e23"}
        ideal = {name for name in names if name not in euclidean}
        if algebra.startswith("CGA") and any("0" in name for name in names):
            return "dilation" if set(names) <= {"1", "e0inf"} else "conformal map"
        if not ideal:
            return "rotor"
        return "motor" if set(names) & {"e12", "e13", "e23"} else "translator"
    return "multivector"


def _used(x: Any) -> list[int]:
    """Return the blades whose coefficients are not rounding errors."""
    size = np.max(np.abs(x.values), axis=-1, initial=0.0)
    slots = (*x.layout.stored, *(slot for slot, _ in x.layout.fixed), *(slot for slot, _ in x.layout.implied))
    size = np.maximum(size, 1.0) if len(slots) > x.layout.size else size
    return [slot.blade for slot in slots if np.any(np.abs(np.asarray(x[slot.name])) > _ROUNDING * size)]


def _names(x: Any, blades: list[int]) -> list[str]:
    return [x.algebra.spelling(blade)[1] for blade in blades]


def _is_one(square: Any) -> Any:
    return (
        square.isclose(1, atol=_ROUNDING) if hasattr(square, "isclose") else np.abs(np.asarray(square) - 1) < _ROUNDING
    )


def _is_simple(line: Any) -> bool:
    direction, moment = _line(line)
    size = np.linalg.norm(direction, axis=-1) * np.linalg.norm(moment, axis=-1)
    return bool(np.all(np.abs(np.sum(direction * moment, -1)) <= _ROUNDING * size))


def _line(x: Any) -> tuple[Any, Any]:
    """Return direction and moment ``p x d`` of lines of space."""
    if x.algebra.name == "CGA3":
        return _parts(x, "-e10inf", "-e20inf", "-e30inf"), _parts(x, "e23inf", "-e13inf", "e12inf")
    return _parts(x, "e23", "-e13", "e12"), _parts(x, "e01", "e02", "e03")


def screw_of(x: Any) -> Screw:
    """Return the screw of rotors, motors and unit quaternions of space."""
    algebra = x.algebra.name
    if algebra not in _SPACE:
        raise AlgebraError("axis()", f"an element of {algebra}", f"a rotor or motor of {', '.join(_SPACE)}")
    logarithm = x.log()
    if algebra == "QUATERNIONS":
        turn = 2 * _parts(logarithm, "e1", "e2", "e12")
        turn = np.where(np.linalg.norm(turn, axis=-1, keepdims=True) > np.pi, turn - 2 * np.pi * _unit(turn), turn)
        return Screw(turn, np.zeros_like(turn), np.zeros_like(turn))
    turn = -2 * _parts(logarithm, "e23", "-e13", "e12")
    if algebra == "VGA3":
        return Screw(turn, np.zeros_like(turn), np.zeros_like(turn))
    ideal = ("e01", "e02", "e03") if algebra == "PGA3" else ("e1inf", "e2inf", "e3inf")
    moment = -2 * _parts(logarithm, *ideal)
    angle = np.linalg.norm(turn, axis=-1, keepdims=True)
    with np.errstate(all="ignore"):
        through = np.cross(turn, moment) / angle**2
        along = np.sum(turn * moment, -1, keepdims=True) / angle**2 * turn
    return Screw(turn, through, np.where(angle > 0, along, moment))


class Geometric:
    """Questions that elements of the plane and of space answer; an element without the property raises."""

    __slots__ = ()

    def _refused(self: Any, what: str, expected: str) -> AlgebraError:
        return AlgebraError(f"{what}()", f"a {kind_of(self)} of {self.algebra.name}", expected)

    def grades(self: Any) -> tuple[int, ...]:
        """Return the grades with coefficients that are not rounding errors, 1e-9 of the largest."""
        return tuple(sorted({blade.bit_count() for blade in _used(self)}))

    def is_versor(self: Any) -> bool:
        """Whether all elements are versors up to rounding: ``x ~x`` is a number, and vectors stay vectors."""
        odd = {grade & 1 for grade in self.grades()}
        if len(odd) != 1 or not _is_number(self * ~self):
            return False
        vectors = (self.algebra.multivector({name: 1}) for name in self.algebra.vectors)
        return all(set(Geometric.grades(self * v * ~self)) <= {1} for v in vectors)

    def is_blade(self: Any) -> bool:
        """Whether all elements are outer products of vectors up to rounding."""
        from .checks import require_blade

        try:
            require_blade("is_blade", self)
        except AlgebraError:
            return False
        return len(self.grades()) <= 1

    def reject(self: Any, onto: Any) -> Any:
        """Return the part that is orthogonal to a blade, ``x`` minus its projection; errors as in `project`."""
        return self - self.project(onto)

    def center(self: Any) -> Any:
        """Return the coordinates of points, or of the centres of point pairs, circles and spheres."""
        kind = kind_of(self)
        if kind == "point":
            return _space(self).coordinates(self)
        if kind in ("point pair", "circle", "sphere"):
            return _space(self).centre(self)
        raise self._refused("center", "a point, point pair, circle or sphere")

    def radius(self: Any) -> Any:
        """Return the radii of point pairs, circles and spheres; NaN for imaginary ones."""
        if self.algebra.name not in ("CGA2", "CGA3") or kind_of(self) not in ("point pair", "circle", "sphere"):
            raise self._refused("radius", "a point pair, circle or sphere of CGA2 or CGA3")
        with np.errstate(invalid="ignore"):
            return np.sqrt(np.asarray(_space(self).radius_squared(self)))[()]

    def direction(self: Any) -> Any:
        """Return the unit directions of lines, vectors and points at infinity."""
        kind, algebra = kind_of(self), self.algebra.name
        if kind in ("line", "screw") and algebra in ("PGA3", "CGA3"):
            return _unit(_line(self)[0])
        if kind == "line" and algebra == "PGA2":
            return _unit(_parts(self, "e2", "-e1"))
        if kind == "direction":
            return _unit(_parts(self, *(("e20", "e01") if algebra == "PGA2" else ("e032", "e013", "e021"))))
        if kind == "vector" and algebra in ("VGA2", "VGA3"):
            return _unit(_parts(self, *self.algebra.vectors))
        raise self._refused("direction", "a line, a vector or a point at infinity")

    def normal(self: Any) -> Any:
        """Return the unit normals of planes, circles in space and bivectors, and of lines of the plane."""
        kind, algebra = kind_of(self), self.algebra.name
        if kind == "plane" and algebra == "PGA3":
            return _unit(_parts(self, "e1", "e2", "e3"))
        if kind == "line" and algebra == "PGA2":
            return _unit(_parts(self, "e1", "e2"))
        if kind == "plane":
            return _unit(_parts(self, "e230inf", "-e130inf", "e120inf"))
        if kind == "circle" and algebra == "CGA3":
            return _unit(_parts(self ^ _space(self).einf, "e230inf", "-e130inf", "e120inf"))
        if kind == "bivector" and algebra == "VGA3":
            return _unit(_parts(self, "e23", "-e13", "e12"))
        raise self._refused("normal", "a plane, a circle in space, a bivector or a line of the plane")

    def points(self: Any) -> Any:
        """Return the coordinates of both points of point pairs, (..., 2, n); NaN for imaginary pairs."""
        if kind_of(self) != "point pair":
            raise self._refused("points", "a point pair")
        names = [name for name in self.algebra.vectors if name not in ("e0", "einf")]
        along = _unit(-_parts(self ^ _space(self).einf, *(f"{name}0inf" for name in names)))
        middle, half = self.center(), np.asarray(self.radius())[..., None] * along
        return np.stack([middle - half, middle + half], -2)

    def angle(self: Any) -> Any:
        """Return the angles of rotors, motors and quaternions in radians: in [0, pi], with a sign in the plane."""
        if self.algebra.name in _PLANE:
            return np.asarray(-2 * np.asarray(self.log()["e12"]))[()]
        return np.linalg.norm(screw_of(self).turn, axis=-1)[()]

    def axis(self: Any) -> Any:
        """Return the unit directions of the axes of rotors, motors and quaternions of space; NaN without a turn."""
        return _unit(screw_of(self).turn)

    def pitch(self: Any) -> Any:
        """Return the translations along the axes of motors of space, per radian; infinite without a turn."""
        screw = screw_of(self)
        angle = np.linalg.norm(screw.turn, axis=-1)
        with np.errstate(all="ignore"):
            along = np.where(
                angle > 0, np.sum(screw.shift * _unit(screw.turn), -1), np.linalg.norm(screw.shift, axis=-1)
            )
            return (along / angle)[()]

    def to_matrix(self: Any) -> Any:
        """Return motors as matrices that act on columns (x, y, z, 1), and rotors and quaternions as 3 x 3 matrices."""
        algebra = self.algebra.name
        if algebra not in (*_SPACE, "PGA2", "CGA2", "VGA2"):
            raise AlgebraError("to_matrix()", f"an element of {algebra}", f"one of {', '.join((*_PLANE, *_SPACE))}")
        space = _space(self)
        n = 2 if algebra in _PLANE else 3
        if algebra == "QUATERNIONS":
            turned = self.reshape(*self.shape, 1) >> space.imaginary(np.eye(3))
            return np.swapaxes(turned.values, -1, -2)
        if algebra in ("VGA2", "VGA3"):
            return np.swapaxes((self.reshape(*self.shape, 1) >> space.vector(np.eye(n))).values, -1, -2)
        places = np.concatenate([np.zeros((1, n)), np.eye(n)])
        moved = space.coordinates(self.reshape(*self.shape, 1) >> space.point(places))
        found = np.zeros((*self.shape, n + 1, n + 1))
        found[..., :n, n] = moved[..., 0, :]
        found[..., :n, :n] = np.swapaxes(moved[..., 1:, :] - moved[..., :1, :], -1, -2)
        found[..., n, n] = 1
        return found

    def explain(self: Any) -> str:
        """Return one line that says what this element is, with three digits; for arrays that of the first element."""
        if self.shape:
            count = f"{' x '.join(map(str, self.shape))} elements of {self.algebra.name}"
            return count if 0 in self.shape else f"{count}; the first: {self.reshape(-1)[0].explain()}"
        kind = kind_of(self)
        return kind + "".join(f", {each}" for each in _facts(self, kind))


def _is_number(x: Any) -> bool:
    return not hasattr(x, "grades") or set(x.grades()) <= {0}


def _space(x: Any) -> Any:
    """Return the space of the algebra of an element."""
    known = SPACES.get(x.algebra.name)
    if known is None or known.algebra != x.algebra:
        raise AlgebraError("space", x.algebra.name, f"one of {', '.join(SPACES)}")
    return known


def _text(v: Any) -> str:
    numbers = np.atleast_1d(v)
    rounded = [f"{0.0 if abs(x) < 5e-4 * np.max(np.abs(numbers), initial=1e-300) else x:.3g}" for x in numbers]
    return rounded[0] if np.ndim(v) == 0 else f"({', '.join(rounded)})"


def _facts(x: Any, kind: str) -> list[str]:
    """Return what is known of an element, in words."""
    algebra = x.algebra.name
    if kind == "point":
        return [f"at {_text(x.center())}"]
    if kind in ("direction", "vector"):
        return [f"along {_text(x.direction())}", *([f"length {_text(x.norm())}"] if kind == "vector" else [])]
    if kind in ("line", "screw") and algebra in ("PGA3", "CGA3"):
        direction, moment = _line(x)
        nearest = np.cross(direction, moment) / np.sum(direction**2)
        pitch = [f"pitch {_text(np.sum(direction * moment) / np.sum(direction**2))}"] if kind == "screw" else []
        return [f"through {_text(nearest)} along {_text(x.direction())}", *pitch]
    if kind == "line" and algebra == "PGA2":
        return [f"normal {_text(x.normal())}", f"distance {_text(-x['e0'] / np.hypot(x['e1'], x['e2']))}"]
    if kind == "plane":
        names = ("e1", "e2", "e3") if algebra == "PGA3" else ("e230inf", "e130inf", "e120inf")
        distance = (-x["e0"] if algebra == "PGA3" else x["e123inf"]) / np.linalg.norm(_parts(x, *names))
        return [f"normal {_text(x.normal())}", f"distance {_text(distance)}"]
    if kind in ("point pair", "circle", "sphere"):
        squared = float(_space(x).radius_squared(x))
        normal = [f"normal {_text(x.normal())}"] if kind == "circle" and algebra == "CGA3" else []
        radius = f"{'imaginary ' if squared < 0 else ''}radius {_text(np.sqrt(abs(squared)))}"
        return [f"centre {_text(x.center())}", *normal, radius]
    if kind in ("rotor", "motor", "translator", "quaternion"):
        return _motion(x, kind)
    if kind == "dilation":
        return [f"by the factor {_text(np.exp(2 * x.log()['e0inf']))}"]
    if kind == "bivector" and algebra == "VGA3":
        return [f"normal {_text(x.normal())}", f"area {_text(x.norm())}"]
    return [f"grades {', '.join(map(str, x.grades()))}"] if kind == "multivector" else []


def _motion(x: Any, kind: str) -> list[str]:
    """Return a motion in words."""
    if kind == "quaternion" and not np.isclose(float(x.norm()), 1, rtol=0, atol=_ROUNDING):
        return [f"norm {_text(x.norm())}", *_motion(x.normalize(), kind)]
    if kind == "translator":
        matrix = x.to_matrix()
        return [f"by {_text(matrix[:-1, -1])}"]
    turn = f"turns by {_text(np.degrees(x.angle()))} degrees"
    if x.algebra.name in _PLANE:
        matrix = x.to_matrix()
        if len(matrix) == 2:
            return [turn]
        return [f"{turn} about {_text(np.linalg.solve(np.eye(2) - matrix[:2, :2], matrix[:2, 2]))}"]
    screw = screw_of(x)
    if x.algebra.name in ("VGA3", "QUATERNIONS"):
        return [f"{turn} about {_text(x.axis())}"]
    shift = float(np.sum(screw.shift * x.axis()))
    along = f"{turn} about the line through {_text(screw.through)} along {_text(x.axis())}"
    return [along if abs(shift) < _ROUNDING else f"{along} and moves {_text(shift)} along it"]
