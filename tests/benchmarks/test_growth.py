"""Growth with the dimension: a run in two dimensions, the page and the picture from figures that are known."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks import growth
from benchmarks.growth import Curve, Point, draw, kernel_of, main, measure_curve, page
from benchmarks.worker import TimeLimitExceeded

ROOT = Path(__file__).parents[2]

CURVES = [
    Curve("full product", "orthonormal", {2: Point(0.01234, 16, 12), 3: "late"}, {2: Point(2.0, 17, 13)}),
    Curve("even product", "null pairs", {2: "ValueError"}, {}),
]


@pytest.mark.slow
def test_a_small_run_writes_page_and_picture(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(growth, "installed", lambda name: False)
    monkeypatch.setattr(growth, "stamped", lambda text, command: f"{text}The stamp of {command}.")
    out = tmp_path / "page.md"
    assert main(["--largest", "2", "--limit", "60", "--out", str(out)]) == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["page.md", "page.svg"]
    text = out.read_text()
    assert "| full product | 2 | 16 | 12 |" in text.partition("## Null pairs")[0]
    assert "| full product | 2 | 10 | 12 |" in text.partition("## Null pairs")[2]
    assert "kingdon is not installed" in text and text.endswith("The stamp of growth.")


def test_a_file_that_cannot_be_written_is_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(growth, "measure_all", lambda *_: CURVES)
    monkeypatch.setattr(growth, "stamped", lambda text, _: text)
    assert main(["--out", str(ROOT / "README.md" / "page.md")]) == 1
    assert "choose one with --out" in capsys.readouterr().err


def test_the_page_of_made_up_figures() -> None:
    text = page(CURVES, 5, "picture.svg")
    assert "| full product | 2 | 16 | 12 | 12.3 | 17 | 13 | 2e+03 |" in text
    assert "| full product | 3 | – | – | > 5000 | – | – | – |" in text
    assert "| even product | 2 | – | – | ValueError | – | – | – |" in text
    assert "](picture.svg)" in text


@pytest.mark.slow
def test_the_picture_is_the_same_every_time(tmp_path: Path) -> None:
    first, second = tmp_path / "a.svg", tmp_path / "b.svg"
    draw(first, CURVES)
    draw(second, CURVES)
    assert first.read_bytes() == second.read_bytes()
    assert "date" not in first.read_text().lower()


def test_larger_dimensions_are_left_out_after_the_first_that_is_late() -> None:
    asked = []

    def worker(expression: str, metric: str, n: int) -> Point:
        asked.append(n)
        if n == 6:
            raise TimeLimitExceeded
        if n == 4:
            raise ValueError
        return Point(1.0, 1, 1)

    assert measure_curve(worker, "full product", "null pairs", 10) == {2: Point(1.0, 1, 1), 4: "ValueError", 6: "late"}
    assert asked == [2, 4, 6]


def test_null_pairs_are_null() -> None:
    (a, _) = kernel_of("vector times vector", "null pairs", 4).parameters
    assert not any(a.layout.algebra.gram[k][k] for k in range(4))
