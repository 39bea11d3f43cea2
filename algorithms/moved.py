"""Names and modules that have moved to other packages, and work at their old place for one version."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from importlib.util import spec_from_loader
from types import ModuleType
from typing import Any

UNTIL = "the old name will be removed in version 0.4"


def moved(package: str, places: Mapping[str, str], modules: Mapping[str, str]) -> Callable[[str], Any]:
    """Return the `__getattr__` of a package, some names of which are now in others.

    Parameters
    ----------
    package : str
        The name of the package.
    places : mapping of str to str
        For each new package the names that have moved there, separated by blanks.
    modules : mapping of str to str
        For each new package the modules that have moved there, separated by blanks; ``old=new`` if their names differ.

    Returns
    -------
    callable
        Function from a name to its object, with a DeprecationWarning that names the new place. Importing a module from
        its old place gives the same warning.
    """
    of = {name: place for place, names in places.items() for name in names.split()}
    _finder.places |= {
        f"{package}.{old}": f"{place}.{new or old}"
        for place, names in modules.items()
        for old, _, new in (name.partition("=") for name in names.split())
    }

    def find(name: str) -> Any:
        if name not in of:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        message = f"{package}.{name} is now {of[name]}.{name}; {UNTIL}"
        warnings.warn(message, DeprecationWarning, stacklevel=2)
        return getattr(import_module(of[name]), name)

    return find


class _Moved(MetaPathFinder, Loader):
    """Imports modules from their new places under their old names."""

    def __init__(self) -> None:
        self.places: dict[str, str] = {}
        self._specs: dict[str, ModuleSpec | None] = {}

    def find_spec(self, name: str, path: Sequence[str] | None, target: ModuleType | None = None) -> ModuleSpec | None:
        """Return a spec for the old name of a module."""
        return spec_from_loader(name, self) if name in self.places else None

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """Return the module from its new place."""
        place = self.places[spec.name]
        warnings.warn(f"{spec.name} is now {place}; {UNTIL}", DeprecationWarning, stacklevel=2)
        module = import_module(place)
        self._specs[spec.name] = module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        """Give the module its own spec back, which the import of the old name has replaced."""
        assert module.__spec__ is not None
        module.__spec__ = self._specs.pop(module.__spec__.name)


_finder = _Moved()
sys.meta_path.append(_finder)
