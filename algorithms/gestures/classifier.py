"""Classifiers of images of hands that are trained on upright hands and recognise rotated ones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import as_given
from ..learning.clifford_svc import CliffordSVC
from .hands import hand_descriptor, turned_descriptor


@dataclass(frozen=True, slots=True, eq=False)
class HandClassifier:
    """A support vector machine of descriptors of hands; `train_hands` makes one."""

    machine: CliffordSVC

    def predict(self, images: ArrayLike) -> NDArray[Any]:
        """Return the labels (n,) of images (n, M, N); errors are those of `hand_descriptor`."""
        found = hand_descriptor(images)
        if found.ndim != 4:
            raise ValueError(f"images: shape {np.shape(images)}; expected (n, M, N)")
        return self.machine.predict(found.reshape(len(found), -1))


def train_hands(images: ArrayLike, labels: ArrayLike, largest: float = 40.0, C: float = 10.0) -> HandClassifier:
    """Train a classifier of hands on upright images.

    Parameters
    ----------
    images : array_like, (n, M, N)
        Grey images, as for `hand_descriptor`.
    labels : array_like, (n,)
    largest : float
        The largest rotation in degrees, in both directions, of the descriptors in the training. Those of each image are
        shifted in steps of 20 degrees, which costs no resampling.
    C : float
        As in `CliffordSVC`.

    Raises
    ------
    TypeError, ValueError
        As in `hand_descriptor` and `CliffordSVC`, or if `largest` is not from 0 to 180.
    """
    if not 0 <= largest <= 180:
        raise ValueError(f"largest: {largest}; expected degrees from 0 to 180")
    descriptors, given = hand_descriptor(images), as_given(labels, "labels")
    if descriptors.ndim != 4 or given.shape != descriptors.shape[:1]:
        raise ValueError(f"images and labels: shapes {np.shape(images)} and {given.shape}; expected (n, M, N) and (n,)")
    steps = int(largest // 20)
    turns = [2 * k for k in range(-steps, steps + 1)]
    samples = np.concatenate([turned_descriptor(descriptors, turn) for turn in turns])
    machine = CliffordSVC("scalar", C=C, tol=1e-3)
    return HandClassifier(machine.fit(samples.reshape(len(samples), -1), np.tile(given, len(turns))))
