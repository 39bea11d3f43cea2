"""The conda recipe requires what the metadata of the project require."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest

import gacompiler

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "docs" / "conda"
METADATA = tomllib.loads((ROOT / "pyproject.toml").read_text())


@pytest.fixture(scope="module")
def recipe() -> Any:
    yaml = pytest.importorskip("yaml")
    return yaml.safe_load((FOLDER / "recipe.yaml").read_text())


def as_conda(line: str) -> str:
    """A requirement with a space between its name and its bounds."""
    return re.sub(r"(?<=[\w-])(?=[<>=])", " ", line, count=1)


def test_requirements(recipe: Any) -> None:
    project = METADATA["project"]
    wanted = [*project["dependencies"], *project["optional-dependencies"]["compiler"]]
    python = f"python {project['requires-python']}"
    assert sorted(recipe["requirements"]["run"]) == sorted([python, *map(as_conda, wanted)])
    build = [as_conda(line) for line in METADATA["build-system"]["requires"]]
    assert sorted(recipe["requirements"]["host"]) == sorted([python, "pip", *build])


def test_facts(recipe: Any) -> None:
    project = METADATA["project"]
    assert recipe["context"]["version"] == gacompiler.__version__
    assert recipe["about"]["summary"] == project["description"] and recipe["about"]["license"] == project["license"]
    scripts = [f"{name} = {place}" for name, place in project["scripts"].items()]
    assert recipe["build"]["python"]["entry_points"] == scripts
    assert (FOLDER / recipe["source"]["path"] / "pyproject.toml").is_file()
    assert (ROOT / recipe["about"]["license_file"]).is_file()
