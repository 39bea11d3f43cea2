"""Every notebook runs in a fresh kernel and prints its stored output; `make notebooks` stores outputs."""

from __future__ import annotations

import base64
import json
import re
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

nbformat = pytest.importorskip("nbformat")
pytestmark = pytest.mark.skipif(
    not (find_spec("nbclient") and find_spec("ipykernel")), reason="no nbclient, or no ipykernel"
)

from stored_notebooks import (  # noqa: E402
    METADATA,
    NOTEBOOKS,
    ROOT,
    check_outputs,
    differences,
    missing_peers,
    normalised,
    same_text,
)

LARGEST, ALL = 400_000, 2_500_000
"""Bytes of one notebook, and of all."""
each_notebook = pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)


def read(path: Path) -> Any:
    return nbformat.read(path, as_version=4)


def outputs(notebook: Any) -> list[Any]:
    return [output for cell in notebook.cells for output in cell.get("outputs", [])]


def compares(path: Path) -> bool:
    """Whether a notebook compares with another library."""
    return '"peer:' in path.read_text()


@pytest.mark.parametrize(
    "path",
    [
        pytest.param(path, id=path.stem, marks=pytest.mark.peers if compares(path) else pytest.mark.slow)
        for path in NOTEBOOKS
    ],
)
def test_notebook_prints_its_stored_output(path: Path) -> None:
    assert not missing_peers(read(path))
    check_outputs(path)


@each_notebook
def test_the_needs_say_what_to_install(path: Path) -> None:
    """Packages that cells import without a tag are dependencies, or named with a command that installs them."""
    notebook = read(path)
    (needs,) = re.findall(r"^\*\*Needs\*\*(.*?)(?:\n\n|\Z)", notebook.cells[0].source, re.MULTILINE | re.DOTALL)
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    sources = "\n".join(c.source for c in cells if not any("peer:" in tag for tag in c.metadata.get("tags", ())))
    found = {name for name in re.findall(r"^ *(?:import|from) (\w+)", sources, re.MULTILINE)}
    found -= {
        "algorithms",
        "gacompiler",
        "generated",
        "numpy",
        "scipy",
        "sympy",
        "chessboard",
        "tests",
        *sys.stdlib_module_names,
    }
    packages = {
        "cv2": "gacompiler[peers]",
        "matplotlib": "gacompiler[pictures]",
        "skimage": "scikit-image",
        "pywt": "pywavelets",
    }
    commands = " ".join(re.findall(r"`(pip install .*?)`", needs))
    assert [name for name in found if packages[name] not in commands] == []


def test_there_are_twenty_three_notebooks_and_the_readme_counts_them() -> None:
    assert len(NOTEBOOKS) == 23
    assert "| `notebooks` | twenty-three " in (ROOT / "README.md").read_text()
    assert sum(path.stat().st_size for path in NOTEBOOKS) < ALL
    assert sum(map(compares, NOTEBOOKS)) >= 8


@each_notebook
def test_first_cell_names_readers_topic_and_requirements(path: Path) -> None:
    notebook = read(path)
    first, last = notebook.cells[0], notebook.cells[-1]
    assert first.cell_type == last.cell_type == "markdown"
    assert first.source.startswith("# ")
    assert [word for word in ("**For** ", "**Question** ", "**Needs** ") if word not in first.source] == []
    assert last.source.startswith("## Where to go next")


@each_notebook
def test_links_lead_to_files(path: Path) -> None:
    for cell in read(path).cells:
        if cell.cell_type == "markdown":
            for target in re.findall(r"\]\((?!https?:)([^)]+)\)", cell.source):
                assert (path.parent / target).is_file(), target


@each_notebook
def test_notebook_is_stored_with_outputs_and_without_volatile_metadata(path: Path) -> None:
    notebook = read(path)
    nbformat.validate(notebook)
    assert path.stat().st_size < LARGEST
    assert json.loads(path.read_text())["metadata"] == METADATA
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert [cell.execution_count for cell in code] == list(range(1, len(code) + 1))
    assert all(set(cell.metadata) <= {"tags"} for cell in notebook.cells)
    assert not [output for output in outputs(notebook) if output.get("name") == "stderr"]
    images = [output.data["image/png"] for output in outputs(notebook) if "image/png" in output.get("data", {})]
    assert len(images) >= 2
    assert all(base64.b64decode(image).startswith(b"\x89PNG") for image in images)
    assert " at 0x" not in "".join(json.dumps(output) for output in outputs(notebook))


def test_texts_are_equal_up_to_rounding() -> None:
    assert same_text("error 0.123, 5 of 7", "error 0.124, 5 of 7")
    assert same_text("1.00000000000000002e-05 -0.", "1.0000000000000001e-05 0.")
    assert not same_text("error 0.123", "error 0.125")
    assert not same_text("5 of 7", "6 of 7")
    assert not same_text("agrees: True", "agrees: False")
    assert not same_text("x_1 + 2", "x_2 + 2")
    assert not same_text("1 2", "1")


def test_differences_are_found() -> None:
    """A changed number, a missing image and a missing text are found, except in a cell whose peer is not installed."""

    def notebook(text: str, tag: str = "peer:numpy", image: str | None = None) -> Any:
        printed = nbformat.v4.new_output("stream", name="stdout", text=text)
        shown = [nbformat.v4.new_output("display_data", data={"image/png": image})] if image else []
        cell = nbformat.v4.new_code_cell("", outputs=[printed, *shown], metadata={"tags": [tag]})
        return nbformat.v4.new_notebook(cells=[cell])

    assert differences(notebook("12"), notebook("12")) == []
    assert len(differences(notebook("12"), notebook("13"))) == 1
    assert len(differences(notebook("12", image="A"), notebook("12"))) == 1
    assert differences(notebook("12", image="A"), notebook("12", image="B")) == []
    assert differences(notebook("12", "peer:no_such_module"), notebook("13", "peer:no_such_module")) == []


def test_progress_of_compilers_is_not_stored() -> None:
    def cell(text: str) -> Any:
        stderr = nbformat.v4.new_output("stream", name="stderr", text=text)
        return nbformat.v4.new_code_cell("", outputs=[stderr])

    notebook = normalised(nbformat.v4.new_notebook(cells=[cell("gac: building f (once)\n"), cell("a warning\n")]))
    assert [len(each.outputs) for each in notebook.cells] == [0, 1]
