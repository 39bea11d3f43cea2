"""Every geometric method of elements of every layout: what it returns moves along with the element, or it is refused.

The motions are matrices of scipy. Coordinates of what was moved are those before, moved by the matrix; lengths and
angles remain. What a method would make of coefficients of another meaning does not move in this way.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gacompiler.errors import GacError
from gacompiler.objects import CGA2, CGA3, PGA2, PGA3, QUATERNIONS, STA, VGA2, VGA3

SPACES = {each.algebra.name: each for each in (PGA2, PGA3, CGA2, CGA3, VGA2, VGA3, QUATERNIONS, STA)}
LEAST = {"PGA2": 50, "PGA3": 70, "CGA2": 80, "CGA3": 110, "VGA2": 25, "VGA3": 30, "QUATERNIONS": 20, "STA": 20}
"""How many pairs of an element and a method have a result at least."""
BLADES: dict[str, tuple[Any, ...]] = {
    "CGA2": (CGA2.circle([1, 2], 2.0), CGA2.line([1, 2], [3, 1]), CGA2.point_pair([1, 2], [3, 1])),
    "CGA3": (
        CGA3.circle([1, 2, 3], [1, 2, -2], 2.0), CGA3.sphere([1, 2, 3], 2.0), CGA3.line([1, 2, 3], [3, 1, 0]),
        CGA3.plane([1, 2, -2], 3.0), CGA3.point_pair([1, 2, 3], [3, 1, 0]),
    ),
    "PGA3": (PGA3.line([1, 2, 3], [3, 1, 0]), PGA3.motor(PGA3.line([1, 2, 3], [3, 1, 0]), 0.7, 2.0)),
}  # fmt: skip
"""Elements whose coefficients are not arbitrary."""


class Motion(NamedTuple):
    """A rigid motion as a matrix and a vector, and as the element that applies it."""

    turn: Any
    shift: Any
    versor: Any

    def matrix(self, size: int) -> Any:
        found = np.eye(size)
        d = len(self.turn)
        found[:d, :d] = self.turn
        found[:d, d:] = self.shift[:, None]
        return found


def motion_of(name: str) -> Motion:
    space, d = SPACES[name], 2 if name.endswith("2") else 3
    if name == "STA":
        return Motion(np.eye(3), np.zeros(3), space.boost(0.3, 0.2, -0.4))
    turn = Rotation.from_rotvec([0.3, -0.5, 0.9] if d == 3 else [0, 0, 0.8]).as_matrix()[:d, :d]
    if name[0] in "VQ":
        return Motion(turn, np.zeros(d), space.from_matrix(turn))
    motion = Motion(turn, np.array([0.7, -1.1, 2.0][:d]), None)
    return motion._replace(versor=space.from_matrix(motion.matrix(d + 1)))


def elements(name: str) -> Iterator[Any]:
    """Yield an element of each layout, with random coefficients, and blades."""
    space, random = SPACES[name], np.random.default_rng(5)
    for layout in (*space.algebra.layouts.values(), space.algebra.full, space.algebra.even):
        numbers = random.normal(size=layout.size)
        try:
            yield space.of(layout, numbers)
        except GacError:  # not of unit norm
            is_motion = 0 in layout.support
            blades = [slot.name for slot in layout.stored if slot.blade.bit_count() == 2 or not is_motion]
            x = sum(number * getattr(space, blade) for number, blade in zip(numbers, blades, strict=False))
            yield (x.exp() if is_motion else x.normalize()).as_layout(layout)
    yield from BLADES.get(name, ())


def found(call: Callable[[], Any]) -> Any:
    """Return the result, or None if the package refuses it."""
    try:
        return call()
    except GacError:
        return None


def remains(_: Motion, a: Any) -> Any:
    return a


def turned(g: Motion, a: Any) -> Any:
    return g.turn @ a if isinstance(a, np.ndarray) else g.versor >> a


def turned_quaternion(g: Motion, a: Any) -> Any:
    return np.array([a[0], *(g.turn @ a[1:] if len(g.turn) == 3 else a[1:])])


def moved_matrix(g: Motion, a: Any) -> Any:
    return g.matrix(len(a)) @ a @ np.linalg.inv(g.matrix(len(a)))


METHODS: dict[str, Callable[[Motion, Any], Any]] = {
    **dict.fromkeys(("radius", "angle", "pitch", "norm", "is_blade", "is_versor"), remains),
    "center": lambda g, a: g.turn @ a + g.shift, "direction": turned, "normal": turned, "axis": turned,
    "points": lambda g, a: tuple(g.versor >> x for x in a), "quaternion": turned_quaternion, "to_matrix": moved_matrix,
}  # fmt: skip
"""What the motion makes of the result."""


def same(a: Any, b: Any) -> bool:
    if isinstance(a, tuple):
        return all(map(same, a, b))
    if hasattr(a, "isclose") and hasattr(b, "isclose"):
        return bool(a.isclose(b, 1e-7, 1e-7))
    return np.shape(a) == np.shape(b) and np.allclose(a, b, rtol=1e-7, atol=1e-7, equal_nan=True)


@pytest.mark.parametrize("name", SPACES)
def test_results_move_along(name: str) -> None:
    g, count = motion_of(name), 0
    for x in elements(name):
        y = g.versor >> x
        for method, moved in METHODS.items():
            a, b = found(getattr(x, method)), found(getattr(y, method))
            assert (a is None) == (b is None), (x, method, a, b)
            assert a is None or same(moved(g, a), b), (x, method, a, b)
            count += a is not None
    assert count >= LEAST[name]


@pytest.mark.parametrize("name", SPACES)
def test_motions_are_their_matrices(name: str) -> None:
    for x in elements(name):
        matrix, shift = found(x.to_matrix), found(x.translation)
        q, dual = found(x.quaternion), found(x.dual_quaternion)
        assert (matrix is None) == (q is None), x
        if matrix is None:
            assert shift is dual is None, x
            continue
        d = 2 if name.endswith("2") else 3
        rotation = Rotation.from_quat(q, scalar_first=True)
        assert same(rotation.as_matrix()[:d, :d], matrix[:d, :d]), x
        assert (shift is None) == (len(matrix) == d) and (shift is None or same(shift, matrix[:d, d])), x
        if dual is not None:
            assert shift is not None
            product = [-shift @ q[1:], *(q[0] * shift + np.cross(shift, q[1:]))]
            assert same(dual, np.array([*q, *np.array(product) / 2])), x


def pairs_move_along(name: str) -> None:
    g, listed = motion_of(name), [(x, motion_of(name).versor >> x) for x in elements(name)]
    methods = ("distance", "angle", "project", "reject", "join", "meet")
    for x, moved in listed:
        for other, also_moved in listed:
            for method in methods[: 2 if name == "QUATERNIONS" else None]:  # whose rotations do not keep grades
                a = found(lambda: getattr(x, method)(other))  # noqa: B023
                b = found(lambda: getattr(moved, method)(also_moved))  # noqa: B023
                assert (a is None) == (b is None), (x, method, other, a, b)
                if a is not None:
                    number = isinstance(a, (float, np.ndarray))
                    assert same(a if number else g.versor >> a, b), (x, method, other, a, b)
                if method == "distance":
                    back = found(lambda: other.distance(x))  # noqa: B023
                    assert (a is None) == (back is None) and (a is None or same(a, back)), (x, other, a, back)
                    assert a is None or x is not other or np.isnan(a) or a < 1e-7, (x, a)


@pytest.mark.slow
@pytest.mark.parametrize("name", SPACES)
def test_relations_of_two_elements_move_along(name: str) -> None:
    """In processes without a C compiler, which would compile some thousands of operations."""
    code = f"import test_methods_of_layouts as test; test.pairs_move_along({name!r})"
    path = os.pathsep.join([str(Path(__file__).parent), *filter(None, sys.path)])
    done = subprocess.run(
        [sys.executable, "-c", code], env={**os.environ, "GAC_BACKEND": "arrays", "PYTHONPATH": path},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
