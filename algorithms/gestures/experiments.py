"""Data sets of hands, and rates of recognition of rotated hands."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from ..arguments import Reals
from ..learning.classifier import train_classifier
from .classifier import train_hands
from .points import mean_of_sequence, point_features


def read_hands(path: str | Path) -> tuple[Reals, NDArray[Any], NDArray[np.intp]]:
    """Return images (n, M, N), labels, and numbers of files from an npz file."""
    with np.load(path, allow_pickle=False) as file:
        return file["images"].astype(float), file["labels"].astype(int), file["numbers"].astype(int)


def read_points(path: str | Path) -> tuple[Reals, NDArray[Any]]:
    """Return key points (frames, 21, 2) and labels from an npz file."""
    with np.load(path, allow_pickle=False) as file:
        return file["points"] / 500.0, file["labels"].astype(int)


def rotated(images: Reals, largest: float = 45.0, seed: int = 1) -> Reals:
    """Rotate each image about its centre by a random angle in degrees."""
    angles = np.random.default_rng(seed).uniform(-largest, largest, len(images))
    return np.stack(
        [
            scipy.ndimage.rotate(image, a, reshape=False, order=1, mode="nearest")
            for image, a in zip(images, angles, strict=True)
        ]
    )


def random_split(count: int, share: float = 0.75, seed: int = 0) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the indices of the samples for the training and of the others."""
    order = np.random.default_rng(seed).permutation(count)
    cut = round(share * count)
    return order[:cut], order[cut:]


def block_split(numbers: NDArray[np.intp], fold: int, folds: int = 5) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return indices for the training and of others, which are a block of successive numbers, mostly other people."""
    order = np.argsort(numbers, kind="stable")
    own = np.arange(len(order)) * folds // len(order) == fold
    return order[~own], order[own]


def hand_rates(
    images: Reals, labels: NDArray[Any], train: NDArray[np.intp], test: NDArray[np.intp]
) -> tuple[float, float]:
    """Train on upright hands, and return the shares of correct labels of upright and of rotated others."""
    model = train_hands(images[train], labels[train])
    upright, turned = (model.predict(found) for found in (images[test], rotated(images[test])))
    return float((upright == labels[test]).mean()), float((turned == labels[test]).mean())


def point_rates(points: Reals, labels: NDArray[Any], folds: int = 10, every: int = 2) -> tuple[float, float]:
    """Recognise rotated key points of blocks of frames that are left out: single frames, and windows of five frames.

    Parameters
    ----------
    points, labels : array
        Frames (n, 21, 2) in the order of time, and their classes (n,).
    folds : int
        The number of blocks of each class.
    every : int
        Frames of the training from one to the next that is used.
    """
    block = np.empty(len(labels), int)
    for name in np.unique(labels):
        own = np.flatnonzero(labels == name)
        block[own] = np.arange(len(own)) * folds // len(own)
    angles = np.random.default_rng(0).uniform(0, 2 * np.pi, len(points))
    c, s = np.cos(angles), np.sin(angles)
    turned = np.einsum("nkj,nij->nki", points, np.stack([np.stack([c, -s], -1), np.stack([s, c], -1)], 1))
    single, windows = np.zeros(len(labels), bool), np.zeros(len(labels), bool)
    for fold in range(folds):
        used = np.flatnonzero(block != fold)[::every]
        model = train_classifier(point_features(points[used]), labels[used], hidden=16, members=1, iterations=100)
        for name in np.unique(labels):
            out = np.flatnonzero((block == fold) & (labels == name))
            found = model.probabilities(point_features(turned[out]))
            single[out] = model.classes[found.argmax(1)] == name
            windows[out] = model.classes[mean_of_sequence(found).argmax(1)] == name
    return float(single.mean()), float(windows.mean())
