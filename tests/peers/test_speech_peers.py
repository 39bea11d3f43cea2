"""Bands of speech compared with librosa, and recognition of hands compared with histograms of scikit-image."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from algorithms.gestures.experiments import hand_rates, random_split, read_hands, rotated
from algorithms.speech import band_filters, band_powers, read_wav

pytestmark = pytest.mark.peers
DATA = Path(__file__).parents[1] / "data"


@pytest.mark.parametrize("rate", [8000, 11025, 22050])
@pytest.mark.parametrize("bands", [20, 40])
def test_mel_powers_are_those_of_librosa(rate: int, bands: int) -> None:
    librosa = pytest.importorskip("librosa")
    samples, _ = read_wav(DATA / "speech" / "7_jackson_1.wav")
    length, hop = 512, 128
    want = librosa.feature.melspectrogram(
        y=samples, sr=rate, n_fft=length, hop_length=hop, n_mels=bands, dtype=np.float64
    )
    found = band_powers(samples, rate, bands, "mel", length / rate, hop / rate)
    count = min(found.shape[1], want.shape[1])
    assert abs(found.shape[1] - want.shape[1]) <= 1
    assert np.allclose(found[:, :count], want[:, :count], rtol=1e-6, atol=1e-6 * want.max())
    mine = band_filters(rate, length, bands, "mel")
    assert np.allclose(mine, librosa.filters.mel(sr=rate, n_fft=length, n_mels=bands, dtype=np.float64), rtol=1e-6)


def test_hands_beside_histograms_of_gradients() -> None:
    feature, svm = pytest.importorskip("skimage.feature"), pytest.importorskip("sklearn.svm")
    images, labels, _ = read_hands(DATA / "gestures" / "hands.npz")
    train, test = random_split(len(labels))

    def histograms(given: np.ndarray) -> np.ndarray:
        return np.stack([feature.hog(image, 9, (8, 8), (2, 2)) for image in given])

    peer = svm.SVC(C=10).fit(histograms(images[train]), labels[train])
    rates = [peer.score(histograms(one), labels[test]) for one in (images[test], rotated(images[test]))]
    upright, turned = hand_rates(images, labels, train, test)
    assert upright > rates[0] and turned > rates[1] + 0.2
