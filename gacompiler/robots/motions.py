"""The motion of each joint of a chain, applied to lines, vectors and tensors.

Twists and wrenches are lines of G(3,0,1): ``w x p + v`` is the twist with direction `w` and moment `v`; a force `f` at
`p` is the line through `p` along `f`. Their regressive product is a power.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from operator import add
from typing import Any

from ..algebra.catalog import PGA3
from ..algebra.multivector import Multivector
from ..frontend.operations import assemble, commutator, cos, sin
from .chains import Chain
from .frames import ZERO, Vector, directions_and_moments, origins, plus

LINE = ("e12", "e13", "e23", "e01", "e02", "e03")
"""The coefficients of a line in the order of a `Chain`."""


def line_of(d: Vector, m: Vector) -> Multivector:
    """The line of numbers with direction `d` and moment `m`."""
    return PGA3.multivector(dict(zip(LINE, (d[2], -d[1], d[0], *m), strict=True)))


def direction_and_moment(line: Any) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
    """Direction and moment of a line."""
    return (line["e23"], -line["e13"], line["e12"]), (line["e01"], line["e02"], line["e03"])


def assembled_line(d: Sequence[Any], m: Sequence[Any] = (0, 0, 0)) -> Any:
    """The line with direction `d` and moment `m`, which may be expressions."""
    return assemble(PGA3, dict(zip(LINE, (d[2], -d[1], d[0], *m), strict=True)))


def total(terms: Sequence[Any]) -> Any:
    """The sum of the terms from left to right; 0 if there are none."""
    return reduce(add, terms) if terms else 0


def _rotated(x: Any, axis: Multivector, c: Any, s: Any) -> Any:
    """A line rotated about an axis through the origin, by an angle with cosine `c` and sine `s`."""
    across = commutator(commutator(axis, x), axis)
    return (x - across) + c * across + s * commutator(x, axis)


class Motion:
    """The motion of one joint: from its own frame to that of its parent, and back."""

    def __init__(self, kind: str, d: Vector, offset: Vector, q: Any) -> None:
        self.slides = kind == "prismatic"
        self.direction, self.offset = d, offset
        self.twist = line_of(ZERO, d) if self.slides else line_of(d, ZERO)
        self._axis, self._shift = line_of(d, ZERO), line_of(ZERO, offset)
        self._slide = None
        if self.slides:
            self._slide = q * line_of(ZERO, d)
        else:
            self._cosine, self._sine = cos(q), sin(q)

    def to_parent(self, x: Any) -> Any:
        """A line of this frame in the parent's frame."""
        moved = x + commutator(x, self._slide) if self.slides else _rotated(x, self._axis, self._cosine, self._sine)
        return moved + commutator(moved, self._shift)

    def from_parent(self, x: Any) -> Any:
        """A line of the parent's frame in this frame."""
        x = x - commutator(x, self._shift)
        if self.slides:
            return x - commutator(x, self._slide)
        return _rotated(x, self._axis, self._cosine, -self._sine)

    def rotated(self, v: Sequence[Any]) -> tuple[Any, ...]:
        """A free vector of this frame in the parent's frame."""
        if self.slides:
            return tuple(v)
        return direction_and_moment(_rotated(assembled_line(v), self._axis, self._cosine, self._sine))[0]

    def position(self, q: Any) -> tuple[Any, ...]:
        """The origin of this frame in the parent's frame."""
        return (
            tuple(r + q * d for r, d in zip(self.offset, self.direction, strict=True)) if self.slides else self.offset
        )

    def tensor_to_parent(self, t: dict[tuple[int, int], Any]) -> dict[tuple[int, int], Any]:
        """A symmetric tensor of this frame in the directions of the parent's frame; keys (i, j), i <= j."""
        if self.slides:
            return t
        if sorted(map(abs, self.direction)) != [0, 0, 1]:
            columns = [self.rotated([t[min(i, j), max(i, j)] for i in range(3)]) for j in range(3)]
            rows = [self.rotated([columns[j][i] for j in range(3)]) for i in range(3)]
            return {(i, j): rows[i][j] for i, j in t}
        # Orthogonal to the axis a tensor is its trace and a vector that rotates by twice the angle.
        k = next(k for k in range(3) if self.direction[k])
        i, j = (k + 1) % 3, (k + 2) % 3
        c, s = self._cosine, self.direction[k] * self._sine

        def entry(a: int, b: int) -> tuple[int, int]:
            return min(a, b), max(a, b)

        mean, half = (t[i, i] + t[j, j]) / 2, (t[i, i] - t[j, j]) / 2
        cc, ss = c * c - s * s, 2 * (c * s)
        difference, mixed = half * cc - t[entry(i, j)] * ss, half * ss + t[entry(i, j)] * cc
        return {
            (i, i): mean + difference,
            (j, j): mean - difference,
            (k, k): t[k, k],
            entry(i, j): mixed,
            entry(i, k): c * t[entry(i, k)] - s * t[entry(j, k)],
            entry(j, k): s * t[entry(i, k)] + c * t[entry(j, k)],
        }


def motions_of(chain: Chain, q: Sequence[Any]) -> list[Motion]:
    """The motion of each joint at joint variables `q`."""
    points = origins(chain)
    found = []
    for joint, ((d, _), parent) in enumerate(zip(directions_and_moments(chain), chain.parents, strict=True)):
        offset = plus(points[joint], points[parent] if parent >= 0 else ZERO, -1)
        found.append(Motion(chain.kinds[joint], d, offset, q[joint]))
    return found
