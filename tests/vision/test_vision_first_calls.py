"""First calls in a new process: kernels of the C library do not load another compiler."""

import json
import subprocess
import sys

import pytest

from generated import cga3, hand_eye, pga3, projective2

_TIMED = """
import json, sys, time
import numpy as np
from algorithms.geometry import nearest_on_circles
from algorithms.vision import LandmarkMap, hand_eye, hand_eye_from_poses
from generated import cga3, pga3

rng = np.random.default_rng(2)
hands, place, world = (pga3.motor_exponential(rng.normal(size=shape)) for shape in ((9, 6), (6,), (6,)))
eyes = pga3.motor_product(pga3.motor_product(pga3.motor_inverse(world), hands), place)
motions = [pga3.motor_product(pga3.motor_inverse(p[:-1]), p[1:]) for p in (hands, eyes)]
circles = cga3.circle_from_centre(rng.normal(size=(2, 3)), rng.normal(size=(2, 3)), 1.0)
views = np.concatenate([rng.normal(size=(1, 10, 2)), np.full((1, 10, 1), 4.0)], -1)
landmarks = LandmarkMap.learn([views])
calls = {
    "hand_eye_from_poses": lambda: hand_eye_from_poses(hands, eyes),
    "hand_eye": lambda: hand_eye(*motions),
    "nearest_on_circles": lambda: nearest_on_circles(circles[0], circles[1]),
    "recognize": lambda: landmarks.recognize(views[0], 1e-3),
}
found = {}
for name, call in calls.items():
    spent = []
    for _ in range(2):
        start = time.process_time()
        call()
        spent.append(time.process_time() - start)
    found[name] = spent
print(json.dumps([found, "numba" in sys.modules]))
"""


@pytest.mark.skipif(
    any(module.backend != "c" for module in (cga3, hand_eye, pga3, projective2)), reason="for compiled C"
)
def test_first_calls_load_no_compiler_and_take_little_longer() -> None:
    done = subprocess.run([sys.executable, "-c", _TIMED], capture_output=True, text=True, check=True)
    spent, has_numba = json.loads(done.stdout.splitlines()[-1])
    assert not has_numba
    for name, (first, second) in spent.items():
        assert first - second < 0.05, (name, first, second)
