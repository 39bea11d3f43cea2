"""Pictures show what is evaluated, and the blocks of the page run."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from algorithms.estimation.servoing import GraspSettings, VisualStatus, random_scene, simulate_grasp
from algorithms.fuzzy import Sugeno, grasp_controller

ROOT = Path(__file__).parents[2]


def test_blocks_run(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("matplotlib")
    monkeypatch.chdir(ROOT)
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "visual-grasping.md").read_text(), re.DOTALL)
    assert len(blocks) == 8
    exec(compile("\n".join(blocks), "docs/visual-grasping.md", "exec"), {"__name__": "visual_grasping"})


def test_memberships_are_those_of_the_sets(tmp_path: Path) -> None:
    pictures = pytest.importorskip("algorithms.fuzzy.pictures")
    system = grasp_controller()
    figure = pictures.plot_memberships(system)
    figure.savefig(tmp_path / "a.png", dpi=30)
    line = figure.axes[0].lines[1]
    variable = system.inputs[0]
    assert line.get_label() == "near"
    assert np.allclose(line.get_ydata(), np.interp(line.get_xdata(), [2, 8, 20, 45], [0, 1, 1, 0]), rtol=0, atol=1e-12)
    assert len(figure.axes[0].lines) == len(variable.sets)


def test_the_surface_has_the_values_of_the_output(tmp_path: Path) -> None:
    pictures = pytest.importorskip("algorithms.fuzzy.pictures")
    system = grasp_controller()
    figure = pictures.plot_control_surface(system, "distance", "angle", "speed", {"force": 0.0}, samples=21)
    figure.savefig(tmp_path / "a.png")
    x, y = np.meshgrid(np.linspace(0, 120, 21), np.linspace(-90, 90, 21))
    values = system.evaluate({"distance": x, "angle": y, "force": 0.0}).values[..., 0]
    low, high = figure.axes[0].zz_dataLim.intervalx
    assert np.allclose([low, high], [values.min(), values.max()], rtol=0, atol=1e-12)
    with pytest.raises(ValueError, match="no input 'speed'; expected distance, angle, force"):
        pictures.plot_control_surface(system, "speed", "angle", "speed")
    with pytest.raises(ValueError, match="no output 'angle'"):
        pictures.plot_control_surface(system, "distance", "angle", "angle")
    with pytest.raises(ValueError, match="both angle"):
        pictures.plot_control_surface(system, "angle", "angle", "speed")
    with pytest.raises(ValueError, match="fixed: angle, which the surface is plotted over"):
        pictures.plot_control_surface(system, "distance", "angle", "speed", {"angle": 0.0})
    with pytest.raises(ValueError, match="samples: 1; expected at least 2"):
        pictures.plot_control_surface(system, "distance", "angle", "speed", samples=1)


def test_a_grasp_is_drawn_by_stages() -> None:
    pictures = pytest.importorskip("algorithms.estimation.servoing.pictures")
    run = simulate_grasp(random_scene(np.random.default_rng(0)), GraspSettings())
    figure = pictures.plot_guided_grasp(run)
    figure.draw_without_rendering()
    shown = sum(len(line.get_xdata()) for line in figure.axes[2].lines)
    assert shown == sum(step.error > 0 for step in run.steps)
    start = figure.axes[0].lines[12].get_xdata()[0]
    assert start == run.scenes[0].images()[0, 0, 0]


@pytest.mark.filterwarnings("error")
def test_a_grasp_that_ends_at_once_is_drawn() -> None:
    pictures = pytest.importorskip("algorithms.estimation.servoing.pictures")
    scene = random_scene(np.random.default_rng(0))
    behind = scene.moved(np.array([0, 0, 0, 0, 0, 5.0]))
    run = simulate_grasp(behind, GraspSettings())
    assert run.status is VisualStatus.LOST_FEATURE and len(run.steps) == 1
    figure = pictures.plot_guided_grasp(run)
    figure.draw_without_rendering()
    assert not figure.axes[2].lines


def test_the_surface_of_sugeno_inference_is_that_of_its_function() -> None:
    pictures = pytest.importorskip("algorithms.fuzzy.pictures")
    system = Sugeno.parse("""
    input x from 0 to 1 samples 2
        set any trapezoid 0 0 1 1
    input y from 0 to 2 samples 2
        set any trapezoid 0 0 2 2
    output z
        function plane 1 + 2 x - 3 y
    rule if x is any and y is any then z is plane
    """)
    axis = pictures.plot_control_surface(system, "x", "y", "z", samples=3).axes[0]
    low, high = axis.get_zlim()
    # The values are from 1 - 6 to 1 + 2, and the axis ends a little beyond them.
    assert -6 < low <= -5 and 3 <= high < 4
