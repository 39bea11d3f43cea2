"""The blocks of the page on Clifford support vector machines, and its pictures."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from algorithms.learning import CliffordSVC
from algorithms.learning.svm_experiments import curves, spirals

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "clifford-svm.md").read_text()


def test_blocks_run(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    blocks = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    assert len(blocks) == 5
    exec(compile("\n".join(blocks), "docs/clifford-svm.md", "exec"), {"__name__": "clifford_svm"})


def test_pictures() -> None:
    pytest.importorskip("matplotlib")
    from algorithms.learning.pictures_of_machines import plot_classes, plot_curves

    x, y = spirals(16)
    figure = plot_classes(x, CliffordSVC(C=10.0).fit(x, y).predict(x), y, "spirals")
    assert figure.axes[0].get_title() == "spirals" and "are wrong" in figure.axes[0].get_legend_handles_labels()[1][0]
    t = x[:10, 0]
    assert len(plot_curves(curves(t), curves(t)).axes[0].lines) == 3
