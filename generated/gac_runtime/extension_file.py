"""The file of the extension through which Python calls kernels: its name, its place, and how it is loaded."""

from __future__ import annotations

import functools
import hashlib
import importlib.machinery
import importlib.util
import os
import sys
from pathlib import Path
from typing import Any

import numpy as np

FOLDER = "_build"
"""Where what is built lies, beside the modules and in the user's cache."""
FLAGS = ("-O2", "-std=c17", "-fPIC")
"""The options that the extension is compiled with."""
SOURCE = Path(__file__).with_name("extension.c")


@functools.cache
def extension_name() -> str:
    """The name of the extension as Python imports it, which changes with its text and the options."""
    text = SOURCE.read_text(encoding="utf-8")
    return f"calls_{hashlib.sha256(chr(0).join([text, *FLAGS]).encode()).hexdigest()[:16]}"


def extension_path(folder: Path) -> Path:
    """Where the extension belongs for modules in `folder`, or in the user's cache."""
    return folder / FOLDER / f"{extension_name()}{importlib.machinery.EXTENSION_SUFFIXES[0]}"


def user_cache() -> Path:
    """The folder for what is built where modules lie in a folder that cannot be written."""
    chosen = os.environ.get("GAC_CACHE")
    return Path(chosen) if chosen else Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "gacompiler"


def load(path: Path) -> Any:
    """The extension in a file; None where there is none that works, or where GAC_BACKEND asks for array expressions.

    A process loads it once, since its name stands for its content.
    """
    name = path.name.partition(".")[0]
    if os.environ.get("GAC_BACKEND", "") == "arrays":
        return None
    if name not in sys.modules:
        if not path.exists():
            return None
        loader = importlib.machinery.ExtensionFileLoader(name, str(path))
        try:
            importlib.util.module_from_spec(importlib.machinery.ModuleSpec(name, loader, origin=str(path)))
        except ImportError:
            return None  # built for another machine
    found: Any = sys.modules[name]
    probe = np.zeros((2, 3))
    where = probe.__array_interface__["data"][0]
    functions = (sys.modules.get("numpy._core.multiarray") or sys.modules["numpy.core.multiarray"])._ARRAY_API
    numbers = np.float64(0), np.float32(1.5)
    known = found.prepare(probe, where, probe.shape, probe.strides, probe.flags.num, *numbers, functions)
    return found if known else None
