"""Other processors, by switches of numpy and OpenBLAS: text, branches of arms and statuses do not change."""

from __future__ import annotations

import os
import platform
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytestmark = [
    pytest.mark.peers,
    pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="kernels of BLAS for x86-64"),
]

ROOT = Path(__file__).parent.parent.parent
FILES = (
    "robots/test_robot_command.py",
    "robots/test_emitted_arithmetic.py",
    "kinematics/test_inverse_elimination.py",
    "kinematics/test_inverse_methods.py",
    "vision/test_hand_eye_degenerate.py",
)
FEATURES = "import numpy; print(*numpy.show_config(mode='dicts').get('SIMD Extensions', {}).get('found', []))"
# Only features of this machine: numpy warns about missing ones, and its baseline cannot be disabled.
FOUND = " ".join(np.show_config(mode="dicts").get("SIMD Extensions", {}).get("found", []))
MACHINES = {
    "Haswell": {"OPENBLAS_CORETYPE": "Haswell"},
    "Prescott without vectors": {"NPY_DISABLE_CPU_FEATURES": FOUND, "OPENBLAS_CORETYPE": "Prescott"},
}


@pytest.mark.parametrize("machine", MACHINES)
def test_text_and_branches_on_another_processor(machine: str) -> None:
    environment = {**os.environ, **MACHINES[machine]}
    options = {"cwd": ROOT, "env": environment, "capture_output": True, "text": True, "check": False}
    if "NPY_DISABLE_CPU_FEATURES" in MACHINES[machine]:
        left = subprocess.run([sys.executable, "-c", FEATURES], **options)  # type: ignore[call-overload]
        assert left.stdout.strip() == "", left.stderr
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider"]
    ran = subprocess.run([*command, *(f"tests/{file}" for file in FILES)], **options)  # type: ignore[call-overload]
    assert ran.returncode == 0, ran.stdout[-4000:] + ran.stderr[-1000:]
