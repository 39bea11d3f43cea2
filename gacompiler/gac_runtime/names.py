"""The names of what is compiled: they contain digests of all that goes into a file, so no file is ever stale."""

from __future__ import annotations

import functools
import hashlib
import importlib.machinery
from pathlib import Path

from .processor import PORTABLE, machine_level

FOLDER = "_build"
"""The folder of what is compiled, beside the modules."""
RUNTIME = "gac_runtime"
"""The folder of the runtime, beside the modules."""
RUNTIME_FILES = ("gac_runtime.h", "gac_runtime.c")
EXTENSION_FILE = "extension.c"

FLAGS = ("-std=c17", "-fPIC", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math")
"""What every library is compiled with, whichever machines it is for. With -fno-trapping-math comparisons may be made
where their branch is not taken; without, gcc makes no vectors of some loops."""

GCC_FLAGS = ("-O1", "-fexpensive-optimizations", "-ftree-loop-vectorize", "-fvect-cost-model=dynamic", "-fpeel-loops")
"""What vectorised straight-line code profits from: as fast as with -O3, and compiled in two thirds of the time. By the
second, gcc clears the upper halves of registers after a loop: without, what ran next took twice as long where it was
compiled for SSE, as scipy's transforms are."""

OTHER_FLAGS = ("-O3",)
"""What other compilers take instead."""

_VECTORS = ("-mavx", "-mavx2", "-mfma", "-mf16c", "-mbmi", "-mbmi2", "-mlzcnt", "-mmovbe", "-mpopcnt")

LEVEL_FLAGS = {
    PORTABLE: (),
    1: ("-DGAC_LEVEL=1",),
    3: ("-DGAC_LEVEL=3", *_VECTORS),
    4: ("-DGAC_LEVEL=4", *_VECTORS),
}
"""What a library is compiled with besides, by the level of the machines that it is for. A portable one has loops for
each level and chooses when it runs; one for this machine is compiled in less than two thirds of the time."""

EXTENSION_FLAGS = ("-O2", "-std=c17", "-fPIC")


def digest(*texts: str) -> str:
    """Sixteen characters that stand for these texts."""
    return hashlib.sha256("\0".join(texts).encode()).hexdigest()[:16]


STANDALONE = "#define GAC_STANDALONE"
"""A line of the C files that have the runtime in them."""


def library_label(module: str, c_text: str) -> str:
    """What a module knows of the name of its library: its own name and a digest of its C text."""
    return f"{module}-{digest(c_text)}"


@functools.cache
def library_file(label: str, runtime: Path, level: int = PORTABLE) -> str:
    """The file name of the library of a module; the runtime is in a folder, or else in the module.

    Names for different levels differ in their endings only: ``.so`` of a portable library, else ``-v4.so``.
    """
    texts = [_text(runtime / name) for name in RUNTIME_FILES]
    flags = [flag for flags in LEVEL_FLAGS.values() for flag in flags]
    ending = "" if level == PORTABLE else f"-v{level}"
    return f"{label}-{digest(*texts, *FLAGS, *GCC_FLAGS, *OTHER_FLAGS, *flags)}{ending}.so"


def library_files(label: str, runtime: Path) -> tuple[str, ...]:
    """The names of the libraries that this machine can load, the preferred one first."""
    return tuple(library_file(label, runtime, level) for level in dict.fromkeys((machine_level(), PORTABLE)))


def lower_library_files(label: str, runtime: Path) -> tuple[str, ...]:
    """The names of libraries for lower levels, which this machine can load too, the highest level first."""
    levels = sorted((level for level in LEVEL_FLAGS if PORTABLE < level < machine_level()), reverse=True)
    return tuple(library_file(label, runtime, level) for level in levels)


@functools.cache
def extension_name() -> str:
    """The name of the extension as Python imports it."""
    return f"calls_{digest(_text(Path(__file__).with_name(EXTENSION_FILE)), *EXTENSION_FLAGS)}"


def _text(path: Path) -> str:
    """The text of a file; empty where there is none, as for a module with the whole runtime in it."""
    return path.read_text(encoding="utf-8") if path.is_file() else ""


def extension_path(folder: Path) -> Path:
    """The place of the extension for modules in `folder`, or for all in the user's cache."""
    return folder / FOLDER / f"{extension_name()}{importlib.machinery.EXTENSION_SUFFIXES[0]}"
