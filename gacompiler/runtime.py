"""Compilation of a kernel from Python: the module is generated into a cache, built and imported."""

from __future__ import annotations

import contextlib
import copyreg
import hashlib
import importlib.util
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

from .backends import build_extension, build_module, find_compiler, no_compiler
from .cache_folder import cache_folder, cache_part
from .errors import BackendError, KernelError, remedy_of
from .frontend.kernel import Kernel
from .generation.cache import open_cache
from .generation.compiling import render_spec
from .generation.files import write
from .generation.spec_files import Spec
from .ir.cost_models import COUNTS, cost_model
from .passes.effort import DEFAULT, effort_of

BACKENDS = ("c", "numba", "arrays")

_compiled: dict[tuple[Kernel, str, int, str], Any] = {}
_definitions: dict[str, Kernel] = {}
"""The kernels that the modules of this process were compiled from, by module name."""


def compile(kernel: Kernel, backend: str | None = None, *, effort: int = DEFAULT, cost: str = COUNTS.name) -> Any:
    """Compile `kernel` and return a function on arrays.

    Parameters
    ----------
    kernel : Kernel
        A function decorated with ``@kernel``.
    backend : {"c", "numba", "arrays"}, optional
        The backend that runs the kernel; by default ``c`` if a C compiler is found, else ``numba`` if it is
        installed. ``arrays`` uses plain array expressions and also accepts torch and jax arrays.
    effort : {0, 1, 2, 3}, optional
        How much work is spent on reducing the number of operations. 0 keeps the author's structure, and 3 is for
        kernels that are compiled once and may take hours. The results are the same up to rounding.
    cost : {"counts", "latency", "fma", "size"}, optional
        What is minimised: operations, cycles of one element, instructions if products and sums are contracted, or the
        size of the code. Level 0 of `effort` has nothing to select from.

    Returns
    -------
    callable
        A function as in a generated module: leading axes are broadcast, and ``out=`` avoids allocation. See its
        ``help()``.

    Raises
    ------
    KernelError
        If the definition cannot be compiled, or there is no such effort or cost model.
    BackendError
        If the backend is unknown or not available.

    Notes
    -----
    Generated files, libraries and optimized programs are cached under ``$GAC_CACHE`` or the user's cache folder, in
    folders named by a digest of their content. Compiling the same kernel again only imports it; see ``gac cache``.

    Compiled kernels can be pickled together with their definition. Unpickling returns the object that the process
    already has, imports the files from the cache folder, or compiles the kernel.
    """
    if not isinstance(kernel, Kernel):
        raise KernelError(
            "compile()", f"an object of type {type(kernel).__name__}", "a function decorated with @kernel(...)"
        )
    if backend is None:
        backend = "c" if find_compiler() else _without_compiler()
    if backend not in BACKENDS:
        raise BackendError("compile()", f"backend {backend!r}", "one of " + ", ".join(BACKENDS))
    if backend == "numba" != _without_compiler():
        raise BackendError("compile()", "numba is not installed", remedy=remedy_of("compiler"))
    key = (kernel, backend, effort_of(effort).level, cost_model(cost).name)
    if key not in _compiled:
        _compiled[key] = _compile(kernel, backend, effort, cost)
    return _compiled[key]


def _without_compiler() -> str:
    """Return the backend for machines without a C compiler."""
    return "numba" if importlib.util.find_spec("numba") else "arrays"


def _compile(kernel: Kernel, backend: str, effort: int, cost: str) -> Any:
    no_file = Path()
    spec = Spec(kernel.name, "gacompiler.compile", kernel.summary or kernel.name, "", (kernel,), no_file)
    files = render_spec(spec, cache=open_cache(), effort=effort, cost=cost)
    digest = hashlib.sha256("".join(files.values()).encode()).hexdigest()[:16]
    write(files, _folder(kernel.name, digest))
    return _loaded(kernel, digest, backend)


def _folder(name: str, digest: str) -> Path:
    return cache_part("modules") / f"{name}-{digest}"


def _loaded(kernel: Kernel, digest: str, backend: str) -> Any:
    """Return the kernel of a module in the cache folder."""
    folder = _folder(kernel.name, digest)
    if backend == "c" and build_module(folder / f"{kernel.name}.c") is None:
        raise BackendError("compile()", no_compiler(), remedy=f'use backend="{_without_compiler()}"')
    # The extension makes calls faster, also with the numba backend.
    with contextlib.suppress(BackendError):
        build_extension(cache_folder())
    module_name = _module_name(kernel.name, digest, backend)
    module = load_module(folder / f"{kernel.name}.py", module_name, backend)
    _definitions[module.__name__] = kernel
    found = getattr(module, kernel.name)
    for kind in {module.Kernel, type(found)}:
        copyreg.pickle(kind, _reduced)
    return found


def _module_name(name: str, digest: str, backend: str) -> str:
    return f"_gac_{name}_{digest}_{backend}"


def _reduced(compiled: Any) -> Any:
    """Reduce a kernel that was compiled here, whose module exists only in this process."""
    module_name = compiled.__module__
    definition = _definitions.get(module_name)
    if definition is None or getattr(sys.modules[module_name], definition.name) is not compiled:
        return compiled.__reduce__()
    *_, digest, backend = module_name.split("_")
    return _restored, (definition, digest, backend)


def _restored(definition: Kernel, digest: str, backend: str) -> Any:
    module = sys.modules.get(f"{__package__}.{_module_name(definition.name, digest, backend)}")
    if module is not None:
        return getattr(module, definition.name)
    if (_folder(definition.name, digest) / f"{definition.name}.py").is_file():
        return _loaded(definition, digest, backend)
    return compile(definition, backend)


def load_module(path: Path, name: str, backend: str | None = None) -> ModuleType:
    """Import a generated module from a file, with the runtime of this package, and set its backend."""
    name = f"{__package__}.{name}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise BackendError(str(path), "cannot be imported", "a generated module")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    if backend is not None:
        module.backend = backend  # type: ignore[attr-defined]
    return module
