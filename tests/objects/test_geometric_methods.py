"""Distances, angles, projections and motions of elements, compared with algorithms.geometry, numpy and scipy."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from algorithms import geometry
from gacompiler.errors import AlgebraError, LayoutError
from gacompiler.objects import CGA2, CGA3, PGA2, PGA3, QUATERNIONS, VGA2, VGA3
from generated import pga3
from tests.support.all_cases import all_cases

RNG = np.random.default_rng(5)
COUNT = 6
P, Q, T = RNG.normal(size=(3, COUNT, 3))
AXIS = P / np.linalg.norm(P, axis=-1, keepdims=True)
ANGLES = RNG.uniform(0.1, 3.0, COUNT)


def elements(space: Any) -> dict[str, Any]:
    d = space.algebra.POINT.size
    a, b, c = (space.point(x) for x in RNG.normal(size=(3, COUNT, d)))
    found = {"point": (3 if space in (PGA2, PGA3) else 1) * a, "line": -2 * space.line(a, b)}
    if d == 3:
        found["plane"] = 2 * space.plane(a, b, c)
    if space in (CGA2, CGA3):
        found["flat point"] = a ^ space.einf
        found["point pair"] = space.point_pair(a, b)
        round_of = space.sphere if d == 3 else space.circle
        found["round"], found["small"] = (round_of(RNG.normal(size=(COUNT, d)), r) for r in (2.0, 0.3))
    if space is CGA3:
        found["circle"] = -space.circle(a, b, c)
        found["dual plane"] = space.plane(a, b, c).polarity().as_layout(CGA3.DUAL_PLANE)
        found["dual line"] = space.line(a, b).polarity().as_layout(CGA3.DUAL_LINE)
    return found


@pytest.mark.parametrize("name", ["project", "reject", "distance", "angle"])
def test_other_element_may_be_exact_or_a_value_of_a_module(name: str) -> None:
    line, skew = PGA3.line([3, 4, 0], [1, 0, 2]), PGA3.line([0, 1, 1], [5, 1, 0])
    expected = getattr(line, name)(skew)
    for other in (skew.exactly(), pga3.Line(skew.values)):
        difference = getattr(line, name)(other) - expected
        worst, size = (np.abs(getattr(x, "values", x)).max() for x in (difference, expected))
        assert worst < 1e-12 < size, type(other)


def other_meaning(space: Any, one: str, two: str) -> bool:
    """Circles of the plane have angles where they cross; `algorithms` takes them for circles of space."""
    return space is CGA2 and bool({"round", "small"} & {one, two})


@pytest.mark.parametrize(("space", "least"), [(PGA2, 5), (PGA3, 13), (CGA2, 40), (CGA3, 150)])
def test_distances_and_angles_are_those_of_algorithms(space: Any, least: int) -> None:
    compared = 0
    for (one, x), (two, y) in product(elements(space).items(), elements(space).items()):
        for name in ("distance", "angle"):
            try:
                found = getattr(x, name)(y)
            except AlgebraError:
                continue
            if not (name == "angle" and other_meaning(space, one, two)):
                expected = getattr(geometry, name)(x, y)
                assert np.allclose(found, expected, rtol=0, atol=1e-9, equal_nan=True), (name, one, two)
                compared += 1
    assert compared >= least


@all_cases("space", [PGA2, PGA3, CGA2, CGA3])
def test_projections_of_points_are_those_of_algorithms(space: Any) -> None:
    onto = elements(space)
    points = space.point(RNG.normal(size=(COUNT, space.algebra.POINT.size)))
    for name in [name for name in onto if name not in ("point", "flat point", "dual plane", "dual line")]:
        if other_meaning(space, name, name):
            continue
        found, expected = points.project(onto[name]), geometry.project(points, onto[name])
        assert np.allclose(space.coordinates(found), space.coordinates(expected), atol=1e-12), name


def test_circles_of_the_plane() -> None:
    one, two = CGA2.circle([0, 0], 1), CGA2.circle([1, 1], 1)
    assert np.isclose(one.angle(two), np.pi / 2) and np.isclose(one.distance(CGA2.circle([5, 0], 1)), 3)
    assert np.isclose(one.angle(CGA2.line([0, 0], [1, 2])), np.pi / 2) and np.isnan(one.angle(CGA2.circle([5, 0], 1)))
    assert np.allclose(CGA2.coordinates(CGA2.point(3, 4).project(one)), [0.6, 0.8])


def test_vectors() -> None:
    a, b = VGA3.vector(P), VGA3.vector(Q)
    cosine = np.sum(P * Q, -1) / np.linalg.norm(P, axis=-1) / np.linalg.norm(Q, axis=-1)
    assert np.allclose(np.cos(a.angle(b)), cosine) and np.allclose(a.distance(b), np.linalg.norm(P - Q, axis=-1))
    assert np.allclose((a ^ b).normal(), np.cross(P, Q) / np.linalg.norm(np.cross(P, Q), axis=-1, keepdims=True))
    assert np.allclose(
        np.sin(VGA3.vector(T).angle(a ^ b)), np.sum(T * (a ^ b).normal(), -1) / np.linalg.norm(T, axis=-1)
    )
    assert np.allclose((a.reject(b) | b), 0) and a.reject(b).isclose(a - a.project(b)).all()


@pytest.mark.parametrize("space", [PGA3, CGA3])
def test_motors_as_matrices_and_quaternions(space: Any) -> None:
    motor = space.translator(T) * space.rotor(AXIS, ANGLES)
    turn = Rotation.from_rotvec(AXIS * ANGLES[:, None])
    assert np.allclose(motor.translation(), T) and np.allclose(motor.quaternion(), turn.as_quat(scalar_first=True))
    matrix = motor.to_matrix()
    assert np.allclose(matrix[:, :3, :3], turn.as_matrix()) and np.allclose(matrix[:, :3, 3], T)
    assert np.all(space.from_matrix(matrix).isclose(motor) | space.from_matrix(matrix).isclose(-motor))
    dual = motor.dual_quaternion()
    shift = QUATERNIONS.imaginary(T / 2) * QUATERNIONS.quaternion(dual[:, :4])
    assert np.allclose(dual[:, 4:], QUATERNIONS.of(QUATERNIONS.QUATERNION, shift).values)
    assert np.all(space.from_dual_quaternion(dual).isclose(motor))
    axis = motor.axis()
    assert np.allclose(axis.direction(), AXIS) and np.allclose((motor >> axis).distance(axis), 0, atol=1e-12)
    assert np.allclose(motor.pitch() * ANGLES, np.sum(T * AXIS, -1)) and np.allclose(motor.angle(), ANGLES)


def test_rotors_and_quaternions_return() -> None:
    q = Rotation.from_rotvec(AXIS * ANGLES[:, None]).as_quat(scalar_first=True)
    for space in (VGA3, PGA3, CGA3, QUATERNIONS):
        rotor = space.from_quaternion(q)
        assert np.allclose(rotor.quaternion(), q) and np.allclose(rotor.angle(), ANGLES)
    assert np.allclose(QUATERNIONS.from_matrix(VGA3.from_quaternion(q).to_matrix()).quaternion(), q)
    for space, n in ((VGA2, 2), (PGA2, 3), (CGA2, 3)):
        turned = space.rotor(2.5).to_matrix()
        assert turned.shape == (n, n) and space.from_matrix(turned).isclose(space.rotor(2.5))
    for motor in (PGA2.motor(0.7, 1, 2), CGA2.motor(0.7, 1, 2)):
        centre = np.append(motor.center(), 1)
        assert np.allclose(motor.to_matrix() @ centre, centre) and np.allclose(motor.translation(), [1, 2])
    with pytest.raises(LayoutError, match=r"3, 3"):
        VGA3.from_matrix(np.eye(4))
    with pytest.raises(LayoutError, match="not orthogonal"):
        PGA3.from_dual_quaternion([1, 0, 0, 0, 1, 0, 0, 0])


def test_factors_of_blades() -> None:
    line, sphere = PGA3.line(P, Q), CGA3.sphere(P, 2.0)
    pair, plane = CGA3.point_pair(P, Q), VGA3.bivector(P)
    for x, count in ((line, 2), (sphere, 4), (pair, 2), (plane, 2), (VGA3.vector(1, 2, 2), 1)):
        weight, vectors = x.factorize()
        made = vectors[0]
        for each in vectors[1:]:
            made = made ^ each
        assert len(vectors) == count and np.all(x.isclose(weight * made, rtol=1e-9, atol=1e-9))
        for k, v in enumerate(vectors):
            square = np.asarray((v * v).grade(0) if hasattr(v * v, "grade") else v * v)
            assert np.allclose(np.abs(square), np.round(np.abs(square)), atol=1e-9)
            assert all(np.allclose(v | w, 0, atol=1e-9) for w in vectors[:k])


def test_blades_and_versors_of_arrays() -> None:
    mixed = np.stack([PGA3.line([0, 0, 0], [1, 0, 0]), PGA3.of(PGA3.LINE, 1, 2, 3, 4, 5, 6)])
    assert mixed.is_blade().tolist() == [True, False]
    assert np.stack([1 + VGA3.e1, VGA3.e1 + VGA3.e2]).is_versor().tolist() == [False, True]


def test_joins_and_meets_take_the_product_of_the_algebra() -> None:
    for space in (PGA3, CGA3):
        p, q = space.point(1, 0, 0), space.point(0, 1, 0)
        line = p.join(q) if space is PGA3 else p.join(q).join(CGA3.einf)
        found = line.meet(space.plane([1, 0, 0], 0.5))
        assert np.allclose(found.center(), [0.5, 0.5, 0])


def test_a_property_is_that_of_each_element_of_an_array() -> None:
    spheres = CGA3.sphere(P.reshape(2, 3, 3), np.full((2, 3), 2.0))
    assert spheres.radius().shape == (2, 3) and np.allclose(spheres.center(), P.reshape(2, 3, 3))
    assert spheres.explain().startswith("array of shape (2, 3), spheres; the first: sphere, centre (")
    with pytest.raises(LayoutError, match="an imaginary sphere"):
        CGA3.sphere([0, 0, 0], radius_squared=-1).radius()
    with pytest.raises(AlgebraError, match="kinds direction and point"):
        np.stack([PGA3.e032, PGA3.e123]).center()


def test_the_former_name_of_from_matrix() -> None:
    with pytest.warns(DeprecationWarning, match="motor_from_matrix is now from_matrix") as caught:
        found = PGA3.motor_from_matrix(np.eye(4))
    assert caught[0].filename == __file__ and found.isclose(1)


@pytest.mark.parametrize("space", [CGA2, CGA3])
def test_elements_that_touch_have_an_angle(space: Any) -> None:
    """Whether rounding errors separate them or not."""
    d = space.algebra.dimension - 2
    sphere, plane = (space.circle, space.line) if d == 2 else (space.sphere, space.plane)
    rng = np.random.default_rng(8)
    centres, radii = rng.normal(size=(500, d)) * 5, rng.uniform(0.5, 3, (500, 2))
    along = rng.normal(size=(500, d))
    along /= np.linalg.norm(along, axis=-1, keepdims=True)
    one = sphere(centres, radii[:, 0])
    for apart, angle in ((radii.sum(-1), np.pi), (radii[:, 0] - radii[:, 1], 0.0)):
        other = sphere(centres + apart[:, None] * along, radii[:, 1])
        np.testing.assert_allclose(one.angle(other), angle, rtol=0, atol=2e-6)
    apart = radii.sum(-1) + 1e-9
    assert np.isnan(one.angle(sphere(centres + apart[:, None] * along, radii[:, 1]))).all()
    np.testing.assert_allclose(one.angle(one), 0, rtol=0, atol=2e-6)
    heights = np.sum(along * centres, -1) + radii[:, 0]
    normals = [*along.T, -heights] if d == 2 else [along, heights]
    touching = np.sin(one.angle(plane(*normals)))
    np.testing.assert_allclose(touching, 0, rtol=0, atol=2e-6)
