"""The cache folder of programs, generated modules and libraries.

Files in this folder are loaded and run, so only the user may be able to write to it: the folder is owned by the user,
is not writable by others, and cannot be replaced by others through a parent folder. Folders are created with mode 0700.
"""

from __future__ import annotations

import os
import tempfile
from functools import cache
from pathlib import Path

from .errors import BackendError
from .gac_runtime.cache import refusal, users_caches


def cache_folder() -> Path:
    """Return the cache folder, which exists: ``$GAC_CACHE``, or ``gacompiler`` in the user's cache folder.

    If the user has no cache folder, or it cannot be used, a temporary folder of this process is returned.

    Raises
    ------
    BackendError
        If ``$GAC_CACHE`` is set to a folder that is not writable, or that others can write to.
    """
    return lasting_folder() or _temporary_folder()


def lasting_folder() -> Path | None:
    """Return the same as `cache_folder`, but None in place of a temporary folder."""
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
        caches = users_caches()
    except RuntimeError:  # this user has no home
        return None
    return None if refusal(caches / "gacompiler") else caches / "gacompiler"


def cache_part(name: str) -> Path:
    """Return a folder in the cache folder, created if it does not exist.

    Raises
    ------
    BackendError
        If the folder is not writable, or others can write to it.
    """
    part = cache_folder() / name
    reason = refusal(part)
    if reason:
        raise BackendError(str(part), reason, "a folder that you can write, and nobody else", "remove it")
    return part


@cache
def _temporary_folder() -> Path:
    return Path(tempfile.mkdtemp(prefix="gacompiler-"))
