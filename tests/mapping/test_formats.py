"""Files of maps, trajectories and graphs: known texts, exact round trips, and errors that name place and kind."""

from __future__ import annotations

import gzip
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from algorithms.mapping import (
    OccupancyGrid,
    SpaceGraphFile,
    Trajectory,
    read_columns,
    read_euroc,
    read_euroc_inertial,
    read_g2o,
    read_g2o_space,
    read_occupancy_grid,
    read_tum,
    write_columns,
    write_euroc,
    write_g2o,
    write_occupancy_grid,
    write_tum,
)
from algorithms.mapping.pose_graph import GraphStatus, optimise_poses
from generated import pga3
from tests.support.all_cases import all_cases

YAML = "image: map.pgm\nresolution: 0.05 # metres\norigin: [-1.5, 2, 0.25]\nnegate: 0\n"
YAML += "occupied_thresh: 0.65\nfree_thresh: 0.196\n"
HALF = float(np.sqrt(0.5))
VERTICES = f"VERTEX_SE3:QUAT 7 1 2 3 0 0 0 1\nVERTEX_SE3:QUAT 3 4 5 6 0 0 {HALF!r} {HALF!r}\n"
UPPER = " ".join(str(10 * i + j) for i in range(6) for j in range(i, 6))
EDGE = f"EDGE_SE3:QUAT 7 3 1 0 0 0 0 0 1 {UPPER}\n"
SPACE = VERTICES + EDGE + "FIX 7\n"
TUM = "# timestamp tx ty tz qx qy qz qw\n1305031098.6659 1.3563 0.6305 1.6380 0.6132 0.5962 -0.3311 -0.3986\n"
EUROC = (
    "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z []\n"
    "1403636580838555648,4.688319,-1.786938,0.783338,0.6,0.8,0,0\n"
)
INERTIAL = (
    "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
    "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n"
    "1403636579758555392,-0.1,0.2,0.3,8.1,-0.4,-2.4\n"
)


def same(one: Any, two: Any) -> bool:
    """Whether all arrays of two results have the same bits."""
    names = [name for name in type(one).__slots__ if getattr(one, name) is not None]
    return all(np.array_equal(getattr(one, name), getattr(two, name)) for name in names)


def test_occupancy_grid_of_ros(tmp_path: Path) -> None:
    """The numbers of cells are those of map_server's documentation: thresholds on 1 - pixel / 255."""
    (tmp_path / "map.pgm").write_bytes(b"P5\n# made by hand\n3 2\n255\n" + bytes([0, 254, 205, 89, 90, 255]))
    (tmp_path / "map.yaml").write_text(YAML)
    grid = read_occupancy_grid(tmp_path / "map.yaml")
    assert (grid.resolution, grid.origin, grid.negate) == (0.05, (-1.5, 2.0, 0.25), False)
    assert grid.cells.tolist() == [[100, -1, 0], [100, 0, -1]]
    scaled = replace(grid, mode="scale").cells
    assert scaled.tolist() == [[100, 98, 0], [100, 0, 1]] and replace(grid, negate=True).cells[1, 0] == 0
    assert replace(grid, mode="raw", pixels=np.array([[7, 100, 205]], np.uint8)).cells.tolist() == [[7, 100, -1]]
    equal = OccupancyGrid(np.array([[0, 1, 2]], np.uint8), 1.0, (0, 0, 0), False, 0.5, 0.5, "scale", 2)
    assert equal.cells.tolist() == [[100, -1, 0]]


@pytest.mark.parametrize(("kind", "depth"), [(np.uint8, 255), (np.uint16, 65535)])
def test_occupancy_grid_round_trip(tmp_path: Path, kind: Any, depth: int) -> None:
    rng = np.random.default_rng(0)
    pixels = rng.integers(0, depth, (5, 7), endpoint=True).astype(kind)
    grid = OccupancyGrid(pixels, 0.1 + 0.2, tuple(rng.normal(size=3)), True, 2 / 3, 1 / 7, "scale", depth)  # type: ignore[arg-type]
    write_occupancy_grid(tmp_path / "a#1.yaml", grid)
    again = read_occupancy_grid(tmp_path / "a#1.yaml")
    assert same(grid, again) and again.pixels.dtype == kind


