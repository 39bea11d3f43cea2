"""A geometric-algebra compiler: multivector definitions in, specialised and proved kernels out."""

import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

from . import extras as extras  # fails with a one-line message if packages are missing, before others are loaded
from . import load_time as load_time  # records the time before the rest is loaded
from . import packages as packages  # finds gacompiler.generated and gacompiler.algorithms

if TYPE_CHECKING:
    from .objects import Cl as Cl
    from .objects import Space as Space
    from .runtime import compile as compile
    from .scripts import read_cluscript as read_cluscript
    from .vocabulary import *  # noqa: F403

__version__ = "0.2.0"

_HOMES = {"Cl": "objects", "Space": "objects", "compile": "runtime", "read_cluscript": "scripts"}
"""The modules of public names that are not in `vocabulary`."""


def __getattr__(name: str) -> Any:
    """Load a public name on first access, since ``gac --help`` and packages such as `wheels` need no vocabulary."""
    if name in ("symbolic", "calculus", "robots", "matrices", *packages.NAMES):
        return import_module(f"{__name__}.{name}")
    if name == "__all__" or not name.startswith("__"):
        home = import_module(f"{__name__}.{_HOMES.get(name, 'vocabulary')}")
        if name in _HOMES or name in ("__all__", *home.__all__):
            globals()[name] = found = getattr(home, name)
            return found
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    loaded = {name for name in globals() if name.startswith("__") or f"{__name__}.{name}" in sys.modules}
    return sorted({*loaded, *import_module(f"{__name__}.vocabulary").__all__})
