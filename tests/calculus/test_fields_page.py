"""The page on linear functions, integrals, fields and spinors runs, and its pictures are correct."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from algorithms.calculus import Fields, YeeBox
from algorithms.calculus.pictures import draw_energy, draw_spin

PAGE = Path(__file__).parents[2] / "docs" / "fields.md"


def test_blocks_of_the_page_run() -> None:
    """Execute the blocks in one namespace, from top to bottom, including their assertions."""
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
    assert len(blocks) >= 6
    exec(compile("\n".join(blocks), "docs/fields.md", "exec"), {"__name__": "fields"})


def test_a_picture_of_energy_shows_the_density(tmp_path: Path) -> None:
    box = YeeBox((6, 5, 4), (3, 2, 1), 0.1)
    electric = np.zeros((6, 5, 4, 3))
    electric[..., 1] = 2.0
    figure = draw_energy(box, Fields(electric, np.zeros_like(electric)), axis=0, layer=3)
    axes = figure.axes[0]
    (image,) = axes.get_images()
    np.testing.assert_allclose(image.get_array(), np.full((4, 5), 2.0))
    assert list(image.get_extent()) == [0, 2, 0, 1] and (axes.get_xlabel(), axes.get_ylabel()) == ("y", "z")
    figure.savefig(tmp_path / "energy.png")
    assert (tmp_path / "energy.png").stat().st_size > 1000
    with pytest.raises(ValueError, match="layer: 6; expected 0 to 5"):
        draw_energy(box, Fields(electric, electric), axis=0, layer=6)
    with pytest.raises(ValueError, match="expected those of one box"):
        draw_energy(box, Fields(electric[None], electric[None]))


def test_a_picture_of_a_spin_shows_its_path(tmp_path: Path) -> None:
    angles = np.linspace(0, 1, 5)
    # turned by 2 angles about e1, from e3 towards -e2, and of any length
    spinors = 3 * np.stack([np.cos(angles), 0 * angles, 0 * angles, -np.sin(angles)], -1)
    figure = draw_spin(spinors)
    (line,) = figure.axes[0].get_lines()
    path = np.array(line.get_data_3d())
    np.testing.assert_allclose(path, [0 * angles, -np.sin(2 * angles), np.cos(2 * angles)], atol=1e-12)
    figure.savefig(tmp_path / "spin.png")
    with pytest.raises(ValueError, match="a spinor that is zero"):
        draw_spin(np.zeros((2, 4)))
