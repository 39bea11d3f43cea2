"""Conformal versors between objects and on every kind of object, against points moved by plain formulas."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from test_toolkit_cga import N, Z, circles, close, lines, pairs, planes, random_versors, same_blade, spheres, unit

from generated import cga3
from tests.support.all_cases import all_cases

O = np.zeros(3)  # noqa: E741


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(43)


def as_versor(motor: Any) -> Any:
    """The sixteen even coefficients of a motor."""
    full = np.zeros((*motor.shape[:-1], 16))
    full[..., [0, 1, 2, 3, 7, 8, 9, 12]] = motor
    return full


def is_unit(v: Any, tolerance: float = 1e-8) -> None:
    one = np.zeros(v.shape)
    one[..., 0] = 1
    size = np.maximum(1, np.sum(v**2, -1, keepdims=True))
    close(cga3.even_product(v, cga3.even_reverse(v)) / size, one / size, tolerance)


def normalized(x: Any) -> Any:
    return x / np.linalg.norm(x, axis=-1, keepdims=True)


def test_versors_move_objects_as_points(rng: np.random.Generator) -> None:
    a, b, c, d = rng.normal(size=(4, N, 3))
    v = random_versors(rng)
    w, x, y, z = (cga3.transform_point(v, p) for p in (a, b, c, d))
    same_blade(cga3.transform_point_pair(v, cga3.point_pair_from_points(a, b)), cga3.point_pair_from_points(w, x), 1e-6)
    same_blade(cga3.transform_circle(v, cga3.circle_from_points(a, b, c)), cga3.circle_from_points(w, x, y), 1e-5)
    same_blade(cga3.transform_sphere(v, cga3.sphere_from_points(a, b, c, d)), cga3.sphere_from_points(w, x, y, z), 1e-4)
    same_blade(cga3.transform_vector(v, cga3.embed_point(a)), cga3.embed_point(w), 1e-7)
    rotation = Rotation.random(N, random_state=7)
    q, t = rotation.as_quat(), rng.normal(size=(N, 3))
    m = cga3.motor_from_rotor_translation(np.stack([q[:, 3], -q[:, 2], q[:, 1], -q[:, 0]], -1), t)
    rotor, translation = cga3.motor_to_rotor_translation(m)
    close(translation, t)
    close(cga3.motor_from_rotor_translation(rotor, translation), m)
    close(as_versor(m), cga3.versor_from_motor(m), 0)


def directed(rng: np.random.Generator, kind: str) -> Any:
    return {"lines": lines(rng)[-1], "planes": planes(rng)[-1], "circles": circles(rng)[-1],
            "point_pairs": cga3.point_pair_polarity(pairs(rng)[-1]), "spheres": spheres(rng)[-1]}[kind]  # fmt: skip


MOVES = {
    "lines": cga3.move_line, "planes": cga3.move_plane, "circles": cga3.transform_circle,
    "point_pairs": cga3.transform_circle, "spheres": cga3.transform_sphere,
}  # fmt: skip


@all_cases("kind", list(MOVES))
def test_versors_between_objects_take_one_to_the_other(rng: np.random.Generator, kind: str) -> None:
    between = {"lines": cga3.motor_between_lines, "planes": cga3.motor_between_planes,
               "spheres": cga3.versor_between_spheres}.get(kind, cga3.versor_between_circles)  # fmt: skip
    move = MOVES[kind]
    a, b = directed(rng, kind), directed(rng, kind)
    opposite = -2 * a
    for first, second in ((a, b), (a, a), (a, opposite), (b, -a), (a, -a * (1 + 1e-13)), (a, 3 * a + 1e-9 * b * 0)):
        v = between(first, second)
        assert np.isfinite(v).all()
        is_unit(as_versor(v) if v.shape[-1] == 8 else v, 1e-6)
        error = np.max(np.abs(normalized(move(v, first)) - normalized(second)), -1)
        assert np.median(error) < 1e-12
        assert np.max(error) < 1e-4


def test_nearly_opposite_lines_and_planes(rng: np.random.Generator) -> None:
    for kind, place in (("lines", lines(rng)), ("planes", planes(rng))):
        p, d, a = place
        for angle in (1e-12, 1e-8, 1e-4, 0.1, 0.5):
            side = unit(np.cross(d, rng.normal(size=(N, 3))))
            e = -np.cos(angle) * d + np.sin(angle) * side
            make = cga3.line_from_point_direction if kind == "lines" else cga3.plane_from_point_normal
            b = make(p + rng.normal(size=(N, 3)), e)
            found = normalized(MOVES[kind](getattr(cga3, f"motor_between_{kind}")(a, b), a))
            close(found, normalized(b), 1e-9)


def test_imaginary_and_mixed_rounds(rng: np.random.Generator) -> None:
    c, d = rng.normal(size=(2, N, 3))
    r, s = rng.uniform(0.5, 2, (2, N))
    a, b = cga3.sphere_from_centre_radius_squared(c, -r), cga3.sphere_from_centre_radius_squared(d, -s)
    v = cga3.versor_between_spheres(a, b)
    close(normalized(cga3.transform_sphere(v, a)), normalized(b), 1e-7)
    assert np.isnan(cga3.versor_between_spheres(a, -b)).all()
    assert np.isnan(cga3.versor_between_spheres(a, cga3.sphere_from_centre(d, s))).all()
    real, unreal = cga3.circle_from_centre(c, d, r), cga3.circle_from_centre(d, c, -r)
    assert np.isnan(cga3.versor_between_circles(real, unreal)).all()
    assert np.isnan(cga3.versor_between_spheres(a, cga3.sphere_from_centre(d, 0.0))).all()
    ring, axis = cga3.circle_from_centre(O, Z, 1.0), cga3.circle_from_line(cga3.line_from_point_direction(O, Z))
    assert np.isnan(cga3.versor_between_circles(ring, axis)).all()


def test_sums_of_versors_become_versors(rng: np.random.Generator) -> None:
    v = random_versors(rng)
    near = cga3.even_product(v, cga3.versor_exponential(rng.normal(size=(N, 10)) / 10))
    middle = cga3.normalize_versor(v + near)
    is_unit(middle, 1e-10)
    half = cga3.even_product(v, cga3.versor_square_root(cga3.even_product(cga3.even_reverse(v), near)))
    close(middle, half, 1e-9)
    close(cga3.normalize_versor(3 * v), v, 1e-10)


def test_projections_of_blades(rng: np.random.Generator) -> None:
    p, n, plane = planes(rng)
    q, d, line = lines(rng)
    dual = cga3.sphere_polarity(cga3.sphere_from_plane(plane))
    below = cga3.project_circle_on_sphere(cga3.circle_from_line(line), dual)
    foot = q - np.sum((q - p) * n, -1)[:, None] * n
    flat = d - np.sum(d * n, -1)[:, None] * n
    size = np.linalg.norm(cga3.line_to_direction_moment(line)[0], axis=-1)
    expected = size[:, None] * cga3.line_from_point_direction(foot, flat)
    close(below, cga3.circle_from_line(expected), 1e-8)
    _, m, _, circle = circles(rng)
    in_plane = cga3.project_circle_on_sphere(circle, dual)
    real = np.abs(np.sum(m * n, -1)) > 0.1
    close(np.abs(np.sum(cga3.circle_normal(in_plane) * n, -1))[real], 1 + 0 * n[real, 0], 1e-9)
    close(np.sum((cga3.circle_centre(in_plane) - p) * n, -1)[real], 0 * n[real, 0], 1e-6)


def test_exponentials_logarithms_and_powers(rng: np.random.Generator) -> None:
    tiny = np.array([0, 1e-12, 1e-9, 1e-5, np.pi - 1e-12, np.pi - 1e-7])
    angle = np.concatenate([tiny, rng.uniform(0, 3.1, N - len(tiny))])
    axis, t, x = rng.normal(size=(3, N, 3))
    t[: N // 10] = 0
    rotation = Rotation.from_rotvec(angle[:, None] * unit(axis))
    rotor = cga3.rotor_from_axis_angle(axis, angle)
    close(cga3.rotate_point(rotor, x), rotation.apply(x), 1e-12)
    m = cga3.motor_from_rotor_translation(rotor, t)
    close(cga3.motor_exponential(cga3.motor_logarithm(m)), m, 1e-13)
    half = cga3.motor_square_root(m)
    close(cga3.motor_product(half, half), m, 1e-12)
    third = cga3.motor_power(m, 1 / 3)
    close(cga3.motor_product(third, cga3.motor_product(third, third)), m, 1e-11)
    matrix = Rotation.from_rotvec(angle[:, None] / 2 * unit(axis))
    close(cga3.motor_to_rotor_translation(half)[0], cga3.rotor_from_axis_angle(axis, angle / 2), 1e-12)
    close(cga3.move_point(half, x) - cga3.move_point(half, O), matrix.apply(x), 1e-11)
    between = cga3.interpolate_motors(half, cga3.motor_product(m, half), 0.5)
    close(between, m, 1e-10)
    v = random_versors(rng)
    close(cga3.versor_exponential(cga3.versor_logarithm(v)), v * np.where(v[:, :1] < 0, -1, 1), 1e-9)
    a = rng.normal(size=(N, 32))
    close(cga3.polarity(cga3.polarity(a)), -a, 1e-15)
