"""What the points of fits say of them, against objects that are known: bounds, other shapes, groups and outliers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from algorithms.geometry import (
    FitStatus,
    fit_circle,
    fit_cone,
    fit_cylinder,
    fit_line,
    fit_plane,
    fit_sphere,
)
from generated import cga3
from tests.support.toolkit_truth import poses

BOUND = 4.03
Generator = np.random.Generator


def directions(rng: Generator, n: int, most: float) -> np.ndarray:
    """Unit vectors about z, at most an angle from it."""
    z, a = rng.uniform(np.cos(most), 1, n), rng.uniform(0, 2 * np.pi, n)
    return np.stack([np.sqrt(1 - z * z) * np.cos(a), np.sqrt(1 - z * z) * np.sin(a), z], -1)


def arc(rng: Generator, n: int, most: float) -> np.ndarray:
    a = rng.uniform(0, most, n)
    return np.stack([np.cos(a), np.sin(a), 0 * a], -1)


SHAPES: dict[str, Callable[[Generator, int], np.ndarray]] = {
    "plane": lambda rng, n: rng.uniform(-1, 1, (n, 3)) * [1, 0.6, 0],
    "line": lambda rng, n: rng.uniform(-1, 1, (n, 3)) * [0, 0, 1],
    "sphere": lambda rng, n: directions(rng, n, 1.4),
    "circle": lambda rng, n: arc(rng, n, 2.5),
    "cylinder": lambda rng, n: arc(rng, n, 4) + rng.uniform(-1.5, 1.5, (n, 1)) * [0, 0, 1],
    "cone": lambda rng, n: (arc(rng, n, 6) * [0.5, 0.5, 0] + [0, 0, 1]) * rng.uniform(0.6, 1.8, (n, 1)),
}
FITS: dict[str, Callable[[np.ndarray], Any]] = {
    "plane": fit_plane,
    "line": fit_line,
    "sphere": fit_sphere,
    "circle": fit_circle,
    "cylinder": fit_cylinder,
    "cone": fit_cone,
}


def angle(one: np.ndarray, other: np.ndarray) -> float:
    return float(np.arcsin(min(float(np.linalg.norm(np.cross(one / np.linalg.norm(one), other))), 1)))


def errors(kind: str, found: Any, turn: np.ndarray, place: np.ndarray, size: float, middle: np.ndarray) -> list[float]:
    """Errors in the order of the deviations, which are those of directions first for planes and lines."""
    axis = turn[:, 2]
    if kind == "plane":
        return [angle(cga3.plane_to_normal(found.object)[0], axis), abs(float((middle - place) @ axis))]
    if kind == "line":
        return [
            angle(cga3.line_to_direction_moment(found.object)[0], axis),
            float(np.linalg.norm(np.cross(middle - place, axis))),
        ]
    if kind == "sphere":
        off = np.linalg.norm(cga3.sphere_centre(found.object) - place)
        return [float(off), abs(float(np.sqrt(cga3.sphere_radius_squared(found.object)) - size))]
    if kind == "circle":
        radius = np.sqrt(cga3.circle_radius_squared(found.object))
        off = np.linalg.norm(cga3.circle_centre(found.object) - place)
        return [float(off), abs(float(radius - size)), angle(cga3.circle_normal(found.object), axis)]
    along = cga3.line_to_direction_moment(found.axis)[0]
    if kind == "cylinder":
        return [0.0, angle(along, axis), abs(float(found.radius - size))]
    return [float(np.linalg.norm(found.apex - place)), angle(along, axis), abs(float(found.angle - np.arctan(0.5)))]


@pytest.mark.parametrize("kind", SHAPES)
def test_errors_are_within_the_bounds_of_good_points(kind: str) -> None:
    rng = np.random.default_rng(71)
    motions = poses(np.random.default_rng(72), 40)[-25:]
    refused = 0
    for matrix in motions:
        n, noise, size = int(rng.integers(20, 120)), 10 ** rng.uniform(-3, -1.5), 10 ** rng.uniform(-2, 2)
        turn, place = matrix[:3, :3], size * matrix[:3, 3]
        points = size * (SHAPES[kind](rng, n) + noise * rng.normal(size=(n, 3))) @ turn.T + place
        found = FITS[kind](points)
        refused += found.status != FitStatus.OK
        if found.status == FitStatus.OK:
            assert (np.array(errors(kind, found, turn, place, size, points.mean(0))) <= BOUND * found.deviations).all()
    assert refused <= 1


@pytest.mark.parametrize("kind", SHAPES)
def test_points_of_something_else(kind: str) -> None:
    """Two groups, some wrong points, and random ones in a box."""
    rng = np.random.default_rng(73)
    for _ in range(3):
        x = SHAPES[kind](rng, 80)
        good = x + 0.01 * rng.normal(size=x.shape)
        assert FITS[kind](good).status == FitStatus.OK
        wrong = good + (rng.random((80, 1)) < 0.1) * rng.normal(0, 0.5, x.shape)
        assert FITS[kind](wrong).status == FitStatus.UNEXPLAINED
        assert FITS[kind](rng.uniform(-1, 1, (80, 3))).status != FitStatus.OK
    normal = {"plane": [0, 0, 0.2], "line": [0.2, 0, 0]}.get(kind)
    if normal is not None:
        groups = good + (np.arange(80)[:, None] % 3 == 0) * np.array(normal)
        assert FITS[kind](groups).status == FitStatus.UNEXPLAINED


def test_other_shapes() -> None:
    """A corner and an arc as lines, a saddle as a plane, an ellipse and a square as circles, a cube as a sphere."""
    rng = np.random.default_rng(74)
    t, n = np.linspace(-1, 1, 60), 200
    flat, ball = rng.uniform(-1, 1, (n, 2)), directions(rng, n, np.pi)
    round_ = arc(rng, n, 2 * np.pi)
    noise = 0.01 * rng.normal(size=(n, 3))
    for fit, points in (
        (fit_line, np.stack([np.maximum(t, 0), np.minimum(t, 0), 0 * t], -1) + noise[:60]),
        (fit_line, np.stack([t, 0.1 * t * t, 0 * t], -1) + noise[:60]),
        (fit_plane, np.column_stack([flat, 0.1 * flat[:, 0] * flat[:, 1]]) + noise),
        (fit_circle, round_ * [1, 0.8, 1] + noise),
        (fit_circle, round_ / np.abs(round_).max(1, keepdims=True) + noise),
        (fit_sphere, ball / np.abs(ball).max(1, keepdims=True) + noise),
        (fit_sphere, ball * [1, 1, 1.1] + noise),
    ):
        assert fit(points).status == FitStatus.UNEXPLAINED


def test_waves_and_slight_bends() -> None:
    """Neighbours share waves, which are no polynomials of few degrees; slight bends are within the bounds."""
    rng, t = np.random.default_rng(78), np.linspace(-1, 1, 300)

    def fitted(off: np.ndarray) -> Any:
        return fit_line(np.stack([t, off, 0 * t], -1) + 0.01 * rng.normal(size=(300, 3)))

    assert fitted(0.03 * np.sin(40 * t)).status == FitStatus.UNEXPLAINED
    straight, bent = fitted(0 * t), fitted(0.02 * t * t)
    assert straight.status == bent.status == FitStatus.OK
    # The line through the middle of the bend is a third of it away.
    assert straight.deviations[1] < 0.002 and 0.02 / 3 < BOUND * bent.deviations[1] < 0.2


def test_distances_that_may_be_two_groups() -> None:
    """Uniform ones have the kurtosis of many mixtures of two groups, either of which may be off by the deviation."""
    rng = np.random.default_rng(79)
    flat, off = rng.uniform(-1, 1, (200, 2)), 0.01 * rng.normal(size=200)
    even = 0.01 * np.sqrt(3) * rng.uniform(-1, 1, 200)
    one, other = (fit_plane(np.column_stack([flat, each])) for each in (off, even))
    assert one.status == other.status == FitStatus.OK
    assert one.deviations[1] < 0.002 and 0.009 < other.deviations[1] < 0.02


def test_too_little_is_known() -> None:
    """As many numbers as parameters; planes of points without a smallest extent, and arcs that may be straight."""
    rng = np.random.default_rng(75)
    assert fit_plane(np.eye(3)).status == fit_circle(np.eye(3)).status == FitStatus.TOO_FEW
    assert fit_plane(rng.normal(size=(50, 3))).status == FitStatus.UNDETERMINED
    flat = arc(rng, 40, 0.1) + 0.01 * rng.normal(size=(40, 3))
    assert fit_circle(flat).status == FitStatus.UNDETERMINED and fit_circle(flat).determined
    assert fit_sphere(rng.normal(size=(5, 3)) * [1, 1, 0]).status == FitStatus.UNDETERMINED


@pytest.mark.parametrize("kind", SHAPES)
def test_points_that_change_after_the_fit(kind: str) -> None:
    """What is computed when it is read is that of the points that were fitted."""
    rng = np.random.default_rng(77)
    x = SHAPES[kind](rng, 60) + 0.01 * rng.normal(size=(60, 3))
    points = x.copy()
    found = FITS[kind](points)
    points[:] = rng.normal(size=points.shape)
    expected = FITS[kind](x)
    assert found.status == expected.status == FitStatus.OK
    np.testing.assert_array_equal(found.deviations, expected.deviations)


def test_batches_exact_points_and_elements() -> None:
    rng = np.random.default_rng(76)
    sets = np.stack([directions(rng, 30, 2), rng.normal(size=(30, 3))])
    found = fit_sphere(sets)
    assert list(np.asarray(found.status)) == [FitStatus.OK, fit_sphere(sets[1]).status] and found.deviations.shape == (
        2,
        2,
    )
    assert found.deviations[0].max() < 1e-13
    np.testing.assert_allclose(fit_sphere(sets[0]).deviations, found.deviations[0], rtol=1e-6)
    assert np.isfinite(fit_circle(1e50 * arc(rng, 9, 3)).object).all()
    with pytest.raises(ValueError, match="expected a unit in which coordinates"):
        fit_circle(1e150 * arc(rng, 9, 3))
