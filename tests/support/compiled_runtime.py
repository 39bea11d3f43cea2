"""The compiled runtime of generated C for tests with a separate cache, because compiling it takes seconds."""

from __future__ import annotations

import shutil
from pathlib import Path

from backend_programs import SWAP, module_source, write

from gacompiler.backends.build import build_module
from gacompiler.gac_runtime.cache import cache_folder


def copy_compiled_runtime(folder: Path, cache: Path) -> Path:
    """Build in an empty folder, then copy the compiled runtime from the cache of the whole run to another cache."""
    build_module(write(module_source("bare", SWAP), folder))
    cache.mkdir(mode=0o700, exist_ok=True)
    return Path(shutil.copytree(cache_folder("runtime"), cache / "runtime"))
