"""Calibrations of named image pairs, in pixels and millimetres."""

from __future__ import annotations

from .stereo import RectifiedPair

MOTORCYCLE = RectifiedPair(focal_length=994.978, centre=(311.193, 254.877), offset=31.086, baseline=193.001)
"""Motorcycle of the Middlebury 2014 stereo data at a quarter of its size, as in `skimage.data.stereo_motorcycle`.

Source: the documentation of that function (Scharstein and others, GCPR 2014).
"""
