"""The folder of what was compiled: programs, generated modules, libraries.

What lies there is loaded and run, so nobody but the user may be able to write to it: the folder belongs to the user,
others have no right to write to it, and no folder above it lets just anyone replace it. Folders that are made here have
mode 0700.
"""

from __future__ import annotations

import os
import tempfile
from functools import cache
from pathlib import Path

from .errors import BackendError
from .gac_runtime.cache import refusal


def cache_folder() -> Path:
    """The folder, which exists: ``$GAC_CACHE``, or ``gacompiler`` in the user's folder of caches.

    Where there is no such folder, or it cannot be used, a temporary one of this process takes its place.

    Raises
    ------
    BackendError
        When ``$GAC_CACHE`` is set to a folder that cannot be written, or that others can write to.
    """
    return lasting_folder() or _temporary_folder()


def lasting_folder() -> Path | None:
    """As `cache_folder`, but None in place of a temporary folder."""
    chosen = os.environ.get("GAC_CACHE")
    if chosen:
        reason = refusal(Path(chosen))
        if reason:
            raise BackendError(
                chosen, reason, "a folder that you can write, and nobody else",
                "set GAC_CACHE to another one, or run `chmod 700` on it if it is yours and you trust what is in it",
            )  # fmt: skip
        return Path(chosen)
    try:
        caches = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    except RuntimeError:  # this user has no home
        return None
    return None if refusal(caches / "gacompiler") else caches / "gacompiler"


def cache_part(name: str) -> Path:
    """A folder in the cache folder, made where it is missing; errors as `cache_folder`."""
    part = cache_folder() / name
    reason = refusal(part)
    if reason:
        raise BackendError(str(part), reason, "a folder that you can write, and nobody else", "remove it")
    return part


@cache
def _temporary_folder() -> Path:
    return Path(tempfile.mkdtemp(prefix="gacompiler-"))
