"""Readers of CARMEN logs and g2o files: angles, odometry, damaged lines, time stamps, compressed files."""

from __future__ import annotations

import gzip
import tracemalloc
import zipfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from algorithms.mapping import build_map
from algorithms.mapping.carmen import CarmenLog, beam_angles
from algorithms.mapping.g2o import read_g2o
from tests.support.all_cases import all_cases

KILLIAN = Path(__file__).parents[1] / "data" / "maps" / "killian_start.g2o.gz"


def flaser(n: int, value: float, time: float | str, pose: str = "1 2 0.3") -> str:
    return f"FLASER {n} {' '.join([str(value)] * n)} {pose} {pose} {time} robot {time}\n"


@all_cases(
    "n, first, last",
    [(180, -90, 89), (360, -90, 89.5), (181, -90, 90), (361, -90, 90), (240, -90, 89.25)],
)
def test_angles_of_beams(n: int, first: float, last: float) -> None:
    start, step = beam_angles(n)
    assert np.degrees([start, start + (n - 1) * step]) == pytest.approx([first, last])
    (reading,) = CarmenLog([flaser(n, 2.0, 5.0)])
    assert np.degrees(reading.scan.angles[[0, -1]]) == pytest.approx([first, last])


def odom(x: float, angle: float, time: float | str) -> str:
    return f"ODOM {x} 0 {angle} 0 0 0 {time} h {time}\n"


def test_odometry_is_interpolated_to_the_time_of_the_scan() -> None:
    """Before the first and after the last line, and where a scan has no time, it is that of the nearest line before."""
    lines = [flaser(3, 1.0, 0.5), odom(1, 3.0, 1), flaser(3, 1.0, 1.25), flaser(3, 1.0, 0), odom(2, -3.0, 2)]
    readings = list(CarmenLog([*lines, flaser(3, 1.0, 1.5), flaser(3, 1.0, 2.5)]))
    turn = 2 * np.pi - 6
    expected = [[1, 0, 3], [1.25, 0, 3 + turn / 4], [1, 0, 3], [1.5, 0, 3 + turn / 2], [2, 0, -3]]
    assert np.allclose([each.odometry for each in readings], expected)  # type: ignore[arg-type]
    assert [each.time for each in readings] == [0.5, 1.25, None, 1.5, 2.5]
    assert list(readings[0].pose) == [1, 2, 0.3]


def test_odometry_over_long_gaps_is_the_last_line_before_the_scan() -> None:
    lines = [odom(1, 0, 1), flaser(3, 1.0, 1.5), odom(5, 0, 4), flaser(3, 1.0, 4.5), odom(6, 0, "nan"), flaser(3, 1, 5)]
    poses = [each.odometry for each in CarmenLog(lines)]
    assert np.array_equal(poses, [[1, 0, 0], [5, 0, 0], [6, 0, 0]])  # type: ignore[arg-type]


@pytest.mark.parametrize(("rate", "count"), [(1, 2), (100, 101)])
def test_scans_wait_for_odometry_for_a_second(rate: int, count: int) -> None:
    """Later, lines of odometry are too far apart for any scan between them. The order remains."""
    n_read = 0

    def lines() -> Iterator[str]:
        nonlocal n_read
        yield odom(1, 0, 1)
        for k in range(1, 200):
            n_read += 1
            yield flaser(3, 1.0, 1 + k / rate)

    log = iter(CarmenLog(lines()))
    assert next(log).time == 1 + 1 / rate and n_read == count
    assert [each.time for each in log] == [1 + k / rate for k in range(2, 200)]


def test_many_scans_between_lines_of_odometry() -> None:
    """All of them are interpolated."""
    scans = [flaser(3, 1.0, 1 + k / 128) for k in range(1, 64)]
    readings = CarmenLog([odom(1, 0, 1), *scans, odom(1.5, 0, 1.5)])
    assert [each.odometry[0] for each in readings] == [1 + k / 128 for k in range(1, 64)]  # type: ignore[index]


