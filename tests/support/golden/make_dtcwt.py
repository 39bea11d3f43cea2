"""Make ``dtcwt.npz``: coefficients of the dtcwt package 0.14, in a separate environment, as it needs numpy below 2.

python -m venv peer && peer/bin/pip install "numpy<2" dtcwt==0.14.0
peer/bin/python tests/support/golden/make_dtcwt.py
"""

from __future__ import annotations

from pathlib import Path

import dtcwt
import numpy as np

PATH = Path(__file__).with_name("dtcwt.npz")


def main() -> None:
    """Keep the image of the file; store three levels and the lowpass residual for each pair of filters."""
    with np.load(PATH) as known:
        image = known["image"]
    numbers = {"image": image}
    for first, later in (("near_sym_a", "qshift_a"), ("near_sym_b", "qshift_b"), ("near_sym_b", "qshift_d")):
        found = dtcwt.Transform2d(first, later).forward(image, 3)
        numbers[f"{first} {later} approx"] = found.lowpass
        for level, bands in enumerate(found.highpasses):
            numbers[f"{first} {later} {level}"] = bands
    np.savez_compressed(PATH, **numbers)


if __name__ == "__main__":
    main()
