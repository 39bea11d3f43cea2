"""Kernels with a numba that lacks the undocumented parts that the fast loops use."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

WITHOUT = """
import sys
from numba.core import untyped_passes
del untyped_passes.IRProcessing  # as a release of numba might
import numpy as np
from generated import pga3, vga3
from generated.gac_runtime import jit
assert jit.Loops.__module__.endswith(".plain")
rng = np.random.default_rng(0)
m, p = rng.normal(size=(40, 8)), rng.normal(size=(40, 3))
"""

RIGHT = """
def same(kernel, *arrays):
    pga3.backend = vga3.backend = "arrays"
    right = kernel(*arrays)
    pga3.backend = vga3.backend = "numba"
    found = kernel(*arrays)
    several = isinstance(found, tuple)
    for one, other in zip(found if several else (found,), right if several else (right,)):
        assert one.dtype == other.dtype and np.allclose(one, other, 1e-13 if one.dtype == float else 1e-4, 1e-5), kernel
same(pga3.move_point, m, p)
same(pga3.move_point, m[0], p[::-2])
same(pga3.move_point, m.astype("f4"), np.asfortranarray(p.astype("f4")))
same(pga3.motor_exponential, rng.normal(size=(3, 6)))
same(pga3.motor_to_rotor_translation, m)
same(vga3.rotor_to_matrix, rng.normal(size=(2, 5, 4)))
out = np.empty((40, 3))
assert pga3.move_point(m, p, out=out) is out and np.array_equal(out, pga3.move_point(m, p))
double = pga3.Kernel.of(lambda x: (2 * x[0], 2 * x[1]), "(2)->(2)")
assert np.array_equal(double(np.ones((4, 2))), np.full((4, 2), 2.0))
assert np.allclose(pga3.move_point.jit(tuple(m[0]), tuple(p[0])), out[0])
"""


@pytest.mark.slow
def test_kernels_run_on_what_numba_documents() -> None:
    done = subprocess.run([sys.executable, "-c", WITHOUT + RIGHT], capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0, done.stderr
