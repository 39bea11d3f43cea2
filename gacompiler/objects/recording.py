"""Recording of the operations that a program uses as a spec: ``gac record``.

The program runs in a separate process, in which initially no operation is compiled, so that all compiled operations are
those that the program uses.
"""

from __future__ import annotations

import json
import os
import runpy
import subprocess
import sys
import tempfile
import traceback
from collections.abc import Sequence
from pathlib import Path

from ..errors import SpecError
from .fusion import Recorder
from .operators import OBSERVERS, operators
from .spec_text import spec_text

FUSED, SEPARATE = "fused", "separate"


def record(script: Path, arguments: Sequence[str] = (), python: str = sys.executable, is_fused: bool = True) -> str:
    """Run a program and return a spec of kernels for its operations, in the order of their first use.

    Parameters
    ----------
    script : Path
        A Python file, which runs as the main program; its output is redirected to standard error.
    arguments : sequence of str
        Command-line arguments, ``sys.argv[1:]``.
    is_fused : bool
        Whether the operations of a function or statement of the program form one kernel; otherwise each operation does.

    Raises
    ------
    SpecError
        If the file does not exist, the program fails, or it used no kernel.
    """
    if not script.is_file():
        raise SpecError(str(script), "no such file", "a Python program that uses gacompiler.objects")
    with tempfile.TemporaryDirectory(prefix="gac-record-") as folder:
        result = Path(folder) / "result.json"
        command = [python, "-m", __name__, str(result), FUSED if is_fused else SEPARATE, str(script), *arguments]
        # As arrays, single objects have an address by which they are recognised.
        environment = {**os.environ, "GAC_BACKEND": "arrays"} if is_fused else None
        run = subprocess.run(
            command, env=environment, stdout=sys.stderr.fileno() if _has_file(sys.stderr) else subprocess.DEVNULL
        )
        if not result.is_file():
            raise SpecError(str(script), f"it ended with status {run.returncode} before recording was complete")
        found = json.loads(result.read_text())
    if found["failure"]:
        raise SpecError(found["where"], found["failure"], remedy="fix the program, then record it again")
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


def _main(result: str, mode: str, script: str, *arguments: str) -> None:
    """Run the program in the separate process, and write the spec or the error to a file."""
    sys.argv = [script, *arguments]
    sys.path[0] = str(Path(script).resolve().parent)
    recorder = Recorder(script)
    if mode == FUSED:
        OBSERVERS.append(recorder)
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
        OBSERVERS.clear()
        used = recorder.kernels if mode == FUSED else operators()
        found["spec"] = spec_text(Path(script).name, used) if used else ""
    Path(result).write_text(json.dumps(found))


if __name__ == "__main__":
    _main(*sys.argv[1:])
