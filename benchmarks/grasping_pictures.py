"""Draw the pictures of `docs/grasping.md`: a grasp of a scan, and the loop from images to a grasp on a table."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np

from algorithms.grasping import guided_grasp, hand_of_table, plan_grasps
from algorithms.grasping.pictures import plot_grasp
from algorithms.kinematics import Robot
from algorithms.kinematics.collisions import mesh_obstacle, plane_obstacle
from algorithms.vision.objects import ObjectModel, Scene, SceneObject
from algorithms.vision.objects.pictures_of_scenes import plot_scene
from generated import pga3

from .grasping_loop import HOME, cameras, motor

SCANS = Path("tests/data/grasping/scans.npz")
FOLDER = Path("docs")
MOUNT = motor(np.zeros(3), np.array([0, 0, 0.0754]))
SHOWN = 60
"""Dots per inch, so that a picture has at most 80 kB."""
Array = np.ndarray[Any, Any]


def scan(name: str) -> tuple[Array, Array]:
    """Return the vertices in metres and the faces of a scan."""
    with np.load(SCANS) as file:
        return file[f"{name}_vertices"] / 2e5, file[f"{name}_faces"].astype(np.intp)


def draw_grasp(path: Path) -> None:
    """Draw the best grasp of a bottle."""
    vertices, faces = scan("MustardBottle")
    plan = plan_grasps(vertices, faces, style=1)
    axes = plot_grasp(vertices, faces, plan[0], plan.hand)
    axes.figure.savefig(path, dpi=SHOWN, metadata={"Software": None})


def draw_loop(path: Path) -> None:
    """Draw an arm that holds a bottle on a table, and the path of the hand."""
    vertices, faces = scan("MustardBottle")
    low = float(vertices[:, 2].min())
    plan = plan_grasps(vertices, faces, style=1, count=6, obstacles=[plane_obstacle([0, 0, 1], [0, 0, low - 0.001])])
    model = ObjectModel.of(points=vertices[::200])
    truth = motor(np.array([0, 0, 0.5]), np.array([0.42, 0.1, 0.001 - low]))
    robot = Robot.named("ur5")
    scene = Scene(cameras(), (SceneObject("bottle", model, truth, vertices, faces[::2]),), robot, HOME)
    whole = Scene(cameras(), (SceneObject("bottle", model, truth, vertices, faces),), robot, HOME)
    views = whole.render("bottle", 0.3)
    table = plane_obstacle([0, 0, 1], [0, 0, 0])
    found = guided_grasp(
        robot, HOME, model, views, plan, mount=MOUNT, obstacles=[table], target=mesh_obstacle(vertices, faces)
    )
    if found.grasp is None:
        raise ValueError(f"draw_loop: {found.status.name}; expected a grasp")
    figure = plot_scene(scene.with_joints(found.path[-1]), found.contacts)
    axes: Any = figure.axes[0]
    hands = pga3.motor_product(robot.forward(found.path), MOUNT)
    axes.plot(*pga3.move_point(hands, np.zeros(3)).T, ".-", color="tab:purple", markersize=3)
    ends = pga3.move_point(hands[-1], hand_of_table().placed_capsules(found.grasp.joints))
    for start, end in ends:
        axes.plot(*np.stack([start, end], -1), color="0.4", linewidth=3, alpha=0.7)
    axes.set(xlim=(-0.75, 0.6), ylim=(-0.6, 0.5), zlim=(0, 0.6))
    axes.set_aspect("equal")
    axes.view_init(25, -65)
    figure.savefig(path, dpi=2 * SHOWN, bbox_inches="tight", metadata={"Software": None})


def main(folder: Path = FOLDER) -> int:
    """Write both pictures."""
    draw_grasp(folder / "grasp.png")
    draw_loop(folder / "grasp-loop.png")
    return 0


if __name__ == "__main__":
    sys.exit(main())
