"""Pictures: the drawn shapes agree with the geometry."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pytest

from tests.support.all_cases import all_cases

matplotlib.use("Agg")

from matplotlib import pyplot
from matplotlib.patches import Circle as Round

from gacompiler.errors import AlgebraError, BackendError, LayoutError
from gacompiler.objects import CGA2, CGA3, PGA2, PGA3, VGA3, draw, save_ganja, view
from gacompiler.objects.scene import (
    Circle,
    Frame,
    Line,
    Plane,
    PointPair,
    Points,
    Sphere,
    clipped,
    polygon,
    scene_of,
    shapes_of,
)

RNG = np.random.default_rng(0)


@pytest.fixture(autouse=True)
def no_figures_left() -> Iterator[None]:
    yield
    pyplot.close("all")


def rounds(ax: Any) -> list[Round]:
    return [patch for patch in ax.patches if isinstance(patch, Round)]


def test_a_circle_of_the_plane_is_a_circle_of_the_picture() -> None:
    """The circle through three points equals the circumcircle by its closed form."""
    for a, b, c in RNG.normal(size=(20, 3, 2)):
        ax = draw(CGA2.point(a) ^ CGA2.point(b) ^ CGA2.point(c))
        m = 2 * np.array([b - a, c - a])
        centre = np.linalg.solve(m, [b @ b - a @ a, c @ c - a @ a])
        (patch,) = rounds(ax)
        assert np.allclose(patch.center, centre, rtol=1e-8)
        assert np.isclose(patch.radius, np.linalg.norm(a - centre), rtol=1e-8)
        assert patch.get_linestyle() == "-"
        pyplot.close(ax.figure)


def test_imaginary_rounds_are_dashed() -> None:
    ax = draw(CGA2.circle([1, 2], 2), CGA2.circle([1, 2], radius_squared=-9))
    real, imaginary = rounds(ax)
    assert (real.radius, real.get_linestyle()) == (pytest.approx(2), "-")
    assert (imaginary.radius, imaginary.get_linestyle()) == (pytest.approx(3), "--")
    far = CGA2.circle([0, 0], 1) & CGA2.line(CGA2.point(0, 2), [1, 0])
    (pair,) = shapes_of(far)
    assert isinstance(pair, PointPair) and pair.is_imaginary
    assert np.allclose(pair.centre, [0, 2]) and pair.radius == pytest.approx(np.sqrt(3))
    assert draw(far).lines[0].get_linestyle() == "--"
    near = shapes_of(CGA2.circle([0, 0], 1) & CGA2.line(CGA2.point(0, 0.6), [1, 0]))[0]
    assert isinstance(near, PointPair) and not near.is_imaginary
    ends = near.centre + np.outer([-1, 1], near.radius * near.direction)
    assert np.allclose(np.sort(ends[:, 0]), [-0.8, 0.8]) and np.allclose(ends[:, 1], 0.6)


@pytest.mark.slow
def test_lines_pass_through_their_points() -> None:
    for space in (PGA2, CGA2, PGA3, CGA3):
        d = 2 if space in (PGA2, CGA2) else 3
        for a, b in RNG.normal(size=(10, 2, d)):
            line = space.line(space.point(a), space.point(b))
            (shape,) = shapes_of(line)
            assert isinstance(shape, Line) and np.isclose(np.linalg.norm(shape.direction), 1)
            for x in (a, b):
                off = x - shape.point - ((x - shape.point) @ shape.direction) * shape.direction
                assert np.allclose(off, 0, atol=1e-10)
            assert shape.direction @ (b - a) > 0 or space is PGA2, "from a to b"
            (drawn,) = draw(line, space.point(a), space.point(b)).lines
            data = np.array(drawn.get_data_3d() if d == 3 else drawn.get_data()).T
            assert np.isclose(
                abs((data[1] - data[0]) @ (b - a)), np.linalg.norm(data[1] - data[0]) * np.linalg.norm(b - a)
            )
            pyplot.close("all")


def test_rounds_and_planes_of_space() -> None:
    centre, normal = np.array([1.0, -2, 0.5]), np.array([2.0, 1, -2])
    (circle,) = shapes_of(CGA3.circle(centre, normal, 1.5))
    assert isinstance(circle, Circle) and circle.normal is not None
    assert np.allclose(circle.centre, centre) and circle.radius == pytest.approx(1.5)
    assert np.allclose(np.cross(circle.normal, normal), 0, atol=1e-12)
    (sphere,) = shapes_of(CGA3.sphere(centre, 2))
    assert sphere == sphere and isinstance(sphere, Sphere) and np.allclose(sphere.centre, centre)
    assert sphere.radius == pytest.approx(2) and not sphere.is_imaginary
    (dual,) = shapes_of(CGA3.point(centre) - 2 * CGA3.einf)
    assert isinstance(dual, Sphere) and np.allclose(dual.centre, centre) and dual.radius == pytest.approx(2)
    for plane in (CGA3.plane(normal, 0.7), PGA3.plane(2 / 3, 1 / 3, -2 / 3, -0.7)):
        (shape,) = shapes_of(plane)
        assert isinstance(shape, Plane) and np.allclose(np.cross(shape.normal, normal), 0, atol=1e-12)
        assert np.allclose(shape.normal * shape.distance, normal / 3 * 0.7)
    (drawn,) = draw(CGA3.circle(centre, normal, 1.5)).lines
    on = np.array(drawn.get_data_3d()).T
    assert np.allclose(np.linalg.norm(on - centre, axis=-1), 1.5) and np.allclose((on - centre) @ normal, 0)
    meet = CGA3.sphere([0, 0, 0], 2) & CGA3.plane([0, 0, 1], 1)
    (circle,) = shapes_of(meet)
    assert (
        isinstance(circle, Circle) and np.allclose(circle.centre, [0, 0, 1]) and np.isclose(circle.radius, np.sqrt(3))
    )


def test_points_of_all_kinds() -> None:
    cloud = RNG.normal(size=(4, 500, 3))
    for space in (PGA3, CGA3):
        (shape,) = shapes_of(space.point(cloud))
        assert isinstance(shape, Points) and np.allclose(shape.places, cloud.reshape(-1, 3))
        (artist,) = draw(space.point(cloud[0])).collections
        assert np.allclose(np.array(artist._offsets3d).T, cloud[0])
    (flat,) = shapes_of(CGA3.point(1, 2, 3) ^ CGA3.einf)
    assert isinstance(flat, Points) and np.allclose(flat.places, [[1, 2, 3]])
    (weighted,) = shapes_of(3 * PGA3.point(1, 2, 3))
    assert isinstance(weighted, Points) and np.allclose(weighted.places, [[1, 2, 3]])
    (zero,) = shapes_of(CGA3.sphere([1, 2, 3], 0))
    assert isinstance(zero, Points) and np.allclose(zero.places, [[1, 2, 3]])
    (artist,) = draw(PGA2.point(cloud[0, :, :2])).collections
    assert np.allclose(artist.get_offsets(), cloud[0, :, :2])


def test_labels_colours_and_limits() -> None:
    a, b = CGA2.point(1, 2), CGA2.circle([0, 0], 1)
    ax = draw(a, b, labels=["a", "b"], colours=["red", "#00ff00"], limits=(-3, 3))
    assert [text.get_text().strip() for text in ax.texts] == ["a", "b"]
    assert matplotlib.colors.to_hex(rounds(ax)[0].get_edgecolor()) == "#00ff00"
    assert ax.get_xlim() == ax.get_ylim() == (-3, 3)
    again = draw(PGA2.point(5, 5), ax=ax)
    assert again is ax and len(ax.collections) == 2
    low, high = draw(b).get_xlim()
    assert low < -1 and high > 1, "drawn shapes are within the limits"


def test_flats_are_cut_at_the_limits() -> None:
    limits = np.array([[-1.0, 1.0]] * 3)
    corners = polygon(Plane(np.array([0, 0, 1.0]), 0.5), limits)
    assert corners is not None and {tuple(x) for x in corners} == {(a, b, 0.5) for a in (-1, 1) for b in (-1, 1)}
    assert polygon(Plane(np.array([0, 0, 1.0]), 2.0), limits) is None
    hexagon = polygon(Plane(np.ones(3) / np.sqrt(3), 0.0), limits)
    assert hexagon is not None and len(hexagon) == 6 and np.allclose(hexagon.sum(axis=-1), 0)
    ends = clipped(Line(np.zeros(3), np.ones(3) / np.sqrt(3)), limits)
    assert ends is not None and np.allclose(np.sort(ends, axis=0), [[-1] * 3, [1] * 3])
    assert clipped(Line(np.array([0, 0, 2.0]), np.array([1.0, 0, 0])), limits) is None


def test_a_motor_is_drawn_as_the_axes_that_it_moves() -> None:
    """A quarter turn about z, and then a translation, in space and in the plane, of unit norm and not."""
    moved = np.array([[1, 2, 3], [1, 3, 3], [0, 2, 3], [1, 2, 4]])
    for space in (PGA3, CGA3):
        motor = space.translator(1, 2, 3) * space.rotor([0, 0, 1], np.pi / 2)
        for each in (motor, -2 * motor):
            (shape,) = shapes_of(each)
            assert isinstance(shape, Frame) and np.allclose(shape.places, moved, atol=1e-12)
    axes = draw(motor, labels=["m"])
    ends = [np.transpose(line.get_data_3d()) for line in axes.lines]
    assert np.allclose(ends, [[moved[0], end] for end in moved[1:]], atol=1e-12)
    assert [line.get_color() for line in axes.lines] == ["#d62728", "#2ca02c", "#1f77b4"]
    assert np.all((np.array(scene_of([motor]).limits).T[0] < moved) & (moved < np.array(scene_of([motor]).limits).T[1]))
    flat = PGA2.translator(1, 2) * PGA2.rotor(np.pi / 2)
    (shape,) = shapes_of(flat)
    assert np.allclose(shape.places, [[1, 2], [1, 3], [0, 2]], atol=1e-12) and len(draw(flat).lines) == 2
    assert len(shapes_of(PGA3.rotor([0, 0, 1], np.array([0.1, 0.2])))) == 2


@all_cases(
    "wrong, error, message",
    [
        (lambda: draw(), AlgebraError, "no object"),
        (lambda: draw(VGA3.e1), AlgebraError, "PGA2, PGA3, CGA2 or CGA3"),
        (lambda: draw(3.0), AlgebraError, "object of float"),
        (
            lambda: draw(PGA3.e1 + PGA3.e12),
            AlgebraError,
            "plane, round or motor",
        ),
        (lambda: draw(1 + PGA3.e0123 + PGA3.e12), AlgebraError, "moves no points to points"),
        (lambda: draw(PGA3.of(PGA3.LINE, 1, 2, 3, 4, 5, 6)), AlgebraError, "not a blade"),
        (lambda: draw(PGA3.e0), AlgebraError, "infinity"),
        (lambda: draw(PGA3.point(1, 2, 3), PGA2.point(1, 2)), AlgebraError, "separately"),
        (lambda: draw(PGA2.point(1, 2), labels=["a", "b"]), LayoutError, "2 labels; expected 1"),
        (lambda: draw(PGA2.point(1, 2), limits=(2, 1)), LayoutError, "limits"),
        (lambda: draw(PGA3.point(1, 2, 3), ax=pyplot.figure().add_subplot()), AlgebraError, "3d"),
    ],
)
def test_error_messages(wrong: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        wrong()


def test_pictures_name_a_missing_library(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    p = PGA3.point(1, 2, 3)
    for library in ("plotly", "plotly.graph_objects", "matplotlib", "matplotlib.colors"):
        monkeypatch.setitem(sys.modules, library, None)
    for where, call in (
        ("draw", lambda: draw(p)),
        ("save", lambda: view(p, drag=[p]).save(tmp_path / "scene.svg")),
        ("save", lambda: view(p, drag=[p]).save(tmp_path / "scene.gltf")),
        ("save_ganja", lambda: save_ganja(tmp_path / "scene.html", p)),
    ):
        with pytest.raises(BackendError, match=rf"{where}: matplotlib is not .* 'gacompiler\[pictures\]'"):
            call()
    with pytest.raises(BackendError, match=r"view: plotly is not installed; run: pip install 'gacompiler\[pictures\]'"):
        view(PGA3.point(1, 2, 3))


def test_interactive_pictures(tmp_path: Path) -> None:
    pytest.importorskip("plotly")
    file = tmp_path / "scene.html"
    objects = [
        CGA3.sphere([1, 2, 3], 2), CGA3.sphere([1, 2, 3], radius_squared=-4), CGA3.plane([0, 0, 1], 2),
        CGA3.circle([0, 0, 0], [0, 0, 1], 3), CGA3.point(RNG.normal(size=(60, 3))),
        CGA3.point(0, 0, 0) ^ CGA3.point(1, 0, 0), CGA3.line(CGA3.point(0, 0, 0), [1, 1, 1]),
    ]  # fmt: skip
    figure = view(*objects, labels=list("abcdefg"), file=file)
    traces = {trace.name: trace for trace in figure.data if trace.name}
    sphere, imaginary, plane, circle, cloud = (traces[name] for name in "abcde")
    places = np.stack([sphere.x, sphere.y, sphere.z], -1)
    assert sphere.type == "surface" and np.allclose(np.linalg.norm(places - [1, 2, 3], axis=-1), 2)
    net = np.stack([imaginary.x, imaginary.y, imaginary.z], -1).astype(float)
    assert imaginary.line.dash == "dash" and np.allclose(
        np.linalg.norm(net[~np.isnan(net[:, 0])] - [1, 2, 3], axis=-1), 2
    )
    assert plane.type == "mesh3d" and np.allclose(plane.z, 2) and len(plane.i) == len(plane.x) - 2
    assert np.allclose(np.hypot(circle.x, circle.y), 3) and np.allclose(circle.z, 0) and circle.line.dash == "solid"
    assert len(cloud.x) == 60 and cloud.mode == "markers"
    text = file.read_text()
    assert "plotly" in text and not re.search(r"<script[^>]*\ssrc=", text), "the file needs no network"
    (axes,) = view(CGA3.translator(1, 2, 3)).data
    assert np.allclose([axes.x[1::3], axes.y[1::3], axes.z[1::3]], np.eye(3) + np.array([[1], [2], [3]]))
    assert axes.line.color[::3] == ("#d62728", "#2ca02c", "#1f77b4")
    flat = view(CGA2.circle([1, 2], 3), PGA2.point(1, 1))
    assert np.allclose(np.hypot(np.array(flat.data[0].x) - 1, np.array(flat.data[0].y) - 2), 3)
