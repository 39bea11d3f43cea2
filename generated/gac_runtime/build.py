"""Compile generated C files into the libraries that their modules load; each file is compiled separately and once.

The runtime (``gac_runtime.c``) is compiled into object files, which are stored in the user's cache. The C file of a
module is compiled and linked with them into ``_build`` next to it, or into the cache if that folder is not writable.
Files are never incomplete: they are written under a temporary name and renamed, and a lock prevents two processes from
building the same file.

This file ships with generated modules and imports nothing from the compiler. Keys, locks and commands depend on each
other, so they are in one file.
"""

from __future__ import annotations

import contextlib
import os
import re
import shlex
import shutil
import stat
import subprocess
import sys
import sysconfig
import tempfile
import threading
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from pathlib import Path

from .cache import CacheError, RuntimeProblem, cache_folder
from .names import (
    EXTENSION_FILE,
    EXTENSION_FLAGS,
    FLAGS,
    FOLDER,
    GCC_FLAGS,
    LEVEL_FLAGS,
    OTHER_FLAGS,
    RUNTIME,
    RUNTIME_FILES,
    STANDALONE,
    digest,
    extension_name,
    extension_path,
    library_file,
    library_files,
    library_label,
)
from .processor import PORTABLE, machine_level

COMPILERS = ("cc", "gcc", "clang")

Progress = Callable[[Path], None]

STEM = "calls"
"""The name of the extension, to which its file name adds a digest."""

_SMALL = 40_000
"""Number of characters from which a file is compiled separately for each precision, in parallel."""

_PATIENCE = 1.0
"""Seconds after which a message about the build is printed."""

_ERROR = re.compile(
    r"(^|[\s:])(fatal )?error:|multiple definition of|undefined (reference|symbol)|cannot find|No space left"
)
"""A message of a compiler or linker that names the cause; paths that contain the word "error" do not match."""


class BuildError(RuntimeProblem):
    """A compiler failed, or a file cannot be read or written."""


def is_wanted() -> bool:
    """Whether GAC_BACKEND is unset or selects C."""
    return os.environ.get("GAC_BACKEND", "") in ("", "c")


def find_compiler() -> tuple[str, ...] | None:
    """Return the command of the C compiler: ``$CC`` if set, else the first of cc, gcc, clang that is installed."""
    wanted = shlex.split(os.environ.get("CC", ""))
    if wanted:
        return tuple(wanted) if shutil.which(wanted[0]) else None
    return next(((name,) for name in COMPILERS if shutil.which(name)), None)


def no_compiler() -> str:
    """Return a message that explains why `find_compiler` returned None."""
    wanted = os.environ.get("CC", "").strip()
    if wanted:
        return f"no C compiler: $CC is {wanted!r}, which is not a program on the PATH; set it to one, or unset it"
    names = ", ".join(COMPILERS)
    return f"no C compiler: $CC is not set and none of {names} is on the PATH; install one, or continue with numba"


@cache
def _version(compiler: tuple[str, ...]) -> str:
    return _run([*compiler, "--version"]).stdout


def compiler_flags(compiler: tuple[str, ...]) -> tuple[str, ...]:
    """Return `FLAGS` and the optimisation flags for the compiler."""
    return (*FLAGS, *(GCC_FLAGS if "Free Software Foundation" in _version(compiler) else OTHER_FLAGS))


