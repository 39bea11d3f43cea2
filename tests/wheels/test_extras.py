"""What is said where the packages of an extra are not installed."""

from __future__ import annotations

import importlib.util
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest

from gacompiler.extras import COMPILER

ROOT = Path(__file__).parents[2]


@pytest.fixture
def hidden(monkeypatch: pytest.MonkeyPatch) -> set[str]:
    """Names of packages that are not found."""
    names: set[str] = set()
    found = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name in names else found(name))
    return names


def run(path: str) -> dict[str, Any]:
    """The names in a file once it has run."""
    names: dict[str, Any] = {}
    exec(compile((ROOT / path).read_text(), path, "exec"), names)
    return names


def test_nothing_is_said_where_all_is_there(hidden: set[str]) -> None:
    assert run("gacompiler/extras.py")["missing"] == run("algorithms/__init__.py")["_missing"] == []


def test_the_compiler_names_its_extra(hidden: set[str]) -> None:
    hidden |= {"click", "mpmath"}
    with pytest.raises(ImportError, match=r"gacompiler needs click, mpmath; run: pip install 'gacompiler\[compiler\]'"):
        run("gacompiler/extras.py")


def test_the_command_says_it_in_one_line(hidden: set[str], monkeypatch: pytest.MonkeyPatch) -> None:
    hidden |= {"jinja2"}
    monkeypatch.setattr(sys, "argv", ["/somewhere/bin/gac", "new", "kernels"])
    with pytest.raises(SystemExit, match=r"^gac: error: gacompiler needs jinja2; .*$"):
        run("gacompiler/extras.py")


def test_algorithms_name_their_extra(hidden: set[str]) -> None:
    hidden |= {"scipy", "numba"}
    with pytest.raises(ImportError, match=r"needs numba and scipy; run: pip install 'gacompiler\[algorithms\]'"):
        run("algorithms/__init__.py")


def test_extras_have_what_is_asked_for() -> None:
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    assert {"compiler", "algorithms", "pictures", "notebooks", "test", "peers", "docs"} == set(extras)
    named = {extra: {line.partition(">")[0] for line in lines} for extra, lines in extras.items()}
    assert set(COMPILER) <= named["compiler"]
    assert {"numba", "scipy"} <= named["algorithms"]
