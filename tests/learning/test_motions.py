"""Activities from sensors that are rotated after the training."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from algorithms.learning.motions import GROUPS, cross_validation, invariants, motion_classifier, read_series

DATA = Path(__file__).parents[1] / "data" / "learning"


def test_rotated_sensors() -> None:
    (x, y), (new, names) = (read_series(DATA / f"BasicMotions_{part}.ts.gz") for part in ("TRAIN", "TEST"))
    classes = sorted(set(y))
    labels, truth = (np.array([classes.index(name) for name in part]) for part in (y, names))
    model = motion_classifier(x, labels)
    logits = model.logits(new)
    right = []
    for k in range(20):
        turns = Rotation.random(random_state=k).as_matrix()
        turned = np.einsum("ij,nsjt->nsit", turns, new.reshape(len(new), 2, 3, -1)).reshape(new.shape)
        found = model.logits(turned)
        assert np.abs(found - logits).max() < 1e-12 * max(1, np.abs(logits).max())
        right.append(np.mean(found.argmax(1) == truth))
    assert np.mean(right) >= 0.975


def test_features_separate_the_classes_of_series_left_out() -> None:
    x, y = read_series(DATA / "BasicMotions_TRAIN.ts.gz")
    labels = np.unique(y, return_inverse=True)[1]
    assert cross_validation(x, labels, folds=2)[1] == 1
    shuffled = np.random.default_rng(0).permutation(labels)
    assert cross_validation(x, shuffled, folds=2)[1] < 0.6


@pytest.mark.slow
def test_the_settings_are_those_with_the_smallest_cross_validated_loss() -> None:
    x, y = read_series(DATA / "BasicMotions_TRAIN.ts.gz")
    labels = np.unique(y, return_inverse=True)[1]
    loss, correct = cross_validation(x, labels)
    assert correct == 1
    for bands, groups in ((10, ("powers",)), (5, GROUPS), (2, GROUPS), (2, ("powers",))):
        assert loss < cross_validation(x, labels, bands=bands, groups=groups)[0]


def test_unknown_group() -> None:
    with pytest.raises(ValueError, match="groups"):
        invariants(np.zeros((1, 6, 100)), groups=("phases",))
