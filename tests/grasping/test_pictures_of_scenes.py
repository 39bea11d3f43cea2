"""Pictures of scenes contain what is in them."""

import numpy as np

from algorithms.grasping.pictures_of_scenes import animate_scenes, plot_scene, plot_view
from tests.support.grasp_scene import HOME, TARGET, motor, scene


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
