"""Classifiers of features: perceptrons, time-delay networks, and systems of experts, made of networks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from ..arguments import as_given, finite, finite_number, real_array, whole_number
from .activations import Split
from .algebra import Array
from .base import Layer
from .delays import Delays, MeanOverTime
from .linear import Linear
from .network import Network

KINDS = ("perceptron", "delays", "experts")
_SPAN = 3
"""The number of times that a layer of a delay network sees."""
_FIELDS = {"kind", "classes", "mean", "deviation", "groups", "hidden", "members", "parameters"}


@dataclass(frozen=True, slots=True, eq=False)
class Classifier:
    """A classifier made of networks. `train_classifier` and `load_classifier` return one.

    Attributes
    ----------
    kind : {"perceptron", "delays", "experts"}
    classes : array, (K,)
        The labels, sorted.
    mean, deviation : array
        Those of the features of training, which standardise others.
    groups : array of int, (K,)
        The group of each class, all 0 without experts.
    hidden : int
        The number of hidden neurons.
    networks : tuple of tuple of Network
        Members, whose probabilities are averaged: those of the gate, which exist for several groups, and then those of
        the expert of each group with several classes.
    """

    kind: str
    classes: NDArray[Any]
    mean: Array
    deviation: Array
    groups: NDArray[np.intp]
    hidden: int
    networks: tuple[tuple[Network, ...], ...]

    def probabilities(self, features: ArrayLike) -> Array:
        """Return the probabilities of the classes, (n, K)."""
        x = _checked(features, self.mean.shape)
        inputs = _inputs((x - self.mean) / self.deviation)
        found, remaining = np.ones((len(x), len(self.classes))), iter(self.networks)
        if self.groups.max():
            found *= _mean_probabilities(next(remaining), inputs)[:, self.groups]
        for own in _experts(self.groups):
            found[:, own] *= _mean_probabilities(next(remaining), inputs)
        return found

    def predict(self, features: ArrayLike) -> NDArray[Any]:
        """Return the labels, (n,)."""
        return np.asarray(self.classes[self.probabilities(features).argmax(1)])

    def __sklearn_clone__(self) -> Classifier:
        """Return the same classifier, for ``sklearn.base.clone``: it has no `fit`, and does not change."""
        return self

    def save(self, path: str | Path) -> None:
        """Write the classifier into a file in numpy's npz format, without pickle."""
        np.savez(
            path, kind=np.array(self.kind), classes=self.classes, mean=self.mean, deviation=self.deviation,
            groups=self.groups, hidden=np.array(self.hidden), members=np.array(len(self.networks[0])),
            parameters=np.concatenate([one.parameters for own in self.networks for one in own]),
        )  # fmt: skip


def load_classifier(path: str | Path) -> Classifier:
    """Read a file written by `Classifier.save`. Nothing in it is executed."""
    with np.load(path, allow_pickle=False) as file:
        if set(file.files) != _FIELDS:
            raise ValueError(f"{path}: contains {sorted(file.files)}; expected a file written by Classifier.save")
        values = {name: file[name] for name in file.files}
    kind, hidden, members = str(values["kind"]), int(values["hidden"]), int(values["members"])
    groups, parameters = values["groups"], values["parameters"]
    networks, start = [], 0
    for count in _results(groups):
        own = [_network(kind, values["mean"].shape, hidden, count, seed) for seed in range(members)]
        for one in own:
            stop = start + one.parameters.size
            if stop > parameters.size:
                raise ValueError(f"{path}: {parameters.size} parameters; expected at least {stop}")
            one.parameters, start = parameters[start:stop].copy(), stop
        networks.append(tuple(own))
    if start != parameters.size:
        raise ValueError(f"{path}: {parameters.size} parameters; expected {start}")
    return Classifier(kind, values["classes"], values["mean"], values["deviation"], groups, hidden, tuple(networks))


def train_classifier(
    features: ArrayLike, labels: ArrayLike, kind: str = "perceptron", *, hidden: int = 32, members: int = 3,
    decay: float = 1e-2, iterations: int = 200, seed: int = 0,
    progress: Callable[[str, int, float], None] | None = None,
) -> Classifier:  # fmt: skip
    """Train a classifier.

    Parameters
    ----------
    features : array_like
        Real numbers (n, d), or quaternions (n, d, 4); for time-delay networks, with at least 5 times, (n, times, d) or
        (n, times, d, 4). Neurons of quaternions have quaternions as weights.
    labels : array_like, (n,)
    kind : {"perceptron", "delays", "experts"}
        A perceptron with one hidden layer; a time-delay network with two layers whose weights all times share, and the
        mean over time; or a gate that selects a group of classes, with a perceptron for each group. Groups are clusters
        of the mean features of the classes.
    hidden, members : int
        The number of neurons of the hidden layer, and of networks with other initial parameters.
    decay : float
        The factor of half the squared parameters in the loss.
    iterations : int
        The largest number of iterations of L-BFGS.
    seed : int
        Of the initial parameters.
    progress : callable, optional
        Called with the name of the network, the iteration, and the loss.

    Raises
    ------
    TypeError, ValueError
        If features or labels cannot be used, or options are out of range.
    """
    if kind not in KINDS:
        raise ValueError(f"kind: {kind!r}; expected one of {', '.join(KINDS)}")
    for name, count in (("hidden", hidden), ("members", members), ("iterations", iterations)):
        whole_number(count, name, 1)
    if not finite_number(decay, "decay") >= 0:
        raise ValueError(f"decay: {decay}; expected a number that is not negative")
    x = _checked(features)
    given = as_given(labels, "labels")
    if given.shape != x.shape[:1]:
        raise ValueError(f"labels: shape {given.shape}; expected ({len(x)},), one for each sample")
    classes, number = np.unique(given, return_inverse=True)
    if len(classes) < 2:
        raise ValueError(f"labels: {len(classes)} class; expected at least two")
    # All times have the same standardisation, for their weights are shared.
    axes = (0, 1) if kind == "delays" else (0,)
    mean, deviation = (np.broadcast_to(f(x, axis=axes, keepdims=True)[0], x.shape[1:]) for f in (np.mean, np.std))
    deviation = np.where(deviation > 0, deviation, 1)
    inputs = _inputs((x - mean) / deviation)
    groups = _groups(inputs, number) if kind == "experts" else np.zeros(len(classes), np.intp)

    def fitted(name: str, used: NDArray[np.intp] | slice, targets: NDArray[np.intp]) -> tuple[Network, ...]:
        found = []
        for member in range(members):
            network = _network(kind, x.shape[1:], hidden, int(targets.max()) + 1, seed + member)

            def report(iteration: int, loss: float, title: str = f"{name} {member + 1}/{members}") -> None:
                if progress:
                    progress(title, iteration, loss)

            network.fit(inputs[used], targets, "lbfgs", epochs=iterations, decay=decay, progress=report)
            found.append(network)
        return tuple(found)

    networks = [fitted("gate", slice(None), groups[number])] if groups.max() else []
    for own in _experts(groups):
        used = np.flatnonzero(np.isin(number, own))
        networks.append(fitted("network", used, np.searchsorted(own, number[used])))
    return Classifier(kind, classes, np.array(mean), deviation, groups, hidden, tuple(networks))


