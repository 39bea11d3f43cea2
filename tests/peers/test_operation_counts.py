"""Operation counts compared with recorded ones and with kingdon: the same expressions by its rules.

The counts of kingdon are those on the page; some of them are counted again, since only its version changes them. Ours
are as well, and a sixth of them is counted again. As in `test_counts.py`, a higher count fails, and a lower one must be
recorded. No count exceeds that of the author's own structure.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from random import Random

import pytest
from further_counts import FURTHER
from known_counts import COUNTS
from known_records import compiled

from benchmarks.counts import PAGE, Peer, count_cells, count_with_kingdon, peer_count, peer_values, table_cells
from benchmarks.kingdon_counts import Unsupported
from benchmarks.known import known
from benchmarks.worker import TimeLimitExceeded, Worker
from gacompiler.frontend.kernel import Kernel, trace
from gacompiler.ir.cost import WEIGHTS
from gacompiler.passes.samples import meaning, sample

pytestmark = pytest.mark.peers

ROOT = Path(__file__).parents[2]
LIMIT = 6.0
NAMES = list(known())
RECORDED = FURTHER | {name: reached for name, (_, reached) in COUNTS.items()}
TOO_SLOW = {
    *("distance_squared_of_moved_points", "three_motors_point", "circle_3_moved_points", "plane_3_moved_points"),
    *("kinetic_energy_of_moved_mass", "volume_of_transformed_events"),
}
"""Expressions that kingdon may not finish within the limit, or hardly."""
COMPILED = NAMES[1::6]
"""A strategy that loses operations of twenty expressions is missed with probability .83 ** 20 = .03; and the counts of
all kernels of the library, some thousands, are in the texts that `gac check` compares."""


@pytest.fixture(scope="module")
def worker() -> Iterator[Worker]:
    """A process that runs kingdon and is stopped at the limit."""
    pytest.importorskip("kingdon")
    with Worker(peer_count, LIMIT) as started:
        yield started


@pytest.fixture(scope="module")
def listed() -> dict[str, tuple[str, ...]]:
    """The rows of the stored page."""
    return table_cells((ROOT / PAGE).read_text())


def operations(cells: tuple[str, ...]) -> list[int]:
    """Products, sums and divisions of kingdon in a row of the page; empty if it did not finish."""
    return [int(number) for number in re.findall(r"\d+", cells[-3])]


def test_the_page_has_the_recorded_counts_and_kingdon_takes_no_fewer(listed: dict[str, tuple[str, ...]]) -> None:
    for name, row in listed.items():
        mul, add = (int(cell) for cell in row[2:4])
        others = {kind: int(number) for number, kind in re.findall(r"(\d+) (\w+)", row[4])}
        assert (mul, add) == RECORDED[name], f"{name}: run `make bench PAGE=operation-counts`"
        if operations(row):
            theirs = (*operations(row), 0)[:3]
            ours = mul * WEIGHTS["mul"] + add * WEIGHTS["add"] + sum(WEIGHTS[kind] * n for kind, n in others.items())
            assert ours <= (Peer(theirs, 0.0).total or 0), f"{name}: ours: {row[2:5]}; kingdon: {row[-3]}"
            if others.get("div", 0) >= theirs[2]:  # otherwise products stand in for its divisions
                assert mul + add <= sum(theirs[:2]), name


@pytest.mark.parametrize("name", COMPILED)
def test_counts_are_those_of_the_page(name: str, listed: dict[str, tuple[str, ...]]) -> None:
    record = compiled(name)
    cost, written = record.cost, record.candidates[0]
    assert written.origin == "as written"
    assert cost.total <= written.cost.total
    assert (cost.mul, cost.add) == RECORDED[name], f"{name}: {cost}; record it if it is an improvement"
    assert listed[name][:-3] == count_cells(known()[name], record), f"{name}: run `make bench PAGE=operation-counts`"


@pytest.mark.parametrize("name", [name for name in NAMES[::8] if name not in TOO_SLOW])
def test_counts_of_kingdon_are_those_of_the_page(name: str, listed: dict[str, tuple[str, ...]], worker: Worker) -> None:
    peer = count_with_kingdon(worker, name, LIMIT)
    if peer.found is None:
        # The time that kingdon takes depends on the machine; any other reason is an error.
        assert peer.reason.startswith(">"), peer.reason
        pytest.skip(f"kingdon: {peer.reason}")
    assert peer.found == (*operations(listed[name]), 0)[:3]


@pytest.fixture(scope="module")
def evaluator() -> Iterator[Worker]:
    """A process that evaluates expressions with kingdon and is stopped at the limit."""
    pytest.importorskip("kingdon")
    with Worker(peer_values, LIMIT) as started:
        yield started


@pytest.mark.parametrize("name", [name for name in NAMES[::3] if name not in TOO_SLOW])
def test_kingdon_computes_the_same(name: str, evaluator: Worker) -> None:
    """Otherwise its count would be of something else. Signs of its blades are not ours, so magnitudes are compared."""
    kernel = known()[name].kernel
    inputs = sample(kernel, Random(1))
    try:
        numbers, factors = evaluator(name, _oriented(kernel, inputs))
    except (TimeLimitExceeded, Unsupported) as error:
        pytest.skip(f"kingdon: {error}")
    ours = [float(value) for part in meaning(trace(kernel).expressions, inputs) for value in part.terms.values()]
    largest = max(map(abs, ours))
    found = [abs(number / factor) for number, factor in zip(numbers, factors, strict=True)]
    assert _large(found, largest) == pytest.approx(_large(map(abs, ours), largest), rel=1e-6)


def _oriented(kernel: Kernel, inputs: dict[str, object]) -> list[float]:
    """Inputs in order, each blade in ascending orientation."""
    return [
        float(inputs[name]) * slot.sign  # type: ignore[arg-type]
        for parameter in kernel.parameters
        for name, slot in zip(parameter.components, parameter.layout.stored, strict=True)
    ]


def _large(values: object, largest: float) -> list[float]:
    """Magnitudes above rounding, sorted."""
    return sorted(value for value in values if value > 1e-9 * largest)  # type: ignore[attr-defined]
