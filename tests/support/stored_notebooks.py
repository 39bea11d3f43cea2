"""Execute the notebooks and store their outputs in a form that is reproducible (`make notebooks`).

The tests execute each notebook again and compare what it prints with what is stored. A cell that needs a library of the
extra `peers` has the tag ``peer:MODULE``; where that module is not installed, its outputs are not compared.
"""

from __future__ import annotations

import argparse
import base64
import io
import os
import re
import sys
from importlib.util import find_spec
from itertools import zip_longest
from pathlib import Path
from typing import Any

import nbformat
from PIL import Image

ROOT = Path(__file__).parents[2]
NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.ipynb"))
SECONDS = 120
"""A cell that takes longer is stopped."""
METADATA = {
    "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
    "language_info": {"name": "python"},
}
_SETUP = """\
%matplotlib inline
import matplotlib_inline.config
matplotlib_inline.config.InlineBackend.instance().print_figure_kwargs = {
    "dpi": 80, "bbox_inches": "tight", "metadata": {"Software": None}
}
del matplotlib_inline
"""
"""Executed before the first cell and not stored: small figures that do not name the version of matplotlib."""
_PEER = "peer:"
_NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d*)?(?:e[+-]?\d+)?(?![\w.])|(?<![\w.])-?\.\d+(?:e[+-]?\d+)?(?![\w.])")
_RELATIVE = 1e-9
"""Numbers within this relative tolerance are equal, for any number of printed digits."""


def peers_of(cell: Any) -> list[str]:
    """The modules that a cell needs and `make test` does not install."""
    tags = cell.metadata.get("tags", [])
    return [tag.removeprefix(_PEER) for tag in tags if tag.startswith(_PEER)]


def missing_peers(notebook: Any) -> list[str]:
    """The modules that cells of a notebook need and that are not installed."""
    return sorted({peer for cell in notebook.cells for peer in peers_of(cell) if find_spec(peer) is None})


def execute(path: Path) -> Any:
    """The notebook at `path`, executed in a fresh kernel and ready to be stored.

    Raises
    ------
    nbclient.exceptions.CellExecutionError
        Where a cell raises.
    """
    from nbclient import NotebookClient  # not where tests are collected

    notebook = nbformat.read(path, as_version=4)
    notebook.cells.insert(0, nbformat.v4.new_code_cell(_SETUP))
    client = NotebookClient(
        notebook,
        timeout=SECONDS,
        kernel_name="python3",
        record_timing=False,
        coalesce_streams=True,
        resources={"metadata": {"path": str(path.parent)}},
    )
    places = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])
    # Matrices are small: further threads of numpy would mostly wait for one another.
    client.execute(env={**os.environ, "PYTHONPATH": places, "OPENBLAS_NUM_THREADS": "1"})
    del notebook.cells[0]
    return normalised(notebook)


def normalised(notebook: Any) -> Any:
    """A notebook without the parts that depend on the kernel or on the number of executions."""
    notebook.metadata = nbformat.from_dict(METADATA)
    count = 0
    for cell in notebook.cells:
        tags = cell.metadata.get("tags", [])
        cell.metadata = nbformat.from_dict({"tags": tags} if tags else {})
        if cell.cell_type == "code":
            count += 1
            cell.execution_count = count
            cell.outputs = [output for output in cell.outputs if not _is_progress(output)]
            for output in cell.outputs:
                if output.output_type == "execute_result":
                    output.execution_count = count
                if "image/png" in output.get("data", {}):
                    output.data.pop("text/plain", None)
    return notebook


def _is_progress(output: Any) -> bool:
    """Whether an output only reports that a kernel is being compiled, which is printed if that takes long."""
    lines = output.text.splitlines() if output.get("name") == "stderr" else [""]
    return all(line.startswith("gac: building") for line in lines)


def _with_palette(image: str) -> str:
    """A PNG with at most 256 colours, which takes a third of the bytes; both in base64."""
    with Image.open(io.BytesIO(base64.b64decode(image))) as picture:
        few = picture.convert("RGB").quantize(256, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
    written = io.BytesIO()
    few.save(written, "PNG", optimize=True)
    return base64.b64encode(written.getvalue()).decode()


def differences(stored: Any, fresh: Any) -> list[str]:
    """List the differences between the outputs of two executions; for images, only whether they exist."""
    found = []
    for number, (old, new) in enumerate(zip(stored.cells, fresh.cells, strict=True), 1):
        if old.cell_type != "code" or any(find_spec(peer) is None for peer in peers_of(old)):
            continue
        for one, two in zip_longest(_texts(old), _texts(new), fillvalue="no output"):
            if not same_text(one, two):
                found.append(f"cell {number}: stored {one!r}, now {two!r}")
    return found


def check_outputs(path: Path) -> None:
    """Execute a notebook; raise an AssertionError if it warns or its output differs from the stored one."""
    fresh = execute(path)
    found = differences(nbformat.read(path, as_version=4), fresh)
    assert not found, "\n".join(
        [f"{path.name}: outputs are not those stored; if they are right, run `make notebooks`", *found]
    )
    warnings = [
        output.text for cell in fresh.cells for output in cell.get("outputs", []) if output.get("name") == "stderr"
    ]
    assert not warnings, f"{path.name}: warns: {warnings}"


def _texts(cell: Any) -> list[str]:
    texts = []
    for output in cell.outputs:
        if output.output_type == "stream":
            texts.append(f"{output.name}: {output.text}")
        else:
            data = output.get("data", {})
            texts += [kind if kind.startswith("image/") else f"{kind}: {data[kind]}" for kind in sorted(data)]
    return texts


def same_text(one: str, two: str) -> bool:
    """Whether two texts are equal up to rounding: numbers may differ by one unit in the last printed digit."""
    if _NUMBER.sub("#", one) != _NUMBER.sub("#", two):
        return False
    return all(_same_number(a, b) for a, b in zip(_NUMBER.findall(one), _NUMBER.findall(two), strict=True))


def _same_number(one: str, two: str) -> bool:
    if not re.search("[.e]", one + two):
        return int(one) == int(two)
    a, b = float(one), float(two)
    return abs(a - b) <= max(_RELATIVE * max(abs(a), abs(b)), 1.01 * min(_last_digit(one), _last_digit(two)))


def _last_digit(number: str) -> float:
    """The value of one unit of the last digit of a number."""
    mantissa, _, exponent = number.partition("e")
    return 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))


def main() -> None:
    """Execute notebooks and store their outputs."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("names", nargs="*", help="notebooks, without .ipynb; by default all")
    names = parser.parse_args().names
    unknown = sorted(set(names) - {path.stem for path in NOTEBOOKS})
    if unknown:
        sys.exit(f"no notebook {', '.join(unknown)}; there are {', '.join(path.stem for path in NOTEBOOKS)}")
    for path in NOTEBOOKS:
        if names and path.stem not in names:
            continue
        missing = missing_peers(nbformat.read(path, as_version=4))
        if missing:
            sys.exit(f"{path.name}: needs {', '.join(missing)} so that all outputs can be stored; make .venv/.peers")
        notebook = execute(path)
        for data in (output.data for cell in notebook.cells for output in cell.get("outputs", []) if "data" in output):
            if "image/png" in data:
                data["image/png"] = _with_palette(data["image/png"])
        nbformat.write(notebook, path)
        print(f"{path.name}: {path.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
