"""Operation counts compared with kingdon: the same expressions, written in its operators, counted by the same rules."""

from __future__ import annotations

from collections.abc import Iterator
from random import Random

import pytest
from known_records import compiled

from benchmarks.counts import count_with_kingdon, peer_count, peer_values
from benchmarks.kingdon_counts import Unsupported
from benchmarks.known import known
from benchmarks.worker import TimeLimitExceeded, Worker
from gacompiler.frontend.kernel import Kernel, trace
from gacompiler.passes.samples import meaning, sample

pytestmark = pytest.mark.peers

LIMIT = 6.0
TOO_SLOW = {"distance_squared_of_moved_points", "three_motors_point", "circle_3_moved_points"}
"""Expressions that kingdon may not finish within the limit."""


@pytest.fixture(scope="module")
def worker() -> Iterator[Worker]:
    """A process that runs kingdon and is stopped at the limit."""
    pytest.importorskip("kingdon")
    with Worker(peer_count, LIMIT) as started:
        yield started


@pytest.mark.parametrize("name", list(known()))
def test_kingdon_takes_no_fewer_operations(name: str, worker: Worker) -> None:
    cost = compiled(name).cost
    peer = count_with_kingdon(worker, name, LIMIT)
    if peer.found is None:
        # The time that kingdon takes depends on the machine; any other reason is an error.
        assert name in TOO_SLOW or peer.reason.startswith(">"), peer.reason
        pytest.skip(f"kingdon: {peer.reason}")
    assert peer.total is not None
    mul, add, div = peer.found
    assert cost.total <= peer.total, f"ours: {cost}; kingdon: {mul} mul, {add} add, {div} div"
    if cost.div >= div:  # otherwise products stand in for its divisions
        assert cost.mul + cost.add <= mul + add


@pytest.fixture(scope="module")
def evaluator() -> Iterator[Worker]:
    """A process that evaluates expressions with kingdon and is stopped at the limit."""
    pytest.importorskip("kingdon")
    with Worker(peer_values, LIMIT) as started:
        yield started


@pytest.mark.parametrize("name", [name for name in known() if name not in TOO_SLOW])
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