def confusion_matrix(truth: ArrayLike, predicted: ArrayLike, classes: ArrayLike) -> NDArray[np.intp]:
    """Return how often samples of each class (rows) were given each label (columns).

    Raises
    ------
    ValueError
        If the lengths differ, or a label is not among the classes.
    """
    names = as_given(classes, "classes")
    found = [as_given(truth, "truth"), as_given(predicted, "predicted")]
    if found[0].shape != found[1].shape or found[0].ndim != 1:
        raise ValueError(f"truth and predicted: shapes {found[0].shape} and {found[1].shape}; expected (n,) twice")
    equal = [one[:, None] == names for one in found]
    if not all(one.any(1).all() for one in equal):
        raise ValueError("truth or predicted: a label that is not in classes; expected labels of classes")
    return np.asarray(equal[0].T.astype(np.intp) @ equal[1].astype(np.intp))


def _checked(features: ArrayLike, shape: tuple[int, ...] | None = None) -> Array:
    array = finite(real_array(features, "features"), "features")
    if shape is None:
        if array.ndim < 2 or array.size == 0:
            raise ValueError(f"features: shape {array.shape}; expected (n, d), (n, d, 4), (n, times, d) or "
                             "(n, times, d, 4), not empty")  # fmt: skip
    elif array.shape[1:] != shape:
        raise ValueError(f"features: shape {array.shape}; expected (n, {', '.join(map(str, shape))})")
    return array.astype(np.float64, copy=False)


def _inputs(x: Array) -> Array:
    """Return inputs of networks: real numbers, or quaternions, as multivectors."""
    size = 4 if x.ndim > 2 and x.shape[-1] == 4 else 1
    return x.reshape(len(x), -1, size)


def _network(kind: str, shape: tuple[int, ...], hidden: int, count: int, seed: int) -> Network:
    algebra, channels = ("H", shape[:-1]) if len(shape) > 1 and shape[-1] == 4 else ("R", shape)
    layers: list[Layer] = [Linear(hidden), Split("tanh"), Linear(count)]
    if kind == "delays":
        if len(channels) != 2 or channels[0] < 2 * _SPAN - 1:
            raise ValueError(f"features: shape (n, {', '.join(map(str, shape))}); expected (n, times, d), or "
                             f"(n, times, d, 4), with at least {2 * _SPAN - 1} times")  # fmt: skip
        times = channels[0] - _SPAN + 1
        layers = [Delays(hidden, channels[0], _SPAN), Split("tanh"), Delays(hidden, times, _SPAN), Split("tanh"),
                  MeanOverTime(times - _SPAN + 1), Linear(count)]  # fmt: skip
    return Network(layers, algebra, int(np.prod(channels)), seed=seed, loss="entropy")


def _mean_probabilities(networks: tuple[Network, ...], inputs: Array) -> Array:
    total = 0
    for network in networks:
        total = total + scipy.special.softmax(network.predict(inputs)[..., 0], axis=1)
    return np.asarray(total / len(networks))


def _groups(inputs: Array, number: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return a group for each class, about the square root of the number of classes."""
    flat = inputs.reshape(len(inputs), -1)
    means = np.array([flat[number == k].mean(0) for k in range(number.max() + 1)])
    found = scipy.cluster.hierarchy.fcluster(
        scipy.cluster.hierarchy.linkage(means, "ward"), max(round(np.sqrt(len(means))), 1), "maxclust"
    )
    return np.unique(found, return_inverse=True)[1]


def _experts(groups: NDArray[np.intp]) -> list[NDArray[np.intp]]:
    """Return the classes of the groups with several classes."""
    found = [np.flatnonzero(groups == k) for k in range(groups.max() + 1)]
    return [own for own in found if len(own) > 1]


def _results(groups: NDArray[np.intp]) -> list[int]:
    """Return the numbers of results of all networks, the gate first."""
    return [int(groups.max()) + 1] * bool(groups.max()) + [len(own) for own in _experts(groups)]
