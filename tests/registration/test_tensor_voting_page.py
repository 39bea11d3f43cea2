"""The blocks of the page on tensor voting, and its pictures."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from algorithms.registration import register_deformable, tensor_vote

ROOT = Path(__file__).parents[2]


def test_blocks_run(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "tensor-voting.md").read_text(), re.DOTALL)
    assert len(blocks) == 4
    exec(compile("\n".join(blocks), "docs/tensor-voting.md", "exec"), {"__name__": "tensor_voting"})


def test_pictures_show_all_points(tmp_path: Path) -> None:
    pictures = pytest.importorskip("algorithms.registration.pictures_of_votes")
    points = np.random.default_rng(0).uniform(size=(50, 2))
    figure = pictures.plot_saliency(tensor_vote(points, sigma=0.2))
    assert len(figure.axes[0].lines[0].get_xdata()) == 50
    figure = pictures.plot_deformation(points, points, register_deformable(points, points))
    figure.savefig(tmp_path / "a.png")
    assert len(figure.axes[1].lines) == 2


@pytest.mark.filterwarnings("error")
def test_pictures_of_few_points(tmp_path: Path) -> None:
    pictures = pytest.importorskip("algorithms.registration.pictures_of_votes")
    for points in (np.zeros((0, 3)), np.zeros((1, 2)), np.full((4, 3), np.nan)):
        pictures.plot_saliency(tensor_vote(points, sigma=1.0)).savefig(tmp_path / "a.png")
