"""Names and modules of `algorithms.grasping` of version 0.2 work there, with a warning that names the new place."""

import importlib
import sys

import pytest

import algorithms.grasping
from algorithms.moved import _finder
from tests.support.all_cases import all_cases

MOVED = {
    "algorithms.fuzzy": "And Conclusion FuzzyOutput FuzzySet FuzzyStatus FuzzyVariable Is Mamdani Not Or Rule "
    "grasp_controller",
    "algorithms.kinematics.collisions": "ArmCapsules CapsuleObstacle MeshObstacle Obstacle PlaneObstacle UR5_CAPSULES "
    "arm_capsules capsule_obstacle mesh_obstacle plane_obstacle",
    "algorithms.vision.objects": "ImageSettings ImageStatus MeasuredEdges MeasuredSilhouettes ObjectModel PoseEstimate "
    "PoseStatus Scene SceneCamera SceneObject TrackStatus TrackedPose View estimate_pose measure_edges "
    "measure_silhouettes scene_image simulate textured_background track_pose",
    "algorithms.estimation.servoing": "GraspRun GraspSettings GraspStage GraspState GraspStep VisualErrors VisualScene "
    "VisualStatus grasp_step random_scene simulate_grasp visual_error",
}


@all_cases("place", MOVED)
def test_old_names_are_the_same_objects(place: str) -> None:
    for name in MOVED[place].split():
        with pytest.warns(DeprecationWarning, match=f"grasping.{name} is now {place}.{name}; .* version 0.4") as caught:
            found = getattr(algorithms.grasping, name)
        assert found is getattr(importlib.import_module(place), name) and caught[0].filename == __file__


@all_cases("old", sorted(_finder.places))
def test_old_modules_are_the_same_objects(old: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, old, raising=False)
    place = _finder.places[old]
    with pytest.warns(DeprecationWarning, match=f"{old} is now {place}; .* version 0.4") as caught:
        found = importlib.import_module(old)
    assert found is importlib.import_module(place) and len(caught) == 1
    assert found.__spec__ is not None and found.__spec__.name == found.__name__ == place


def test_the_warning_of_a_module_points_at_the_import(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "algorithms.grasping.fuzzy_sets", raising=False)
    with pytest.warns(DeprecationWarning) as caught:
        import algorithms.grasping.fuzzy_sets  # noqa: F401
    assert caught[0].filename == __file__


def test_other_names_are_errors() -> None:
    with pytest.raises(ModuleNotFoundError, match="nothing"):
        importlib.import_module("algorithms.grasping.nothing")
    with pytest.raises(AttributeError, match=r"'algorithms\.grasping' has no attribute 'plan_grasp'"):
        algorithms.grasping.plan_grasp  # noqa: B018
