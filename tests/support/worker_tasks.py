"""Functions that tests run in other processes, which import little besides them."""

from __future__ import annotations

import os
import time
from typing import TYPE_CHECKING

from gacompiler.errors import KernelError
from gacompiler.generation.cache import Cache, key_of

if TYPE_CHECKING:
    from gacompiler.generation.compiling import Progress
    from gacompiler.generation.spec_files import Spec


def named(spec: Spec, progress: Progress) -> tuple[str, int]:
    progress(spec.name)
    return spec.name, os.getpid()


def printed(spec: Spec, progress: Progress) -> tuple[int, dict[str, str]]:
    """Return the number of the process, and the files of a spec by name."""
    from gacompiler.generation.compiling import render_spec

    return os.getpid(), render_spec(spec, progress)


def failing(spec: Spec, progress: Progress) -> str:
    if spec.name == "planes":
        raise KernelError(spec.name, "a reason", "another", "a remedy")
    return spec.name


def slow_but_for_planes(spec: Spec, progress: Progress) -> str:
    if spec.name == "planes":
        raise KernelError(spec.name, "a reason")
    time.sleep(60)
    return spec.name


def ending(spec: Spec, progress: Progress) -> str:
    os._exit(1)


def write_and_read(cache: Cache, number: int) -> list[str]:
    """Write the same keys as other processes with different content, and return everything read that nobody wrote."""
    wrong = []
    for k in range(200):
        key = key_of(str(k % 5))
        cache.put(key, [number] * (1000 * (number + 1)))
        found = cache.get(key)
        if found is not None and found != [found[0]] * (1000 * (found[0] + 1)):
            wrong.append(key)
        if k % 20 == 0:
            cache.prune()
    return wrong
