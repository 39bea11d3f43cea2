"""What a program used, as a spec: ``gac record``.

The program runs in a process of its own, where nothing is compiled yet, so that what is compiled is what it used.
"""

from __future__ import annotations

import json
import runpy
import subprocess
import sys
import tempfile
import traceback
from collections.abc import Sequence
from pathlib import Path

from ..errors import SpecError
from .operators import operators
from .spec_text import spec_text


def record(script: Path, arguments: Sequence[str] = (), python: str = sys.executable) -> str:
    """Run a program and give the spec of the kernels that it used, in the order of their first use.

    Parameters
    ----------
    script : Path
        A Python file; it runs as if it were called by its name, with what it prints on standard error.
    arguments : sequence of str
        What it finds in ``sys.argv[1:]``.

    Raises
    ------
    SpecError
        When there is no such file, the program fails, or it used no kernel.
    """
    if not script.is_file():
        raise SpecError(str(script), "no such file", "a Python program that uses gacompiler.objects")
    with tempfile.TemporaryDirectory(prefix="gac-record-") as folder:
        result = Path(folder) / "result.json"
        command = [python, "-m", __name__, str(result), str(script), *arguments]
        run = subprocess.run(command, stdout=sys.stderr.fileno() if _has_file(sys.stderr) else subprocess.DEVNULL)
        if not result.is_file():
            raise SpecError(str(script), f"it ended with status {run.returncode} before it was done")
        found = json.loads(result.read_text())
    if found["failure"]:
        raise SpecError(found["where"], found["failure"], remedy="mend the program, then record it again")
    if not found["spec"]:
        raise SpecError(
            str(script), "it used no kernel", "operations on multivectors of gacompiler.objects",
            "see docs/objects.md",
        )  # fmt: skip
    return str(found["spec"])


def _has_file(stream: object) -> bool:
    try:
        stream.fileno()  # type: ignore[attr-defined]
    except (OSError, AttributeError, ValueError):
        return False
    return True


def _main(result: str, script: str, *arguments: str) -> None:
    """In the process of its own: run the program, and leave the spec or what went wrong in a file."""
    sys.argv = [script, *arguments]
    sys.path[0] = str(Path(script).resolve().parent)
    found = {"spec": "", "failure": "", "where": script}
    try:
        runpy.run_path(script, run_name="__main__")
    except SystemExit as end:
        if end.code not in (None, 0):
            found["failure"] = f"it ended with status {end.code}"
    except BaseException as error:
        frames = [f for f in traceback.extract_tb(error.__traceback__) if f.filename == script]
        found["where"] = f"{script}:{frames[-1].lineno}" if frames else script
        found["failure"] = f"{type(error).__name__}: {error}"
    if not found["failure"] and operators():
        found["spec"] = spec_text(Path(script).name, operators())
    Path(result).write_text(json.dumps(found))


if __name__ == "__main__":
    _main(*sys.argv[1:])
