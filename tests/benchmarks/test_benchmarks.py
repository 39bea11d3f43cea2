"""The benchmarks run and write their page. No test depends on measured times."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from benchmarks import __main__ as commands
from benchmarks import by_hand, command, comparisons
from benchmarks.building import Building, LibrarySize
from benchmarks.by_hand import HandTimes
from benchmarks.cases import CASES, OPTIONAL, Case, Peer
from benchmarks.features import Compared, Features
from benchmarks.generation import Generation, KernelTime, ModuleTime, specs
from benchmarks.kernels import KernelTimes, PeerTimes, measure
from benchmarks.libraries import installed
from benchmarks.machine import Machine
from benchmarks.report import Run, page
from benchmarks.timing import QUICK, median_times
from gacompiler.gac_runtime.build import built_library
from tests.support.all_cases import all_cases

ROOT = Path(__file__).parents[2]

HAS_PGA3 = built_library(ROOT / "generated" / "pga3.c", "f64") is not None

SECTIONS = [
    "Machine",
    "Method",
    "Generation",
    "C build",
    "Kernels, float64",
    "Kernels, float32",
    "Peers",
    "Comparison with hand-written C",
    "Fusion",
    "Threads",
    "One call",
    "Uniform arguments",
]


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "benchmarks", "benchmarks", *arguments], capture_output=True, text=True, cwd=ROOT
    )


def tables(text: str) -> dict[str, list[list[str]]]:
    """By section, the rows of its tables without their headers."""
    found: dict[str, list[list[str]]] = {}
    for section in text.split("\n## ")[1:]:
        rows = [[cell.strip() for cell in line[1:-1].split(" | ")] for line in section.splitlines() if line[:2] == "| "]
        found[section.partition("\n")[0]] = rows
    return found


@pytest.mark.peers
def test_a_quick_run_writes_the_page(tmp_path: Path) -> None:
    out = tmp_path / "page.md"
    done = run("--quick", "--sizes", "1", "8", "--out", str(out))
    assert done.returncode == 0, done.stderr
    assert str(out) in done.stdout
    text = out.read_text()
    found = tables(text)
    assert list(found) == [*SECTIONS, "Share of the memory bandwidth, 8 elements"]
    assert "a quick run" in text
    facts = dict(found["Machine"][1:])
    assert facts["numpy"] == np.__version__
    assert "-ffp-contract=off" in facts["flags"]
    titles = [case.title for case in CASES]
    for kind in ("float64", "float32"):
        header, *rows = found[f"Kernels, {kind}"]
        assert header == ["kernel", "mul", "add", "others", "1", "8 C", "8 F"]
        assert [row[0] for row in rows] == titles
        assert all(float(cell.replace(",", "")) > 0 for row in rows for cell in row[4:])
    for name in ("kingdon", "clifford", *OPTIONAL):
        rows = [row for row in found["Peers"] if row[1] == name]
        assert rows if facts[name] != "not installed" else f"{name}" in text.partition("Not installed")[2]
    assert {row[1] for row in found["Peers"][1:]} >= {"numpy", "scipy"}
    if HAS_PGA3:
        measured = {row[0] for row in found["Comparison with hand-written C"][1:]}
        assert measured == {f"{module}.{kernel}" for module, kernel in by_hand.KERNELS}
    assert {row[1] for row in found["Fusion"][1:]} == {"C", "F"}
    assert len(found["Threads"]) == 4
    assert {row[0] for row in found["One call"][1:]} == {"motor product", "moved point"}
    assert len(found["Uniform arguments"]) == 7
    slowest = [row[0] for row in found["Generation"] if re.fullmatch(r"\w+\.\w+", row[0])]
    assert len(slowest) == 10 and all(name.startswith("vga2.") for name in slowest)
    assert (tmp_path / "page.png").read_bytes()[:4] == b"\x89PNG"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["page.md", "page.png"]


def test_bad_arguments_are_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    for word, message in (("0", "an integer of at least 1"), ("many", "'many'")):
        with pytest.raises(SystemExit):
            command.main(["--sizes", word])
        assert message in capsys.readouterr().err.splitlines()[-1]
    assert commands.run("command", ["--out", str(ROOT / "README.md" / "page.md")]) == 1
    error = capsys.readouterr().err
    assert "choose one with --out" in error and len(error.splitlines()) == 1


@all_cases("case", CASES)
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
    built = Building(70.0, 0.02, (LibrarySize("m", 2_000_000, 1_500_000), LibrarySize("n", 1_000_000, 250_000)))
    hand = (
        HandTimes("m.slow", "float64", (2e-9, 3e-9), (1e-9, 3e-9), (4e-9, 3e-9)),
        HandTimes("m.fast", "float64", (1.1e-9, 1e-9), (1e-9, 2e-9), (1.1e-9, 2e-9)),
    )
    features = Features(
        (
            Compared("chain", 1000, "F", {"three": 6e-9, "three, out=": 4e-9, "fused, out=": 2e-9}),
            Compared("chain", 2000, "C", {"three": 6e-9, "three, out=": 3e-9, "fused, out=": 2e-9}),
        ),
        (Compared("m.k", 1000, "F", {"1": 3e-9, "2": 2e-9}), Compared("m.l", 1000, "F", {"1": 3e-9, "2": 2.5e-9})),
        2,
        (Compared("product", 1, "C", {"`a * b`": 50e-9, "`p(a, b)`": 40e-9, "x": 25e-9, "y": 1e-7}, ("x", "y")),),
        (Compared("m.k", 1000, "C", {"each": 4e-9, "one": 2e-9}),),
    )
    sizes, backends, missing = ((1, 1000), (10, 20)), {"pga3": "c"}, ("clifford",)
    return Run(
        machine, generation, built, sizes[0], (kernel,), sizes[1], hand, features, backends, missing, False, 7, None
    )


def test_the_page_of_made_up_figures() -> None:
    """Ratios, shares, order and units from known figures."""
    text = page(made_up((1e-6, 80e-9), (2e-6, None)))
    found = tables(text)
    assert found["Kernels, float64"][1] == [CASES[0].title, "21", "18", "1 div, 2 call", "1,000", "80.0", "80.0"]
    assert found["Peers"][1] == [CASES[0].title, "numpy", "a \\| b", "2.0", "–"]
    assert found["Share of the memory bandwidth, 1,000 elements"][1][2:] == ["50 %", "50 %", "25 %", "25 %"]
    slowest = [row[0] for row in found["Generation"] if re.fullmatch(r"m\.k\d+", row[0])]
    assert slowest == [f"m.k{n}" for n in range(11, 1, -1)]
    generation = dict(row for row in found["Generation"] if len(row) == 2)
    assert generation["median"] == "600 ms"
    assert generation["above 1 s"] == "2"
    assert found["C build"][1:] == [["m", "2.00", "1.50"], ["n", "1.00", "0.25"], ["all", "3.00", "1.75"]]
    assert targets(text)["C build"].endswith("Missed: 70.0 s.")
    assert "clifford" in text.partition("Not installed")[2]
    assert "a quick run" not in text
    assert page(made_up((1e-6, 80e-9), (2e-6, None))) == text


def targets(text: str) -> dict[str, str]:
    """The text about its target for each section."""
    sections = text.split("\n## ")[1:]
    return {section.partition("\n")[0]: " ".join(section.partition("Target: ")[2].split()) for section in sections}


def test_methods_of_calling_of_made_up_figures() -> None:
    """Ratios are not inverted, and missed targets are listed by name."""
    text = page(made_up((1e-6, 80e-9), (2e-6, 40e-9)))
    found, said = tables(text), targets(text)
    assert found["Comparison with hand-written C"] == [
        ["kernel", "type", "10 ns", "20 ns", "10 ratio", "20 ratio", "10 C", "20 C"],
        ["m.slow", "float64", "2.00", "3.00", "2.00", "1.00", "2.00", "1.00"],
        ["m.fast", "float64", "1.10", "1.00", "1.10", "0.50", "1.00", "2.00"],
    ]
    first, second = said["Comparison with hand-written C"].split(" Target: ")
    assert first.startswith("a ratio of at most 1.15 on 10 elements.") and first.endswith(
        "Missed: m.slow float64 (2.00)."
    )
    assert second.endswith("Missed: m.slow float64 (2.00).")
    assert found["Fusion"][1] == ["1,000", "F", "6.00", "4.00", "2.00", "3.0", "2.0"]
    assert said["Fusion"].endswith("Missed: 2,000 C (1.50).")
    assert [row[-1] for row in found["Threads"][1:]] == ["1.5", "1.2"]
    assert said["Threads"].endswith("Missed: m.l 1,000 (1.20).")
    assert [row[-1] for row in found["One call"][1:]] == ["1.0", "0.80", "0.50", "2.0"]
    missed = "Missed: product: x is faster than the call; product: the operator takes 50.0 ns."
    assert said["One call"].endswith(missed)
    assert found["Uniform arguments"][1][-1] == "2.0"
    assert said["Peers"].endswith(f"Missed: {CASES[0].title} 1,000 (numpy, 0.50).")
    assert "Not measured" in comparisons.by_hand((), (10,))


def test_all_calls_of_an_alternate_measurement_are_made() -> None:
    made: list[str] = []
    found = median_times({name: lambda name=name: made.append(name) for name in "ab"}, QUICK)
    assert set(found) == {"a", "b"} == set(made)
    assert all(spent > 0 for spent in found.values())


def test_a_peer_that_takes_one_element_or_computes_something_else() -> None:
    def one_only(x: np.ndarray) -> object:
        assert x.ndim == 1
        return lambda: x / np.sqrt(x @ x)

    def case(peer: Peer) -> Case:
        return Case("vga3", "normalize_vector", lambda rng, lead: (rng.normal(size=(*lead, 3)),), (peer,))

    single = Peer("numpy", "`x / sqrt(x @ x)`", one_only, largest=1)
    absent = Peer("no_such_library", "`x / sqrt(x @ x)`", one_only, largest=1)
    assert not installed("no_such_library")
    assert [peer.times[1] for peer in measure(case(single), (1, 5), QUICK, print).peers] == [None]
    assert measure(case(absent), (1, 5), QUICK, print).peers == ()
    with pytest.raises(RuntimeError, match="gives a different result"):
        measure(case(Peer("numpy", "`x`", lambda x: lambda: x, largest=1)), (1,), QUICK, print)


def test_hand_written_c_that_computes_something_else_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not HAS_PGA3:
        pytest.skip("no C")
    wrong = tmp_path / "by_hand.c"
    text = by_hand.SOURCE.read_text()
    wrong.write_text(text.replace("AT(out, 0) = b.z - a.z;", "AT(out, 0) = a.z - b.z;"))
    assert wrong.read_text() != text
    monkeypatch.setattr(by_hand, "SOURCE", wrong)
    monkeypatch.setattr(by_hand, "KERNELS", (("pga3", "join_points"),))
    monkeypatch.setattr(by_hand, "WIDTHS", {"the compiler's default": ()})
    monkeypatch.setattr(by_hand, "NATIVE", ("-O1",))
    with pytest.raises(RuntimeError, match=r"pga3\.join_points: the error of hand-written C is"):
        by_hand.measure((16,), QUICK, print)
