"""Networks: gradients of losses, training, files, and bad input."""

from __future__ import annotations

import copy
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from algorithms.learning import (
    Adam,
    GradeLinear,
    Linear,
    Network,
    Sgd,
    Split,
    TrainingStatus,
    TwoSided,
    cosine,
    halving,
)
from algorithms.learning.__main__ import main
from tests.support.all_cases import all_cases

RANDOM = np.random.default_rng(0)
X = RANDOM.normal(size=(40, 2, 8))
TRUE = Network([Linear(2), Split("tanh"), Linear(1)], channels=2, seed=9)
Y = TRUE.predict(X)


def network(**options: object) -> Network:
    return Network([Linear(3), Split("tanh"), Linear(1)], "G(3)", 2, **options)  # type: ignore[arg-type]


@pytest.mark.parametrize("loss", ["squares", "entropy"])
def test_gradient_of_the_loss(loss: str) -> None:
    one = Network([Linear(3), Split("tanh"), Linear(3)], "G(3)", 2, loss=loss)
    y = np.arange(40) % 3 if loss == "entropy" else RANDOM.normal(size=(40, 3, 8))
    along = RANDOM.normal(size=one.parameters.shape)
    expected = one.gradient(X, y)[1] @ along
    start, h, sides = one.parameters.copy(), 1e-5, []
    for sign in (1, -1):
        one.parameters = start + sign * h * along
        sides.append(one.loss(X, y))
    assert (sides[0] - sides[1]) / (2 * h) == pytest.approx(expected, rel=1e-7)


@all_cases("optimizer", ["sgd", "adam", "rprop", "lbfgs"])
def test_every_optimizer_decreases_the_loss(optimizer: str) -> None:
    one = network()
    before = one.loss(X, Y)
    result = one.fit(X, Y, optimizer, epochs=60)
    assert one.loss(X, Y) < before / 4 and len(result.losses) > 5


def test_seeds_and_single_precision() -> None:
    runs = [network(dtype=np.float32, seed=3) for _ in range(2)]
    for one in runs:
        one.fit(X, Y, Adam(0.01), epochs=5, schedule=cosine(5), seed=4)
    assert runs[0].parameters.dtype == np.float32 and np.array_equal(runs[0].parameters, runs[1].parameters)
    assert runs[0].predict(X).dtype == np.float32


def test_schedules() -> None:
    assert [halving(2)(k) for k in range(5)] == [1, 1, 0.5, 0.5, 0.25]
    assert cosine(4)(0) == 1 and cosine(4)(4) == pytest.approx(0) and cosine(4)(2) == pytest.approx(0.5)


def test_saved_network_is_equal(tmp_path: Path) -> None:
    one = Network([Linear(3, side="right", grades=(0, 2)), Split("relu"), Linear(1)], "G(3,0,1)", 2, seed=1)
    one.save(tmp_path / "n.npz")
    x = RANDOM.normal(size=(3, 2, 16))
    assert np.array_equal(Network.load(tmp_path / "n.npz").predict(x), one.predict(x))
    np.savez(tmp_path / "other.npz", a=1)
    with pytest.raises(ValueError, match="a file written by"):
        Network.load(tmp_path / "other.npz")


def test_stops_early_and_keeps_the_best() -> None:
    one = network()
    noise = RANDOM.normal(size=Y.shape)
    result = one.fit(X, Y, validation=(X, noise), patience=5, epochs=400)
    assert result.status == TrainingStatus.STOPPED_EARLY
    assert one.loss(X, noise) == pytest.approx(result.validation.min())


def test_interruption_keeps_the_last_step() -> None:
    one = network()
    seen = []

    def progress(epoch: int, loss: float) -> None:
        seen.append(one.parameters.copy())
        if epoch == 3:
            raise KeyboardInterrupt

    assert one.fit(X, Y, progress=progress).status == TrainingStatus.INTERRUPTED
    assert np.array_equal(one.parameters, seen[-1]) and len(seen) == 4
    assert one.fit(X, Y, "lbfgs", progress=progress).status == TrainingStatus.INTERRUPTED


def test_divergence_is_reported() -> None:
    one = Network([Linear(3), Split("identity"), Linear(1)], channels=2)
    with pytest.warns(RuntimeWarning, match="diverged"):
        result = one.fit(X, Y, Sgd(1e6), epochs=50)
    assert result.status == TrainingStatus.DIVERGED and np.isfinite(one.parameters).all()


def test_bad_input() -> None:
    bad = X.copy()
    bad[3, 1, 2] = np.nan
    with pytest.raises(ValueError, match=r"X: nan at \(3, 1, 2\)"):
        network().predict(bad)
    with pytest.raises(ValueError, match="no samples"):
        network().fit(X[:0], Y[:0])
    with pytest.raises(ValueError, match="8 coefficients"):
        network().predict(np.ones((3, 2, 4)))
    with pytest.raises(ValueError, match="y: shape"):
        network().loss(X, Y[:3])
    with pytest.raises(ValueError, match="algebra"):
        Network([Linear(1)], "G(9)")
    with pytest.raises(ValueError, match="labels"):
        Network([Linear(2)], channels=2, loss="entropy").loss(X, np.full(40, 2))
    assert network().predict(X[:0]).shape == (0, 1, 8)


def test_command_prints_a_table(capsys: pytest.CaptureFixture[str]) -> None:
    main(["moebius", "--algebras", "R", "C", "--seeds", "1", "--parameters", "40"])
    real, complex_ = (float(row.split("|")[3]) for row in capsys.readouterr().out.splitlines()[2:])
    assert complex_ < real


def test_gradients_share_no_arrays() -> None:
    random = np.random.default_rng(12)
    network = Network([Linear(64), Split("tanh"), Linear(4)], "G(3)", 16)
    x, y = random.normal(size=(2, 30, 16, 8)), random.normal(size=(2, 30, 4, 8))
    first = network.gradient(x[0], y[0])[1]
    kept = first.copy()
    copied = copy.deepcopy(network)
    network.gradient(x[1], y[1])
    assert np.array_equal(first, kept)
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda k: network.gradient(x[k % 2], y[k % 2])[1], range(16)))
    assert all(np.array_equal(one, found[k % 2]) for k, one in enumerate(found))
    assert np.array_equal(found[0], kept) and np.array_equal(copied.gradient(x[0], y[0])[1], kept)


def test_parameters_before_a_divergence_are_kept() -> None:
    one = network()
    before = one.loss(X, Y)
    with pytest.warns(RuntimeWarning, match="diverged in epoch 1.*smallest loss"):
        result = one.fit(X, Y, Sgd(1e6), epochs=20, batch=None)
    assert result.status is TrainingStatus.DIVERGED and one.loss(X, Y) == before
    with pytest.warns(RuntimeWarning, match="diverged in epoch 0: loss inf; the initial ones are kept"):
        one.fit(1e150 * X, 1e160 * Y, epochs=3)
    assert one.loss(X, Y) == before


@all_cases("channels", [0, -1, 2.5])
@all_cases("kind", [GradeLinear, TwoSided])
def test_layers_need_a_positive_number_of_channels(kind: Any, channels: Any) -> None:
    with pytest.raises(ValueError, match=f"{channels} channels; expected a positive integer"):
        Network([kind(channels)], "G(3)", 2)


def test_names_of_algebras_are_strings() -> None:
    for name in (None, 3):
        with pytest.raises(TypeError, match="expected a name like"):
            Network([Linear(1)], name)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="expected positive integers"):
        network().fit(X, Y, epochs=2.5)  # type: ignore[arg-type]
