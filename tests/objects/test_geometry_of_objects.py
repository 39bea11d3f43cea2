"""What elements are: centres, radii, directions, normals and screws, compared with vectors and with scipy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gacompiler.errors import AlgebraError
from gacompiler.objects import CGA2, CGA3, PGA2, PGA3, QUATERNIONS, STA, VGA2, VGA3
from tests.support.all_cases import all_cases

P, Q = np.array([[1.0, 2, 3], [-2, 0, 5]]), np.array([[0.0, 1, -1], [4, 4, 1]])
N = np.array([[2.0, 3, 6], [-6, 2, 3]]) / 7
RADII = np.array([2.0, 0.5])
ANGLES, SHIFTS = np.array([0.7, 3.0]), np.array([2.0, -1.5])


def close(a: Any, b: Any, atol: float = 1e-12) -> bool:
    return np.shape(a) == np.shape(b) and bool(np.allclose(a, b, rtol=1e-12, atol=atol))


def test_centres_radii_directions_and_normals() -> None:
    for points in (PGA3.point(P), 3 * PGA3.point(P), CGA3.point(P), 2 * CGA3.point(P)):
        assert close(points.center(), P) and close(points[0].center(), P[0])
    circle, sphere = CGA3.circle(P, N, RADII), CGA3.sphere(P, RADII)
    assert close(circle.center(), P) and close(circle.radius(), RADII) and close(circle.normal(), N)
    assert (
        close(sphere.center(), P)
        and close(sphere.radius(), RADII)
        and np.all(np.isnan(CGA3.sphere(P, radius_squared=-1).radius()))
    )
    assert close(CGA2.circle(P[:, :2], RADII).center(), P[:, :2])
    pair = CGA3.point_pair(CGA3.point(P), CGA3.point(Q))
    assert all(close(CGA3.coordinates(x), y) for x, y in zip(pair.points(), (P, Q), strict=True))
    assert close(pair.radius(), np.linalg.norm(P - Q, axis=-1) / 2)
    along = (Q - P) / np.linalg.norm(Q - P, axis=-1, keepdims=True)
    for line in (PGA3.line(P, Q), CGA3.line(P, Q)):
        assert close(line.direction(), along)
    for plane in (PGA3.plane(2 * N, 3.0), CGA3.plane(2 * N, 3.0)):
        assert close(plane.normal(), N)
    assert close(PGA2.line([0, 1], [5, 1]).direction(), [1, 0]) and close(PGA2.line([0, 1], [5, 1]).normal(), [0, 1])
    assert close(VGA3.vector(3 * N).direction(), N) and close(PGA3.direction(3 * N).direction(), N)


@pytest.mark.parametrize("space", [PGA3, CGA3])
def test_screws_are_those_of_their_making(space: Any) -> None:
    line = space.line(P, P + N)
    motor = space.motor(line, ANGLES, SHIFTS)
    assert close(motor.angle(), ANGLES) and close(motor.pitch(), SHIFTS / ANGLES)
    assert close(motor.axis().direction(), N) and close(motor.axis().distance(line), [0, 0])
    matrix = motor.to_matrix()
    assert close(matrix[..., :3, :3], Rotation.from_rotvec(ANGLES[:, None] * N).as_matrix())
    moved = space.coordinates(motor >> space.point(Q))
    assert close(np.einsum("kij,kj->ki", matrix, np.concatenate([Q, np.ones((2, 1))], -1))[:, :3], moved)
    assert close((-motor).angle(), ANGLES) and np.isinf(space.translator([1, 2, 3]).pitch())


def test_rotations() -> None:
    for rotor in (VGA3.rotor(N, ANGLES), QUATERNIONS.rotation(N, ANGLES), -QUATERNIONS.rotation(N, ANGLES)):
        assert close(rotor.angle(), ANGLES) and close(rotor.axis(), N)
        assert close(rotor.to_matrix(), Rotation.from_rotvec(ANGLES[:, None] * N).as_matrix())
    assert VGA2.rotor(-0.5).angle() == pytest.approx(-0.5) and PGA2.motor(2.0, 1, 2).angle() == pytest.approx(2.0)
    c, s = np.cos(0.5), np.sin(0.5)
    assert close(VGA2.rotor(0.5).to_matrix(), [[c, -s], [s, c]])
    assert close(PGA2.motor(0.5, 1, 2).to_matrix(), [[c, -s, 1], [s, c, 2], [0, 0, 1]])


def test_blades_versors_and_parts() -> None:
    line, other = PGA3.line([0, 0, 0], [1, 0, 0]), PGA3.line([0, 0, 1], [0, 1, 1])
    assert line.is_blade() and not (line + other).is_blade() and line.grades() == (2,)
    assert (1 + VGA3.e12).is_versor() and not (1 + VGA3.e1).is_versor() and PGA3.motor([0, 0, 1], 1, 2).is_versor()
    assert not (VGA3.e1 + VGA3.e123 * 0.5 + VGA3.e12).is_versor()
    v = VGA3.vector(1, 2, 3)
    assert v.reject(VGA3.e12).isclose(3 * VGA3.e3) and (v.project(VGA3.e12) + v.reject(VGA3.e12)).isclose(v)


EXPLAINED = [
    (CGA3.circle([0, 0, 1], [0, 0, 1], np.sqrt(3)), "circle, centre (0, 0, 1), normal (0, 0, 1), radius 1.73"),
    (CGA3.sphere([1, 2, 3], radius_squared=-4), "imaginary sphere, centre (1, 2, 3), radius 2"),
    (CGA3.dilator(2.5), "scaling by 2.5 about the origin"),
    (CGA3.point(1, 2, 3) ^ CGA3.einf, "point (1, 2, 3)"),
    (PGA3.motor(PGA3.line([1, 0, 0], [1, 0, 1]), 1.0, 2),
     "motor, turns by 57.3 degrees about the line through (1, 0, 0) along (0, 0, 1) and moves 2 along it"),
    (PGA3.translator([1, 2, 3]), "translation by (1, 2, 3)"),
    (PGA3.plane(0, 0, 2, -2), "plane, normal (0, 0, 1), distance 1"),
    (PGA3.line([0, 0, 1], [1, 0, 1]), "line through (0, 0, 1) along (1, 0, 0)"),
    (PGA3.line([0, 0, 0], [1, 0, 0]) + PGA3.line([0, 0, 1], [0, 1, 1]),
     "screw through (0, 0, 0.5) along (0.707, 0.707, 0), pitch -0.5"),
    (PGA3.point(np.eye(3)), "array of shape (3,), points; the first: point (1, 0, 0)"),
    (PGA2.motor(np.pi / 2, 2, 0), "rotation by 90 degrees about (1, 1)"),
    (VGA3.bivector(2, 0, 0), "plane through the origin, normal (0, 0, 1)"),
    (QUATERNIONS.quaternion(0, 0, 0, 3), "quaternion of norm 3: rotation by 180 degrees about (0, 0, 1)"),
    (1 + VGA3.e1, "multivector with grades 0 and 1"),
    (STA.vector(1, 2, 3, 4), "spacelike vector (1, 2, 3, 4), length 5.29"),
    (0 * VGA3.e1, "zero"),
]  # fmt: skip


@all_cases("x, text", EXPLAINED)
def test_explanations(x: Any, text: str) -> None:
    assert x.explain() == text


def test_elements_without_a_property_are_refused() -> None:
    plane, motor = PGA3.plane(0, 0, 1, -1), PGA3.motor([0, 0, 1], 1)
    for run, text in (
        (plane.radius, r"radius: a plane, PGA3.PLANE; expected a point pair, circle or sphere"),
        (plane.center, "center: a plane, PGA3"), (motor.normal, "normal.*PGA3.*expected a plane or circle"),
        (CGA3.sphere([0, 0, 0], 1).normal, "normal: a sphere"), (motor.direction, "direction.*PGA3"),
        (STA.boost(0.5, 0, 0).angle, "angle.*STA"), (PGA3.point(1, 2, 3).points, "points: a point"),
        (plane.angle, "angle: a PGA3.PLANE; expected a rotor"), (VGA3.rotor([0, 0, 1], 1).pitch, "PGA3 or CGA3"),
        (PGA2.motor(1, 1, 2).axis, r"center\(\) is what"), (lambda: plane.distance(3), "distance: int"),
        (lambda: plane.distance(CGA3.point(1, 2, 3)), "multivectors of CGA3"), ((1 + VGA3.e1).factorize, "not a blade"),
        (lambda: CGA3.circle([0, 0, 0], [0, 0, 1], 1).distance(CGA3.line([2, 0, 0], [2, 1, 1])), "no closed form"),
    ):  # fmt: skip
        with pytest.raises(AlgebraError, match=text):
            run()
