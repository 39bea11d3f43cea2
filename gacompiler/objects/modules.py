"""An operation as a generated module, made by another process: the search for the best kernel takes a second."""

from __future__ import annotations

import hashlib
import os
import sys
import tempfile
from functools import partial
from pathlib import Path
from typing import Any

from ..runtime import load_module
from .background import Job
from .native import own_folder
from .spec_text import Operation, spec_text

_COMPILE = """\
import os, sys
spec, target = sys.argv[1:3]
sys.path[:] = sys.argv[3:]
from pathlib import Path
from gacompiler.generation.spec_files import load_spec
from gacompiler.runtime import compile
try:
    (kernel,) = load_spec(Path(spec)).kernels
    compile(kernel, "c")
except BaseException:
    os.remove(spec)
    raise
(path,) = (module.__file__ for name, module in sys.modules.items() if name.startswith(f"_gac_{kernel.name}_"))
Path(spec).write_text(path)
os.replace(spec, target)
"""


def module_job(operator: Operation) -> Job:
    """The making of a module with one operation; the file that is made has the module's path in it.

    Raises
    ------
    SpecError
        When the operation cannot be written down, since a layout is made of functions and has no name.
    """
    text = spec_text(operator.kernel.name, [operator])
    target = own_folder() / f"{hashlib.sha256(text.encode()).hexdigest()[:24]}.path"
    target.unlink(missing_ok=True)  # another version of the compiler may have made it
    return Job(target, partial(_prepared, target, text))


def _prepared(target: Path, text: str) -> list[str]:
    handle, spec = tempfile.mkstemp(dir=target.parent, prefix=f"spec_{target.stem}_", suffix=".py")
    with os.fdopen(handle, "w", encoding="utf-8") as stream:
        stream.write(text)
    return [sys.executable or "python3", "-c", _COMPILE, spec, str(target), *sys.path]


def load_made(job: Job, name: str) -> Any:
    """The function of a module that was made."""
    path = Path(job.target.read_text(encoding="utf-8"))
    return getattr(load_module(path, f"_gac_{path.parent.name}_c", "c"), name)
