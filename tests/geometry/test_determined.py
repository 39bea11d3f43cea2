"""Whether data determine a result: both sides of thresholds, in any unit, for single sets and with leading axes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from toolkit_truth import apply, close, line_of, plane_of, poses, turn

from algorithms.geometry import fit_circle, fit_cone, fit_cylinder, fit_line, fit_plane, fit_sphere
from algorithms.motors import (
    motor_from_objects,
    motor_from_points,
    rotor_from_frames,
    rotor_from_vectors,
    similarity_from_points,
)
from generated import cga3, pga3
from tests.support.all_cases import all_cases

LEADING = (2, 5)
"""No two axes of a batch are of the same length, so that none can be taken for another."""
UNITS = (1e-4, 1.0, 1e4)


def motions() -> np.ndarray:
    """Random directions without the special ones at the beginning."""
    return poses(np.random.default_rng(1), 40)[-10:].reshape(*LEADING, 4, 4)


def frames() -> np.ndarray:
    return motions()[..., :3, :3]


def both(call: Callable[..., Any], *arguments: np.ndarray) -> np.ndarray:
    """``determined`` of a batch, after comparing it with that of its elements one by one."""
    found = call(*arguments).determined
    assert found.shape == LEADING
    for k in np.ndindex(LEADING):
        assert call(*(each[k] for each in arguments)).determined == found[k]
    return np.asarray(found)


CROSS = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]])


@all_cases("size", UNITS)
@all_cases(
    "call, shift",
    [
        (rotor_from_vectors, 0.0),
        (motor_from_points, 3.0),
        (similarity_from_points, 3.0),
        (lambda a, b: motor_from_objects(points=(a, b)), 1e3),
    ],
)
def test_a_cross_with_a_short_arm(call: Callable[..., Any], shift: float, size: float) -> None:
    """Arms 1 and w: the two largest eigenvalues differ by w**2, which must exceed 1e-10 of the mean square of 1/2."""
    for width, expected in ((3e-5, True), (1.2e-5, True), (4e-6, False), (1e-6, False)):
        start = np.broadcast_to(size * CROSS * [1, width, 1], (*LEADING, 4, 3))
        end = start @ np.swapaxes(frames(), -1, -2) + shift * size
        assert (both(call, start, end) == expected).all()


@pytest.mark.parametrize("copies", [1, 300])
def test_planes_that_nearly_share_a_direction(copies: int) -> None:
    """Normals e1, many times, and e2, and e1 tilted by w: singular values about the root of the number, 1 and w."""
    matrices = motions()
    root = np.sqrt(copies + 1.0)
    for tilt, expected in ((1e-8 * root, True), (2.5e-10 * root, True), (0.5e-10 * root, False), (0.0, False)):
        normals = np.array([[1.0, 0, 0]] * copies + [[0, 1, 0], [1, 0, tilt]])
        normals = np.broadcast_to(normals, (*LEADING, copies + 2, 3))
        places = np.random.default_rng(3).normal(size=normals.shape)
        one = plane_of(normals, places)
        two = plane_of(turn(matrices[..., None, :, :], normals), apply(matrices[..., None, :, :], places))
        assert (both(lambda a, b: motor_from_objects(planes=(a, b)), one, two) == expected).all()


def test_objects_in_batches_are_those_of_one_set() -> None:
    rng = np.random.default_rng(4)
    matrices = motions()
    p, d = rng.normal(size=(2, *LEADING, 4, 3))
    moved, turned = apply(matrices[..., None, :, :], p), turn(matrices[..., None, :, :], d)
    noisy = moved + 0.1 * rng.normal(size=moved.shape)
    pairs = {
        "points": (p, noisy),
        "lines": (line_of(p, d), line_of(noisy, turned)),
        "planes": (plane_of(d, p), plane_of(turned, noisy)),
        "circles": (cga3.circle_from_centre(p, d, 2.0), cga3.circle_from_centre(noisy, turned, 2.0)),
    }
    for kinds in (("points",), ("lines",), ("planes",), ("points", "circles", "planes", "lines")):
        found = motor_from_objects(**{kind: pairs[kind] for kind in kinds})
        assert found.determined.all() and found.residual.shape == LEADING
        assert (found.residual > 1e-3).all() and (found.residual < 0.5).all()
        for k in np.ndindex(LEADING):
            one = motor_from_objects(**{kind: tuple(each[k] for each in pairs[kind]) for kind in kinds})
            close(found.motor[k], one.motor, 1e-11)
            close(found.residual[k], one.residual, 1e-12)


def test_flat_frames_by_the_lengths_of_their_rows() -> None:
    """Volume 1e-12 and rows of length 1, of which two lie within 1e-6 of the first: flat; as turned, not as columns."""
    near = np.array([[1.0, 0, 0], [1, 1e-6, 0], [1, 0, 1e-6]])
    good = np.array([[1.0, 0, 0], [1, 1e-4, 0], [1, 0, 1e-4]])
    for rows, expected in ((near, True), (good, False)):
        for size in UNITS:
            given = np.broadcast_to(size * rows, (*LEADING, 3, 3))
            image = given @ np.swapaxes(frames(), -1, -2)
            found = rotor_from_frames(given, image)
            assert (np.isnan(found).all(-1) == expected).all()
            assert np.isnan(rotor_from_frames(given[1, 2], image[1, 2])).all() == expected
            if not expected:
                close(pga3.rotor_to_matrix(found), frames(), 1e-7)


BOX = np.array([[x, y, z] for x in (-1.0, 1) for y in (-1.0, 1) for z in (-1.0, 1)] + [[2, 0, 0], [-2, 0, 0]])


@pytest.mark.parametrize("size", UNITS)
@pytest.mark.parametrize(
    ("fit", "shape"),
    [(fit_plane, [1, "w", 0]), (fit_circle, [1, "w", 0]), (fit_sphere, [1, 1, "w"]), (fit_sphere, [1, "w", "w"])],
    ids=["plane", "circle", "sphere", "sphere on a line"],
)
def test_boxes_that_are_nearly_flat(fit: Callable[..., Any], shape: list[Any], size: float) -> None:
    """The thickness w relative to a length of about 1 must exceed 1e-10, also with the centroid far from the origin."""
    for width, expected in ((1e-6, True), (3e-10, True), (5e-11, False), (0.0, False)):
        if fit is fit_circle and width == 3e-10:
            continue  # the circle is determined, and yet its radius is of the order of 1e9
        points = size * BOX * [width if s == "w" else s for s in shape]
        given = np.broadcast_to(points, (*LEADING, *points.shape)) @ np.swapaxes(frames(), -1, -2)
        assert (both(fit, given) == expected).all()


@pytest.mark.parametrize("size", UNITS)
def test_lines_through_points_that_are_nearly_round(size: float) -> None:
    """Mean squares 1 and 1 - w: their difference must exceed 1e-10 of the larger."""
    for gap, expected in ((1e-2, True), (1e-9, True), (1e-11, False), (0.0, False)):
        points = size * CROSS * [1.0, np.sqrt(1 - gap), 1.0]
        given = np.broadcast_to(points, (*LEADING, 4, 3)) @ np.swapaxes(frames(), -1, -2)
        assert (both(fit_line, given) == expected).all()


@pytest.mark.parametrize("fit", [fit_cylinder, fit_cone])
def test_cylinders_and_cones_in_batches_and_through_flat_points(fit: Callable[..., Any]) -> None:
    rng = np.random.default_rng(6)
    angle, height = rng.uniform(0, 2 * np.pi, (6, 40)), rng.uniform(0.5, 3, (6, 40))
    around = height if fit is fit_cone else 1.0
    points = np.stack([around * np.cos(angle), around * np.sin(angle), height], -1)
    points[1::2] *= [1, 1, -1]
    place = rng.normal(size=(6, 1, 3))
    sets = (points + place).reshape(2, 3, 40, 3)
    found = fit(sets)
    assert found.determined.all() and found.axis.shape == (2, 3, 6)
    for k in np.ndindex(2, 3):
        np.testing.assert_array_equal(found.axis[k], fit(sets[k]).axis)
    if fit is fit_cone:
        close(found.apex, place.reshape(2, 3, 3), 1e-8)
        close(found.angle, np.pi / 4, 1e-8)
        expected = cga3.line_from_point_direction(place[:, 0], np.resize([[0.0, 0, 1], [0, 0, -1]], (6, 3)))
        close(found.axis, expected.reshape(2, 3, 6), 1e-7)
    for size in UNITS:
        flat = size * points[0] * [1, 1, 1e-11]
        assert not fit(flat).determined


@all_cases("size", UNITS)
@all_cases("far", [1.0, 1e5])
@all_cases(
    "fit",
    [
        *(fit_plane, fit_line, fit_circle, fit_sphere, fit_cylinder, fit_cone),
        *(lambda points: motor_from_points(points, -points), lambda points: similarity_from_points(points, -points)),
        lambda points: motor_from_objects(points=(points, -points)),
    ],
)
def test_rounding_of_the_same_points_determines_nothing(fit: Callable[..., Any], far: float, size: float) -> None:
    """Points whose coordinates differ in the last digit determine nothing, and points on a line only the line."""
    rng = np.random.default_rng(7)
    same = size * far * np.ones((8, 10, 3))
    straight = same + size * np.linspace(-1, 1, 10)[:, None] * [0.3, -0.5, 0.8]
    for exact in (same, straight):
        points = exact * (1 + np.finfo(float).eps * rng.integers(-1, 2, exact.shape))
        for given in (exact, points):
            assert (fit(given).determined == (fit is fit_line and exact is straight)).all()
            for k in range(0, 8, 4):
                assert fit(given[k]).determined == (fit is fit_line and exact is straight)
