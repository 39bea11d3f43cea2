"""The cache of the command line: the second run of a command compiles nothing and prints the same."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result

from gacompiler.cli import main
from gacompiler.cli.caching import PARTS
from gacompiler.generation import compiling
from gacompiler.generation.checked_in import generated_folder

SPEC = '''
from gacompiler import kernel
from gacompiler.algebra.catalog import VGA2

@kernel(a=VGA2.VECTOR, b=VGA2.VECTOR)
def line(a, b):
    """An area."""
    return a ^ b
'''


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("GAC_CACHE", str(tmp_path / "cache"))
    monkeypatch.setenv("GAC_BACKEND", "arrays")  # avoid the start-up time of numba
    monkeypatch.delenv("GAC_CACHE_SIZE", raising=False)
    (tmp_path / "lines.py").write_text(SPEC)
    return tmp_path


@pytest.fixture
def compiled(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The names of the kernels that this process has compiled so far."""
    names: list[str] = []
    real = compiling.compile_kernel

    def noted(definition: Any, **options: Any) -> Any:
        names.append(definition.name)
        return real(definition, **options)

    monkeypatch.setattr(compiling, "compile_kernel", noted)
    return names


def run(*words: str) -> Result:
    return CliRunner().invoke(main, list(words))


def entries(here: Path) -> list[str]:
    return sorted(path.name for path in (here / "cache" / "compilations").iterdir())


COMMANDS = [
    ("generate", "lines.py", "--no-build", "-o", "out"),
    ("generate", "lines.py", "--target", "rust", "-o", "out"),
    ("generate", "lines.py", "--target", "c", "--target", "rust", "--no-build", "-o", "out"),
    ("cost", "lines.py"),
    ("verify", "lines.py", "-o", "out"),
]


@pytest.mark.parametrize("words", COMMANDS, ids=lambda words: "-".join(words))
def test_nothing_is_compiled_twice(words: tuple[str, ...], here: Path, compiled: list[str]) -> None:
    run("generate", "lines.py", "--no-build", "-o", "out", "--no-cache")
    compiled.clear()
    first = run(*words)
    assert first.exit_code == 0 and compiled == ["line"], first.output
    files = {path.name: path.read_text() for path in (here / "out").glob("lines.*")}
    second = run(*words)
    assert second.exit_code == 0 and compiled == ["line"]
    assert second.output.replace(", unchanged", "") == first.output.replace(", unchanged", "")
    assert {path.name: path.read_text() for path in (here / "out").glob("lines.*")} == files
    kept = entries(here)
    assert run(*words, "--no-cache").exit_code == 0 and compiled == ["line", "line"]
    assert entries(here) == kept


