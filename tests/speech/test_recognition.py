"""Recognition of speakers that are left out of the training, and the command."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from algorithms.speech import bark_image, read_wav, vowel_features, word_features, word_image, word_quaternions
from algorithms.speech.__main__ import main
from algorithms.speech.experiments import Corpus, leave_out, read_corpus, select_decay

DATA = Path(__file__).parents[1] / "data" / "speech"
IMAGE = bark_image(*read_wav(DATA / "7_jackson_1.wav"))


def test_coefficients_equal_sums() -> None:
    word = word_image(IMAGE)
    word = word - word.mean()
    band, time = (2 * np.pi * np.arange(n)[:, None] / n for n in word.shape)

    def component(f: object, u: int, g: object, v: int) -> float:
        return float((f(u * band) * word * g(v * time).T).sum()) / word.size  # type: ignore[operator]

    found = word_features(IMAGE)
    assert found.shape == (34,)
    assert found[:4] == pytest.approx([component(np.cos, 0, f, v) for v in (1, 2) for f in (np.cos, neg_sin)], abs=1e-9)
    assert found[4:10] == pytest.approx(
        [component(f, u, np.cos, 0) for u in (1, 2, 3) for f in (np.cos, neg_sin)], abs=1e-9
    )
    assert abs(found[10]) == pytest.approx(abs(component(np.cos, 1, np.cos, 1)), abs=1e-9)
    assert word_quaternions(IMAGE).shape == (24, 3, 4) and vowel_features(IMAGE).shape == (10,)


def neg_sin(x: np.ndarray) -> np.ndarray:
    return -np.sin(x)


def test_levels_and_silence_around_a_word_have_no_influence() -> None:
    quiet = np.full((20, 6), IMAGE.min())
    assert np.allclose(word_features(np.hstack([quiet, IMAGE, quiet]) + 7), word_features(IMAGE), atol=1e-9)
    assert np.allclose(vowel_features(IMAGE - 3), vowel_features(IMAGE), atol=1e-9)


@pytest.mark.parametrize("folds", [3, pytest.param(12, marks=pytest.mark.slow)])
def test_vowels_of_voices_left_out(folds: int) -> None:
    corpus = read_corpus(DATA / "french_vowels.npz", "vowels")
    rates = leave_out(corpus, members=1, folds=folds)
    assert rates.mean > 0.9 and rates.confusion.sum() == len(corpus.labels) == 468 and len(rates.folds) == folds
    labels = np.random.default_rng(0).permutation(corpus.labels)
    shuffled = leave_out(Corpus(corpus.features, labels, corpus.speakers), members=1, folds=2)
    assert shuffled.mean < 0.2


def test_decay_is_selected_by_speakers_left_out() -> None:
    corpus = read_corpus(DATA / "french_vowels.npz", "vowels")
    assert select_decay(corpus, (100.0, 0.01), folds=2, members=1, iterations=30) == 0.01
    with pytest.raises(ValueError, match="at least one"):
        select_decay(corpus, ())


@pytest.mark.slow
def test_digits_of_speakers_left_out() -> None:
    assert leave_out(read_corpus(DATA / "digits.npz", "digits"), members=1).mean > 0.7


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["perceptron", "experts"])
def test_formants_of_speakers_left_out(kind: str) -> None:
    corpus = read_corpus(DATA / "h95.csv.gz", "formants", kind)
    assert corpus.features.shape == (1668, 1, 4)
    assert leave_out(corpus, kind, folds=3, members=1, decay=1e-3, iterations=100).mean > 0.75


def test_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data, model = str(DATA / "french_vowels.npz"), str(tmp_path / "model.npz")
    few = ["--members", "1", "--iterations", "30", "--hidden", "8"]
    main(["train", "vowels", data, "--save", model, *few])
    assert "iteration 20: loss" in capsys.readouterr().err
    main(["predict", "vowels", data, "--load", model])
    out = capsys.readouterr().out
    assert float(out.splitlines()[-1].split()[0]) > 85 and len(out.splitlines()) == 12
    main(["evaluate", "vowels", data, "--folds", "2", *few])
    seen = capsys.readouterr()
    assert "fold 1:" in seen.err and "on average over 2 folds" in seen.out


def test_bad_files_and_images(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", levels=np.ones((20, 3)))
    with pytest.raises(ValueError, match="no frames; expected levels"):
        read_corpus(tmp_path / "a.npz", "digits")
    np.savez(tmp_path / "a.npz", levels=np.ones((20, 3)), frames=[2], label=["a"], speaker=["b"])
    with pytest.raises(ValueError, match="3 frames; expected 2"):
        read_corpus(tmp_path / "a.npz", "digits")
    with pytest.raises(ValueError, match="expected one of digits"):
        read_corpus(tmp_path / "a.npz", "songs")
    with pytest.raises(ValueError, match="folds: 13 of 12 speakers"):
        leave_out(read_corpus(DATA / "french_vowels.npz", "vowels"), folds=13)
    for compute in (vowel_features, word_features, word_quaternions):
        with pytest.raises(ValueError, match="5 bands; expected at least 11"):
            compute(np.eye(5))
        with pytest.raises(ValueError, match="the same everywhere"):
            compute(np.ones((20, 9)))
        with pytest.raises(ValueError, match="finite"):
            compute(np.full((20, 9), np.nan))
    with pytest.raises(ValueError, match="middle: 0"):
        vowel_features(IMAGE, 0)
