"""Files of comparisons are not imported if they are deselected, because other libraries take seconds to load."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import pytest


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Ignore this folder; pytest does not call this hook for files named on the command line."""
    return True if "not peers" in config.option.markexpr and collection_path.suffix == ".py" else None


def pytest_pycollect_makemodule() -> None:
    """Import clifford before the first file of comparisons."""
    interpreted_clifford()


@cache
def interpreted_clifford() -> None:
    """Import clifford with its functions in Python: numba would compile them for each algebra, in seconds."""
    with contextlib.suppress(ImportError), pytest.MonkeyPatch.context() as patch:
        import numba
        import sparse  # noqa: F401 - used by clifford, and not usable in Python

        compiled = numba.njit

        def njit(function: Callable[..., Any] | None = None, **_: Any) -> Any:
            if function is None:
                return njit
            return compiled(function) if function.__name__ == "count_set_bits" else function  # which has no Python

        patch.setattr(numba, "njit", njit)
        patch.setattr(numba, "jit", njit)
        import clifford.tools.g3c.rotor_parameterisation  # noqa: F401
