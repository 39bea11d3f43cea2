"""Shared by tests of calls: the same module with the extension, without it, on plain arrays and on numba."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from backend_programs import extension_of, load_beside, write

from gacompiler.backends import ModuleSource, build_library
from gacompiler.gac_runtime.names import extension_name, extension_path

IMPLEMENTATIONS = ("extension", "c", "arrays")


def build_once(source: ModuleSource, folder: Path) -> Path:
    """Write and build the module in `folder` if that has not been done, and return its folder."""
    built = folder / "built"
    if not built.exists():
        built.mkdir()
        build_library(write(source, built))
    return built


def load_implementations(
    source: ModuleSource, folder: Path, wanted: Sequence[str] = IMPLEMENTATIONS
) -> dict[str, ModuleType]:
    """Load the available implementations of a module by name; ``numba`` is numba called by the extension."""
    built = build_once(source, folder)
    plain = folder / "plain"
    found = {}
    has_extension = extension_path(built).exists()
    shutil.copytree(built, plain)
    extension_path(plain).unlink(missing_ok=True)
    places = {"extension": (built, "c"), "c": (plain, "c"), "arrays": (plain, "arrays"), "numba": (built, "numba")}
    for name, (place, backend) in places.items():
        if name not in wanted or (place is built and not has_extension):
            continue
        if name == "c" and not list(place.glob("_build/*.so")):
            continue
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("GAC_BACKEND", backend)
            patch.setenv("GAC_CACHE", str(folder / "nothing"))
            if place is plain:
                patch.delitem(sys.modules, extension_name(), raising=False)
            found[name] = load_beside(place / f"{source.name}.py", f"{source.name}_{name}")
        assert (extension_of(found[name]) is not None) == (place is built)
    return found


def outcome(function: Callable[..., Any], *arguments: Any, **named: Any) -> tuple[Any, ...]:
    """The result of a call, or its error, in a form that can be compared."""
    try:
        result = function(*arguments, **named)
    except Exception as error:
        return type(error), str(error)
    return _described(result)


def _described(result: Any) -> tuple[Any, ...]:
    if isinstance(result, tuple):
        return tuple(map(_described, result))
    array = np.asarray(getattr(result, "values", result))
    return type(result), array.dtype, array.shape, array.tobytes()
