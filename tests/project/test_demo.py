"""The demonstration."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PICTURES = ("arms.png", "stereo.png", "spectrum.png")


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, *arguments], capture_output=True, text=True, cwd=ROOT)


@pytest.mark.slow
def test_demo(tmp_path: Path) -> None:
    """Run on real input with existing builds; check the pictures and the key figures.

    Other tests compare the kernels without a library, which take the same calls.
    """
    image = pytest.importorskip("PIL.Image")
    pytest.importorskip("skimage.data")
    done = run("-m", "algorithms.demo", "--out", str(tmp_path / "new" / "folder"))
    assert done.returncode == 0, done.stderr
    for text in (
        "(0.596303, -0.150050, 0.657476) m",
        "343,274 of 370,500",
        "motor_product",
        "fundamental_matrix_from_cameras",
        "ulp",
        "Error of the inverse transform",
    ):
        assert text in done.stdout
    assert "Backend " in done.stdout
    for name in PICTURES:
        path = tmp_path / "new" / "folder" / name
        assert name in done.stdout
        with image.open(path) as picture:
            assert min(picture.size) > 900
            assert len(picture.convert("RGB").getcolors(1 << 24)) > 1000
    assert sorted(path.name for path in (tmp_path / "new" / "folder").iterdir()) == sorted(PICTURES)


def test_demo_says_where_it_cannot_write(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("kept")
    done = run("-m", "algorithms.demo", "--out", str(tmp_path / "file" / "folder"))
    assert done.returncode == 1
    assert done.stdout == ""
    assert len(done.stderr.splitlines()) == 1
    assert "expected a writable folder" in done.stderr
    assert (tmp_path / "file").read_text() == "kept"
