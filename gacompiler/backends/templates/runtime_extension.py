"""The extension that calls kernels without Python in between, if it is built.

Copied into every generated module as it is, with the other ``runtime_`` files, but for the name of the extension.
"""

from __future__ import annotations

import importlib.machinery
import importlib.util
import os
import sys
from typing import Any

import numpy as np

_EXTENSION = ""
_EXTENSION_FOLDER = ""


def _loaded_extension(folder: str, name: str) -> Any:
    """The extension of a name from a folder; None where it is not there, or where GAC_BACKEND asks for array
    expressions.

    Modules that were made by the same compiler share it.
    """
    if not name or os.environ.get("GAC_BACKEND", "") == "arrays":
        return None
    if name not in sys.modules:
        path = os.path.join(folder, name + importlib.machinery.EXTENSION_SUFFIXES[0])
        if not os.path.exists(path):
            return None
        loader = importlib.machinery.ExtensionFileLoader(name, path)
        try:
            importlib.util.module_from_spec(importlib.machinery.ModuleSpec(name, loader, origin=path))
        except ImportError:
            return None  # built for another machine
    extension: Any = sys.modules[name]
    probe = np.zeros((2, 3))
    where = probe.__array_interface__["data"][0]
    functions = (sys.modules.get("numpy._core.multiarray") or sys.modules["numpy.core.multiarray"])._ARRAY_API
    numbers = np.float64(0), np.float32(1.5)
    known = extension.prepare(probe, where, probe.shape, probe.strides, probe.flags.num, *numbers, functions)
    return extension if known else None


_extension = _loaded_extension(os.path.join(os.path.dirname(os.path.abspath(__file__)), _EXTENSION_FOLDER), _EXTENSION)
_Call: Any = object if _extension is None else _extension.Call


class _Signature:
    """The signature of a kernel for `inspect`, which cannot see it in C."""

    def __get__(self, kernel: Any, owner: type) -> Any:
        if kernel is None:
            raise AttributeError("a class has none")
        import inspect
        import keyword

        kinds = inspect.Parameter
        reserved = any(map(keyword.iskeyword, kernel._names))
        kind = kinds.POSITIONAL_ONLY if reserved else kinds.POSITIONAL_OR_KEYWORD
        parameters = [kinds(name, kind) for name in kernel._names]
        named = [kinds(name, kinds.KEYWORD_ONLY, default=None) for name in ("out", "num_threads")]
        return inspect.Signature([*parameters, *named])
