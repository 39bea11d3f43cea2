"""The command that builds maps, and pictures of maps."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from algorithms.mapping import BuiltMap, LineMap, Scan, build_map, read_g2o
from algorithms.mapping.__main__ import main
from algorithms.mapping.pictures_of_maps import draw_map, draw_path_errors, draw_votes

ROOT = Path(__file__).parents[2]
KILLIAN = ROOT / "tests" / "data" / "maps" / "killian_start.g2o.gz"


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The first 25 scans of Killian Court in the format of CARMEN, the last line cut off."""
    text = ""
    for each in read_g2o(KILLIAN).readings[:25]:
        pose = " ".join(f"{x:.5f}" for x in each.odometry)
        text += f"ODOM {pose} 0 0 0 {each.time} h {each.time}\n"
        text += f"FLASER 180 {' '.join(f'{r:.2f}' for r in each.scan.ranges)} {pose} {pose} {each.time} h {each.time}\n"
    path = tmp_path_factory.mktemp("log") / "court.log"
    path.write_text(text[:-200])
    return path


@pytest.fixture(scope="module")
def built(log: Path) -> BuiltMap:
    return build_map(log)


def test_map_picture_and_poses_are_written(log: Path, tmp_path: Path, capsys: Any, built: BuiltMap) -> None:
    files = [tmp_path / name for name in ("map.svg", "map.npz", "poses.csv")]
    assert main([str(log), "-o", str(files[0]), "--map", str(files[1]), "--poses", str(files[2])]) == 0
    report = capsys.readouterr().err
    assert "24 scans, 24 in the map" in report and "line 50: FLASER" in report
    assert files[0].read_text().startswith("<?xml")
    assert np.array_equal(LineMap.load(files[1]).lines, built.line_map.lines)
    table = np.loadtxt(files[2], delimiter=",", skiprows=1)
    assert np.allclose(table[:, :3], built.poses, atol=1e-6) and np.array_equal(table[:, 3], built.statuses)


def test_graph_with_scans_is_read(tmp_path: Path) -> None:
    import gzip

    path = tmp_path / "few.g2o"
    path.write_text("".join(gzip.decompress(KILLIAN.read_bytes()).decode().splitlines(keepends=True)[:40]))
    assert main([str(path), "--map", str(tmp_path / "map.npz"), "--no-loops", "--lines", "5"]) == 0
    assert 0 < len(LineMap.load(tmp_path / "map.npz")) <= 5


@pytest.mark.parametrize(
    ("text", "options", "message"),
    [
        (None, [], "No such file"),
        ("ODOM 0 0 0 0 0 0 1 h 1\n", [], "no scan in it"),
        ("FLASER 3 0 0 0 0 0 0 0 0 0 1 h 1\n", [], "1 scans, none with enough readings"),
        ("", ["-o", "no/such/folder/map.svg"], "no such folder"),
    ],
)
def test_failures_are_reported_in_a_line(
    tmp_path: Path, capsys: Any, text: str | None, options: list[str], message: str
) -> None:
    path = tmp_path / "a.log"
    if text is not None:
        path.write_text(text)
    assert main([str(path), *options]) == 1
    error = capsys.readouterr().err.strip()
    assert error.startswith("mapping: ") and message in error and "\n" not in error


def test_help_has_examples(capsys: Any) -> None:
    with pytest.raises(SystemExit, match="0"):
        main(["--help"])
    shown = capsys.readouterr().out
    assert "examples:" in shown and "office.log.gz -o map.svg" in shown


def test_map_is_drawn_over_its_scans(log: Path, built: BuiltMap) -> None:
    scans = [each.scan for each in read_g2o(KILLIAN).readings[:24]]
    (axis,) = draw_map(built, scans, truth=built.poses).axes
    segments = axis.collections[-1].get_segments()
    assert np.allclose(segments, built.line_map.ends)
    points, path, truth = (line.get_xydata() for line in axis.lines)
    assert len(points) == sum(len(scan.points()) for scan in scans)
    assert np.allclose(path, built.poses[:, :2]) and np.allclose(truth, path)
    (alone,) = draw_map(built.line_map).axes
    assert len(alone.lines) == 0 and len(alone.collections) == 1
    (nothing,) = draw_map(build_map([(Scan(np.zeros(3), 0.0, 0.1, 30.0), None, None)])).axes
    assert len(nothing.collections[-1].get_segments()) == 0


def test_errors_of_the_path_are_drawn(built: BuiltMap) -> None:
    truth = built.poses + np.array([0.3, 0.4, np.radians(2)])
    above, below = draw_path_errors(built, truth).axes
    assert above.lines[0].get_ydata() == pytest.approx(np.full(24, 0.5))
    assert below.lines[0].get_ydata() == pytest.approx(np.full(24, 2.0))


def test_votes_are_drawn() -> None:
    row, matrix = np.arange(9), np.zeros((5, 7))
    (axis,) = draw_votes(row, 2.0).axes
    assert [bar.get_height() for bar in axis.patches] == list(row)
    assert axis.patches[4].get_x() + 1.0 == pytest.approx(0)
    matrix[3, 2] = 1
    image = draw_votes(matrix, 0.5).axes[0].images[0]
    assert image.get_extent() == [-1.25, 1.25, -1.75, 1.75] and image.get_array()[2, 3] == 1