def test_plain_image(tmp_path: Path) -> None:
    (tmp_path / "map.pgm").write_text("P2\n2 2\n# four pixels\n255\n0 1\n254 255\n")
    (tmp_path / "map.yaml").write_text(YAML)
    assert read_occupancy_grid(tmp_path / "map.yaml").pixels.tolist() == [[0, 1], [254, 255]]


def test_trajectory_of_tum(tmp_path: Path) -> None:
    path = tmp_path / "groundtruth.txt"
    path.write_text(TUM)
    found = read_tum(path)
    assert found.times.tolist() == [1305031098.6659] and found.places.tolist() == [[1.3563, 0.6305, 1.638]]
    assert found.quaternions.tolist() == [[-0.3986, 0.6132, 0.5962, -0.3311]]
    path.write_bytes(gzip.compress(TUM.encode()))
    assert same(found, read_tum(path))


def test_trajectories_round_trip(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    motors = pga3.normalize_motor(rng.normal(size=(20, 8)))
    first = Trajectory.of_motors(np.sort(rng.normal(size=20)), motors)
    write_tum(tmp_path / "a.txt", first)
    assert same(first, read_tum(tmp_path / "a.txt"))
    stamps = 1403636579758555392 + np.arange(20) * 5000001
    full = replace(
        first,
        times=stamps * 1e-9,
        nanoseconds=stamps,
        velocities=rng.normal(size=(20, 3)),
        biases=rng.normal(size=(20, 6)),
    )
    write_euroc(tmp_path / "a.csv", full)
    assert same(full, read_euroc(tmp_path / "a.csv"))
    write_euroc(tmp_path / "b.csv", first)
    assert np.abs(read_euroc(tmp_path / "b.csv").times - first.times).max() < 1e-9
    turns = pga3.motor_to_matrix(pga3.motor_product(pga3.motor_inverse(first.motors), motors))
    assert np.allclose(turns, np.eye(4), atol=1e-12)


def test_recordings_of_euroc(tmp_path: Path) -> None:
    path = tmp_path / "data.csv"
    path.write_text(EUROC)
    found = read_euroc(path)
    assert found.nanoseconds is not None and found.nanoseconds.tolist() == [1403636580838555648]
    assert found.quaternions.tolist() == [[0.6, 0.8, 0, 0]] and found.velocities is None
    path.write_text(INERTIAL)
    samples = read_euroc_inertial(path)
    assert samples.rates.tolist() == [[-0.1, 0.2, 0.3]] and samples.forces.tolist() == [[8.1, -0.4, -2.4]]
    assert samples.nanoseconds.tolist() == [1403636579758555392]


def test_named_columns(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    table = {"t": np.array([2**62 + 1, -3]), "x": rng.normal(size=2), "y z": rng.normal(size=2) * 1e-300}
    write_columns(tmp_path / "a.csv", table)
    again = read_columns(tmp_path / "a.csv")
    assert list(again) == list(table) and all(np.array_equal(again[name], table[name]) for name in table)
    (tmp_path / "b.csv").write_text("# name, x [m]\nfirst, 1\nsecond, 2.5\n")
    assert read_columns(tmp_path / "b.csv", ["x"])["x"].tolist() == [1, 2.5]


def test_graph_in_space(tmp_path: Path) -> None:
    path = tmp_path / "graph.g2o"
    path.write_text(SPACE)
    graph = read_g2o_space(path)
    assert graph.vertices.tolist() == [7, 3] and graph.edges.tolist() == [[0, 1]] and graph.fixed.tolist() == [0]
    assert graph.information[0, 1].tolist() == [1, 11, 12, 13, 14, 15] == graph.information[0, :, 1].tolist()
    assert graph.turns_first[0, 0].tolist() == [33, 34, 35, 3, 13, 23]
    turn = pga3.motor_to_matrix(graph.motors[1])
    assert np.allclose(turn, [[0, -1, 0, 4], [1, 0, 0, 5], [0, 0, 1, 6], [0, 0, 0, 1]])


def test_graphs_round_trip(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    poses, motions = rng.normal(size=(9, 7)), rng.normal(size=(11, 7))
    for rows in (poses, motions):
        rows[:, 3:] /= np.linalg.norm(rows[:, 3:], axis=1, keepdims=True)
    random = rng.normal(size=(11, 6, 6))
    information = random + random.transpose(0, 2, 1)
    graph = SpaceGraphFile(
        rng.permutation(9) + 2**40, poses, rng.integers(0, 9, (11, 2)), motions, information, np.array([2])
    )
    write_g2o(tmp_path / "a.g2o", graph)
    assert same(graph, read_g2o_space(tmp_path / "a.g2o"))
    plane = read_g2o(Path(__file__).parents[1] / "data" / "maps" / "killian_start.g2o.gz")
    write_g2o(tmp_path / "b.g2o", plane)
    again = read_g2o(tmp_path / "b.g2o")
    assert all(
        np.array_equal(getattr(plane, name), getattr(again, name))
        for name in ("poses", "edges", "motions", "information")
    )


def test_graph_of_a_file_is_optimised(tmp_path: Path) -> None:
    """A square in space whose poses are known; without noise the start is corrected, and a wrong edge is rejected."""
    rng = np.random.default_rng(4)
    step = pga3.motor_from_rotation_vector_translation([0, 0, np.pi / 10], [1.0, 0, 0.1])
    truth = [np.eye(8)[0]]
    for _ in range(19):
        truth.append(np.asarray(pga3.motor_product(truth[-1], step)))
    motors = np.array(truth)
    edges = np.array([(k, k + 1) for k in range(19)] + [(0, 19), (3, 12), (5, 15)])
    motions = np.asarray(pga3.motor_product(pga3.motor_inverse(motors[edges[:, 0]]), motors[edges[:, 1]]))
    off = pga3.motor_from_rotation_vector_translation(0.1 * rng.normal(size=(19, 3)), 0.3 * rng.normal(size=(19, 3)))
    start = np.r_[motors[:1], np.asarray(pga3.motor_product(motors[1:], off))]
    rows = [np.column_stack([place, turn[:, [1, 2, 3, 0]]]) for turn, place in (
        map(np.asarray, pga3.motor_to_quaternion_translation(each)) for each in (start, motions))]  # fmt: skip
    information = np.tile(np.diag([100.0] * 3 + [400] * 3), (22, 1, 1))
    file = SpaceGraphFile(np.arange(20), rows[0], edges, rows[1], information, np.array([0]))
    write_g2o(tmp_path / "a.g2o", file)
    graph = read_g2o_space(tmp_path / "a.g2o")
    found = optimise_poses(graph.motors, graph.edges, graph.motion_motors, graph.turns_first, marginals=[0, 5])
    assert found.status == GraphStatus.OK and found.cost < 1e-16
    assert np.allclose(pga3.motor_to_matrix(found.motors), pga3.motor_to_matrix(motors), atol=1e-8)
    assert not found.covariances[0].any() and (np.diagonal(found.covariances[1]) > 0).all()
    wrong = graph.motion_motors
    wrong[-1] = wrong[0]
    robust = np.arange(22) > 18
    again = optimise_poses(graph.motors, graph.edges, wrong, graph.turns_first, robust)
    assert again.status == GraphStatus.OK and again.weights[-1] < 0.01 and (again.weights[:-1] > 0.99).all()
    alone = optimise_poses(graph.motors, graph.edges[:5], wrong[:5], graph.turns_first[:5], marginals=[2, 9])
    assert alone.status == GraphStatus.DISCONNECTED and np.array_equal(alone.motors[9], graph.motors[9])
    assert np.isfinite(alone.covariances[0]).all() and np.isinf(alone.covariances[1]).all()


Read = Callable[[Path], Any]
PLANE = "VERTEX_SE2 0 0 0 0\n"
WRONG: list[tuple[Read, str, str]] = [
    (read_tum, EUROC, "line 2: .*; expected 8 numbers: timestamp tx"),
    (read_tum, TUM.replace("1.3563", "nan"), "line 2: nan; expected finite"),
    (read_tum, TUM.replace("1.3563", "x"), "line 2: .*; expected 8 numbers"),
    (read_tum, TUM[:-1], "line 2: a line without an end"),
    (read_tum, TUM[:-9] + "\n", "line 2: .*; expected 8 numbers"),
    (read_tum, TUM.replace("-0.3986", "-0.9"), "norm 1.285; expected norm 1"),
    (read_tum, "", "an empty file; expected lines timestamp"),
    (read_euroc, TUM.split("\n", 1)[1], "line 1: columns .*; expected 'timestamp'"),
    (read_euroc, INERTIAL, "line 1: columns timestamp, .*; expected 'p_RS_R_x'"),
    (read_euroc, EUROC.replace("0.6,0.8", "0.6,0.9"), "norm 1.08"),
    (read_euroc, EUROC.replace("4.688319", "inf"), "line 2: inf"),
    (read_euroc, EUROC.replace(",0,0\n", ",0\n"), "line 2: 7 columns; expected 8"),
    (read_euroc, EUROC.replace("1403636580838555648", "1.4"), "expected whole nanoseconds"),
    (read_euroc_inertial, EUROC, "line 1: columns timestamp, .*; expected 'w_RS_S_x'"),
    (read_columns, "1,2\n3,4\n", "line 1: '1,2'; expected the names of columns"),
    (read_columns, "a,b\n1\n", "line 2: 1 columns; expected 2"),
    (read_columns, "a,b\n1,\n", "line 2: .*; expected b as a number"),
    (read_columns, "a,b\n1,1_0\n", "line 2: .*; expected b as a number"),
    (read_g2o_space, VERTICES.replace(" 7 ", " 1_0 "), "line 1: '1_0'; expected the number of a vertex"),
    (read_g2o_space, PLANE, "line 1: 'VERTEX_SE2'; expected lines VERTEX_SE3:QUAT"),
    (read_g2o_space, SPACE.replace(" 55\n", "\n"), "line 3: 27 numbers; expected 28"),
    (read_g2o_space, SPACE.replace(" 55\n", " nan\n"), "line 3: nan; expected finite"),
    (read_g2o_space, VERTICES[:-4], "line 2: a line without an end"),
    (read_g2o_space, VERTICES + EDGE.replace(" 7 3 ", " 7 4 "), "line 3: vertex 4, which the file lacks"),
    (read_g2o_space, VERTICES + VERTICES, "line 3: vertex 7 for the second time"),
    (read_g2o_space, "VERTEX_SE3:QUAT 1.5 0 0 0 0 0 0 1\n", "line 1: '1.5'; expected the number of a vertex"),
    (read_g2o_space, "VERTEX_SE3:QUAT 1 0 0 0 0 0 0 2\n", "line 1: a quaternion of norm 2"),
    (read_occupancy_grid, TUM, "line 2: .*; expected the keys image"),
    (read_occupancy_grid, YAML.replace("0.05", "nan"), "line 2: nan"),
    (read_occupancy_grid, YAML.replace("resolution", "size"), "expected 'resolution' as well"),
    (read_occupancy_grid, YAML.replace("[-1.5, 2, 0.25]", "[1, 2]"), "line 3: .*; expected .x, y, angle"),
    (read_occupancy_grid, YAML.replace("negate: 0", "negate: 2"), "line 4: 2; expected 0 or 1"),
    (read_occupancy_grid, YAML + "mode: other\n", "line 7: other; expected trinary"),
]  # fmt: skip


@all_cases("read, text, error", WRONG)
def test_files_of_other_kinds_are_one_error(tmp_path: Path, read: Read, text: str, error: str) -> None:
    path = tmp_path / "file.txt"
    path.write_text(text)
    with pytest.raises(ValueError, match=error) as found:
        read(path)
    assert "file.txt" in str(found.value) and "\n" not in str(found.value)


FLAT = "VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1 0 0\nEDGE_SE2 0 1 1 0 0 4 0 0 4 0 9\n"


@pytest.mark.parametrize(
    ("data", "error"),
    [
        (gzip.compress(FLAT.encode(), mtime=0)[:-12], "ended before the end-of-stream marker"),
        (b"PK\x03\x04" + FLAT.encode(), "not a zip file"),
        (b"VERTEX_SE2 0 nan 0 0\n", "line 1: VERTEX_SE2: nan 0 0; expected finite"),
    ],
    ids=("cut", "another archive", "no valid line"),
)
def test_graphs_of_which_nothing_is_read_are_one_error(tmp_path: Path, data: bytes, error: str) -> None:
    (tmp_path / "file.g2o").write_bytes(data)
    with pytest.raises(ValueError, match=f"file.g2o.*{error}"):
        read_g2o(tmp_path / "file.g2o")


def test_first_lines_with_a_mark_and_impossible_information(tmp_path: Path) -> None:
    path = tmp_path / "file.g2o"
    path.write_bytes(b"\xef\xbb\xbf" + FLAT.encode())
    whole = read_g2o(path)
    assert len(whole.poses) == 2 and whole.edges.tolist() == [[0, 1]] and not whole.problems
    # The determinant of x and y is negative; each diagonal is positive.
    path.write_text(FLAT.replace("4 0 0 4 0 9", "4 5 0 4 0 9") + FLAT.splitlines()[-1] + "\n")
    found = read_g2o(path)
    assert found.information.tolist() == [[[4, 0, 0], [0, 4, 0], [0, 0, 9]]]
    assert [(each.line, each.reason) for each in found.problems] == [
        (3, "EDGE_SE2: an information matrix with a negative eigenvalue; the line was left out")
    ]


@pytest.mark.parametrize(
    "data", [b"P5\n3 2\n255\n12345", b"P5\n3 2\n255\n1234567", b"\x89PNG\r\n", b"P5\n3 2\n", b"P5" + 60 * b" "]
)
def test_damaged_images_are_one_error(tmp_path: Path, data: bytes) -> None:
    (tmp_path / "map.pgm").write_bytes(data)
    (tmp_path / "map.yaml").write_text(YAML)
    with pytest.raises(ValueError, match=r"map\.pgm: .*; expected"):
        read_occupancy_grid(tmp_path / "map.yaml")


def flipped(packed: bytes) -> list[bytes]:
    """Compressed data with one wrong byte after the ten of the header."""
    return [packed[:k] + bytes([packed[k] ^ 255]) + packed[k + 1 :] for k in range(10, len(packed))]


@pytest.mark.parametrize("read", [read_tum, read_euroc, read_columns, read_g2o_space, read_occupancy_grid])
def test_damaged_data_are_one_error(tmp_path: Path, read: Read) -> None:
    path = tmp_path / "file.gz"
    packed = gzip.compress(SPACE.encode())
    for data in (*flipped(packed), packed[:-9], b"\xff\xfe\x00binary\n"):
        path.write_bytes(data)
        with pytest.raises(ValueError, match=r"file\.gz: .*; expected"):
            read(path)
    with pytest.raises(FileNotFoundError):
        read(tmp_path / "missing")


def test_damaged_graph_ends_at_the_damage(tmp_path: Path) -> None:
    """Lines before the damage are read; if there are none, the file is an error."""
    path = tmp_path / "file.gz"
    for data in flipped(gzip.compress(PLANE.encode())):
        path.write_bytes(data)
        try:
            found = read_g2o(path)
        except ValueError as error:
            assert "ends here" in str(error)
        else:
            assert len(found.poses) and "ends here" in found.problems[-1].reason


def test_what_cannot_be_read_again_is_not_written(tmp_path: Path) -> None:
    good = Trajectory(np.zeros(1), np.zeros((1, 3)), np.eye(4)[:1])
    for bad in (replace(good, times=np.array([np.nan])), replace(good, quaternions=np.zeros((1, 4)))):
        for write in (write_tum, write_euroc):
            with pytest.raises(ValueError, match=r"finite|norm"):
                write(tmp_path / "a", bad)
    for bad in (replace(good, velocities=np.full((1, 3), np.nan)), replace(good, biases=np.zeros((1, 3)))):
        with pytest.raises(ValueError, match=r"velocities|biases"):
            write_euroc(tmp_path / "a", bad)
    tables: list[dict[str, Any]] = [{"a,b": [1.0]}, {"1": [1.0]}, {"a": [np.inf]}, {"a": [1.0], "b": [1.0, 2.0]}, {}]
    for table in (*tables, {"a\x85b": [1.0]}, {"a": np.array([2**63], np.uint64)}):
        with pytest.raises(ValueError, match="expected"):
            write_columns(tmp_path / "a", table)
    grid = OccupancyGrid(np.zeros((2, 2), np.uint8), 1.0)
    empty, order = np.zeros((0, 3), np.uint8), {"occupied_thresh": 0.2, "free_thresh": 0.6}
    changes: list[dict[str, Any]] = [{"resolution": np.nan}, {"pixels": np.zeros((2, 2))}, {"pixels": empty}, order]
    for wrong in (replace(grid, **change) for change in changes):
        with pytest.raises(ValueError, match="expected"):
            write_occupancy_grid(tmp_path / "a.yaml", wrong)
    with pytest.raises(ValueError, match=r"ends in \.yaml"):
        write_occupancy_grid(tmp_path / "a.txt", grid)
    with pytest.raises(ValueError, match="without ' #'"):
        write_occupancy_grid(tmp_path / "a #1.yaml", grid)
    assert not list(tmp_path.iterdir())
