"""Modules of the programs by hand, written and built once for all tests of the backends.

Machine code that numba keeps is kept beside a module's file, so all that load this file share that, too.
"""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

import pytest
from alone import is_alone
from backend_programs import (
    BACKENDS,
    DISTANCE,
    INNER,
    MANY,
    MOVE_POINT,
    NORMALIZE,
    PROGRAMS,
    inputs,
    load,
    module_source,
)
from one_element import WAYS, build_once, load_ways

from gacompiler.backends import library_path
from gacompiler.backends.module import ModuleSource

CHOSEN = (MOVE_POINT, NORMALIZE, DISTANCE) if is_alone() else (*PROGRAMS, MANY, INNER)


@pytest.fixture(scope="session")
def kernels() -> ModuleSource:
    """What stands in the module."""
    return module_source("kernels", *CHOSEN)


@pytest.fixture(scope="session")
def folder_of_kernels(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the module is, built and plain."""
    return tmp_path_factory.mktemp("kernels")


@pytest.fixture(scope="session")
def built(kernels: ModuleSource, folder_of_kernels: Path) -> Path:
    """The module's file, beside its library and the extension, where there is a compiler."""
    return build_once(kernels, folder_of_kernels) / "kernels.py"


@pytest.fixture(scope="session")
def modules(built: Path) -> dict[str, ModuleType]:
    """The module on every backend that is there."""
    loaded = {}
    with pytest.MonkeyPatch.context() as patch:
        for name in BACKENDS:
            if name == "c" and not library_path(built.with_suffix(".c")).exists():
                continue
            patch.setenv("GAC_BACKEND", name)
            loaded[name] = load(built, f"kernels_on_{name}")
    return loaded


@pytest.fixture(params=BACKENDS)
def module(request: pytest.FixtureRequest, modules: dict[str, ModuleType]) -> ModuleType:
    """The module on one backend after the other."""
    if request.param not in modules:
        pytest.skip("no C compiler")
    return modules[request.param]


@pytest.fixture(scope="session")
def ways(kernels: ModuleSource, folder_of_kernels: Path) -> dict[str, ModuleType]:
    """The module with the extension and without, on plain arrays, and on numba."""
    found = load_ways(kernels, folder_of_kernels, (*WAYS, "numba"))
    for loaded in (found[way] for way in WAYS if way in found):
        for program in CHOSEN:
            getattr(loaded, program.name)(*inputs(program))  # so that libraries are loaded
    return found
