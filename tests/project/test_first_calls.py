"""First calls of algorithms in a new process: compiled kernels serve them, and numba is not loaded."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from selection import some_slow

from generated import images

CALLS = {
    "optical flow": "wavelets.optical_flow(image, image)",
    "discrete wavelets": "wavelets.discrete_wavelet(image).inverse()",
    "dual tree": "wavelets.dual_tree(image).inverse()",
    "quaternion pyramid": "wavelets.QuaternionPyramid(image).inverse()",
    "denoising": "wavelets.denoise(image)",
    "quaternion Fourier transform": "wavelets.qft(image)",
    "local phase": "wavelets.local_phase(image, (0.1, 0.2))",
    "outer product": "subspaces.outer_product(blade, blade)",
    "coefficients of vectors": "subspaces.FactoredBlade.of_vectors(rng.normal(size=(2, 5))).coefficients()",
    "compound matrices": "calculus.minors.compound(rng.normal(size=(3, 5, 5)), 3)",
    "inverses": "calculus.minors.inverses(rng.normal(size=(3, 5, 5)))",
    "products of five vectors": "calculus.products.product_of(5)(rng.normal(size=32), rng.normal(size=32))",
}
QUICK = ("optical flow", "local phase", "outer product", "inverses")
SETUP = """
import sys
import time

import numpy as np

import algorithms.calculus.minors
import algorithms.calculus.products
from algorithms import calculus, subspaces, wavelets

rng = np.random.default_rng(0)
image = rng.normal(size=(64, 64))
blade = subspaces.Blade(rng.normal(size=5), 5, 1)
"""


@pytest.mark.skipif(images.backend != "c", reason="the C of generated modules is not built")
@pytest.mark.parametrize("name", some_slow(CALLS, *(name for name in CALLS if name not in QUICK)))
def test_first_calls_load_no_numba(name: str, tmp_path: Path) -> None:
    program = f"{SETUP}\n{CALLS[name]}\nprint('numba' in sys.modules)"
    environment = {
        **os.environ,
        "NUMBA_CACHE_DIR": str(tmp_path),
        "PYTHONPATH": os.pathsep.join(filter(None, sys.path)),
    }
    run = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "False"
