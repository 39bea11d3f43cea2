"""Grasps: motors are recovered from moved elements, and degrees of freedom agree with geometry."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from algorithms.kinematics.grasps import grasp
from generated import pga3
from tests.support.all_cases import all_cases

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
        # with either orientation: half turns about the line, the normal, and their common perpendicular
        either = grasp(*pairs)
        assert len(either.motors) == 4 and min(same(one, m) for one in either.motors) < 1e-9
        for one in either.motors:
            assert np.abs(pga3.move_point(one, x) - moved[0]).max() < 1e-9
            assert same(pga3.move_line(one, ln), moved[1]) < 1e-9 and same(pga3.move_plane(one, h), moved[2]) < 1e-9


@all_cases(
    "kinds, freedoms",
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
def test_remaining_degrees_of_freedom(kinds: str, freedoms: int) -> None:
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


Z = np.array([0.0, 0.0, 1.0])
ORIGIN = np.zeros(3)


def turned(vector: np.ndarray) -> np.ndarray:
    """A rotation about the origin as a matrix (4, 4)."""
    found = np.eye(4)
    found[:3, :3] = Rotation.from_rotvec(vector).as_matrix()
    return found


def slid(x: float, y: float, z: float) -> np.ndarray:
    found = np.eye(4)
    found[:3, 3] = x, y, z
    return found


FREE: dict[str, tuple[dict[str, list[np.ndarray]], int, Callable[[np.ndarray], np.ndarray]]] = {
    "point": ({"points": [ORIGIN]}, 3, lambda u: turned(u)),
    "line": ({"lines": [line(ORIGIN, Z)]}, 2, lambda u: slid(0, 0, u[1]) @ turned(u[0] * Z)),
    "plane": ({"planes": [plane(ORIGIN, Z)]}, 3, lambda u: slid(u[0], u[1], 0) @ turned(u[2] * Z)),
    "point on line": ({"points": [ORIGIN], "lines": [line(ORIGIN, Z)]}, 1, lambda u: turned(u[0] * Z)),
    "two points": ({"points": [ORIGIN, Z]}, 1, lambda u: turned(u[0] * Z)),
    "parallel lines": ({"lines": [line(ORIGIN, Z), line(np.array([1.0, 0, 0]), Z)]}, 1, lambda u: slid(0, 0, u[0])),
    "two planes": ({"planes": [plane(ORIGIN, np.eye(3)[k]) for k in (0, 1)]}, 1, lambda u: slid(0, 0, u[0])),
    "line across plane": ({"lines": [line(ORIGIN, Z)], "planes": [plane(ORIGIN, Z)]}, 1, lambda u: turned(u[0] * Z)),
}
"""Elements held at the origin, the number of remaining degrees of freedom, and the free motions as matrices."""


@pytest.mark.parametrize(("name", "length"), [(name, (0.1, 3.0)[k % 2]) for k, name in enumerate(FREE)])
def test_the_nearest_grasp_is_the_one_that_a_search_finds(name: str, length: float) -> None:
    """All grasps are one grasp after motions that preserve the features of the gripper; scipy minimises over these."""
    held, freedoms, motion = FREE[name]
    moves = {"points": pga3.move_point, "lines": pga3.move_line, "planes": pga3.move_plane}
    rng = np.random.default_rng(len(name))
    gripper, grip, near = (pga3.motor_exponential(rng.normal(size=6)) for _ in range(3))
    pairs = {
        kind: (moves[kind](gripper, np.array(some)), moves[kind](grip, moves[kind](gripper, np.array(some))))
        for kind, some in held.items()
    }
    found = grasp(**pairs, near=near, oriented=True, length=length)
    assert found.freedoms.tolist() == [freedoms]
    frame, first, wanted = (pga3.motor_to_matrix(motor) for motor in (gripper, grip, near))
    back = np.linalg.inv(frame)

    def square(pose: np.ndarray, wanted: np.ndarray = wanted) -> float:
        offset, turn = pose[:3, 3] - wanted[:3, 3], pose[:3, :3] - wanted[:3, :3]
        return float(offset @ offset + length**2 * np.square(turn).sum() / 2)

    def away(u: np.ndarray, first: np.ndarray = first, frame: np.ndarray = frame, back: np.ndarray = back) -> float:
        return square(first @ frame @ motion(u) @ back)

    starts = rng.uniform(-3, 3, (4, 3))
    best = min(minimize(away, start, method="BFGS", options={"gtol": 1e-9}).fun for start in starts)
    mine = square(pga3.motor_to_matrix(found.motors[0]))
    assert mine <= best * (1 + 1e-12) + 1e-12 and mine == pytest.approx(best, rel=1e-7, abs=1e-9)
    assert found.distances[0] == pytest.approx(np.sqrt(mine), rel=1e-7, abs=1e-7)
    for kind, (own, goal) in pairs.items():
        assert np.abs(moves[kind](found.motors[0], own) - goal).max() < 1e-9
    again = grasp(**pairs, near=-near, oriented=True, length=length)
    assert same(again.motors[0], found.motors[0]) < 1e-9


def test_the_nearest_of_several_orientations_is_first() -> None:
    """The axis of a gripper on a line in either orientation: the nearest grasp has the current orientation."""
    own = line(ORIGIN, Z)[None]
    for angle in (0.3, 3.0):
        near = pga3.motor_from_line(line(ORIGIN, np.array([1.0, 0, 0])), angle)
        found = grasp(lines=(own, own), near=near)
        assert len(found.motors) == 2 and (np.diff(found.distances) > 0).all()
        upright = pga3.motor_to_matrix(found.motors[0])[2, 2]
        assert upright == pytest.approx(np.sign(np.cos(angle)), abs=1e-12)
        assert found.distances[0] == pytest.approx(2 * np.sin(min(angle, np.pi - angle) / 2), abs=1e-9)


def test_invalid_reference_poses() -> None:
    own = line(ORIGIN, Z)[None]
    for near in (np.zeros(8), np.eye(8)[5]):
        with pytest.raises(ValueError, match=r"grasp: near: .*; expected a motor"):
            grasp(lines=(own, own), near=near)
    with pytest.raises(ValueError, match="grasp: near: nan at"):
        grasp(lines=(own, own), near=np.full(8, np.nan))
    with pytest.raises(ValueError, match="grasp: lines: nan at"):
        grasp(lines=(own, own * np.nan))
    with pytest.raises(ValueError, match=r"grasp: length: 0\.0; expected a positive number"):
        grasp(lines=(own, own), length=0.0)


def test_constraints_that_contradict_each_other() -> None:
    x = RNG.normal(size=(2, 3))
    assert len(grasp(points=(x, 2 * x)).motors) == 0  # a different distance
    with pytest.raises(ValueError, match="no constraint"):
        grasp()
    with pytest.raises(ValueError, match="grasp: points: 2 of the gripper, 1 of the object"):
        grasp(points=(x, x[:1]))
    with pytest.raises(ValueError, match="grasp: planes: shape"):
        grasp(planes=(x, x))
