"""The folder of what was compiled: programs, generated modules, libraries.

What lies there is loaded and run, so nobody but the user may be able to write to it: the folder belongs to the user,
others have no right to write to it, and no folder above it lets just anyone replace it. Folders that are made here have
mode 0700.
"""

from __future__ import annotations

import os
import stat
import tempfile
from functools import cache
from pathlib import Path

from .errors import BackendError


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
        refusal = _refusal(Path(chosen))
        if refusal:
            raise BackendError(
                chosen, refusal, "a folder that you can write, and nobody else",
                "set GAC_CACHE to another one, or run `chmod 700` on it if it is yours and you trust what is in it",
            )  # fmt: skip
        return Path(chosen)
    try:
        caches = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    except RuntimeError:  # this user has no home
        return None
    return None if _refusal(caches / "gacompiler") else caches / "gacompiler"


def cache_part(name: str) -> Path:
    """A folder in the cache folder, made where it is missing; errors as `cache_folder`."""
    part = cache_folder() / name
    refusal = _refusal(part)
    if refusal:
        raise BackendError(str(part), refusal, "a folder that you can write, and nobody else", "remove it")
    return part


@cache
def _temporary_folder() -> Path:
    return Path(tempfile.mkdtemp(prefix="gacompiler-"))


def _refusal(folder: Path) -> str:
    """Why a folder, which is made where it is missing, must not be used; empty when it may."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        own, link = folder.stat(), folder.lstat()
        above = {*folder.absolute().parents, *folder.resolve().parents}
        modes = {parent: parent.stat().st_mode for parent in above}
    except OSError as error:
        return f"it cannot be used: {error.strerror}"
    if not os.access(folder, os.R_OK | os.W_OK | os.X_OK):
        return "it cannot be written"
    if not hasattr(os, "geteuid"):
        return ""  # Windows, where modes say nothing, and users' folders are their own
    user = os.geteuid()
    if own.st_uid != user or link.st_uid not in (user, 0):
        return "it belongs to another user"
    if own.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        return f"others may write to it (mode {stat.S_IMODE(own.st_mode):o})"
    open_to_all = sorted(p for p, mode in modes.items() if mode & stat.S_IWOTH and not mode & stat.S_ISVTX)
    return f"anyone may replace it, since anyone may write to {open_to_all[0]}" if open_to_all else ""
