"""Compile libraries for the generated modules in a wheel, one for each processor level."""

from __future__ import annotations

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
from .targets import Target, compiler_target

LEVELS = tuple(level for level in LEVEL_FLAGS if level != PORTABLE)
"""The x86-64 levels for which a wheel contains libraries: 1 runs everywhere, 3 uses AVX2 and 4 uses AVX-512."""

Progress = Callable[[Path], None]


def module_folders(files: Mapping[str, bytes]) -> dict[str, list[str]]:
    """Return the folders of a wheel that contain a runtime and generated C files, with the names of these C files.

    Raises
    ------
    BackendError
        If there are none, or a runtime is not the one of this version. Runtimes of other versions look for libraries
        under other names.
    """
    found: dict[str, list[str]] = {}
    for path in map(PurePosixPath, sorted(files)):
        has_runtime = f"{path.parent / RUNTIME}/__init__.py" in files
        if path.suffix == ".c" and f"{path.with_suffix('.py')}" in files and has_runtime:
            found.setdefault(str(path.parent), []).append(path.name)
    if not found:
        raise BackendError("the wheel", "no generated C file next to a runtime in it", "files from `gac generate`")
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
    """Compile the generated modules in a wheel.

    Parameters
    ----------
    files : mapping of str to bytes
        The files by their paths in the wheel.
    levels : sequence of int
        Some of the x86-64 `LEVELS`; by default all. Other architectures have a single library.
    pythons : sequence of str
        Interpreters for which the extension module is built, which makes calls faster. The default is the running
        interpreter, if the compiler targets its architecture and its headers are installed. Other interpreters, and
        other versions of these, call kernels through ctypes.
    progress : callable
        Called with the path of each library.

    Returns
    -------
    platform : str
        The tag of the platform on which all of the libraries can be loaded.
    files : dict of str to bytes
        The libraries and extension modules, by their paths in the wheel.

    Raises
    ------
    BackendError
        If there is no compiler, the compiler fails, or an interpreter is for another architecture.
    """
    compiler = find_compiler()
    if compiler is None:
        raise BackendError("C compiler", no_compiler(), "a working compiler", "install one, or use --no-build")
    target, sources = compiler_target(compiler), module_folders(files)
    machine = target.machine
    # Elsewhere the level of a machine is not known, and libraries select their loops themselves.
    has_levels = target == Target("x86_64", "linux")
    if levels and not has_levels:
        found_target = f"it compiles for {target.system} on {machine}"
        raise BackendError(compiler[0], found_target, "linux on x86_64", "omit --target-level")
    found = [python_of(command) for command in (pythons or [sys.executable])]
    for command, python in zip(pythons, found, strict=False):
        if not python.is_for(target) or not python.has_headers:
            what = f"for {python.machine}" if not python.is_for(target) else "without the header Python.h"
            raise BackendError(command, f"a {python.implementation} {what}", f"a CPython for {machine}")
    usable = [python for python in found if python.is_for(target) and python.has_headers]
    with tempfile.TemporaryDirectory() as scratch:
        root = Path(scratch)
        for name, content in files.items():
            if any(PurePosixPath(name).is_relative_to(folder) for folder in sources):
                (root / name).parent.mkdir(parents=True, exist_ok=True)
                (root / name).write_bytes(content)
        c_files = [root / folder / name for folder, own in sources.items() for name in own]
        for level in (levels or LEVELS) if has_levels else (PORTABLE,):
            build_for_level({c_file: library_path(c_file, level) for c_file in c_files}, level, progress)
        for folder in sources:
            for python in usable:
                progress(build_extension(python, compiler, root / folder / FOLDER))
        built = sorted(path for folder in sources for path in (root / folder / FOLDER).iterdir())
        libraries = {path.relative_to(root).as_posix(): path.read_bytes() for path in built}
    return platform_tag(libraries.items()), libraries
