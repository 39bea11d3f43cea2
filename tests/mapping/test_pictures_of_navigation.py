"""Plots and the animation of a run."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from PIL import Image

from algorithms.mapping.floor_plans import FloorPlan
from algorithms.mapping.localization import LineLocalizer
from algorithms.mapping.navigation_run import simulate_following
from algorithms.mapping.objects import MapObject
from algorithms.mapping.paths import PlanarPath
from algorithms.mapping.pictures_of_navigation import animate_run, draw_errors, draw_run
from generated import pga2

ROOM = FloorPlan.from_walls([[[0, 0], [6, 0]], [[6, 0], [6, 4]], [[6, 4], [0, 4]], [[0, 4], [0, 0]]], solid=True)


@pytest.mark.slow
def test_pictures(tmp_path: Path) -> None:
    path = PlanarPath.through([[1.5, 1.5], [2.5, 1.5], [2.5, 2.0]], 0.3)
    begin = path.pose(0.0)
    run = simulate_following(ROOM, path, LineLocalizer(ROOM.segments, begin, [1e-4] * 3), begin)
    truth = np.asarray(pga2.motor_to_angle_translation(run.truth)[1])
    figure = draw_run(ROOM.segments, path, run, [MapObject.circle([2.5, 3.0], 0.3, "column")])
    FigureCanvasAgg(figure).draw()
    (stage,) = figure.axes
    shown = {line.get_label(): line for line in stage.lines}
    np.testing.assert_allclose(np.array(shown["true way"].get_data()).T, truth)
    assert len(stage.collections[0].get_segments()) == 4 and stage.get_title() == "ARRIVED"
    assert [text.get_text() for text in stage.texts] == ["column"]
    errors = draw_errors(run)
    FigureCanvasAgg(errors).draw()
    np.testing.assert_allclose(errors.axes[0].lines[0].get_ydata(), 100 * run.distances)
    np.testing.assert_allclose(errors.axes[2].lines[0].get_ydata(), run.normalized_errors)
    written = animate_run(ROOM.segments, path, run, tmp_path / "run.gif", frames_per_second=2)
    with Image.open(written) as film:
        assert film.n_frames == len(np.arange(0, len(run.times), 10))
    with pytest.raises(ValueError, match="1 steps; expected at least 2"):
        animate_run(ROOM.segments, path, replace(run, times=run.times[:1]), tmp_path / "none.gif")
