"""Constructors of numeric objects, against vectors, matrices and closed forms."""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gacompiler.errors import AlgebraError, LayoutError
from gacompiler.objects import CGA2, CGA3, PGA2, PGA3, QUATERNIONS, STA, VGA2, VGA3
from tests.support.all_cases import all_cases

RNG = np.random.default_rng(0)
N = 200
AXES, ANGLES, PLACES, SHIFTS = (
    RNG.normal(size=(N, 3)),
    RNG.uniform(-6, 6, N),
    RNG.normal(size=(N, 3)),
    RNG.normal(size=(N, 3)),
)
UNIT = AXES / np.linalg.norm(AXES, axis=-1, keepdims=True)
ROTATIONS = Rotation.from_rotvec(UNIT * ANGLES[:, None])
CENTRES, RADII = RNG.normal(size=(N, 3)), RNG.uniform(0.1, 3, N)


def close(a: Any, b: Any, tolerance: float = 1e-12) -> bool:
    return bool(np.allclose(a, b, rtol=0, atol=tolerance))


def test_rotors_follow_the_right_hand_rule() -> None:
    wanted = ROTATIONS.apply(PLACES)
    assert close((VGA3.rotor(AXES, ANGLES) >> VGA3.vector(PLACES)).values, wanted)
    assert close(PGA3.coordinates(PGA3.rotor(AXES, ANGLES) >> PGA3.point(PLACES)), wanted)
    assert close(CGA3.coordinates(CGA3.rotor(AXES, ANGLES) >> CGA3.point(PLACES)), wanted)
    assert close(QUATERNIONS.rotate(QUATERNIONS.rotation(AXES, ANGLES), QUATERNIONS.imaginary(PLACES)).values, wanted)
    assert close((STA.rotor(AXES, ANGLES) >> STA.vector(np.c_[np.ones(N), PLACES])).values[:, 1:], wanted)
    quaternions = np.abs(QUATERNIONS.rotation(AXES, ANGLES).values)
    assert close(quaternions, np.abs(ROTATIONS.as_quat()[:, [3, 0, 1, 2]]))


def test_rotors_of_the_plane() -> None:
    turned = np.stack([np.cos(ANGLES), np.sin(ANGLES)], -1)
    assert close((VGA2.rotor(ANGLES) >> VGA2.vector(1, 0)).values, turned)
    assert close(PGA2.coordinates(PGA2.rotor(ANGLES) >> PGA2.point(1, 0)), turned)
    assert close(CGA2.coordinates(CGA2.rotor(ANGLES) >> CGA2.point(1, 0)), turned)
    centre, east = np.array([2.0, -1.0]), np.array([1.0, 0.0])
    assert close(PGA2.coordinates(PGA2.rotor(ANGLES, PGA2.point(centre)) >> PGA2.point(centre + east)), centre + turned)
    assert close(CGA2.coordinates(CGA2.rotor(ANGLES, centre) >> CGA2.point(centre + east)), centre + turned)


def test_translators_and_motors() -> None:
    moved = ROTATIONS.apply(PLACES) + SHIFTS
    assert close(PGA3.coordinates(PGA3.translator(SHIFTS) >> PGA3.point(PLACES)), PLACES + SHIFTS)
    assert close(CGA3.coordinates(CGA3.translator(SHIFTS) >> CGA3.point(PLACES)), PLACES + SHIFTS)
    assert close(
        PGA2.coordinates(PGA2.translator(SHIFTS[:, :2]) >> PGA2.point(PLACES[:, :2])), (PLACES + SHIFTS)[:, :2]
    )
    assert close(
        CGA2.coordinates(CGA2.translator(SHIFTS[:, :2]) >> CGA2.point(PLACES[:, :2])), (PLACES + SHIFTS)[:, :2]
    )
    cga = CGA3.translator(SHIFTS) * CGA3.rotor(AXES, ANGLES)
    assert cga.layout == CGA3.MOTOR and close(CGA3.coordinates(cga >> CGA3.point(PLACES)), moved)
    matrices = np.tile(np.eye(4), (N, 1, 1))
    matrices[:, :3, :3], matrices[:, :3, 3] = ROTATIONS.as_matrix(), SHIFTS
    pga = PGA3.from_matrix(matrices)
    assert pga.layout == PGA3.MOTOR and close(PGA3.coordinates(pga >> PGA3.point(PLACES)), moved)
    assert close(CGA3.coordinates(CGA3.motor([0, 0, 1], pi / 2, 1, 2, 3) >> CGA3.point(1, 0, 0)), [1, 3, 3])
    assert close(PGA2.coordinates(PGA2.motor(pi / 2, 1, 2) >> PGA2.point(1, 0)), [1, 3])
    assert close(CGA2.coordinates(CGA2.motor(pi / 2, 1, 2) >> CGA2.point(1, 0)), [1, 3])


