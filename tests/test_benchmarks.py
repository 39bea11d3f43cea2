"""The benchmarks run and write their page. Nothing here looks at how long anything took."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parent.parent
sys.path.append(str(ROOT))

from benchmarks.cases import CASES, Case  # noqa: E402
from benchmarks.generation import Generation, KernelTime, ModuleTime, specs  # noqa: E402
from benchmarks.kernels import KernelTimes, PeerTimes  # noqa: E402
from benchmarks.machine import Machine  # noqa: E402
from benchmarks.report import Run, page  # noqa: E402

SECTIONS = ["Machine", "Method", "Generation", "Kernels, float64", "Kernels, float32", "Peers"]


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", "benchmarks", *arguments], capture_output=True, text=True, cwd=ROOT)


def tables(text: str) -> dict[str, list[list[str]]]:
    """By section, the rows of its tables without their headers."""
    found: dict[str, list[list[str]]] = {}
    for section in text.split("\n## ")[1:]:
        rows = [[cell.strip() for cell in line[1:-1].split(" | ")] for line in section.splitlines() if line[:2] == "| "]
        found[section.partition("\n")[0]] = rows
    return found


def test_a_quick_run_writes_the_page(tmp_path: Path) -> None:
    out = tmp_path / "page.md"
    done = run("--quick", "--sizes", "1", "8", "--out", str(out))
    assert done.returncode == 0, done.stderr
    assert str(out) in done.stdout
    text = out.read_text()
    found = tables(text)
    assert list(found) == [*SECTIONS, "Share of the memory's speed, 8 elements"]
    assert "A quick run" in text
    facts = dict(found["Machine"][1:])
    assert facts["numpy"] == np.__version__
    assert "-ffp-contract=off" in facts["flags"]
    titles = [case.title for case in CASES]
    for kind in ("float64", "float32"):
        header, *rows = found[f"Kernels, {kind}"]
        assert header == ["kernel", "mul", "add", "others", "1", "8 C", "8 F"]
        assert [row[0] for row in rows] == titles
        assert all(float(cell.replace(",", "")) > 0 for row in rows for cell in row[4:])
    for name in ("kingdon", "clifford"):
        rows = [row for row in found["Peers"] if row[1] == name]
        assert rows if facts[name] != "not installed" else f"{name}" in text.partition("Not installed")[2]
    assert {row[1] for row in found["Peers"][1:]} >= {"numpy", "scipy"}
    slowest = [row[0] for row in found["Generation"] if re.fullmatch(r"\w+\.\w+", row[0])]
    assert len(slowest) == 10 and all(name.startswith("vga2.") for name in slowest)
    assert (tmp_path / "page.png").read_bytes()[:4] == b"\x89PNG"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["page.md", "page.png"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--sizes", "0"), "expected 1 or more"),
        (("--sizes", "many"), "'many'"),
        (("--out", "README.md/page.md"), "choose one with --out"),
    ],
)
def test_bad_arguments_are_one_line(arguments: tuple[str, ...], words: str) -> None:
    done = run(*arguments)
    assert done.returncode != 0
    assert words in done.stderr.splitlines()[-1]
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.title)
def test_arguments_have_the_leading_shape(case: Case) -> None:
    for lead in ((), (3,)):
        arrays = case.arguments(np.random.default_rng(0), lead)
        assert case.peers or case.formula
        assert np.asarray(arrays[-1]).shape[: len(lead)] == lead
        assert all(np.isfinite(array).all() for array in arrays)


def test_every_spec_is_generated_unless_quick() -> None:
    assert {path.stem for path in specs(False)} > {path.stem for path in specs(True)} == {"vga2"}
    assert {"pga3", "cga3"} <= {path.stem for path in specs(False)}


def made_up(times: tuple[float, ...], theirs: tuple[float | None, ...]) -> Run:
    cost = {"mul": 21, "add": 18, "div": 1, "sqrt": 0, "call": 2}
    kinds = {(kind, order): times for kind in ("float64", "float32") for order in "CF"}
    kernel = KernelTimes(CASES[0], cost, 10, kinds, (PeerTimes("numpy", "a | b", theirs),))
    generation = Generation(
        tuple(KernelTime("m", f"k{n}", 0.1 * n, 0.05) for n in range(12)), (ModuleTime("m", 12, 7.0),)
    )
    machine = Machine((("processor", "made up"),), 4e9, 2e9, 1e10)
    return Run(machine, generation, (1, 1000), (kernel,), {"pga3": "c"}, ("clifford",), False, 7, None)


def test_the_page_of_made_up_figures() -> None:
    """Ratios, shares, order and units, from figures that are known."""
    text = page(made_up((1e-6, 80e-9), (2e-6, None)))
    found = tables(text)
    assert found["Kernels, float64"][1] == [CASES[0].title, "21", "18", "1 div, 2 call", "1,000", "80.0", "80.0"]
    assert found["Peers"][1] == [CASES[0].title, "numpy", "a \\| b", "2.0", "–"]
    assert found["Share of the memory's speed, 1,000 elements"][1][2:] == ["50 %", "50 %", "25 %", "25 %"]
    slowest = [row[0] for row in found["Generation"] if re.fullmatch(r"m\.k\d+", row[0])]
    assert slowest == [f"m.k{n}" for n in range(11, 1, -1)]
    generation = dict(row for row in found["Generation"] if len(row) == 2)
    assert generation["median"] == "600 ms"
    assert generation["above 1 s"] == "2"
    assert "clifford" in text.partition("Not installed")[2]
    assert "A quick run" not in text
    assert page(made_up((1e-6, 80e-9), (2e-6, None))) == text
