"""What tests of calls share: the same module with the extension, without it, on plain arrays and on numba."""

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

WAYS = ("extension", "c", "arrays")


def build_once(source: ModuleSource, folder: Path) -> Path:
    """Where in `folder` the module is written and built; again nothing is done."""
    built = folder / "built"
    if not built.exists():
        built.mkdir()
        build_library(write(source, built))
    return built


def load_ways(source: ModuleSource, folder: Path, wanted: Sequence[str] = WAYS) -> dict[str, ModuleType]:
    """The module by each way to run it that is there; ``numba`` is numba called by the extension."""
    built = build_once(source, folder)
    plain = folder / "plain"
    found = {}
    has_extension = extension_path(built).exists()
    shutil.copytree(built, plain)
    extension_path(plain).unlink(missing_ok=True)
    places = {"extension": (built, "c"), "c": (plain, "c"), "arrays": (plain, "arrays"), "numba": (built, "numba")}
    for way, (place, backend) in places.items():
        if way not in wanted or (place is built and not has_extension):
            continue
        if way == "c" and not list(place.glob("_build/*.so")):
            continue
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("GAC_BACKEND", backend)
            patch.setenv("GAC_CACHE", str(folder / "nothing"))
            if place is plain:
                patch.delitem(sys.modules, extension_name(), raising=False)
            found[way] = load_beside(place / f"{source.name}.py", f"{source.name}_{way}")
        assert (extension_of(found[way]) is not None) == (place is built)
    return found


def outcome(function: Callable[..., Any], *arguments: Any, **named: Any) -> tuple[Any, ...]:
    """What a call gives, or which error, in a form that can be compared."""
    try:
        result = function(*arguments, **named)
    except Exception as error:
        return type(error), str(error)
    return _described(result)


def _described(result: Any) -> tuple[Any, ...]:
    if isinstance(result, tuple):
        return tuple(map(_described, result))
    array = np.asarray(result)
    return type(result), array.dtype, array.shape, array.tobytes()