def test_screws_about_lines() -> None:
    lines = PGA3.line(PGA3.point(CENTRES), PGA3.direction(AXES))
    distances = RNG.normal(size=N)
    moved = PGA3.coordinates(PGA3.motor(lines, ANGLES, distances) >> PGA3.point(PLACES))
    assert close(moved, CENTRES + ROTATIONS.apply(PLACES - CENTRES) + UNIT * distances[:, None], 1e-11)
    about = PGA3.coordinates(PGA3.rotor(lines, ANGLES) >> PGA3.point(PLACES))
    assert close(about, CENTRES + ROTATIONS.apply(PLACES - CENTRES), 1e-11)
    turned = CGA3.coordinates(CGA3.rotor([0, 0, 1], pi / 2, [1, 0, 0]) >> CGA3.point(2, 0, 5))
    assert close(turned, [1, 1, 5])


def test_rotors_between_vectors() -> None:
    a, b = VGA3.vector(AXES), VGA3.vector(PLACES)
    turned = (VGA3.rotor_between(a, b) >> a).values
    assert close(turned / np.linalg.norm(turned, axis=-1)[:, None], PLACES / np.linalg.norm(PLACES, axis=-1)[:, None])
    assert close(np.linalg.norm(turned, axis=-1), np.linalg.norm(AXES, axis=-1))
    assert close((VGA2.rotor_between(VGA2.e1, VGA2.vector(0, 3)) >> VGA2.e1).values, [0, 1])
    mirrored = VGA3.reflect(VGA3.vector(AXES), VGA3.vector(PLACES)).values
    assert close(mirrored, PLACES - 2 * (PLACES * UNIT).sum(-1, keepdims=True) * UNIT)


def test_incidence_in_projective_space() -> None:
    p, q, r = (PGA3.point(x) for x in (PLACES, CENTRES, SHIFTS))
    plane = PGA3.plane(p, q, r)
    normal = np.cross(CENTRES - PLACES, SHIFTS - PLACES)
    found = plane.values[:, :3]
    assert close(np.cross(found, normal), 0, 1e-10) and close(np.abs((plane ^ p).values), 0, 1e-10)
    given = PGA3.plane(1, 2, 3, -4)
    assert np.array_equal((given ^ PGA3.point(4, 0, 0)).values, [0]) and (given ^ PGA3.point(0, 0, 0)).values != 0
    assert close((PGA3.line(p, q)).norm(), np.linalg.norm(PLACES - CENTRES, axis=-1))
    a, b = PGA2.line(1, 0, -2), PGA2.line(0, 1, -3)
    assert close(PGA2.coordinates(a ^ b), [2, 3])
    assert np.array_equal((PGA2.line(PGA2.point(0, 1), PGA2.point(1, 1)) ^ PGA2.point(7, 1)).values, [0])


def test_rounds_and_flats() -> None:
    spheres = CGA3.sphere(CENTRES, RADII)
    assert spheres.layout == CGA3.SPHERE
    assert close(CGA3.centre(spheres), CENTRES, 1e-11) and close(CGA3.radius_squared(spheres), RADII**2, 1e-11)
    on = CGA3.point(CENTRES + RADII[:, None] * UNIT)
    assert close((spheres ^ on).values, 0, 1e-11), "the sphere spans its points"
    imaginary = CGA3.sphere(CENTRES, radius_squared=-(RADII**2))
    assert close(CGA3.radius_squared(imaginary), -(RADII**2), 1e-11)
    circles = CGA3.circle(CENTRES, AXES, RADII)
    assert circles.layout == CGA3.CIRCLE
    assert close(CGA3.centre(circles), CENTRES, 1e-11) and close(CGA3.radius_squared(circles), RADII**2, 1e-11)
    across = np.cross(UNIT, PLACES)
    across *= RADII[:, None] / np.linalg.norm(across, axis=-1, keepdims=True)
    assert close((circles ^ CGA3.point(CENTRES + across)).values, 0, 1e-11)
    plane = CGA3.plane(AXES, RADII)
    assert np.all(CGA3.is_flat(plane)) and not np.any(CGA3.is_flat(spheres))
    assert close((plane ^ CGA3.point(UNIT * RADII[:, None] + across)).values, 0, 1e-11)
    line = CGA3.line(CGA3.point(CENTRES), AXES)
    assert line.layout == CGA3.LINE and close((line ^ CGA3.point(CENTRES + 2 * AXES)).values, 0, 1e-10)
    through = CGA3.line(CGA3.point(CENTRES), CGA3.point(PLACES))
    assert close((through ^ CGA3.point(2 * PLACES - CENTRES)).values, 0, 1e-10)
    pair = CGA3.point_pair(CGA3.point(CENTRES), CGA3.point(PLACES))
    assert close(CGA3.centre(pair), (CENTRES + PLACES) / 2, 1e-10)
    assert close(CGA3.radius_squared(pair), ((CENTRES - PLACES) ** 2).sum(-1) / 4, 1e-10)
    round_ = CGA2.circle(CENTRES[:, :2], RADII)
    assert close(CGA2.centre(round_), CENTRES[:, :2], 1e-11) and close(CGA2.radius_squared(round_), RADII**2, 1e-11)
    three = CGA2.point(0, 0) ^ CGA2.point(2, 0) ^ CGA2.point(0, 2)
    assert close(CGA2.centre(three), [1, 1]) and CGA2.radius_squared(three) == pytest.approx(2)


