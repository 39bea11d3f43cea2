"""The picture of the README shows the numbers of the pages that it is drawn from."""

from pathlib import Path

import pytest

from benchmarks.overview import PICTURE, Count, Ratio, main, read_counts, read_ratios

DOCS = Path(__file__).parents[2] / "docs"


def test_counts_are_read_with_divisions_and_vertical_lines() -> None:
    text = """
| expression | definition | mul | add | others | kingdon | ms |
| --- | --- | ---: | ---: | --- | ---: | ---: |
| foot | `a | b` | 10 | 4 | 1 div | 8 / 5, 2 div | 3 |
| unfinished | `a` | 3 | 5 |  | – | 1 |
"""
    assert read_counts(text) == [Count(15, 15)]


def test_ratios_are_those_of_one_robot() -> None:
    text = "## ur5\n| | specialised | generic | specialised, batch | generic, batch | Pinocchio |\n"
    text += "|---|---|---|---|---|---|\n"
    text += "| `forward` | 1.0 | 3.0 | 9 | 9 | 2.0 |\n\n## panda\n| `gravity` | 1.0 | 3.0 | 9 | 9 | 2.0 |\n"
    assert read_ratios(text, "ur5") == [Ratio("forward", 0.5, 1.5)]


@pytest.mark.slow
def test_the_picture_is_that_of_the_pages(tmp_path: Path) -> None:
    """`python -m benchmarks overview` was run after the pages had been written."""
    assert main(["--out", str(tmp_path / "overview.svg")]) == 0
    assert (tmp_path / "overview.svg").read_text() == PICTURE.read_text()


def test_the_numbers_of_the_readme_are_those_of_the_pages() -> None:
    readme = (DOCS.parent / "README.md").read_text()
    counts = read_counts((DOCS / "operation-counts.md").read_text())
    assert f"operations of {len(counts)} expressions" in readme
    dynamics = next(
        r for r in read_ratios((DOCS / "robot-speed.md").read_text(), "ur5") if r.method == "inverse_dynamics"
    )
    assert f"{dynamics.any:.2f} of Pinocchio's time; {dynamics.own:.2f} with specialised kernels" in readme