def test_iterators_are_read_as_lists_are() -> None:
    """Scans before the first line of odometry have its pose."""
    lines = [flaser(3, 1.0, 1, "9 0 0"), flaser(3, 1.0, 2, "9 1 0"), odom(0.5, 0, 3), flaser(3, 1.0, 4, "9 2 0")]
    for source in (lines, iter(lines)):
        assert [list(each.odometry) for each in CarmenLog(source)] == [[0.5, 0, 0]] * 3  # type: ignore[arg-type]


def test_log_without_odometry_has_that_of_the_scans() -> None:
    (reading,) = CarmenLog([flaser(3, 1.0, 0.5, "4 5 0.6")])
    assert list(reading.odometry) == [4, 5, 0.6]


def test_largest_ranges_are_dropped() -> None:
    (reading,) = CarmenLog(["FLASER 4 1.0 29.9 30.0 81.83 0 0 0 0 0 0 1 h 1\n"])
    assert list(reading.scan.beams) == [0, 1]
    (reading,) = CarmenLog(["FLASER 4 1.0 29.9 30.0 81.83 0 0 0 0 0 0 1 h 1\n"], max_range=80)
    assert list(reading.scan.beams) == [0, 1, 2]


@all_cases("cut", range(1, 60))
def test_log_that_is_cut_within_a_line(cut: int, tmp_path: Path) -> None:
    """The scans before the cut are read; what is left of the last line is a problem, or complete but for its host."""
    whole = flaser(10, 1.25, 10.5) + flaser(10, 2.25, 11.5)
    path = tmp_path / "cut.log"
    path.write_text(whole[:-cut])
    log = CarmenLog(path)
    readings = list(log)
    assert readings[0].time == 10.5
    if len(readings) == 2:
        assert readings[1].scan.ranges.tolist() == [2.25] * 10 and readings[1].time == 11.5
        assert log.n_problems == 0
    else:
        assert log.n_problems == 1 and log.problems[0].line == 2


def test_damaged_lines_are_listed_with_their_numbers() -> None:
    lines = [
        "FLASER\n", "FLASER x 1 2\n", "FLASER -1\n", "FLASER 3 1 2\n", "FLASER 2 1 a 0 0 0 0 0 0 1 h 1\n", "\n",
        "FLASER 2 1 1 0 0 0 nan 0 0 1 h 1\n", "ODOM 1 2\n", "ROBOTLASER1 0 1\n", "# a comment\n", "PARAM a b\n",
        flaser(2, 1.0, 3.0),
    ]  # fmt: skip
    log = CarmenLog(lines)
    assert len(list(log)) == log.n_scans == 1
    assert [problem.line for problem in log.problems] == [1, 2, 3, 4, 5, 7, 8, 9]
    assert "2 of 3 ranges" in log.problems[3].reason


def test_ranges_that_are_not_numbers_are_not_measured() -> None:
    (reading,) = CarmenLog(["FLASER 4 nan inf -1 2.0 0 0 0 0 0 0 1 h 1\n"])
    assert list(reading.scan.beams) == [3]


def test_time_stamps_that_are_missing_or_jump_are_counted() -> None:
    log = CarmenLog([flaser(2, 1.0, t) for t in (0, 0, 5, 6, 2, 3, 1000, 1001)])
    assert [each.time for each in log] == [None, None, 5, 6, 2, 3, 1000, 1001]
    assert (log.n_untimed, log.n_jumps, log.n_problems) == (2, 2, 0)


