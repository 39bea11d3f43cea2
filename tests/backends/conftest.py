"""Modules of the example programs, written and built once for all tests of the backends.

numba caches machine code next to the file of a module, so all tests that load the file share it.
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
from one_element import IMPLEMENTATIONS, build_once, load_implementations

from gacompiler.backends import library_path
from gacompiler.backends.module import ModuleSource

CHOSEN = (MOVE_POINT, NORMALIZE, DISTANCE) if is_alone() else (*PROGRAMS, MANY, INNER)


@pytest.fixture(scope="session")
def kernels() -> ModuleSource:
    """The source of the module."""
    return module_source("kernels", *CHOSEN)


@pytest.fixture(scope="session")
def folder_of_kernels(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder that contains the module, built and plain."""
    return tmp_path_factory.mktemp("kernels")


@pytest.fixture(scope="session")
def built(kernels: ModuleSource, folder_of_kernels: Path) -> Path:
    """The file of the module; its folder has the library and the extension if there is a compiler."""
    return build_once(kernels, folder_of_kernels) / "kernels.py"


@pytest.fixture(scope="session")
def modules(built: Path) -> dict[str, ModuleType]:
    """The module on every available backend."""
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
    """The module on each backend in turn."""
    if request.param not in modules:
        pytest.skip("no C compiler")
    return modules[request.param]


@pytest.fixture(scope="session")
def implementations(kernels: ModuleSource, folder_of_kernels: Path) -> dict[str, ModuleType]:
    """The module with the extension, without it, on plain arrays, and on numba."""
    found = load_implementations(kernels, folder_of_kernels, (*IMPLEMENTATIONS, "numba"))
    for loaded in (found[name] for name in IMPLEMENTATIONS if name in found):
        for program in CHOSEN:
            getattr(loaded, program.name)(*inputs(program))  # so that libraries are loaded
    return found