def test_scaling() -> None:
    factors = RNG.uniform(0.1, 5, N)
    assert close(CGA3.coordinates(CGA3.dilator(factors) >> CGA3.point(PLACES)), factors[:, None] * PLACES)
    assert close(CGA2.coordinates(CGA2.dilator(2) >> CGA2.point(1, 2)), [2, 4])


def test_boosts() -> None:
    velocities = UNIT * RNG.uniform(0, 0.99, N)[:, None]
    gamma = 1 / np.sqrt(1 - (velocities**2).sum(-1))
    moved = (STA.boost(velocities) >> STA.g0).values
    assert np.allclose(moved, gamma[:, None] * np.c_[np.ones(N), velocities], rtol=1e-12)
    assert STA.boost(0, 0, 0).isclose(1.0) and STA.boost(0.6, 0, 0).layout == STA.ROTOR


@all_cases(
    "wrong, error, message",
    [
        (lambda: STA.boost(1, 0, 0), LayoutError, "less than 1"),
        (lambda: CGA3.dilator(-1), LayoutError, "positive"),
        (lambda: CGA3.sphere([0, 0, 0]), LayoutError, "no radius"),
        (lambda: CGA3.sphere([0, 0, 0], 1, radius_squared=1), LayoutError, "two radii"),
        (lambda: CGA3.centre(CGA3.plane([0, 0, 1], 1)), AlgebraError, "flat"),
        (lambda: CGA3.centre(CGA3.motor([0, 0, 1], 1.0, 1, 2, 3)), AlgebraError, "blade"),
        (lambda: CGA3.coordinates(CGA3.einf), LayoutError, "e0"),
        (lambda: PGA3.coordinates(PGA3.direction(1, 2, 3)), LayoutError, "infinity"),
        (lambda: PGA3.from_matrix(np.ones((4, 4))), LayoutError, "not a rigid motion"),
        (lambda: PGA3.from_matrix(np.ones((3, 4))), LayoutError, "4, 4"),
        (lambda: PGA3.rotor(PGA3.of(PGA3.LINE, 1, 2, 3, 4, 5, 6), 1.0), AlgebraError, "not a blade"),
        (lambda: PGA3.line(PGA3.point(1, 2, 3)), LayoutError, "objects to join"),
    ],
)
def test_error_messages(wrong: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        wrong()


@all_cases("space", [PGA2, PGA3, CGA2, CGA3])
def test_random_motors(space: Any) -> None:
    """Rotations are uniform: matrices have mean 0, squared traces mean 1 (Schur); translations are normal."""
    d, n = space.algebra.POINT.size, 4000
    m = space.random_motor(n, 2.0, 0)
    assert m.layout == space.algebra.MOTOR and m.shape == (n,) and space.random_motor((2, 3)).shape == (2, 3)
    assert space.random_motor().shape == () and abs(np.mean(m.scalar > 0) - 0.5) < 0.03
    origin = space.coordinates(m >> space.point(np.zeros(d)))
    frame = space.coordinates(m[:, None] >> space.point(np.eye(d))) - origin[:, None]
    assert close(frame @ np.swapaxes(frame, -1, -2), np.eye(d)) and close(np.linalg.det(frame), 1)
    assert np.abs(frame.mean(0)).max() < 0.04
    assert abs(np.mean(np.trace(frame, axis1=1, axis2=2) ** 2) - (1 if d == 3 else 2)) < 0.1
    assert np.abs(origin.mean(0)).max() < 0.15 and np.abs(origin.std(0) - 2).max() < 0.1
    assert np.array_equal(space.random_motor(n, 2.0, 0).values, m.values)
