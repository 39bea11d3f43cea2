"""Names that have moved to other packages, and work at their old place for one version."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any


def moved(package: str, places: Mapping[str, str]) -> Callable[[str], Any]:
    """Return the `__getattr__` of a package, some names of which are now in others.

    Parameters
    ----------
    package : str
        The name of the package.
    places : mapping of str to str
        For each new package the names that have moved there, separated by blanks.

    Returns
    -------
    callable
        Function from a name to its object, with a DeprecationWarning that names the new place.
    """
    of = {name: place for place, names in places.items() for name in names.split()}

    def find(name: str) -> Any:
        if name not in of:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        message = f"{package}.{name} is now {of[name]}.{name}; the old name will be removed in version 0.4"
        warnings.warn(message, DeprecationWarning, stacklevel=2)
        return getattr(import_module(of[name]), name)

    return find