def processors() -> int:
    """Return the number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


# Locations of files.


def runtime_folder(c_file: Path) -> Path:
    """Return the folder of the runtime with which a module is compiled: the one next to it, or that of this file.

    For a C file that contains the runtime, this is the folder of the C file, which has no separate runtime.
    """
    if STANDALONE in _read(c_file):
        return c_file.parent
    beside = c_file.parent / RUNTIME
    return beside if (beside / RUNTIME_FILES[0]).is_file() else Path(__file__).parent


@cache
def _texts(folder: Path, names: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(_read(folder / name) for name in names)


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except OSError as error:
        raise BuildError(str(path), error.strerror or str(error), "a generated C file") from error


def library_name(module: str, c_text: str, runtime: Path | None = None, level: int = PORTABLE, only: str = "") -> str:
    """Return the file name of a library, which depends on the text, the runtime and the flags and is never stale."""
    return library_file(library_label(module, c_text), runtime or Path(__file__).parent, level, only)


def library_path(c_file: Path, level: int | None = None, only: str = "") -> Path:
    """Return the path next to a C file for its library, for this machine or for machines of a given level."""
    level = machine_level() if level is None else level
    return c_file.parent / FOLDER / library_name(c_file.stem, _read(c_file), runtime_folder(c_file), level, only)


def library_beside(c_file: Path, only: str = "") -> Path | None:
    """Return the built library next to a C file that this machine can load; None if there is none."""
    names = library_files(library_label(c_file.stem, _read(c_file)), runtime_folder(c_file), only)
    places = (c_file.parent / FOLDER / name for name in names)
    return next((path for path in places if path.exists()), None)


def cached_path(c_file: Path, only: str = "") -> Path | None:
    """Return the path in the user's cache for the library of a C file; None without a compiler.

    The path depends on the version of the compiler.

    Raises
    ------
    CacheError
        If the cache cannot be used, or not safely.
    """
    compiler = find_compiler()
    if compiler is None:
        return None
    name = library_path(c_file, only=only).stem
    return cache_folder("libraries") / f"{name}-{digest(_version(compiler), *compiler)}.so"


def built_library(c_file: Path, only: str = "") -> Path | None:
    """Return the built library of a C file, next to the file or in the user's cache; None if it is not built."""
    beside = library_beside(c_file, only)
    if beside is not None:
        return beside
    with contextlib.suppress(CacheError):
        cached = cached_path(c_file, only)
        if cached is not None and cached.exists():
            return cached
    return None


def _is_open(folder: Path) -> bool:
    """Whether a library may be built in a folder: it is writable, but not by all users."""
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    return os.access(folder, os.W_OK) and not (os.name == "posix" and folder.stat().st_mode & stat.S_IWOTH)


# Building.


def build_module(c_file: Path, only: str = "") -> Path | None:
    """Return the library of a generated C file, after building it if necessary.

    Parameters
    ----------
    c_file : Path
        The C file, with its header in the same folder. The runtime is the one next to it, or that of this file.
    only : str
        The precision whose functions suffice, "f64" or "f32", which are compiled in half the time; empty for both.

    Returns
    -------
    Path or None
        The library, next to the file or in the user's cache; None if it is not built and there is no compiler.

    Raises
    ------
    BuildError
        If the compiler fails.
    CacheError
        If the folder of the file is not writable, or writable by all users, and the cache cannot be used either.

    Notes
    -----
    If the build takes more than a second, a message is printed to stderr.
    """
    found = built_library(c_file) or (built_library(c_file, only) if only else None)
    if found is not None or find_compiler() is None:
        return found
    beside = library_path(c_file, only=only)
    target = beside if _is_open(beside.parent) else cached_path(c_file, only)
    assert target is not None
    with _lock(target.name):
        if not target.exists():
            with _announced(c_file.stem):
                build({c_file: target}, only=only)
    return target


def build_modules(
    c_files: Sequence[Path],
    *,
    force: bool = False,
    portable: bool = False,
    only: str = "",
    progress: Progress = lambda library: None,
) -> list[Path | None]:
    """Return the libraries of several C files next to them, building missing ones in parallel; see `build_module`.

    The libraries are for machines of this level, or for all machines if `portable` is true. The extension that calls
    kernels is built next to them if the Python headers are installed.
    """
    level = PORTABLE if portable else machine_level()
    targets = [library_path(c_file, level, only) for c_file in c_files]
    if not portable and not force:
        targets = [
            library_beside(source) or library_beside(source, only) or target
            for source, target in zip(c_files, targets, strict=True)
        ]
    wanted = {source: target for source, target in zip(c_files, targets, strict=True) if force or not target.exists()}
    has_compiler = find_compiler() is not None
    if has_compiler and wanted:
        build(wanted, progress, level, only)
    if has_compiler:
        for folder in dict.fromkeys(source.parent for source in c_files):
            build_extension(folder)
    return [target if has_compiler or target.exists() else None for target in targets]


