"""Compile a generated C file into the shared library that its module loads."""

from __future__ import annotations

import hashlib
import os
import re
import shlex
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from pathlib import Path

from ..errors import BackendError
from ..gac_runtime.extension_file import FLAGS as EXTENSION_FLAGS
from ..gac_runtime.extension_file import FOLDER, SOURCE, extension_name, extension_path

FLAGS = ("-std=c17", "-fPIC", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math")
"""No flag depends on the machine: the loops carry code for wide vectors and choose when they are loaded. By the last
one, comparisons may be made where their branch is not taken; without, gcc makes no vectors of `turns_of_ellipse`."""

GCC_FLAGS = ("-O1", "-fexpensive-optimizations", "-ftree-loop-vectorize", "-fvect-cost-model=dynamic", "-fpeel-loops")
"""What vectorised straight-line code profits from: as fast as with -O3, and compiled in two thirds of the time. By the
second, gcc clears the upper halves of registers after a loop: without, what ran next took twice as long where it was
compiled for SSE, as scipy's transforms are."""

OTHER_FLAGS = ("-O3",)
"""What other compilers take instead."""

STEM = "calls"
"""The name of the extension; its file has a digest besides."""

COMPILERS = ("cc", "gcc", "clang")


def no_compiler() -> str:
    """Why `find_compiler` finds none, in words."""
    wanted = os.environ.get("CC", "").strip()
    if wanted:
        return f"no C compiler: $CC is {wanted!r}, which is no program on the PATH; set it to one, or unset it"
    names = ", ".join(COMPILERS)
    return f"no C compiler: $CC is not set and none of {names} is on the PATH; install one, or run on numba as it is"


def library_name(module: str, c_text: str) -> str:
    """The file name of the library made of `c_text`: it changes with the text and the flags, so it is never stale."""
    digest = hashlib.sha256("\0".join([c_text, *FLAGS, *GCC_FLAGS, *OTHER_FLAGS]).encode()).hexdigest()
    return f"{module}-{digest[:16]}.so"


_extensions: dict[str, Path] = {}
"""What this process has built, by file name: another folder gets a copy."""


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


@cache
def compiler_flags(compiler: tuple[str, ...]) -> tuple[str, ...]:
    """`FLAGS` and those of the optimiser, of which gcc takes its own."""
    run = _run([*compiler, "--version"])
    return (*FLAGS, *(GCC_FLAGS if "Free Software Foundation" in run.stdout else OTHER_FLAGS))


def processors() -> int:
    """How many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def build_library(c_path: Path, *, force: bool = False) -> Path | None:
    """Compile `c_path` unless its library is there; as `build_libraries` of one file."""
    return build_libraries([c_path], force=force)[0]


def build_libraries(c_paths: Sequence[Path], *, force: bool = False) -> list[Path | None]:
    """Compile C files whose libraries are not there, on all processors.

    Parameters
    ----------
    c_paths : sequence of Path
        Generated C files; the header of each is beside it.
    force : bool
        Compile even if the library is there.

    Returns
    -------
    list of Path or None
        The library of each, or None where it is not there and neither is a compiler (`no_compiler` says why).

    Raises
    ------
    BackendError
        When a file cannot be read, a folder not be written, or the compiler fails; the other files are built.

    Notes
    -----
    The extension that calls kernels is built beside them, if the headers of Python are there.
    """
    targets = [library_path(c_path) for c_path in c_paths]
    wanted = [(source, target) for source, target in zip(c_paths, targets, strict=True) if force or not target.exists()]
    compiler = find_compiler()
    if compiler is not None and wanted:
        _build(compiler, dict(wanted))
    if compiler is not None:
        for folder in dict.fromkeys(source.parent for source in c_paths):
            build_extension(compiler, folder)
    return [target if compiler is not None or target.exists() else None for target in targets]


def _build(compiler: tuple[str, ...], targets: dict[Path, Path]) -> None:
    """Compile everything in parallel, the longest first, then link and move each library to its place."""
    scratch: dict[Path, Path] = {}
    try:
        for source, target in targets.items():
            scratch[source] = _scratch(source, target.parent)
        jobs = []
        for source, folder in scratch.items():
            text = source.read_text(encoding="utf-8")
            # Both precisions side by side; a file that cannot be halved would give every symbol twice.
            halves = ("f64", "f32") if all(f"#ifndef ONLY_{only}" in text for only in ("F32", "F64")) else ("all",)
            jobs += [(len(text), source, folder / f"{half}.o") for half in halves]
        jobs.sort(key=lambda job: -job[0])
        commands = [
            [*compiler, *compiler_flags(compiler), f"-DONLY_{part.stem.upper()}", "-c", str(source), "-o", str(part)]
            for _, source, part in jobs
        ]
        with ThreadPoolExecutor(processors()) as threads:
            runs = list(threads.map(_run, commands))
        failures: list[BackendError] = []
        for source, target in targets.items():
            library = scratch[source] / "library.so"
            objects = [part for _, owner, part in jobs if owner == source]
            link = [*compiler, "-shared", *map(str, objects), "-o", str(library), "-lm"]
            try:
                for command, run, job in zip(commands, runs, jobs, strict=True):
                    if job[1] == source:
                        _check(command, run, source)
                _check(link, _run(link), source)
            except BackendError as error:
                failures.append(error)
                continue
            os.replace(library, target)
            for stale in target.parent.glob(f"{source.stem}-{'[0-9a-f]' * 16}.so"):
                if stale != target:
                    stale.unlink(missing_ok=True)
        if failures:
            raise failures[0]
    finally:
        for folder in scratch.values():
            shutil.rmtree(folder, ignore_errors=True)


def build_extension(compiler: tuple[str, ...], folder: Path) -> Path | None:
    """Compile the extension for modules in `folder` unless it is there; None where this Python has no headers."""
    include, target = Path(sysconfig.get_path("include")), extension_path(folder)
    if sys.implementation.name != "cpython" or not (include / "Python.h").is_file():
        return None
    if target.exists():
        return target
    scratch = _scratch(Path(STEM), target.parent)
    try:
        source, built = scratch / f"{STEM}.c", scratch / target.name
        known = _extensions.get(target.name)
        if known is not None and known.exists():
            shutil.copyfile(known, built)
        else:
            shutil.copyfile(SOURCE, source)
            undefined = ["-undefined", "dynamic_lookup"] if sys.platform == "darwin" else []
            options = [*EXTENSION_FLAGS, f"-DINIT=PyInit_{extension_name()}", f"-I{include}", "-shared", *undefined]
            command = [*compiler, *options, str(source), "-o", str(built)]
            _check(command, _run(command), source)
        os.replace(built, target)
        _extensions[target.name] = target
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
    suffix = target.name.removeprefix(extension_name())
    for stale in target.parent.glob(f"{STEM}_{'[0-9a-f]' * 16}{suffix}"):
        if stale != target:
            stale.unlink(missing_ok=True)
    return target


def _scratch(source: Path, folder: Path) -> Path:
    try:
        folder.mkdir(exist_ok=True)
        return Path(tempfile.mkdtemp(prefix=f".{source.stem}-", dir=folder))
    except OSError as error:
        raise BackendError(
            str(folder), error.strerror or str(error), "a folder that can be written", "choose another with -o"
        ) from error


def _run(command: list[str]) -> subprocess.CompletedProcess[str]:
    try:
        return subprocess.run(command, capture_output=True, text=True, errors="replace")
    except OSError as error:
        raise BackendError(command[0], error.strerror or str(error), "a C compiler") from error


def _check(command: list[str], run: subprocess.CompletedProcess[str], c_path: Path) -> None:
    if run.returncode == 0:
        return
    # gcc's last line, "collect2: error: ld returned 1", only says that the linker said something above.
    lines = [line for line in run.stderr.splitlines() if line.strip() and not line.startswith("collect2:")]
    telling = (line for line in lines if re.search(r"error|multiple definition|undefined|cannot find|No space", line))
    first = next(telling, lines[0] if lines else f"status {run.returncode}")
    raise BackendError(
        str(c_path), f"{command[0]} failed: {first.strip()}", "a file that compiles", f"run {shlex.join(command)}"
    )