def test_without_a_cache_nothing_is_stored(here: Path, compiled: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    for words in COMMANDS[:4]:
        assert run(*words, "--no-cache").exit_code == 0
    assert compiled == ["line"] * 4 and not (here / "cache").exists()
    monkeypatch.setenv("GAC_CACHE_SIZE", "0")
    assert run("cost", "lines.py").exit_code == 0
    assert len(compiled) == 5 and not (here / "cache").exists()


@pytest.mark.slow
def test_check_uses_the_entries_of_generate(here: Path, compiled: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """Differences are detected and the text is proved with and without programs from the cache."""
    assert run("generate", "--all", "omnidirectional", "--no-build", "-o", "out").exit_code == 0
    n = len(compiled)
    result = run("check", "omnidirectional")
    assert result.exit_code == 0 and "files are up to date" in result.output
    result = run("check", "omnidirectional", "--prove")
    assert result.exit_code == 0 and f"{n} kernels are proved" in result.output and len(compiled) == n > 5
    for path in generated_folder().glob("omnidirectional.*"):
        (here / path.name).write_text(path.read_text().replace(" + ", " - ", 1))
    monkeypatch.setattr("gacompiler.cli.checking.generated_folder", lambda: here)
    result = run("check", "omnidirectional")
    assert result.exit_code == 1 and "files differ" in result.output and len(compiled) == n


def test_verify_with_a_cache_finds_a_flipped_sign(here: Path) -> None:
    run("generate", "lines.py", "--no-build", "-o", "out")
    assert run("verify", "lines.py", "-o", "out").exit_code == 0
    for name in ("lines.py", "lines.c"):
        path = here / "out" / name
        text = path.read_text()
        place = text.rindex(" - ", 0, text.rindex(" * b_e1"))
        path.write_text(text[:place] + " + " + text[place + 3 :])
        assert run("verify", "lines.py", "-o", "out").exit_code == 1
        path.write_text(text)


def test_processes_share_the_cache(here: Path, compiled: list[str]) -> None:
    (here / "others.py").write_text(SPEC.replace("def line", "def other"))
    words = ("lines.py", "others.py", "--no-build", "-o", "out", "-j", "2")
    result = run("generate", *words)
    assert result.exit_code == 0 and compiled == [], "other processes compiled them"
    assert result.output.count("1 kernels") == 2 and len(entries(here)) == 4
    assert run("generate", *words, "-j", "1").exit_code == 0 and compiled == []
    result = run("generate", *words, "-j", "0")
    assert result.exit_code == 2 and "x>=1" in result.output


@pytest.mark.slow
def test_cache_is_shown_and_cleared(here: Path) -> None:
    (here / "cache" / "foreign").mkdir(parents=True, mode=0o700)
    (here / "cache").chmod(0o700)
    run("generate", "lines.py", "--no-build")
    lines = run("cache").output.splitlines()
    assert lines[0] == f"{here / 'cache'}: at most 256.0 MB of compilations"
    assert lines[2].split()[:2] == ["compilations", "2"]
    data = json.loads(run("cache", "--json").output)
    assert data["place"] == str(here / "cache") and data["limit"] == 256_000_000
    sizes = [(here / "cache" / "compilations" / name).stat().st_size for name in entries(here)]
    assert data["parts"]["compilations"] == {"files": 2, "bytes": sum(sizes)}
    for folder in ("modules/line-0/_build", "objects"):
        (here / "cache" / folder).mkdir(parents=True, exist_ok=True)
        (here / "cache" / folder / "library.so").write_text("123")
    data = json.loads(run("cache", "--json").output)
    assert data["parts"]["modules"] == data["parts"]["objects"] == {"files": 1, "bytes": 3}
    assert run("cache", "--clear").exit_code == 0
    assert json.loads(run("cache", "--json").output)["parts"] == {part: {"files": 0, "bytes": 0} for part in PARTS}
    assert (here / "cache" / "foreign").is_dir(), "files that are not part of the cache are kept"


@pytest.mark.slow
def test_the_limit_is_respected(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run("generate", "lines.py", "--no-build")
    (here / "cache" / "compilations" / ("0" * 64)).write_bytes(b"x" * 1_000_000)
    monkeypatch.setenv("GAC_CACHE_SIZE", "1")
    (here / "lines.py").write_text(SPEC.replace("def line", "def join"))
    assert run("generate", "lines.py", "--no-build").exit_code == 0
    assert "0" * 64 not in entries(here) and entries(here)
    assert sum(path.stat().st_size for path in (here / "cache" / "compilations").iterdir()) <= 1_000_000


@pytest.mark.parametrize("words", [*COMMANDS[:4], ("cache",), ("cache", "--clear")], ids=lambda words: "-".join(words))
def test_a_folder_that_others_can_write_is_an_error_of_one_line(words: tuple[str, ...], here: Path) -> None:
    (here / "cache").mkdir()
    (here / "cache").chmod(0o777)
    result = run(*words)
    assert result.exit_code == 1
    message = result.output.strip()
    assert message.startswith(f"gac: error: {here / 'cache'}: others may write to it") and message.count("\n") == 0
    assert "chmod 700" in message and not list((here / "cache").iterdir())
    if words[0] != "cache":
        assert run(*words, "--no-cache").exit_code == 0


def test_an_unusable_home_folder_is_reported_but_not_an_error(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("GAC_CACHE")
    monkeypatch.setenv("XDG_CACHE_HOME", str(here / "lines.py"))
    assert run("generate", "lines.py", "--no-build").exit_code == 0
    result = run("cache")
    assert result.exit_code == 0 and "nothing is cached" in result.output and "GAC_CACHE" in result.output
    assert json.loads(run("cache", "--json").output)["place"] is None