def build(
    targets: dict[Path, Path],
    progress: Progress = lambda library: None,
    level: int | None = None,
    only: str = "",
) -> None:
    """Compile files in parallel, the longest first, link each with the runtime and move it to its destination.

    Parameters
    ----------
    targets : dict of Path to Path
        The library of each file.
    progress : callable
        Called with each library when it is finished.
    level : int, optional
        The level of the target machines; `PORTABLE` for all machines, by default the level of this machine.
    only : str
        The precision whose functions are compiled, "f64" or "f32"; empty for both.

    Raises
    ------
    BuildError
        If one of the files fails; the others are still built.
    """
    compiler = find_compiler()
    if compiler is None:
        raise BuildError("C compiler", no_compiler(), "an installed C compiler")
    level = machine_level() if level is None else level
    scratch: dict[Path, Path] = {}
    try:
        jobs = []
        for source, target in targets.items():
            scratch[source] = _scratch(source.stem, target.parent)
            text = _read(source)
            can_be_halved = all(f"#ifndef ONLY_{only}" in text for only in ("F32", "F64"))
            halves = (only,) if only else ("f64", "f32") if len(text) >= _SMALL else ("all",)
            parts = halves if can_be_halved else ("all",)
            jobs += [(len(text), source, scratch[source] / f"{part}.o") for part in parts]
        jobs.sort(key=lambda job: -job[0])
        kinds = {part.stem for *_, part in jobs}
        precisions = tuple(kinds) if len(kinds) == 1 and "all" not in kinds else ("f64", "f32")
        missing = Counter(source for _, source, _ in jobs)
        failures: list[BuildError] = []
        with ThreadPoolExecutor(processors()) as threads:
            # The runtime comes first because every library depends on it.
            runtimes = {}
            for source, folder in scratch.items():
                runtime = runtime_folder(source)
                if runtime not in runtimes and (runtime / RUNTIME_FILES[0]).is_file():
                    runtimes[runtime] = [
                        threads.submit(_runtime_object, compiler, level, runtime, precision, folder)
                        for precision in precisions
                    ]
            commands = [_compile(compiler, level, source, part, runtime_folder(source)) for _, source, part in jobs]
            runs: dict[Path, list[tuple[list[str], subprocess.CompletedProcess[str]]]] = {}
            for (_, source, _), command, run in zip(jobs, commands, threads.map(_run, commands), strict=True):
                runs.setdefault(source, []).append((command, run))
                missing[source] -= 1
                if missing[source]:
                    continue
                try:
                    for each in runs[source]:
                        _check(*each, source)
                    objects = [part for _, owner, part in jobs if owner == source]
                    objects += [future.result() for future in runtimes.get(runtime_folder(source), [])]
                    _link(compiler, objects, scratch[source] / "library.so", source)
                except BuildError as error:
                    failures.append(error)
                    continue
                target = targets[source]
                os.replace(scratch[source] / "library.so", target)
                if not only:
                    for half in ("f64", "f32"):
                        library_path(source, level, half).unlink(missing_ok=True)
                _remove_stale(
                    target,
                    rf"{re.escape(source.stem)}-[0-9a-f]{{16}}(-[0-9a-f]{{16}}(-v\d)?(-f\d\d)?)?\.so",
                    re.sub(r"(-v\d)?(-f\d\d)?\.so$", "", target.name),
                )
                progress(target)
        if failures:
            raise failures[0]
    finally:
        for folder in scratch.values():
            shutil.rmtree(folder, ignore_errors=True)


def _link(compiler: tuple[str, ...], objects: Sequence[Path], library: Path, source: Path) -> None:
    command = [*compiler, "-shared", *map(str, objects), "-o", str(library), "-lm"]
    _check(command, _run(command), source)


def _compile(compiler: tuple[str, ...], level: int, source: Path, target: Path, runtime: Path) -> list[str]:
    """Return the command that compiles a file for the precision in the name of its target, or for both."""
    only = f"-DONLY_{target.stem.rpartition('-')[2].upper()}"
    # "gac_runtime/gac_runtime.h" is searched in the folder of the C file, then in the folder of the runtime's package.
    flags = (*compiler_flags(compiler), *LEVEL_FLAGS[level])
    return [*compiler, *flags, f"-I{runtime.parent}", only, "-c", str(source), "-o", str(target)]


