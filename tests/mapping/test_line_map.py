"""Line maps: fusion compared with least squares of numpy, association, extension, splitting, merging, saving."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from algorithms.arguments import Reals
from algorithms.mapping import MappingStatus, Scan, Segments, segments
from algorithms.mapping.line_map import LineMap, same_wall
from algorithms.mapping.line_views import View, seen_through
from generated import line_maps, pga2
from tests.support.all_cases import all_cases

IDENTITY = np.eye(4)[0]


def motor(x: float, y: float, angle: float) -> Reals:
    return np.asarray(pga2.motor_from_angle_translation(angle, np.array([x, y])))


def segment(p: tuple[float, float], q: tuple[float, float], deviation: float = 0.01, count: int = 50) -> Segments:
    """A segment as a scanner at the origin sees it: the normal points away from it."""
    ends = np.array([p, q], float)
    along = (ends[1] - ends[0]) / (length := float(np.hypot(*(ends[1] - ends[0]))))
    normal = np.array([-along[1], along[0]])
    normal *= 1.0 if normal @ ends[0] >= 0 else -1.0
    lever = ends.mean(0) @ [-normal[1], normal[0]]
    spread = deviation**2 / (count * length**2 / 12)
    covariance = np.array([[spread, lever * spread], [lever * spread, deviation**2 / count + lever**2 * spread]])
    return Segments(
        normal[None], np.array([normal @ ends[0]]), ends[None], covariance[None], np.array([count]),
        np.array([deviation]), np.array([0]),
    )  # fmt: skip


def distances(line_map: LineMap, row: int, points: Reals) -> Reals:
    return np.asarray(points @ line_map.normals[row] - line_map.offsets[row])


def test_change_of_a_line_is_measured_as_it_was_made() -> None:
    rng = np.random.default_rng(0)
    for _ in range(20):
        angle, offset = rng.uniform(-np.pi, np.pi), rng.normal()
        line = np.array([np.cos(angle), np.sin(angle), -offset])
        middle = pga2.point_on_line(line, rng.normal())
        change = rng.normal(size=2) * [0.5, 1.0]
        other = line_maps.changed_line(line, middle, change)
        assert np.hypot(*other[:2]) == pytest.approx(1)
        assert line_maps.line_seen_from(line, middle, other, middle, np.ones(3))[0] == pytest.approx(change)


def test_covariance_at_another_place_is_that_of_the_derivative() -> None:
    line, triangle, step = np.array([0.6, 0.8, -3.0]), np.array([0.01, 0.002, 0.03]), 1e-6
    here, there = pga2.point_on_line(line, 2.0), pga2.point_on_line(line, -1.5)
    columns = []
    for change in np.eye(2) * step:
        moved = line_maps.changed_line(line, here, change)
        columns.append(line_maps.line_seen_from(line, there, moved, here, triangle)[0] / step)
    matrix = np.array(columns).T @ triangle[[[0, 1], [1, 2]]] @ np.array(columns)
    found = line_maps.line_seen_from(line, there, line, here, triangle)[1]
    assert found == pytest.approx(matrix[[0, 0, 1], [0, 1, 1]], rel=1e-5)


def test_fusion_is_that_of_information_matrices() -> None:
    rng = np.random.default_rng(1)
    a, b = (m @ m.T for m in rng.normal(size=(2, 2, 2)))
    change = rng.normal(size=2)
    correction, covariance, square = line_maps.fuse_lines(a[[0, 0, 1], [0, 1, 1]], b[[0, 0, 1], [0, 1, 1]], change)
    fused = np.linalg.inv(np.linalg.inv(a) + np.linalg.inv(b))
    assert covariance == pytest.approx(fused[[0, 0, 1], [0, 1, 1]])
    assert correction == pytest.approx(fused @ np.linalg.solve(b, change))
    assert square == pytest.approx(change @ np.linalg.solve(a + b, change))


@pytest.mark.parametrize("pose", [(0.0, 0.0, 0.0), (30.0, -20.0, 2.5)])
def test_views_of_one_wall_become_one_segment(pose: tuple[float, float, float]) -> None:
    """Fifty noisy pieces of a wall: one row, as long as the wall, nearer to it than single pieces, also far away."""
    rng = np.random.default_rng(2)
    found, frame = LineMap.empty(), motor(*pose)
    errors = []
    for k in range(50):
        start = 0.1 * k
        tilt, shift = rng.normal(size=2) * [0.004, 0.01]
        p, q = (start, 2 + shift - tilt), (start + 2.0, 2 + shift + tilt)
        found = found.updated(segment(p, q), frame).map
        errors.append(abs(shift))
    assert len(found) == 1 and found.n_views[0] == 50 and found.counts[0] == 2500
    truth = pga2.move_point(frame, np.array([[0.0, 2.0], [6.9, 2.0]]))
    ends = found.ends[0]
    assert min(np.abs(ends - truth).max(), np.abs(ends[::-1] - truth).max()) < 0.02
    assert np.abs(distances(found, 0, truth)).max() < 0.5 * np.mean(errors)
    assert found.lengths[0] == pytest.approx(6.9, abs=0.02)


@all_cases(
    "p, q, n",
    [
        ((1.0, 2.05), (3.0, 2.05), 1),  # the same wall
        ((2.1, 2.0), (4.0, 2.0), 1),  # its continuation
        ((2.5, 2.0), (4.0, 2.0), 2),  # behind a door
        ((2.1, 2.1), (4.0, 2.1), 2),  # a step beside it
        ((0.5, 2.2), (1.5, 2.2), 2),  # parallel
        ((0.5, 1.9), (1.5, 2.1), 2),  # oblique
        ((1.0, 2.0), (1.0, 4.0), 2),  # a corner
    ],
)
def test_association(p: tuple[float, float], q: tuple[float, float], n: int) -> None:
    one = LineMap.empty().updated(segment((0, 2), (2, 2)), IDENTITY).map
    update = one.updated(segment(p, q), IDENTITY)
    assert len(update.map) == n and update.rows.tolist() == [n - 1] and update.status == MappingStatus.OK
    assert len(one) == 1 and one.counts[0] == 50


def test_sides_of_a_wall_are_two_rows() -> None:
    """A thin wall, seen from both sides: from the origin, and then from behind the wall, half a turn around."""
    one = LineMap.empty().updated(segment((-1, 2), (1, 2)), IDENTITY).map
    both = one.updated(segment((-1, 1.9), (1, 1.9)), motor(0, 4, np.pi)).map
    assert len(both) == 2 and both.normals[0] @ both.normals[1] == pytest.approx(-1)
    assert both.offsets[0] == pytest.approx(2) and both.offsets[1] == pytest.approx(-2.1)


def test_several_pieces_of_one_wall_in_one_scan() -> None:
    one = LineMap.empty().updated(segment((0, 2), (6, 2)), IDENTITY).map
    pieces = [segment((k, 2.01), (k + 0.8, 2.01)) for k in (0.0, 2.0, 4.0)]
    names = ("normals", "offsets", "ends", "covariances", "counts", "deviations", "first")
    three = Segments(*(np.concatenate([getattr(piece, name) for piece in pieces]) for name in names))
    update = one.updated(three, IDENTITY)
    assert len(update.map) == 1 and update.rows.tolist() == [0, 0, 0] and update.map.counts[0] == 200


def test_segments_that_are_not_finite_leave_the_map_as_it_was() -> None:
    one = LineMap.empty().updated(segment((0, 2), (2, 2)), IDENTITY).map
    bad = segment((0, 3), (2, 3))
    bad.offsets[0] = np.nan
    update = one.updated(bad, IDENTITY)
    assert update.map is one and update.status == MappingStatus.TOO_FEW_READINGS and update.rows.tolist() == [-1]
    assert one.updated(segment((0, 3), (2, 3)), np.full(4, np.nan)).map is one
    nothing = segments(Scan(np.full(181, 80.0), -np.pi / 2, np.pi / 180, 30.0))
    assert one.updated(nothing, IDENTITY).map is one


def test_duplicates_are_merged() -> None:
    """Pieces that were added from right to left with gaps, and then the wall between them."""
    found = LineMap.empty()
    for k in (8.0, 4.0, 0.0):
        found = found.updated(segment((k, 2), (k + 1.5, 2)), IDENTITY).map
    found = found.updated(segment((1.4, 2.02), (8.2, 2.02)), IDENTITY).map
    assert len(found) == 3 and list(same_wall(found))
    merged = found.merged()
    assert len(merged) == 1 and not list(same_wall(merged)) and merged.counts[0] == 200
    assert merged.lengths[0] == pytest.approx(9.5, abs=0.01)
    assert merged.merged().lines == pytest.approx(merged.lines)


def test_doors_are_cut_out_of_walls() -> None:
    """A wall of 6 m with a door from 2 m to 3 m: beams pass there, and readings lie on the rest."""
    whole = LineMap.empty().updated(segment((0, 2), (6, 2)), IDENTITY).map
    xs = np.linspace(0.02, 5.98, 300)
    views = []
    for y in (0.0, 0.5, 1.0):
        ends = np.stack([xs, np.where((xs > 2) & (xs < 3), 5.0, 2.0)], 1)
        views.append(View(motor(3.0, y, 0.0), ends - [3.0, y]))
    cut, residual = seen_through(whole, views)
    assert len(cut) == 2 and residual == pytest.approx(0, abs=1e-9)
    spans = np.sort(cut.ends[:, :, 0], axis=1)
    assert np.sort(spans, axis=0) == pytest.approx(np.array([[0, 2.0], [3.0, 6]]), abs=0.2)
    assert cut.counts.sum() == pytest.approx(50, abs=2)
    # Without views nothing confirms the wall; one person in front of it does not cut it.
    assert len(seen_through(whole, [])[0]) == 0
    person = np.stack([xs, np.where((xs > 2) & (xs < 2.5), 1.0, 2.0)], 1)
    kept, _ = seen_through(whole, [*(View(IDENTITY, np.stack([xs, np.full(300, 2.0)], 1)) for _ in range(2)),
                                   View(IDENTITY, person)])  # fmt: skip
    assert len(kept) == 1 and kept.lengths[0] == pytest.approx(6, abs=0.05)


def test_residual_is_the_deviation_of_readings() -> None:
    rng = np.random.default_rng(3)
    whole = LineMap.empty().updated(segment((0, 2), (6, 2)), IDENTITY).map
    points = np.stack([rng.uniform(0, 6, 2000), 2 + 0.02 * rng.normal(size=2000)], 1)
    assert seen_through(whole, [View(IDENTITY, points)])[1] == pytest.approx(0.02, rel=0.1)


def test_moved_map() -> None:
    one = LineMap.empty().updated(segment((0, 2), (2, 2)), motor(1, 2, 0.3)).map
    pose = motor(-5, 3, 2.0)
    moved = one.moved(pose)
    assert np.allclose(moved.ends, pga2.move_point(pose, one.ends))
    assert np.allclose(moved.moved(pga2.motor_inverse(pose)).lines, one.lines)


def test_pruned_map_keeps_the_longest() -> None:
    found = LineMap.empty()
    for k, length in enumerate((0.2, 1.0, 3.0, 2.0)):
        for _ in range(2):
            found = found.updated(segment((0, 2 + k), (length, 2 + k)), IDENTITY).map
    assert found.pruned(2, 0.3).lengths == pytest.approx([1, 3, 2])
    assert found.pruned(2, 0.3, 2).lengths == pytest.approx([3, 2])
    assert len(found.pruned(3)) == 0


def test_map_is_saved_and_loaded(tmp_path: Path) -> None:
    one = LineMap.empty().updated(segment((0, 2), (2, 2)), motor(1, 2, 0.3)).map
    path = tmp_path / "map.npz"
    one.save(path)
    other = LineMap.load(path)
    for name in ("lines", "spans", "spreads", "counts", "n_views"):
        assert np.array_equal(getattr(one, name), getattr(other, name))
    LineMap.empty().save(path)
    assert len(LineMap.load(path)) == 0
    np.savez(path, lines=np.zeros((1, 3)))
    with pytest.raises(ValueError, match="expected a map of"):
        LineMap.load(path)
    one.save(path)
    with np.load(path) as file:
        arrays = dict(file)
    np.savez(path, **{**arrays, "spans": np.zeros((2, 2))})
    with pytest.raises(ValueError, match=r"spans has shape \(2, 2\)"):
        LineMap.load(path)
    np.savez(path, **{**arrays, "lines": np.array([[{}, {}, {}]], object)}, allow_pickle=True)
    with pytest.raises(ValueError, match="allow_pickle=False"):
        LineMap.load(path)


def test_damaged_maps_are_one_error(tmp_path: Path) -> None:
    """A map that is cut or changed anywhere gives the map, or ValueError; so do wrong lines, spans and covariances."""
    one = LineMap.empty().updated(segment((0, 2), (2, 2)), motor(1, 2, 0.3)).map
    path = tmp_path / "map.npz"
    one.save(path)
    whole = path.read_bytes()
    damaged = [b"", b"PK", b"no map", whole[:-1], *(whole[:k] for k in range(10, len(whole), 97))]
    for cut in damaged:
        path.write_bytes(cut)
        with pytest.raises(ValueError, match=r"map\.npz"):
            LineMap.load(path)
    for k in range(0, len(whole), 41):
        path.write_bytes(whole[:k] + bytes([whole[k] ^ 0x55]) + whole[k + 1 :])
        try:
            LineMap.load(path)
        except ValueError as error:
            assert "map.npz" in str(error)
    arrays = {name: getattr(one, name) for name in ("lines", "spans", "spreads", "counts", "n_views")}
    for name, value in (("lines", 2 * one.lines), ("spans", one.spans[:, ::-1]), ("spreads", -one.spreads)):
        np.savez(path, version=1, **{**arrays, name: value})
        with pytest.raises(ValueError, match=rf"{name}\[0\]"):
            LineMap.load(path)


def test_covariances_have_the_convention_of_segments() -> None:
    """A map of one scan at the origin has the covariances of its segments, and those that poses add."""
    found = segment((3, 2), (5, 2.5), deviation=0.5)
    one = LineMap.empty().updated(found, IDENTITY).map
    assert one.covariances == pytest.approx(found.covariances, rel=0.05)
    assert one.normals == pytest.approx(found.normals) and one.offsets == pytest.approx(found.offsets)
