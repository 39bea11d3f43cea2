"""Names of compiled files, which contain digests of all their sources and flags, so that no file is ever stale."""

from __future__ import annotations

import functools
import hashlib
import importlib.machinery
from pathlib import Path

from .processor import PORTABLE, machine_level

FOLDER = "_build"
"""The folder of compiled files, next to the modules."""
RUNTIME = "gac_runtime"
"""The folder of the runtime, next to the modules."""
RUNTIME_FILES = ("gac_runtime.h", "gac_runtime.c")
EXTENSION_FILE = "extension.c"

FLAGS = ("-std=c17", "-fPIC", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math")
"""Flags for all libraries on all machines. With -fno-trapping-math, comparisons may be evaluated even if their branch
is not taken; without it, gcc does not vectorize some loops."""

GCC_FLAGS = (
    *("-O1", "-fexpensive-optimizations", "-ftree-loop-vectorize", "-fvect-cost-model=dynamic", "-fpeel-loops"),
    "-fno-thread-jumps",
)
"""Optimisation flags for vectorised straight-line code. They give the speed of -O3 in two thirds of its compile time.
Without the last one, conditions that are the same for all elements divide loops into paths that are not vectorised.
With the second flag, gcc clears the upper halves of vector registers after a loop. Without it, code compiled for SSE
that ran next, for example scipy's transforms, took twice as long."""

OTHER_FLAGS = ("-O3",)
"""Optimisation flags for other compilers."""

_VECTORS = ("-mavx", "-mavx2", "-mfma", "-mf16c", "-mbmi", "-mbmi2", "-mlzcnt", "-mmovbe", "-mpopcnt")

LEVEL_FLAGS = {
    PORTABLE: (),
    1: ("-DGAC_LEVEL=1",),
    3: ("-DGAC_LEVEL=3", *_VECTORS),
    4: ("-DGAC_LEVEL=4", *_VECTORS),
}
"""Additional flags by the processor level of the target machines. A portable library contains loops for each level and
selects one at run time; a library for this machine alone compiles in less than two thirds of the time."""

EXTENSION_FLAGS = ("-O2", "-ftree-vectorize", *FLAGS)


def digest(*texts: str) -> str:
    """Return a digest of the texts with sixteen characters."""
    return hashlib.sha256("\0".join(texts).encode()).hexdigest()[:16]


STANDALONE = "#define GAC_STANDALONE"
"""A line that marks C files that contain the runtime."""


def library_label(module: str, c_text: str) -> str:
    """Return the part of a library's name that its module stores: the module's name and a digest of its C text."""
    return f"{module}-{digest(c_text)}"


@functools.cache
def library_file(label: str, runtime: Path, level: int = PORTABLE, only: str = "") -> str:
    """Return the file name of the library of a module, compiled with the runtime in folder `runtime`.

    If that folder has no runtime, the C file of the module contains it. Names for different levels differ only in
    their endings: ``.so`` for a portable library, else ``-v4.so``. Libraries of `only` one precision, "f64" or "f32",
    end in ``-f64.so`` and ``-f32.so``.
    """
    texts = [_text(runtime / name) for name in RUNTIME_FILES]
    flags = [flag for flags in LEVEL_FLAGS.values() for flag in flags]
    ending = ("" if level == PORTABLE else f"-v{level}") + (f"-{only}" if only else "")
    return f"{label}-{digest(*texts, *FLAGS, *GCC_FLAGS, *OTHER_FLAGS, *flags)}{ending}.so"


def library_files(label: str, runtime: Path, only: str = "") -> tuple[str, ...]:
    """Return the names of the libraries that this machine can load, the preferred one first."""
    return tuple(library_file(label, runtime, level, only) for level in dict.fromkeys((machine_level(), PORTABLE)))


def lower_library_files(label: str, runtime: Path) -> tuple[str, ...]:
    """Return the names of libraries for lower levels, which this machine can also load, the highest level first."""
    levels = sorted((level for level in LEVEL_FLAGS if PORTABLE < level < machine_level()), reverse=True)
    return tuple(library_file(label, runtime, level) for level in levels)


@functools.cache
def extension_name() -> str:
    """Return the name under which Python imports the extension."""
    return f"calls_{digest(_text(Path(__file__).with_name(EXTENSION_FILE)), *EXTENSION_FLAGS)}"


def _text(path: Path) -> str:
    """Return the text of a file; empty if it does not exist, as for a module that contains the runtime."""
    return path.read_text(encoding="utf-8") if path.is_file() else ""


def extension_path(folder: Path) -> Path:
    """Return the path of the extension for modules in `folder`; the folder may be the user's cache, for all modules."""
    return folder / FOLDER / f"{extension_name()}{importlib.machinery.EXTENSION_SUFFIXES[0]}"