def _runtime_object(compiler: tuple[str, ...], level: int, runtime: Path, half: str, scratch: Path) -> Path:
    """Return the compiled runtime for one precision, in the user's cache or, without a usable cache, in `scratch`."""
    key = digest(
        *_texts(runtime, RUNTIME_FILES), _version(compiler), *compiler, *compiler_flags(compiler), *LEVEL_FLAGS[level]
    )
    name = f"gac_runtime-{key}-{half}.o"
    try:
        folder = cache_folder("runtime")
    except CacheError:
        folder = scratch
    target = folder / name
    with _lock(name):
        if not target.exists():
            own = _scratch(RUNTIME, folder)
            try:
                command = _compile(compiler, level, runtime / RUNTIME_FILES[1], own / name, runtime)
                _check(command, _run(command), runtime / RUNTIME_FILES[1])
                os.replace(own / name, target)
            finally:
                shutil.rmtree(own, ignore_errors=True)
    return target


# The extension.

_extensions: dict[str, Path] = {}
"""Extensions built by this process, by file name; other folders get a copy."""


def build_extension(folder: Path) -> Path | None:
    """Compile the extension for modules in `folder` unless it exists.

    Returns
    -------
    Path or None
        The extension; None if the Python headers or a compiler are missing.
    """
    include, target, compiler = Path(sysconfig.get_path("include")), extension_path(folder), find_compiler()
    source = Path(__file__).with_name(EXTENSION_FILE)
    has_headers = sys.implementation.name == "cpython" and (include / "Python.h").is_file()
    if compiler is None or not has_headers or not source.is_file():
        return None
    if target.exists():
        return target
    scratch = _scratch(STEM, target.parent)
    try:
        built = scratch / target.name
        known = _extensions.get(target.name)
        if known is not None and known.exists():
            shutil.copyfile(known, built)
        else:
            undefined = ["-undefined", "dynamic_lookup"] if sys.platform == "darwin" else []
            options = [*EXTENSION_FLAGS, f"-DINIT=PyInit_{extension_name()}", f"-I{include}", "-shared", *undefined]
            command = [*compiler, *options, str(source), "-o", str(built)]
            _check(command, _run(command), source)
        os.replace(built, target)
        _extensions[target.name] = target
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
    suffix = target.name.removeprefix(extension_name())
    _remove_stale(target, rf"{STEM}_[0-9a-f]{{16}}{re.escape(suffix)}")
    return target


# Files and processes.


def _scratch(stem: str, folder: Path) -> Path:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        return Path(tempfile.mkdtemp(prefix=f".{stem}-", dir=folder))
    except OSError as error:
        raise BuildError(
            str(folder), error.strerror or str(error), "a writable folder", "choose another with -o"
        ) from error


def _remove_stale(target: Path, pattern: str, current: str | None = None) -> None:
    """Remove files that were built from earlier texts, whose names match `pattern`.

    Files whose names begin with `current` are kept: they are built from the same text for other machines.
    """
    for path in target.parent.iterdir():
        is_current = path.name.startswith(current) if current else path == target
        if not is_current and re.fullmatch(pattern, path.name):
            path.unlink(missing_ok=True)


@contextlib.contextmanager
def _lock(name: str) -> Iterator[None]:
    """Prevent other processes from building the same file; without lock support, the last process replaces the file."""
    try:
        import fcntl

        handle = os.open(cache_folder("locks") / f"{name}.lock", os.O_RDWR | os.O_CREAT, 0o600)
    except (ImportError, OSError, CacheError):
        yield
        return
    try:
        # The operating system releases the lock when the process ends, however it ends.
        fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        os.close(handle)


@contextlib.contextmanager
def _announced(name: str) -> Iterator[None]:
    """Print a message about the build to stderr if it takes long."""
    timer = threading.Timer(_PATIENCE, print, [f"gac: building {name} (once)"], {"file": sys.stderr, "flush": True})
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


def _run(command: list[str]) -> subprocess.CompletedProcess[str]:
    try:
        return subprocess.run(command, capture_output=True, text=True, errors="replace")
    except OSError as error:
        raise BuildError(command[0], error.strerror or str(error), "a C compiler") from error


def _check(command: list[str], run: subprocess.CompletedProcess[str], c_file: Path) -> None:
    if run.returncode == 0:
        return
    # gcc's last line, "collect2: error: ld returned 1", only refers to messages of the linker above it.
    lines = [line for line in run.stderr.splitlines() if line.strip() and not line.startswith("collect2:")]
    first = next(filter(_ERROR.search, lines), lines[0] if lines else f"status {run.returncode}")
    raise BuildError(
        str(c_file), f"{command[0]} failed: {first.strip()}", "a file that compiles", f"run {shlex.join(command)}"
    )
