"""Build the extension module that calls kernels, for one or several versions of Python."""

from __future__ import annotations

import json
import shlex
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from ..errors import BackendError
from ..gac_runtime.names import EXTENSION_FILE, EXTENSION_FLAGS, RUNTIME, extension_name
from .targets import Target

_QUESTION = """
import json, platform, sys, sysconfig
print(json.dumps([
    sys.implementation.name, platform.machine(), platform.system(), sysconfig.get_path("include"),
    sysconfig.get_config_var("EXT_SUFFIX"),
]))
"""


class Python(NamedTuple):
    """Properties of an interpreter that are needed to build an extension module for it."""

    implementation: str
    machine: str
    system: str
    include: str
    suffix: str
    """File name suffix of extension modules, such as ``.cpython-311-x86_64-linux-gnu.so``."""

    def is_for(self, target: Target) -> bool:
        """Whether a compiler for `target` can build extension modules for the interpreter."""
        machine = {"arm64": "aarch64", "AMD64": "x86_64"}.get(self.machine, self.machine)
        return (machine, self.system.lower()) == target

    @property
    def has_headers(self) -> bool:
        """Whether the headers needed to build an extension module are installed."""
        return self.implementation == "cpython" and (Path(self.include) / "Python.h").is_file()


def python_of(command: str) -> Python:
    """Query an interpreter, given by its command.

    Raises
    ------
    BackendError
        If the interpreter cannot be run.
    """
    try:
        done = subprocess.run([command, "-I", "-c", _QUESTION], capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError) as error:
        raise BackendError(command, f"it cannot be run: {error}", "a Python interpreter") from error
    return Python(*json.loads(done.stdout))


def build_extension(python: Python, compiler: Sequence[str], folder: Path) -> Path:
    """Compile the extension module for an interpreter into a folder, under the name that the runtime looks for.

    Raises
    ------
    BackendError
        If the compiler fails.
    """
    target = folder / f"{extension_name()}{python.suffix}"
    source = Path(__file__).parents[1] / RUNTIME / EXTENSION_FILE
    options = [*EXTENSION_FLAGS, f"-DINIT=PyInit_{extension_name()}", f"-I{python.include}", "-shared"]
    command = [*compiler, *options, str(source), "-o", str(target)]
    folder.mkdir(parents=True, exist_ok=True)
    done = subprocess.run(command, capture_output=True, text=True, errors="replace")
    if done.returncode:
        lines = [line for line in done.stderr.splitlines() if "error" in line]
        found = f"{command[0]} failed: {(lines or ['status ' + str(done.returncode)])[0].strip()}"
        raise BackendError(str(source), found, "a file that compiles", f"run {shlex.join(command)}")
    return target
