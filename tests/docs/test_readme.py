"""A stranger pastes the blocks of the README: they run, are short, and print what their comments say."""

from __future__ import annotations

import re
import tomllib
from importlib.metadata import distribution
from pathlib import Path

import pytest
from click.testing import CliRunner
from packaging.requirements import Requirement
from website import motion
from wheel_examples import Environment

from gacompiler.cli import main

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "README.md").read_text()
WAYS = TEXT.partition("## Four starting points")[2].partition("\n## ")[0]
BLOCKS = re.findall(r"```python\n(.*?)```", WAYS, re.DOTALL)
EXAMPLES = [ROOT / "docs" / "examples" / f"{name}.py" for name in ("robot", "graphics", "kernel", "research")]
"""The four programs as files."""


def test_there_are_four_ways_in_of_at_most_eight_lines() -> None:
    assert len(BLOCKS) == 4 and sorted(EXAMPLES) == sorted((ROOT / "docs" / "examples").iterdir())
    assert [path.read_text() for path in EXAMPLES] == BLOCKS
    assert all(len([line for line in block.splitlines() if line]) <= 8 for block in BLOCKS)


def seen(k: int, printed: str, folder: Path) -> None:
    """A comment ``: [ ... ]`` was printed, and a file in quotes was written."""
    for wanted in re.findall(r"#.*?(\[[ \d.\-]+\])$", BLOCKS[k], re.MULTILINE):
        assert wanted.split() == printed.strip().splitlines()[-1].split()
    for name in re.findall(r'save\("(.*?)"\)', BLOCKS[k]):
        assert (folder / name).stat().st_size > 10_000
    assert printed or "save" in BLOCKS[k], "it shows something"


@pytest.mark.parametrize("k", range(4))
def test_a_way_in_runs_as_it_is(
    k: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Executed as an own program."""
    monkeypatch.chdir(tmp_path)
    exec(compile(BLOCKS[k], f"README.md: block {k}", "exec"), {"__name__": "__main__"})
    seen(k, capsys.readouterr().out, tmp_path)


@pytest.mark.slow
def test_the_dependencies_are_enough(tmp_path: Path) -> None:
    """Each program runs where only what `pip install gacompiler` requires is installed, without a C compiler."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    wanted, known = [Requirement(line).name for line in project["dependencies"]], set()
    while wanted:
        name = wanted.pop()
        if name not in known:
            known.add(name)
            lines = map(Requirement, distribution(name).requires or ())
            wanted += [line.name for line in lines if not line.marker or line.marker.evaluate({"extra": ""})]
    place = Environment(tmp_path / "venv")
    for name in known - {"numpy"}:
        for file in {entry.parts[0] for entry in distribution(name).files or ()} - {"..", "__pycache__"}:
            (place.site / file).symlink_to(str(distribution(name).locate_file(file)))
    (place.site / "source.pth").write_text(str(ROOT))
    assert place.run("import numba").returncode == 1 == place.run("import cffi").returncode
    for k, path in enumerate(EXAMPLES):
        seen(k, place.output(path.read_text(), GAC_BACKEND="arrays"), place.folder)


def test_the_starter_is_the_spec_of_the_readme(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """`gac new` writes the kernel that the README and the help of `gac` continue with."""
    monkeypatch.chdir(tmp_path)
    assert CliRunner().invoke(main, ["new", "my_kernels"]).exit_code == 0
    starter = (tmp_path / "my_kernels.py").read_text()
    (shown,) = re.findall(r"```python\n# my_kernels\.py\n(.*?)```", TEXT, re.DOTALL)
    assert starter.endswith(shown.partition("\n\n")[2])
    assert set(re.findall(r"my_kernels\.py:(\w+)", TEXT)) == {"move"}


def test_the_moving_picture_is_that_of_the_program() -> None:
    """`PYTHONPATH=docs python -m website.motion` was run; a corner keeps its distance from the line."""
    assert motion.picture() == motion.PICTURE.read_text()


def test_words_are_defined_before_they_are_used() -> None:
    head = TEXT.partition("## Install")[0]
    for word in ("kernel", "layout", "motor"):
        first = re.search(rf"\b{word}", head)
        assert first and head[first.start() - 1] in "*", f"{word}: {head[first.start() - 20 : first.end() + 20]!r}"