def test_compressed_log_that_ends_early(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    text = "".join(flaser(20, float(rng.uniform(1, 9)), t) for t in range(1, 400))
    packed = gzip.compress(text.encode())
    path = tmp_path / "log.gz"
    path.write_bytes(packed)
    assert len(list(CarmenLog(path))) == 399
    path.write_bytes(packed[: len(packed) // 2])
    log = CarmenLog(path)
    assert 0 < len(list(log)) < 399
    assert log.n_problems == 1 and "ends here" in log.problems[0].reason
    # A second stream whose first block has no kind: another error than the end of the file.
    path.write_bytes(packed + packed[:10] + b"\xff" * 99)
    log = CarmenLog(path)
    assert len(list(log)) <= 399 and log.n_problems == 1 and "ends here" in log.problems[0].reason


def test_log_is_read_again_from_its_start(tmp_path: Path) -> None:
    path = tmp_path / "log"
    path.write_text(flaser(2, 1.0, 1.0) + "FLASER\n")
    log = CarmenLog(path)
    assert [len(list(log)), len(list(log))] == [1, 1]
    assert log.n_problems == 1


def test_memory_does_not_grow_with_the_log() -> None:
    def lines(n: int) -> Iterator[str]:
        yield odom(0, 0, 0.5)
        yield from (flaser(20, 1.5, t) for t in range(1, n))

    def peak(n: int) -> int:
        tracemalloc.start()
        for _ in CarmenLog(lines(n)):
            pass
        found = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return found

    peak(10)
    # Python keeps freed tuples, of 72 bytes; scans that are kept would take ten times as much.
    assert peak(1000) < peak(100) + 100_000


def test_graph_of_killian_court() -> None:
    graph = read_g2o(KILLIAN)
    assert (len(graph.poses), len(graph.edges), len(graph.readings)) == (400, 414, 400)
    assert graph.problems == () and len(graph.readings[7].scan) == 180
    assert np.array_equal([each.odometry for each in graph.readings], graph.poses)
    assert np.array_equal(graph.information[0], np.diag([500.0, 500.0, 5000.0]))
    assert graph.readings[0].scan.angles[[0, 90]] == pytest.approx([-np.pi / 2, 0], abs=1e-4)
    chain = graph.edges[:, 1] == graph.edges[:, 0] + 1
    steps = np.hypot(*(graph.poses[graph.edges[chain, 1], :2] - graph.poses[graph.edges[chain, 0], :2]).T)
    assert np.allclose(np.hypot(*graph.motions[chain, :2].T), steps, atol=0.15)


def test_graph_in_a_zip_archive_with_other_numbers(tmp_path: Path) -> None:
    text = (
        "VERTEX_SE2 10 1 2 0.5\nVERTEX_SE2 12 3 4 0.25\nVERTEX_SE2 10 9 9 9\nEDGE_SE2 10 12 1 0 0.1 9 1 2 8 3 7\n"
        "EDGE_SE2 12 99 1 0 0 1 0 0 1 0 1\nEDGE_SE2 12 10 1\nFIX 10\n"
    )
    path = tmp_path / "graph.zip"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("__MACOSX/._graph.g2o", "x")
        archive.writestr("folder/graph.g2o", text)
    graph = read_g2o(path)
    assert graph.poses.tolist() == [[1, 2, 0.5], [3, 4, 0.25]] and graph.edges.tolist() == [[0, 1]]
    assert graph.information.tolist() == [[[9, 1, 2], [1, 8, 3], [2, 3, 7]]]
    assert [problem.line for problem in graph.problems] == [3, 5, 6]
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("other.txt", text)
    with pytest.raises(ValueError, match=r"other\.txt; expected one named"):
        read_g2o(path)


@pytest.mark.parametrize(
    "text",
    ["#ROSBAG V2.0\nbinary", "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\nEDGE_SE3:QUAT 0 1 1 0 0 0 0 0 1\n", "a,b\n1,2\n"],
)
def test_files_of_other_formats_are_errors(tmp_path: Path, text: str) -> None:
    """A bag, a graph in space and a table give errors that name what was found, and not an empty map."""
    log, graph = tmp_path / "log.txt", tmp_path / "graph.g2o"
    log.write_text(text)
    graph.write_text(text)
    with pytest.raises(ValueError, match=r"log\.txt: \d lines, none of them FLASER"):
        build_map(log)
    with pytest.raises(ValueError, match=r"graph\.g2o: lines .*; expected VERTEX_SE2"):
        build_map(graph)


@pytest.mark.parametrize(
    ("name", "text", "reason"),
    [
        ("log.txt", "", "$"),
        ("log.txt", "FLASER 3 1 2\n", ", line 1: FLASER: 2 of 3 ranges"),
        ("graph.g2o", "VERTEX_SE2 0 0 0 0\n", "$"),
    ],
)
def test_files_without_scans_are_errors(tmp_path: Path, name: str, text: str, reason: str) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(ValueError, match=rf"{name}: no scan in it; expected a log of CARMEN .* with scans{reason}"):
        build_map(tmp_path / name)
