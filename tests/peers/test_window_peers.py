"""Image filters as window kernels against those of OpenCV, in single precision."""

from __future__ import annotations

import numpy as np
import pytest

import gacompiler
from gacompiler import SCALAR, array, each, exp, kernel, window

pytestmark = pytest.mark.peers

IMAGE = array(SCALAR, "n", "m")
SHAPES = ((61, 83), (16, 17), (7, 40))


@kernel(image=IMAGE, taps=array(SCALAR, 9))
def separable(image, taps):
    """A filter along rows and columns."""

    def line(*numbers):
        return sum(tap * number for tap, number in zip(taps, numbers, strict=True))

    low = each(lambda *rows: each(line, *rows), *window(image, 9, boundary="mirror"))
    return each(lambda row: each(line, *window(row, 9, boundary="mirror")), low)


@kernel(image=IMAGE, width=SCALAR, spread=SCALAR)
def bilateral(image, width, spread):
    """A bilateral filter over the pixels at most two pixels away."""
    near = [(i, j) for i in range(5) for j in range(5) if 0 < (i - 2) ** 2 + (j - 2) ** 2 <= 4]

    def pixel(w):
        centre = w[2][2]
        weights, values = [1], [centre]
        for i, j in near:
            distance, difference = (i - 2) ** 2 + (j - 2) ** 2, w[i][j] - centre
            values.append(w[i][j])
            weights.append(exp(-distance / (2 * width * width) - difference * difference / (2 * spread * spread)))
        return sum(a * b for a, b in zip(weights, values, strict=True)) / sum(weights)

    return each(lambda row: each(pixel, row), window(image, 5, 5, boundary="mirror"))


def test_filters_equal_those_of_opencv() -> None:
    cv2 = pytest.importorskip("cv2")
    rng = np.random.default_rng(4)
    both = gacompiler.compile(separable), gacompiler.compile(bilateral)
    for shape in SHAPES:
        image, taps = rng.uniform(size=shape).astype(np.float32), rng.uniform(size=9).astype(np.float32)
        taps /= taps.sum()
        found = both[0](image, taps)
        assert found.dtype == np.float32 and np.abs(found - cv2.sepFilter2D(image, -1, taps, taps)).max() < 1e-6
        wanted = cv2.bilateralFilter(image, 5, 0.3, 2.0)
        # OpenCV interpolates weights in a table.
        assert np.abs(both[1](image, np.float32(2), np.float32(0.3)) - wanted).max() < 1e-5
