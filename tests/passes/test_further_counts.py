"""The page that lists operation counts; `test_operation_counts.py` compares them where it compares kingdon's."""

from __future__ import annotations

import math
import re
import time
from pathlib import Path

import pytest
from further_counts import FURTHER
from known_records import compiled

from benchmarks.counts import PAGE, Peer, Row, page, table_cells
from benchmarks.known import known
from benchmarks.worker import TimeLimitExceeded, Worker

ROOT = Path(__file__).parents[2]

NAMES = list(known())


@pytest.fixture(scope="module")
def listed() -> dict[str, tuple[str, ...]]:
    """The rows of the stored page."""
    return table_cells((ROOT / PAGE).read_text())


def test_every_further_expression_is_counted_and_documented() -> None:
    further = {name: each for name, each in known().items() if each.published is None}
    assert set(further) == set(FURTHER)
    assert all(each.kernel.summary.endswith(".") for each in further.values())
    assert len({each.algebra for each in further.values()}) >= 6


def test_the_page_lists_nothing_else(listed: dict[str, tuple[str, ...]]) -> None:
    assert list(listed) == NAMES


def test_a_page_with_invented_figures() -> None:
    """The page has the counts of kingdon in sentences and in cells."""
    each = known()["rotor_vector"]
    record = compiled("rotor_vector")
    more, less, late = Peer((40, 20, 1), 0.0123), Peer((9, 6, 0), 2.0), Peer(None, 3.0, "> 3 s")
    text = page([Row(each, record, 0.5, peer) for peer in (more, less, late)], 3)
    assert [row[9:] for row in rows(text)] == [
        ("40 / 20, 1 div", "500", "12"), ("9 / 6", "500", "2000"), ("–", "500", "> 3 s"),
    ]  # fmt: skip
    flat = " ".join(text.split())
    assert "kingdon finished 2 expressions and did not finish 1." in flat
    assert "needs more operations for 1 of them, the same number for 0, and fewer for 1." in flat
    assert f"of the ratios of the counts is {(68 * 15 / 30**2) ** 0.5:.2f}." in flat
    assert "make .venv/.peers" in page([Row(each, record, 0.5, None)], 3)


def rows(text: str) -> list[tuple[str, ...]]:
    """The rows of expressions in a page."""
    lines = [line for line in text.splitlines() if re.match(r"\| \w+ \| `", line)]
    return [tuple(cell.strip() for cell in line[1:-1].split(" | ")) for line in lines]


def test_a_worker_answers_raises_and_is_stopped() -> None:
    with Worker(math.sqrt, 30) as worker:
        assert worker(4) == 2
        with pytest.raises(ValueError, match=r"domain|nonnegative"):
            worker(-1)
        assert worker(9) == 3
    with Worker(time.sleep, 0.05) as worker:
        with pytest.raises(TimeLimitExceeded, match=r"more than 0\.05 s"):
            worker(30)
        assert worker(0) is None
