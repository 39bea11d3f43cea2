"""Make ``opencv_qdft.npz``: the quaternion Fourier transform of OpenCV's extra modules, in a separate environment.

python -m venv peer && peer/bin/pip install opencv-contrib-python-headless==4.10.0.84
peer/bin/python tests/support/golden/make_opencv_qdft.py
"""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

PATH = Path(__file__).with_name("opencv_qdft.npz")


def main() -> None:
    """Quaternions in eighths, so that they are exact; the axis is (i + j + k) / sqrt(3)."""
    image = np.round(8 * np.random.default_rng(0).normal(size=(12, 9, 4))) / 8
    numbers = {"image": image}
    for side, left in (("left", True), ("right", False)):
        numbers[side] = cv2.ximgproc.qdft(image, 0, left)
        numbers[f"{side} inverse"] = cv2.ximgproc.qdft(image, cv2.DFT_INVERSE, left)
    np.savez_compressed(PATH, **numbers)


if __name__ == "__main__":
    main()
