"""Activities from sensors that are rotated after the training."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from algorithms.learning.motions import classifier, read_series, spectra

DATA = Path(__file__).parents[1] / "data" / "learning"


def test_rotated_sensors() -> None:
    (x, y), (new, names) = (read_series(DATA / f"BasicMotions_{part}.ts.gz") for part in ("TRAIN", "TEST"))
    classes = sorted(set(y))
    labels, truth = (np.array([classes.index(name) for name in part]) for part in (y, names))
    network = classifier(50, len(classes))
    network.fit(spectra(x), labels, "lbfgs", epochs=200, decay=3e-3)
    logits = network.predict(spectra(new))
    right = []
    for k in range(20):
        turns = Rotation.random(random_state=k).as_matrix()
        turned = np.einsum("ij,nsjt->nsit", turns, new.reshape(len(new), 2, 3, -1)).reshape(new.shape)
        found = network.predict(spectra(turned))
        assert np.abs(found - logits).max() < 1e-12 * max(1, np.abs(logits).max())
        right.append(np.mean(found[..., 0].argmax(1) == truth))
    # Scale, bands and decay are those with the best cross-validation of the training recordings.
    assert np.mean(right) >= 0.9
