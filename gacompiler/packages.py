"""The packages `generated` and `algorithms` under this package: ``import gacompiler.algorithms.vision``.

These are the same module objects as those of ``import algorithms.vision``. If a program has an ``algorithms.py`` of its
own, that name is the program's, and ``gacompiler.algorithms`` is still the package that was installed with this one.
"""

from __future__ import annotations

import os
import sys
from importlib.machinery import ModuleSpec
from types import ModuleType

NAMES = ("generated", "algorithms")
_PLACE = os.path.dirname(os.path.dirname(os.path.realpath(__file__)))


class _Same:
    """A loader that gives a module which has another name."""

    def __init__(self, name: str) -> None:
        self._name = name

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        from importlib import import_module

        module = import_module(self._name)
        self._spec = module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        module.__spec__ = self._spec  # which the import of the second name has replaced


class _Finder:
    """Finds the packages and their modules under the name of this package."""

    def find_spec(self, fullname: str, path: object = None, target: object = None) -> ModuleSpec | None:
        head, _, rest = fullname.partition(".")
        name = rest.partition(".")[0]
        if head != __package__ or name not in NAMES:
            return None
        from importlib.util import find_spec, spec_from_file_location

        if _is_own(name):
            return ModuleSpec(fullname, _Same(rest)) if find_spec(rest) is not None else None  # type: ignore[arg-type]
        folder = os.path.join(_PLACE, name)
        start = os.path.join(folder, "__init__.py")
        if rest != name or not os.path.isfile(start):
            return None  # modules of the package are found in its folder
        return spec_from_file_location(fullname, start, submodule_search_locations=[folder])


def _is_own(name: str) -> bool:
    """Whether a name at the top is the package that was installed with this one."""
    from importlib.util import find_spec

    loaded = sys.modules.get(name)
    spec = loaded.__spec__ if loaded is not None else find_spec(name)
    origin = getattr(spec, "origin", None)
    return origin is not None and os.path.realpath(origin) == os.path.join(_PLACE, name, "__init__.py")


sys.meta_path.insert(0, _Finder())
