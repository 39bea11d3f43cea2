"""Pictures of scenes contain what is in them."""

import numpy as np
from scipy.spatial import cKDTree

from algorithms.vision.objects import measure_silhouettes
from algorithms.vision.objects.pictures_of_images import plot_silhouettes
from algorithms.vision.objects.pictures_of_scenes import animate_scenes, plot_scene, plot_view
from algorithms.vision.objects.pose_pictures import plot_poses
from generated import pga3
from tests.support.grasp_scene import HOME, TARGET, motor, scene
from tests.support.image_scene import BOX, NEAR, RED, plain


def test_scene_view_and_animation(tmp_path) -> None:
    built = scene(motor((0, 0, 0), TARGET))
    figure = plot_scene(built, TARGET[None])
    # Seven segments of the arm, the samples, two cameras of eight edges, and the contacts.
    assert len(figure.axes[0].lines) == 7 + 1 + 16 + 1 and len(figure.axes[0].collections) == 1
    view = built.render("box")[0]
    lines = plot_view(view).axes[0].lines
    assert [line.get_label() for line in lines] == ["points", "edges"]
    assert np.array_equal(lines[1].get_xydata(), view.edges[1])
    path = animate_scenes([built, built.with_joints(HOME + 0.1)], tmp_path / "scene.gif")
    assert path.read_bytes()[:4] == b"GIF8"


def test_contours_and_the_projected_model() -> None:
    cameras, images = plain("box")
    found = measure_silhouettes(BOX, cameras, images, NEAR, colour=RED)
    figure = plot_silhouettes(BOX, found, images)
    for axes, silhouette, camera in zip(figure.axes, found.silhouettes, cameras, strict=True):
        contour, outline, edges = axes.lines
        assert np.array_equal(contour.get_xydata()[:-1], silhouette.segment.contours[0])
        # The projected outline is on the contour, and the edges are inside of it.
        assert cKDTree(contour.get_xydata()).query(outline.get_xydata())[0].max() < 1.5
        assert len(outline.get_xydata()) > 100 and len(edges.get_xydata()) > 40
        assert np.array_equal(axes.images[0].get_array(), images[cameras.index(camera)])
        assert axes.get_title() == "OK"
    nothing = measure_silhouettes(BOX, cameras, images, NEAR, colour=(0, 0, 1))
    assert [len(axes.lines) for axes in plot_silhouettes(BOX, nothing, images).axes] == [0, 0]


def test_poses_are_drawn_over_a_view() -> None:
    built = scene(motor((0, 0, 0), TARGET))
    one, view = built.object("box"), built.render("box", 0.0)[0]
    off = pga3.motor_product(one.pose, motor((0, 0, 0.1), (0.01, 0, 0)))
    axes = plot_poses(view, one.model, {"start": off, "found": one.pose}).axes[0]
    assert [line.get_label() for line in axes.lines] == ["points", "edges", "start", "found"]
    ours = axes.lines[3].get_xydata()
    measured = axes.lines[1].get_xydata()
    gaps = np.linalg.norm(measured[:, None] - ours, axis=-1).min(1)
    assert gaps.max() < 1e-6 < np.linalg.norm(measured[:, None] - axes.lines[2].get_xydata(), axis=-1).min(1).max()
    low, high = np.sort(axes.get_ylim())
    assert low <= measured[:, 1].min() and measured[:, 1].max() <= high
