"""Imports of optional packages, with an error that names the extra to install."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def extra(name: str, module: str) -> Iterator[None]:
    """Import packages of an extra of the distribution in the body of a ``with`` statement.

    Parameters
    ----------
    name : str
        The extra.
    module : str
        The module that needs the packages.

    Raises
    ------
    ImportError
        If a package is missing.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        if package in ("", "gacompiler", "generated", "algorithms"):
            raise
        raise ImportError(f"{module} needs {package}; run: pip install 'gacompiler[{name}]'") from None
