"""Compiled libraries for the generated modules in a wheel, one for each level of processors."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path, PurePosixPath

from ..backends import find_compiler, no_compiler, runtime_files
from ..backends.build import build_for_level, library_path
from ..errors import BackendError
from ..gac_runtime.names import FOLDER, LEVEL_FLAGS, RUNTIME
from ..gac_runtime.processor import PORTABLE
from .extensions import build_extension, python_of
from .platforms import platform_tag

LEVELS = tuple(level for level in LEVEL_FLAGS if level != PORTABLE)
"""The levels of x86-64 that a wheel has libraries for: 1 runs everywhere, 3 has AVX2, 4 has AVX-512."""

Progress = Callable[[Path], None]


def compiler_machine(compiler: Sequence[str]) -> str:
    """The machines that a compiler compiles for: ``x86_64``, ``aarch64``."""
    done = subprocess.run([*compiler, "-dumpmachine"], capture_output=True, text=True)
    if done.returncode or not done.stdout.strip():
        raise BackendError(compiler[0], "it does not say for which machines it compiles", "gcc or clang")
    return done.stdout.partition("-")[0].strip()


def module_folders(files: Mapping[str, bytes]) -> dict[str, list[str]]:
    """The folders of a wheel that have a runtime and generated C beside it, with the names of these C files.

    Raises
    ------
    BackendError
        When there are none, or when a runtime is not that of this version, whose libraries have other names.
    """
    found: dict[str, list[str]] = {}
    for path in map(PurePosixPath, sorted(files)):
        has_runtime = f"{path.parent / RUNTIME}/__init__.py" in files
        if path.suffix == ".c" and f"{path.with_suffix('.py')}" in files and has_runtime:
            found.setdefault(str(path.parent), []).append(path.name)
    if not found:
        raise BackendError("the wheel", "no generated C file beside a runtime in it", "what `gac generate` writes")
    for folder in found:
        for part, text in runtime_files().items():
            name = str(PurePosixPath(folder) / part)
            if files.get(name) != text.encode():
                raise BackendError(
                    name, "not the runtime of this version of gacompiler", "the same text",
                    "write the modules again with `gac generate`",
                )  # fmt: skip
    return found


def compiled_files(
    files: Mapping[str, bytes],
    levels: Sequence[int] = (),
    pythons: Sequence[str] = (),
    progress: Progress = lambda library: None,
) -> tuple[str, dict[str, bytes]]:
    """Compile the generated modules among the files of a wheel.

    Parameters
    ----------
    files : mapping of str to bytes
        By their path in the wheel.
    levels : sequence of int
        Of x86-64, some of `LEVELS`; by default all. Other machines have one library for all.
    pythons : sequence of str
        Interpreters for which the extension is built, by which calls are shorter; by default the one that runs this,
        where it is for the machines of the compiler and has its headers. With others, and on interpreters of other
        versions, kernels are called through ctypes.
    progress : callable
        Called with each library.

    Returns
    -------
    platform : str
        The tag of the platform on which all of the libraries can be loaded.
    files : dict of str to bytes
        The libraries and extensions, by their path in the wheel.

    Raises
    ------
    BackendError
        When there is no compiler, when it fails, or when an interpreter is for other machines.
    """
    compiler = find_compiler()
    if compiler is None:
        raise BackendError("C compiler", no_compiler(), "one that can be run", "or give --no-build")
    machine, sources = compiler_machine(compiler), module_folders(files)
    if levels and machine != "x86_64":
        raise BackendError(compiler[0], f"it compiles for {machine}", "x86_64, which has levels", "give no level")
    found = [python_of(command) for command in (pythons or [sys.executable])]
    for command, python in zip(pythons, found, strict=False):
        if python.machine != machine or not python.has_headers:
            what = f"for {python.machine}" if python.machine != machine else "without the header Python.h"
            raise BackendError(command, f"a {python.implementation} {what}", f"a CPython for {machine}")
    usable = [python for python in found if python.machine == machine and python.has_headers]
    with tempfile.TemporaryDirectory() as scratch:
        root = Path(scratch)
        for name, content in files.items():
            if any(PurePosixPath(name).is_relative_to(folder) for folder in sources):
                (root / name).parent.mkdir(parents=True, exist_ok=True)
                (root / name).write_bytes(content)
        c_files = [root / folder / name for folder, own in sources.items() for name in own]
        for level in (levels or LEVELS) if machine == "x86_64" else (PORTABLE,):
            build_for_level({c_file: library_path(c_file, level) for c_file in c_files}, level, progress)
        for folder in sources:
            for python in usable:
                progress(build_extension(python, compiler, root / folder / FOLDER))
        built = sorted(path for folder in sources for path in (root / folder / FOLDER).iterdir())
        libraries = {path.relative_to(root).as_posix(): path.read_bytes() for path in built}
    return platform_tag(libraries.items()), libraries
