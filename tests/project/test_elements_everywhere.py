"""Every public function of the chapters, as tests call it, with elements of every layout in place of its arrays.

The result is that of the array if the coefficients of the element are what the function takes; else it raises an error.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from elements_everywhere import original
from test_elements_in_calls import CALLS, FURTHER, key_of

FILES = {
    "calculus": (
        "frames_and_simplexes grid_derivatives integrals linear_functions maxwell multivector_functions spinors "
    ),
    "estimation": (
        "body_eye clocks end_effector kalman motor_filter motor_smoother orientation_filter rotor_filter "
        "smoothing tracking tracking_simulation visual_grasping "
    ),
    "fuzzy": "fuzzy_text sugeno",
    "geometry": "geometry geometry_rounds stereographic",
    "gestures": "gestures",
    "grasping": "closing grasp_loop quality",
    "kinematics": (
        "arm_paths constraints floating_base kinematics_rates retiming robots_single robots_trajectories "
        "self_motions tasks "
    ),
    "learning": "charges classifier clifford_svm elements_as_samples layers network pictures",
    "mapping": (
        "floor_plans formats lidar_odometry line_map localization logs map_3d map_objects mapper paths relocator "
        "scan_simulation trust "
    ),
    "motors": "motors",
    "registration": "pictures_of_rigid tensor_voting_page",
    "shapes": "contours cubes flow sphere_matching surfaces volume_warps",
    "speech": "speech",
    "subspaces": "subspaces subspaces_bivectors subspaces_versors",
    "vision": (
        "bundle_files focal_lengths image_measurement image_tracking lenses linear_cameras rectification scene_images "
        "vision vision_degenerate "
    ),
    "wavelets": (
        "wavelets_colours wavelets_discrete wavelets_inputs wavelets_lie_filters wavelets_phase "
        "wavelets_shrinkage wavelets_space wavelets_stationary "
    ),
}
"""Tests of each chapter that together call most of its functions, and take little time."""
LEAST = {
    "calculus": 32, "estimation": 150, "fuzzy": 2, "geometry": 16, "gestures": 3, "grasping": 14, "kinematics": 79,
    "learning": 34, "mapping": 22, "motors": 28, "registration": 7, "shapes": 7, "subspaces": 10, "vision": 102,
    "wavelets": 54,
}  # fmt: skip
"""How many pairs of a function of the chapter and a parameter they examine at least."""
ELSEWHERE = {
    "calculus.YeeBox.run": "fields of the package, and currents from a function",
    "estimation.BodyEye.pose": "of an eye that was found",
    "estimation.simulate_tracking": "a path from a function",
    "grasping.hand_from_urdf": "a file",
    "grasping.plan_grasps_in_view": "large images",
    "kinematics.FloatingRobot.inverse": "refuses all poses",
    "kinematics.FloatingRobot.view": "draws",
    "kinematics.FloatingRobot.with_base": "refuses all bases",
    "kinematics.collisions.Obstacle.moved": "abstract",
    "kinematics.inverse.self_motions": "as Robot.self_motions",
    "mapping.build_map": "scans",
    "mapping.simulate_following": "a localizer",
    "mapping.write_columns": "writes files",
    "registration.Deformation.warp": "of a deformation that was found",
    "registration.extract_surface": "takes long",
    "registration.register": "takes long",
}
"""Functions that are not called with other arguments, and what they take or do."""
FOLDER = Path(__file__).parents[1]


@pytest.mark.slow
def test_elements_are_what_functions_take_or_are_refused(tmp_path: Path) -> None:
    files = [str(FOLDER / chapter / f"test_{name}.py") for chapter, names in FILES.items() for name in names.split()]
    written = tmp_path / "found.json"
    command = [sys.executable, "-m", "pytest", "-q", "-p", "elements_everywhere", "-p", "no:cacheprovider", *files]
    run = subprocess.run(
        command, capture_output=True, text=True, check=False, cwd=FOLDER.parent,
        env={**os.environ, "ELEMENTS_FOUND": str(written), "PYTHONPATH": f"{FOLDER / 'support'}:{FOLDER.parent}"},
    )  # fmt: skip
    assert written.exists(), run.stdout + run.stderr
    found = json.loads(written.read_text())
    few = {chapter: least for chapter, least in LEAST.items() if found["pairs"].get(chapter, 0) < least}
    known = {original(*key_of(name)) for name in (*CALLS, *FURTHER, *ELSEWHERE)}
    assert not found["wrong"] and not few, (found, few, run.stdout)
    left = [name for name in found["missed"] if original(*key_of(name.partition(".")[2])) not in known]
    assert not left, f"call these in tests with small arrays, or in test_elements_in_calls.py: {left}"
