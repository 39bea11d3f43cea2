"""Locations of the specs of the package and of the modules generated from them."""

from __future__ import annotations

import importlib.util
from pathlib import Path

_PACKAGE = Path(__file__).parent.parent


def own_specs() -> list[Path]:
    """Return the spec files of the modules that are checked in under ``generated``."""
    return sorted(path for path in (_PACKAGE / "specs").glob("*.py") if path.stem != "__init__")


def generated_folder() -> Path:
    """Return the folder of the checked-in modules: the ``generated`` package installed with this one."""
    found = importlib.util.find_spec("generated")
    if found is not None and found.submodule_search_locations:
        return Path(next(iter(found.submodule_search_locations)))
    return _PACKAGE.parent / "generated"
