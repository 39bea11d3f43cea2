"""Grasps: motors are recovered from what they move, and freedoms are those of geometry."""

from __future__ import annotations

import numpy as np
import pytest

from algorithms.kinematics.grasps import grasp
from generated import pga3

RNG = np.random.default_rng(0)


def motor() -> np.ndarray:
    return np.asarray(pga3.motor_exponential(RNG.normal(size=6)))


def line(point: np.ndarray, direction: np.ndarray) -> np.ndarray:
    unit = direction / np.linalg.norm(direction)
    return np.asarray(pga3.line_from_direction_moment(unit, np.cross(point, unit)))


def plane(point: np.ndarray, normal: np.ndarray) -> np.ndarray:
    return np.asarray(pga3.plane_from_point_normal(point, normal / np.linalg.norm(normal)))


def flag() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A point on a line on a plane."""
    point, along, normal = RNG.normal(size=(3, 3))
    normal -= along * (normal @ along) / (along @ along)
    return point, line(point, along), plane(point, normal)


def same(a: np.ndarray, b: np.ndarray) -> float:
    return float(min(np.abs(a - b).max(), np.abs(a + b).max()))


def test_a_flag_determines_the_motor() -> None:
    for _ in range(20):
        m, (x, ln, h) = motor(), flag()
        moved = pga3.move_point(m, x), pga3.move_line(m, ln), pga3.move_plane(m, h)
        pairs = [(one[None], two[None]) for one, two in zip((x, ln, h), moved, strict=True)]
        found = grasp(*pairs, oriented=True)
        assert found.freedoms.tolist() == [0] and same(found.motors[0], m) < 1e-9 and found.residuals[0] < 1e-12
        # of either sense: half turns about line, normal, and what is across both
        either = grasp(*pairs)
        assert len(either.motors) == 4 and min(same(one, m) for one in either.motors) < 1e-9
        for one in either.motors:
            assert np.abs(pga3.move_point(one, x) - moved[0]).max() < 1e-9
            assert same(pga3.move_line(one, ln), moved[1]) < 1e-9 and same(pga3.move_plane(one, h), moved[2]) < 1e-9


@pytest.mark.parametrize(
    ("kinds", "freedoms"),
    [
        ("x", 3),
        ("l", 2),
        ("h", 3),
        ("xl", 1),
        ("xh", 1),
        ("lh", 1),
        ("xx", 1),
        ("ll", 0),
        ("hh", 1),
        ("xxx", 0),
        ("hhh", 0),
    ],
)
def test_freedoms_that_are_left(kinds: str, freedoms: int) -> None:
    x, ln, h = flag()
    m, near = motor(), motor()
    given: dict[str, list[np.ndarray]] = {"x": [], "l": [], "h": []}
    for k, kind in enumerate(kinds):
        first = kinds.index(kind) == k
        other = {"x": RNG.normal(size=3), "l": line(*RNG.normal(size=(2, 3))), "h": plane(*RNG.normal(size=(2, 3)))}
        given[kind].append({"x": x, "l": ln, "h": h}[kind] if first else other[kind])
    moves = {"x": pga3.move_point, "l": pga3.move_line, "h": pga3.move_plane}
    pairs = {
        name: (np.array(some), moves[kind](m, np.array(some)))
        for kind, name in (("x", "points"), ("l", "lines"), ("h", "planes"))
        if (some := given[kind])
    }
    found = grasp(**pairs, near=near, oriented=True)
    assert found.freedoms.tolist() == [freedoms]
    for kind, name in (("x", "points"), ("l", "lines"), ("h", "planes")):
        if name in pairs:
            assert np.abs(moves[kind](found.motors[0], pairs[name][0]) - pairs[name][1]).max() < 1e-9
    if freedoms:
        assert same(grasp(**pairs, near=m, oriented=True).motors[0], m) < 1e-9
    else:
        assert same(found.motors[0], m) < 1e-9


def test_constraints_that_contradict_each_other() -> None:
    x = RNG.normal(size=(2, 3))
    assert len(grasp(points=(x, 2 * x)).motors) == 0  # another distance
    with pytest.raises(ValueError, match="no constraint"):
        grasp()
    with pytest.raises(ValueError, match="grasp: points: 2 of the gripper, 1 of the object"):
        grasp(points=(x, x[:1]))
    with pytest.raises(ValueError, match="grasp: planes: shape"):
        grasp(planes=(x, x))
