"""Data sets of speech as features, and rates of recognition of speakers that are left out."""

from __future__ import annotations

import csv
import gzip
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arguments import Reals
from ..learning.classifier import confusion_matrix, train_classifier
from .descriptors import vowel_features, word_features, word_quaternions

TASKS = ("digits", "vowels", "formants")


@dataclass(frozen=True, slots=True, eq=False)
class Corpus:
    """Features (n, ...) of samples, their labels (n,) and speakers (n,)."""

    features: Reals
    labels: NDArray[Any]
    speakers: NDArray[Any]


@dataclass(frozen=True, slots=True, eq=False)
class Rates:
    """Results for speakers that were left out of the training.

    Attributes
    ----------
    mean : float
        The mean over folds of the share of correct labels.
    folds : array, (F,)
        The share of each fold.
    confusion : array of int, (K, K)
        How often samples of each class (rows) were given each label (columns).
    classes : array, (K,)
    """

    mean: float
    folds: Reals
    confusion: NDArray[np.intp]
    classes: NDArray[Any]


def read_corpus(path: str | Path, task: str, kind: str = "perceptron") -> Corpus:
    """Read images of digits or vowels (npz), or tables of formants (csv.gz), and compute their features.

    Parameters
    ----------
    path : path
        An npz file with the arrays levels (bands, frames of all samples), in half decibels; frames, the number of each
        sample; label; and speaker. Or a compressed csv file with columns f0, f1, f2, f3, vowel and speaker.
    task : {"digits", "vowels", "formants"}
    kind : {"perceptron", "delays", "experts"}
        The kind of the classifier: time-delay networks of digits use quaternions of 24 times.

    Raises
    ------
    ValueError
        If the task is another one, or the file does not contain these values.
    """
    if task not in TASKS:
        raise ValueError(f"task: {task!r}; expected one of {', '.join(TASKS)}")
    if task == "formants":
        return _read_formants(path)
    with np.load(path, allow_pickle=False) as file:
        missing = {"levels", "frames", "label", "speaker"} - set(file.files)
        if missing:
            raise ValueError(f"{path}: no {sorted(missing)[0]}; expected levels, frames, label and speaker")
        levels, frames = file["levels"] / 2.0, file["frames"].astype(int)
        labels, speakers = file["label"], file["speaker"]
    if frames.sum() != levels.shape[1] or not len(frames) == len(labels) == len(speakers):
        raise ValueError(f"{path}: {levels.shape[1]} frames; expected {frames.sum()}, and one label and speaker each")
    compute = vowel_features if task == "vowels" else word_quaternions if kind == "delays" else word_features
    images = np.split(levels, np.cumsum(frames)[:-1], axis=1)
    return Corpus(np.stack([compute(image) for image in images]), labels, speakers)


def _read_formants(path: str | Path) -> Corpus:
    """Return the logarithms of the fundamental frequency and three formants as quaternions."""
    with gzip.open(path, "rt") as file:
        rows = list(csv.DictReader(file))
    names = "f0", "f1", "f2", "f3"
    if not rows or not {*names, "vowel", "speaker"} <= set(rows[0]):
        raise ValueError(f"{path}: expected rows with f0, f1, f2, f3, vowel and speaker")
    values = np.array([[float(row[name]) for name in names] for row in rows])
    # Formants that were not measured, 0, are replaced by the means of the others.
    values = np.where(values > 0, np.log(np.maximum(values, 1)), np.nan)
    values = np.where(np.isnan(values), np.nanmean(values, 0), values)
    return Corpus(values[:, None], np.array([row["vowel"] for row in rows]), np.array([row["speaker"] for row in rows]))


def leave_out(
    corpus: Corpus, kind: str = "perceptron", *, folds: int | None = None,
    progress: Callable[[int, float], None] | None = None, **options: Any,
) -> Rates:  # fmt: skip
    """Train without the speakers of each fold, and recognise them.

    Parameters
    ----------
    corpus : Corpus
    kind, options
        As in `train_classifier`.
    folds : int, optional
        The number of folds of speakers in the order of their names; one for each speaker if None.
    progress : callable, optional
        Called with the number of the fold and its share of correct labels.
    """
    names, number = np.unique(corpus.speakers, return_inverse=True)
    count = len(names) if folds is None else folds
    if not 2 <= count <= len(names):
        raise ValueError(f"folds: {count} of {len(names)} speakers; expected 2 or more, and a speaker for each")
    found, shares = np.empty_like(corpus.labels), []
    for fold in range(count):
        out = number % count == fold
        model = train_classifier(corpus.features[~out], corpus.labels[~out], kind, **options)
        found[out] = model.predict(corpus.features[out])
        shares.append(float((found[out] == corpus.labels[out]).mean()))
        if progress:
            progress(fold, shares[-1])
    classes = np.unique(corpus.labels)
    return Rates(float(np.mean(shares)), np.array(shares), confusion_matrix(corpus.labels, found, classes), classes)


def select_decay(corpus: Corpus, decays: Sequence[float] = (0.01, 0.05), kind: str = "perceptron",
                 *, folds: int | None = None, **options: Any) -> float:  # fmt: skip
    """Return the decay of the highest mean rate of `leave_out`, for a corpus without the speakers of the test."""
    if not decays:
        raise ValueError("decays: none; expected at least one")
    rates = [leave_out(corpus, kind, folds=folds, decay=decay, **options).mean for decay in decays]
    return decays[int(np.argmax(rates))]
