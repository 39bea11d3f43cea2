"""Recordings of accelerometers and gyroscopes as multivectors, and a classifier invariant under rotations."""

from __future__ import annotations

import gzip
import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .activations import Split
from .algebra import Algebra, Array
from .linear import Linear
from .losses import entropy
from .network import Network


def read_series(path: str | Path) -> tuple[Array, list[str]]:
    """Read a file in the format .ts, also compressed: (recordings, dimensions, times), and the classes."""
    opened = gzip.open if str(path).endswith(".gz") else open
    with opened(path, "rt") as file:
        lines = [line.strip() for line in file if line.strip() and line[0] not in "#@"]
    parts = [line.split(":") for line in lines]
    values = [[[float(number) for number in row.split(",")] for row in part[:-1]] for part in parts]
    return np.array(values), [part[-1] for part in parts]


def series(recordings: Array) -> Array:
    """Return accelerations as vectors and angular velocities as bivectors of G(3), (recordings, times, 8)."""
    accelerations, turning = recordings[:, :3].transpose(0, 2, 1), recordings[:, 3:6].transpose(0, 2, 1)
    found = np.zeros((*accelerations.shape[:2], 8))
    found[..., 1:4] = accelerations
    # The bivectors e12, e13 and e23 of rotations about z, -y and x.
    found[..., 4], found[..., 5], found[..., 6] = turning[..., 2], -turning[..., 1], turning[..., 0]
    return found


def powers(elements: Array, bands: int) -> Array:
    """Return squared Fourier coefficients in bands of equal width, without the mean, (recordings, bands, blades)."""
    squares = np.abs(np.fft.rfft(elements, axis=1)[:, 1:]) ** 2 / 900
    count = squares.shape[1] // bands * bands
    return np.asarray(squares[:, :count].reshape(len(squares), bands, -1, squares.shape[-1]).sum(2))


GROUPS = ("powers", "products", "means", "lags")


def invariants(recordings: Array, bands: int = 10, groups: Sequence[str] = GROUPS) -> Array:
    """Return logarithms of invariants under rotations of the sensors, (recordings, numbers).

    Parameters
    ----------
    recordings : array
        (recordings, 6, times): accelerations and angular velocities.
    bands : int
        The number of bands of frequencies.
    groups : sequence of {"powers", "products", "means", "lags"}
        The powers of vectors and bivectors; those of the vector and the trivector of their products; squares of mean
        vectors and bivectors; the mean scalar and the squared mean bivector of products of accelerations 1, 2 and 4
        samples apart.
    """
    if not groups or set(groups) - set(GROUPS):
        raise ValueError(f"groups: {groups}; expected some of {GROUPS}")
    algebra, elements = Algebra(3), series(recordings)
    vectors, bivectors = (elements * (algebra.grades == k) for k in (1, 2))
    parts: list[Array] = []
    if "powers" in groups:
        power = powers(elements, bands)
        parts += [power[..., 1:4].sum(-1), power[..., 4:7].sum(-1)]
    if "products" in groups:
        power = powers(algebra.product(vectors, bivectors), bands)
        parts += [power[..., 1:4].sum(-1), power[..., 7]]
    if "means" in groups:
        parts += [(one.mean(1) ** 2).sum(-1)[:, None] for one in (vectors, bivectors)]
    for lag in (1, 2, 4) if "lags" in groups else ():
        product = algebra.product(vectors[:, lag:], vectors[:, :-lag]).mean(1)
        parts += [np.abs(product[:, :1]), (product[:, 4:7] ** 2).sum(-1)[:, None]]
    return np.asarray(np.log1p(np.concatenate(parts, 1)))


@dataclass(frozen=True, slots=True, eq=False)
class MotionClassifier:
    """A classifier of recordings, with logits that rotations of the sensors do not change."""

    network: Network
    mean: Array
    deviation: Array
    bands: int
    groups: tuple[str, ...]

    def logits(self, recordings: Array) -> Array:
        """Return (recordings, classes)."""
        return self._of(invariants(recordings, self.bands, self.groups))

    def _of(self, features: Array) -> Array:
        return np.asarray(self.network.predict(((features - self.mean) / self.deviation)[..., None])[..., 0])


def _trained(features: Array, labels: Array, classes: int, bands: int, groups: Sequence[str], decay: float,
             seed: int) -> MotionClassifier:  # fmt: skip
    mean, deviation = features.mean(0), features.std(0)
    deviation = np.where(deviation > 0, deviation, 1)
    layers = [Linear(16), Split("tanh"), Linear(classes)]
    network = Network(layers, "R", features.shape[1], seed=seed, loss="entropy")
    network.fit(((features - mean) / deviation)[..., None], labels, "lbfgs", epochs=100, decay=decay)
    return MotionClassifier(network, mean, deviation, bands, tuple(groups))


def motion_classifier(
    recordings: Array, labels: Array, *, bands: int = 10, groups: Sequence[str] = GROUPS, decay: float = 3e-3,
    seed: int = 0,
) -> MotionClassifier:  # fmt: skip
    """Train a classifier of recordings with labels 0, 1, ..."""
    return _trained(invariants(recordings, bands, groups), labels, int(labels.max()) + 1, bands, groups, decay, seed)


def cross_validation(
    recordings: Array, labels: Array, *, bands: int = 10, groups: Sequence[str] = GROUPS, decay: float = 3e-3,
    folds: int = 5,
) -> tuple[float, float]:  # fmt: skip
    """Return the mean cross entropy and the fraction of correct labels of recordings left out, for three seeds."""
    features, classes = invariants(recordings, bands, groups), int(labels.max()) + 1
    losses, correct = [], []
    for fold, seed in itertools.product(range(folds), range(3)):
        out = np.arange(len(labels)) % folds == fold
        model = _trained(features[~out], labels[~out], classes, bands, groups, decay, seed)
        logits = model._of(features[out])
        losses.append(entropy(logits[..., None], labels[out])[0])
        correct.append(float(np.mean(logits.argmax(1) == labels[out])))
    return float(np.mean(losses)), float(np.mean(correct))
