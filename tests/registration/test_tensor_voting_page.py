"""The blocks of the page on tensor voting, and its pictures."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from algorithms.registration import extract_curves, extract_junctions, register_deformable, tensor_vote

ROOT = Path(__file__).parents[2]


@pytest.mark.slow
def test_blocks_run(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "tensor-voting.md").read_text(), re.DOTALL)
    assert len(blocks) == 5
    exec(compile("\n".join(blocks), "docs/tensor-voting.md", "exec"), {"__name__": "tensor_voting"})


def test_pictures_show_all_points() -> None:
    pictures = pytest.importorskip("algorithms.registration.pictures_of_votes")
    points = np.random.default_rng(0).uniform(size=(50, 2))
    figure = pictures.plot_saliency(tensor_vote(points, sigma=0.2))
    assert len(figure.axes[0].lines[0].get_xdata()) == 50
    figure = pictures.plot_deformation(points, points, register_deformable(points, points))
    assert len(figure.axes[1].lines) == 2


@pytest.mark.filterwarnings("error")
def test_pictures_of_few_points() -> None:
    pictures = pytest.importorskip("algorithms.registration.pictures_of_votes")
    pictures.plot_saliency(tensor_vote(np.zeros((1, 2)), sigma=1.0))
    pictures.plot_saliency(tensor_vote(np.full((4, 3), np.nan), sigma=1.0)).draw_without_rendering()


def test_pictures_show_all_curves() -> None:
    pictures = pytest.importorskip("algorithms.registration.pictures_of_votes")
    rng = np.random.default_rng(0)
    points = rng.uniform(-1, 1, (200, 1)) * np.repeat(np.eye(3)[:2], 100, axis=0)
    points = np.concatenate([points, [[0, 0, -1], [0, 0, 1]]])
    curves, junctions = extract_curves(points, sigma=0.15), extract_junctions(points, sigma=0.15)
    figure = pictures.plot_curves(points, curves, junctions)
    figure.draw_without_rendering()
    assert len(figure.axes[1].lines) == len(curves.pieces) + 1 > 50
    assert len(figure.axes[1].lines[-1].get_data_3d()[0]) == len(junctions.points) == 1
    nothing = np.zeros((0, 3))
    figure = pictures.plot_curves(nothing, extract_curves(nothing, sigma=1), extract_junctions(nothing, sigma=1))


@pytest.mark.slow
def test_pictures_of_the_page_are_drawn(tmp_path: Path) -> None:
    drawing = pytest.importorskip("benchmarks.tensor_voting_pictures")
    drawing.draw(tmp_path, tokens=40)
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "curves-in-space.png",
        "deformation.png",
        "tensor-voting.png",
    ]
