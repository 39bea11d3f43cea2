"""Compile a generated C file into the shared library that its module loads."""

from __future__ import annotations

import hashlib
import os
import shlex
import shutil
import subprocess
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from ..errors import BackendError

FLAGS = ("-O3", "-std=c17", "-fPIC", "-ffp-contract=off", "-fno-math-errno")
"""No flag depends on the machine: the loops carry code for wide vectors and choose when they are loaded."""

FOLDER = "_build"
"""Where libraries live, beside the module."""

COMPILERS = ("cc", "gcc", "clang")

NO_COMPILER = (
    "no C compiler: $CC is not set and none of cc, gcc, clang is on the PATH; install one, or run on numba as it is"
)


def library_name(module: str, c_text: str) -> str:
    """The file name of the library made of `c_text`: it changes with the text and the flags, so it is never stale."""
    digest = hashlib.sha256("\0".join([c_text, *FLAGS]).encode()).hexdigest()
    return f"{module}-{digest[:16]}.so"


def library_path(c_path: Path) -> Path:
    """Where the library of a C file belongs."""
    try:
        text = c_path.read_text(encoding="utf-8")
    except OSError as error:
        raise BackendError(str(c_path), error.strerror or str(error), "a generated C file") from error
    return c_path.parent / FOLDER / library_name(c_path.stem, text)


def find_compiler() -> tuple[str, ...] | None:
    """The command of the C compiler: ``$CC`` if set, else the first of cc, gcc, clang that is there."""
    wanted = shlex.split(os.environ.get("CC", ""))
    if wanted:
        return tuple(wanted) if shutil.which(wanted[0]) else None
    return next(((name,) for name in COMPILERS if shutil.which(name)), None)


def build_library(c_path: Path, *, force: bool = False) -> Path | None:
    """Compile `c_path` unless its library is there.

    Parameters
    ----------
    c_path : Path
        A generated C file; its header is beside it.
    force : bool
        Compile even if the library is there.

    Returns
    -------
    Path or None
        The library, or None where there is no compiler (`NO_COMPILER` says so in words).

    Raises
    ------
    BackendError
        When the file cannot be read, the folder not be written, or the compiler fails.
    """
    target = library_path(c_path)
    if target.exists() and not force:
        return target
    compiler = find_compiler()
    if compiler is None:
        return None
    try:
        target.parent.mkdir(exist_ok=True)
        scratch = Path(tempfile.mkdtemp(prefix=f".{c_path.stem}-", dir=target.parent))
    except OSError as error:
        raise BackendError(
            str(target.parent), error.strerror or str(error), "a folder that can be written", "choose another with -o"
        ) from error
    try:
        os.replace(_compile(compiler, c_path, scratch), target)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
    for stale in target.parent.glob(f"{c_path.stem}-{'[0-9a-f]' * 16}.so"):
        if stale != target:
            stale.unlink(missing_ok=True)
    return target


def _compile(compiler: tuple[str, ...], c_path: Path, folder: Path) -> Path:
    """The library in a scratch folder; the two precisions are compiled side by side."""
    objects = [folder / f"{only}.o" for only in ("f64", "f32")]
    commands = [
        [*compiler, *FLAGS, f"-DONLY_{part.stem.upper()}", "-c", str(c_path), "-o", str(part)] for part in objects
    ]
    library = folder / "library.so"
    for runs in (commands, [[*compiler, "-shared", *map(str, objects), "-o", str(library), "-lm"]]):
        with ThreadPoolExecutor() as threads:
            for command, run in zip(runs, threads.map(_run, runs), strict=True):
                _check(command, run, c_path)
    return library


def _run(command: list[str]) -> subprocess.CompletedProcess[str]:
    try:
        return subprocess.run(command, capture_output=True, text=True, errors="replace")
    except OSError as error:
        raise BackendError(command[0], error.strerror or str(error), "a C compiler") from error


def _check(command: list[str], run: subprocess.CompletedProcess[str], c_path: Path) -> None:
    if run.returncode == 0:
        return
    lines = run.stderr.splitlines()
    first = next((line for line in lines if "error" in line), lines[0] if lines else f"status {run.returncode}")
    raise BackendError(
        str(c_path), f"{command[0]} failed: {first.strip()}", "a file that compiles", f"run {shlex.join(command)}"
    )
