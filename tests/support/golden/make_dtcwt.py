"""Make ``dtcwt.npz``: coefficients of the dtcwt package 0.14, in a separate environment, as it needs numpy below 2.

python -m venv peer && peer/bin/pip install "numpy<2" dtcwt==0.14.0
peer/bin/python tests/support/golden/make_dtcwt.py
"""

from __future__ import annotations

from pathlib import Path

import dtcwt
import numpy as np

PATH = Path(__file__).with_name("dtcwt.npz")
PAIRS = (("near_sym_a", "qshift_a"), ("near_sym_b", "qshift_b"), ("near_sym_b", "qshift_d"))
SHAPES = ((22,), (64,), (13, 22), (6, 10, 8))
"""Sizes that no multiples of 4, or of 2 if the package permits it, except for one."""


def main() -> None:
    """Keep the image of the file; store three levels and the lowpass residual for each pair of filters.

    Other signals are stored with their shape in the name.
    """
    with np.load(PATH) as known:
        image = known["image"]
    numbers = {"image": image}
    for first, later in PAIRS:
        store(numbers, f"{first} {later}", dtcwt.Transform2d(first, later).forward(image, 3))
    rng = np.random.default_rng(5)
    kinds = (dtcwt.Transform1d, dtcwt.Transform2d, dtcwt.Transform3d)
    for shape in SHAPES:
        signal = numbers[f"{shape}"] = rng.normal(size=shape)
        for first, later in PAIRS[1:] if len(shape) < 3 else PAIRS[:1]:
            found = kinds[len(shape) - 1](first, later).forward(signal, 3 if len(shape) < 3 else 2)
            store(numbers, f"{shape} {first} {later}", found)
    np.savez_compressed(PATH, **numbers)


def store(numbers: dict[str, np.ndarray], name: str, found: dtcwt.Pyramid) -> None:
    """Add the lowpass residual and all levels."""
    numbers[f"{name} approx"] = found.lowpass
    for level, bands in enumerate(found.highpasses):
        numbers[f"{name} {level}"] = bands


if __name__ == "__main__":
    main()
