"""Rates of recognition of speech and of hands, and times of Lie filters beside Gaussian filters of scipy."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import scipy.ndimage

from algorithms.gestures import hand_descriptor
from algorithms.gestures.experiments import block_split, hand_rates, point_rates, random_split, read_hands, read_points
from algorithms.speech import bark_image, phoneme_features, read_wav, word_features
from algorithms.speech.experiments import Corpus, leave_out, read_corpus
from algorithms.wavelets import lie_responses, orbit_energies

from . import pages
from .registration import timed

PAGE = Path("docs/speech-speed.md")
DATA = Path("tests/data")
SPEECH = (
    ("French vowels, 10 numbers", "french_vowels.npz", "vowels", "perceptron", None, {}),
    ("French vowels, 10 numbers", "french_vowels.npz", "vowels", "experts", None, {}),
    ("digits, 34 numbers", "digits.npz", "digits", "perceptron", None, {}),
    ("digits, 34 numbers", "digits.npz", "digits", "perceptron", None, {"decay": 0.05}),
    ("digits, 34 numbers", "digits.npz", "digits", "experts", None, {}),
    ("digits, 24 times of 3 quaternions", "digits.npz", "digits", "delays", None,
     {"hidden": 8, "members": 1, "decay": 0.05, "iterations": 80}),
    ("formants of 10 vowels (pb52)", "pb52.csv.gz", "formants", "perceptron", 5, {"members": 1}),
    ("formants of 10 vowels (pb52)", "pb52.csv.gz", "formants", "perceptron", 5, {"members": 1, "decay": 1e-3}),
    ("formants of 12 vowels (h95)", "h95.csv.gz", "formants", "perceptron", 5, {"members": 1, "decay": 1e-3}),
)  # fmt: skip


def speech() -> list[str]:
    """Return rows of rates of speakers that were left out."""
    rows = []
    for text, name, task, kind, folds, options in SPEECH:
        corpus = read_corpus(DATA / "speech" / name, task, kind)
        rates = leave_out(corpus, kind, folds=folds, **options)
        given = ", ".join(f"{key} {value}" for key, value in options.items()) or "defaults"
        rows.append(f"| {text} | {kind} | {given} | {100 * rates.mean:.1f} % | {100 * rates.folds.min():.0f} % |")
    return rows


def chance() -> str:
    """Return the rate of French vowels with permuted labels."""
    corpus = read_corpus(DATA / "speech" / "french_vowels.npz", "vowels")
    labels = np.random.default_rng(0).permutation(corpus.labels)
    return f"{100 * leave_out(Corpus(corpus.features, labels, corpus.speakers), members=1).mean:.1f} %"


def gestures() -> list[str]:
    """Return rows of rates of hands and key points."""
    images, labels, numbers = read_hands(DATA / "gestures" / "hands.npz")
    upright, turned = hand_rates(images, labels, *random_split(len(labels)))
    rows = [f"| images, random split (75 % for training) | {100 * upright:.1f} % | {100 * turned:.1f} % |"]
    blocks = np.array([hand_rates(images, labels, *block_split(numbers, fold)) for fold in range(5)]).mean(0)
    rows.append(f"| images, five blocks of successive files | {100 * blocks[0]:.1f} % | {100 * blocks[1]:.1f} % |")
    single, windows = point_rates(*read_points(DATA / "gestures" / "key_points.npz"))
    rows.append(f"| key points, ten blocks in time, single frames | | {100 * single:.1f} % |")
    rows.append(f"| key points, ten blocks in time, windows of 5 frames | | {100 * windows:.1f} % |")
    return rows


def times(rounds: int) -> list[str]:
    """Return rows of the least times in milliseconds of processor time of one thread."""
    random = np.random.default_rng(0)
    large, small = random.random((512, 512)), random.random((256, 256))
    hand = read_hands(DATA / "gestures" / "hands.npz")[0][0]
    samples, rate = read_wav(DATA / "speech" / "7_jackson_1.wav")
    image = bark_image(samples, rate)
    calls = {
        "`lie_responses`, six filters, 512 x 512, sigma 1": lambda: lie_responses(large),
        "six Gaussian filters of scipy, 512 x 512, sigma 1": lambda: [
            scipy.ndimage.gaussian_filter(large, 1.0) for _ in range(6)
        ],
        "`orbit_energies`, 256 x 256, sigma 1, window 12": lambda: orbit_energies(small),
        "`hand_descriptor`, 64 x 64": lambda: hand_descriptor(hand),
        "`phoneme_features`, 20 bands": lambda: phoneme_features(image),
        "`word_features`, 20 bands": lambda: word_features(image),
        f"`bark_image`, {len(samples) / rate:.2f} s": lambda: bark_image(samples, rate),
    }
    return [
        f"| {name} | {1e3 * min(timed(lambda c=call: [c() for _ in range(5)])[1] for _ in range(rounds)) / 5:.2f} |"
        for name, call in calls.items()
    ]


def page(speech_rows: list[str], permuted: str, gesture_rows: list[str], time_rows: list[str]) -> str:
    """Return the text of the page."""
    lines = [
        "# Recognition of speech and hands: rates and times",
        "",
        "Written by `python -m benchmarks speech`. Data and their licences are in `tests/data/speech/README.md` and",
        "`tests/data/gestures/README.md`.",
        "",
        "## Speech",
        "",
        "One speaker is left out in each fold; speakers of formants are in five folds. The last column is the worst",
        "fold. Decays of digits were compared on the same speakers; that of formants is also better on pb52.",
        "",
        "| data | classifier | options | mean | worst |",
        "| --- | --- | --- | ---: | ---: |",
        *speech_rows,
        "",
        f"French vowels with permuted labels: {permuted}.",
        "",
        "## Hands",
        "",
        "Images are rotated by up to 45 degrees after a training on upright ones, key points by any angle.",
        "",
        "| data | upright | rotated |",
        "| --- | ---: | ---: |",
        *gesture_rows,
        "",
        "## Times",
        "",
        "Least processor time of one thread.",
        "",
        "| call | ms |",
        "| --- | ---: |",
        *time_rows,
    ]
    return "\n".join(lines) + "\n"


def main(arguments: list[str] | None = None) -> int:
    """Measure, and write the page; arguments are those of the command line, or by default of the process."""
    options = pages.options("speech", __doc__, PAGE, quick=False).parse_args(arguments)
    text = page(speech(), chance(), gestures(), times(5))
    return pages.publish("speech", options.out, text, "3 tables")


if __name__ == "__main__":
    sys.exit(main())
