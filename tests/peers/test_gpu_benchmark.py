"""The script that measures on a device runs without one, and says that there is none."""

from __future__ import annotations

import pytest
from operator_kernels import compile_quickly

from benchmarks.gpu import main

pytestmark = pytest.mark.peers


def test_rows(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    torch = pytest.importorskip("torch")
    compile_quickly(monkeypatch)
    monkeypatch.setattr("benchmarks.gpu.ROUNDS", 1)
    monkeypatch.setattr("benchmarks.gpu.PRODUCTS", (("G(3)", 2),))
    assert main(["--device", "cpu", "--count", "100"]) == 0
    text = capsys.readouterr().out
    for wanted in ("100 points moved, float32", "gradient by the motor, float64", "10 arms of six joints", "G(3), 2"):
        assert wanted in text
    if not torch.cuda.is_available():
        assert main([]) == 1
        assert "finds no device; expected one, or --device cpu" in capsys.readouterr().err
