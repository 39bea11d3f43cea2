"""The repository keeps what its documents promise: names, commands, versions, pins, nothing built or local in it."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest

import gacompiler
from gacompiler.cli import COMMANDS
from gacompiler.gac_runtime.build import built_library

ROOT = Path(__file__).parents[2]
FOLDERS = {"gacompiler", "generated", "algorithms", "tests", "benchmarks", "docs", ".ci"}
REQUIRED = {"pyproject.toml", "Makefile", "README.md", "LICENSE", ".gitignore", *FOLDERS}
OPTIONAL = {"notebooks"}
BUILT = {".so", ".o", ".a", ".pyc", ".nbi", ".nbc", ".dll", ".dylib", ".whl", ".egg"}
CLOCKS = {"perf_counter", "perf_counter_ns", "monotonic", "monotonic_ns", "process_time", "time_ns", "timeit"}
DOCUMENTS = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def files() -> list[str]:
    """Files that git tracks or would track."""
    command = ["git", "ls-files", "--cached", "--others", "--exclude-standard"]
    try:
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    except FileNotFoundError:
        pytest.skip("no git")
    if done.returncode:
        pytest.skip("no git repository")
    return [name for name in done.stdout.splitlines() if (ROOT / name).is_file()]


def project() -> dict[str, Any]:
    return tomllib.loads((ROOT / "pyproject.toml").read_text())


def commands(document: Path, program: str) -> list[list[str]]:
    """The arguments of a program, wherever a document shows it in code."""
    text = document.read_text()
    blocks = re.findall(r"```\w*\n(.*?)```", text, re.DOTALL)
    lines = [line.removeprefix("$ ") for block in blocks for line in block.splitlines()]
    lines += re.findall(r"`([^`\n]+)`", re.sub(r"```.*?```", "", text, flags=re.DOTALL))
    found = [re.match(rf"{program} +([^#]+)", line.strip()) for line in lines]
    return [shlex.split(match[1]) for match in found if match]


def targets() -> list[str]:
    return re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(), re.MULTILINE)


def test_names_at_the_top() -> None:
    names = {name.partition("/")[0] for name in files()}
    assert names >= REQUIRED, f"not there: {sorted(REQUIRED - names)}"
    assert names <= REQUIRED | OPTIONAL, f"do not belong there: {sorted(names - REQUIRED - OPTIONAL)}"


def test_commands_of_the_documents_exist() -> None:
    shown = {document.relative_to(ROOT).as_posix(): commands(document, "make") for document in DOCUMENTS}
    assert {"demo", "test"} <= {arguments[0] for arguments in shown["README.md"]}
    for name, found in shown.items():
        for arguments in found:
            wanted = {argument for argument in arguments if "=" not in argument}
            assert wanted <= {*targets(), ".venv/.peers"}, f"{name}: make {' '.join(arguments)}"
    for document in DOCUMENTS:
        for arguments in commands(document, "gac"):
            assert arguments[0] in COMMANDS, f"{document.name}: gac {' '.join(arguments)}"


def test_help_lists_every_target() -> None:
    done = subprocess.run(["make", "help"], cwd=ROOT, capture_output=True, text=True, check=True)
    assert [line.split()[0] for line in done.stdout.splitlines()] == targets()


def test_ci_runs_targets() -> None:
    script = ROOT / ".ci" / "run"
    steps = " ".join(re.findall(r"^side_by_side (.*)$", script.read_text(), re.MULTILINE)).split()
    assert {"lint", "test", "types", "docs", "check", "thorough"} <= set(steps) <= set(targets())
    assert script.stat().st_mode & 0o111


def test_version_is_the_latest_in_the_changelog() -> None:
    entries = re.findall(r"^## \[([^]]+)\]", (ROOT / "docs" / "CHANGELOG.md").read_text(), re.MULTILINE)
    assert next(entry for entry in entries if entry != "Unreleased") == gacompiler.__version__
    assert f"version: {gacompiler.__version__}\n" in (ROOT / "docs" / "CITATION.cff").read_text()
    assert project()["project"]["dynamic"] == ["version"]
    assert project()["tool"]["setuptools"]["dynamic"] == {"version": {"attr": "gacompiler.__version__"}}


def test_packages_are_marked_as_typed() -> None:
    metadata = project()
    assert "Typing :: Typed" in metadata["project"]["classifiers"]
    assert "py.typed" in metadata["tool"]["setuptools"]["package-data"]["*"]
    packages = [pattern.removesuffix("*") for pattern in metadata["tool"]["setuptools"]["packages"]["find"]["include"]]
    assert [name for name in packages if not (ROOT / name / "py.typed").is_file()] == []


def test_every_dependency_is_pinned() -> None:
    lines = (ROOT / ".ci" / "constraints.txt").read_text().splitlines()
    pins = [line for line in lines if line and not line.startswith("#")]
    assert all(re.fullmatch(r"[\w.-]+==[\w.]+", pin) for pin in pins)
    pinned = [normal(pin.partition("==")[0]) for pin in pins]
    assert len(pinned) == len(set(pinned))
    metadata = project()
    wanted = [*metadata["project"]["dependencies"], *metadata["build-system"]["requires"]]
    for extra in metadata["project"]["optional-dependencies"].values():
        wanted += extra
    missing = {normal(re.split(r"[\s<>=!~;\[]", line)[0]) for line in wanted} - set(pinned)
    assert not missing, f"not in .ci/constraints.txt: {sorted(missing)}"


def normal(name: str) -> str:
    """The name of a package as indices compare it."""
    return re.sub(r"[-_.]+", "-", name).lower()


def test_nothing_built_is_tracked() -> None:
    folders = {"__pycache__", "_build", "build", "dist", ".venv"}
    for name in files():
        assert Path(name).suffix not in BUILT, name
        assert not folders & set(Path(name).parts), name


def test_no_merge_is_unfinished() -> None:
    for name in files():
        content = (ROOT / name).read_bytes()
        assert b"\n<<<<<<< " not in content and b"\n>>>>>>> " not in content, name


def test_no_path_of_any_machine() -> None:
    places = ["home", "root", "Users", "work", "mnt", "private"]
    pattern = re.compile(rf"(?<![\w.~/])/(?:{'|'.join(places)})/\w|\b[A-Z]:\\\\?Users")
    for name in files():
        try:
            text = (ROOT / name).read_text(encoding="utf-8")
        except UnicodeDecodeError:
            continue
        if not any(f"/{place}/" in text for place in places) and "Users" not in text:
            continue
        match = pattern.search(text)
        assert not match, f"{name}:{text.count(chr(10), 0, match.start()) + 1}: {match[0]}"


def test_a_generated_module_loads_no_compiler() -> None:
    """Neither the compiler nor sympy, and numba only where no library is built."""
    code = "import sys, generated.pga3 as m; print(m.backend, *{n.partition('.')[0] for n in sys.modules})"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    backend, *loaded = done.stdout.split()
    assert not {"sympy", "gacompiler", "scipy", "matplotlib"} & set(loaded)
    if built_library(ROOT / "generated" / "pga3.c", "f64") is not None:
        assert "numba" not in loaded
    assert backend in ("c", "numba", "arrays")


def test_no_test_asserts_on_time() -> None:
    """A machine may be busy: tests count operations and bytes, benchmarks measure time."""
    # Also in programs for other processes, which are texts.
    clocks = re.compile(rf"\b(?:{'|'.join(CLOCKS)})\b|\btime\.time\(")
    for path in sorted((ROOT / "tests").rglob("*.py")):
        found = clocks.search(path.read_text())
        assert path == Path(__file__) or not found, f"{path.name} looks at the clock: {found}"


def test_contributing_names_files_that_exist() -> None:
    text = (ROOT / "docs" / "CONTRIBUTING.md").read_text()
    for name in re.findall(r"`((?:gacompiler|tests|docs|generated|\.ci|benchmarks)/[\w./]*)`", text):
        assert (ROOT / name).exists(), name
