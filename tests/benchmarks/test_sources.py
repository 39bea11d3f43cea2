"""The tests that `make test ONLY=...` selects."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.sources import affected, imports_of_files

TREE = {
    "algorithms/__init__.py": "",
    "algorithms/vision/__init__.py": "from .camera import Camera",
    "algorithms/vision/camera.py": "from generated import pga3",
    "algorithms/mapping/__init__.py": "def f():\n    from ..vision import Camera",
    "algorithms/wavelets/__init__.py": "import numpy",
    "generated/pga3.py": "",
    "generated/gac_runtime/__init__.py": "",
    "tests/support/scenes.py": "import algorithms.mapping",
    "tests/vision/test_documents.py": "",
    "tests/mapping/test_maps.py": "from scenes import room",
    "tests/wavelets/test_wavelets.py": "from algorithms import wavelets",
}


@pytest.mark.parametrize(
    ("changed", "folders"),
    [
        ("algorithms/vision", {"vision", "mapping"}),
        ("algorithms/vision/camera.py", {"vision", "mapping"}),
        ("algorithms/wavelets", {"wavelets"}),
        ("generated/pga3.py", {"mapping"}),
        ("generated/gac_runtime", {"mapping"}),
        ("tests/support/scenes.py", {"mapping"}),
    ],
)
def test_importers_are_found(changed: str, folders: set[str], tmp_path: Path) -> None:
    for name, text in TREE.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    found = {path.parts[1] for path in affected([changed], imports_of_files(tmp_path))}
    assert found == folders


def test_other_names_are_refused() -> None:
    with pytest.raises(ValueError, match="ONLY=algorithms/visoin: no Python file"):
        affected(["algorithms/visoin"], {Path("algorithms/vision/camera.py"): set()})
