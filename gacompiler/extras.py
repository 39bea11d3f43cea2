"""Packages that an installation may lack. Importing this module checks for those that all of gacompiler needs.

They are dependencies of the distribution and lack only where it was installed without them, for generated modules.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

from .errors import BackendError

COMPILER = ("jinja2", "mpmath")
"""The packages that every compilation needs; others are loaded on demand."""

COMMAND = ("click", "rich")
"""The packages that the command needs besides."""

is_command = Path(sys.argv[0]).stem in ("gac", "-m")
missing = sorted(name for name in (*COMPILER, *COMMAND * is_command) if find_spec(name) is None)
if missing:
    line = (
        f"gacompiler needs {', '.join(missing)}; run: pip install {' '.join(missing)}; "
        "generated modules, as in `from generated import pga3`, need only numpy"
    )
    if is_command:
        sys.exit(f"gac: error: {line}")
    raise ImportError(line)


def remedy_of(extra: str) -> str:
    """Return how to install an extra of the distribution."""
    return f"run: pip install 'gacompiler[{extra}]'"


@contextmanager
def needs(extra: str, where: str) -> Iterator[None]:
    """Import packages of an extra of the distribution in the body of a ``with`` statement.

    Parameters
    ----------
    extra : str
    where : str
        What needs the packages: a command, or a function.

    Raises
    ------
    BackendError
        If a package is missing.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        package = str(error.name).partition(".")[0]
        raise BackendError(where, f"{package} is not installed", remedy=remedy_of(extra)) from None
