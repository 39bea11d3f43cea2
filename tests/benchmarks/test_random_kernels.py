"""Random kernels: the same for every run, of all metrics, and a summary of made-up figures."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from benchmarks.random_kernels import Measured, main, measure, random_kernel, summary
from gacompiler.generation.kernel_key import description_of


def test_kernels_depend_on_their_number_only() -> None:
    first, second = (description_of(random_kernel(1, 7)[0]) for _ in range(2))
    assert first == second != description_of(random_kernel(2, 7)[0])


def test_all_metrics_and_dimensions_occur() -> None:
    made = [random_kernel(1, number) for number in range(120)]
    assert {metric for _, metric in made} == {"orthonormal", "degenerate", "null pairs", "oblique"}
    assert {each.parameters[0].layout.algebra.dimension for each, _ in made} == set(range(1, 7))


def test_a_refused_kernel_has_the_reason() -> None:
    found = [measure(1, number, {"effort": 0}) for number in range(16, 26)]
    assert any(each.error for each in found) and any(each.total for each in found)
    assert all("defect" not in each.error and not (each.error and each.total) for each in found)


def test_the_summary_of_made_up_figures() -> None:
    found = [
        Measured(k, 3 if k < 10 else 5, "oblique", k / 1000, 10, (5, 5, 0), "refused" * (k == 4)) for k in range(20)
    ]
    lines = summary(found).splitlines()
    assert "| 1 to 4 | 10 | 5.0 ms | 9.0 ms | 9.0 ms | 9.0 ms | 100 |" in lines
    assert "| 1 to 6 | 20 | 10.0 ms | 19.0 ms | 19.0 ms | 19.0 ms | 200 |" in lines
    assert lines[-1] == "1 of 20 kernels are refused; all others are verified."


def test_a_run_is_compared_with_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "found.json"
    assert main(["--count", "3", "--effort", "0", "--json", str(file)]) == 0
    rows = json.loads(file.read_text())
    assert [row[0] for row in rows] == [0, 1, 2]
    rows[1][4] += 1
    file.write_text(json.dumps(rows))
    capsys.readouterr()
    assert main(["--count", "3", "--effort", "0", "--compare", str(file)]) == 0
    assert f"kernel 1: {rows[1][4]} -> {rows[1][4] - 1}" in capsys.readouterr().out
