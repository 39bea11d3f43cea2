"""First calls of algorithms in a new process: compiled kernels serve them, and much is not loaded."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from generated import images

CALLS = """
wavelets.optical_flow(image, image)
wavelets.discrete_wavelet(image).inverse()
wavelets.dual_tree(image).inverse()
wavelets.QuaternionPyramid(image).inverse()
wavelets.denoise(image)
wavelets.qft(image)
wavelets.local_phase(image, (0.1, 0.2))
subspaces.outer_product(blade, blade)
subspaces.FactoredBlade.of_vectors(rng.normal(size=(2, 5))).coefficients()
calculus.minors.compound(rng.normal(size=(3, 5, 5)), 3)
calculus.minors.inverses(rng.normal(size=(3, 5, 5)))
calculus.products.product_of(5)(rng.normal(size=32), rng.normal(size=32))
kinematics.Robot.named("puma560").pose(np.zeros(6))
kinematics.Robot.from_dh([{}], "modified").forward_all([[0.0]])
vision.fundamental_matrix(*cameras)
vision.triangulate(cameras, vision.MOTORCYCLE.correspondences(np.ones((2, 3))))
wavelets.iqft(wavelets.qft(np.ones((3, 4)), axes=("k", "j")))
vision.hand_eye_from_poses(hands, eyes)
geometry.nearest_on_circles(*circles)
landmarks.recognize(views[0], 1e-3)
"""
PROGRAM = """
import sys

import numpy as np

import algorithms.calculus.minors
import algorithms.calculus.products
from algorithms import calculus, geometry, kinematics, subspaces, vision, wavelets
from generated import cga3, pga3

rng = np.random.default_rng(0)
image = rng.normal(size=(64, 64))
blade = subspaces.Blade(rng.normal(size=5), 5, 1)
cameras = vision.MOTORCYCLE.cameras()
hands, place, world = (pga3.motor_exponential(rng.normal(size=shape)) for shape in ((9, 6), (6,), (6,)))
eyes = pga3.motor_product(pga3.motor_product(pga3.motor_inverse(world), hands), place)
circles = cga3.circle_from_centre(rng.normal(size=(2, 3)), rng.normal(size=(2, 3)), 1.0)
views = np.concatenate([rng.normal(size=(1, 10, 2)), np.full((1, 10, 1), 4.0)], -1)
landmarks = vision.LandmarkMap.learn([views])
unwanted = {"gacompiler", "sympy", "matplotlib", "rich", "jinja2", "mpmath", *sys.argv[2:]}
for call in sys.argv[1].strip().splitlines():
    exec(call)
    assert not unwanted & {*sys.modules}, f"{call} loads {unwanted & {*sys.modules}}"

import algorithms.demo.__main__, algorithms.demo.programs

assert not {"gacompiler", "sympy"} & {*sys.modules}, "the demonstration loads the compiler"
"""


@pytest.mark.slow
def test_first_calls_load_neither_the_compiler_nor_numba(tmp_path: Path) -> None:
    """Only the demonstration loads packages for pictures; numba is needed only where the C is not built."""
    environment = {
        **os.environ,
        "NUMBA_CACHE_DIR": str(tmp_path),
        "PYTHONPATH": os.pathsep.join(filter(None, sys.path)),
    }
    command = [sys.executable, "-c", PROGRAM, CALLS, *(["numba"] if images.backend == "c" else [])]
    done = subprocess.run(command, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("call", ["optical_flow(image, image)", "disparity(image, image, 9)", "dwt(image[0])"])
def test_first_calls_without_parts_of_scipy(call: str) -> None:
    """Whose imports take a tenth of a second."""
    program = f"""
import sys

import numpy as np

from algorithms import wavelets

image = np.random.default_rng(0).normal(size=(64, 64))
wavelets.{call}
print([name for name in ("scipy.fft", "scipy.linalg", "scipy.ndimage", "scipy.special") if name in sys.modules])
"""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True)
    assert done.stdout.strip() == "[]", done.stderr
