"""The user's cache, which holds compiled files of modules whose folders are not writable."""

from __future__ import annotations

import os
import stat
from pathlib import Path


class RuntimeProblem(Exception):
    """Something that the runtime needs is missing or unusable.

    Attributes
    ----------
    where, found, expected, remedy : str
    """

    def __init__(self, where: str, found: str, expected: str, remedy: str = "") -> None:
        super().__init__(f"{where}: {found}; expected {expected}{f'; {remedy}' if remedy else ''}")
        self.where, self.found, self.expected, self.remedy = where, found, expected, remedy


class CacheError(RuntimeProblem):
    """A cache folder that cannot be used, or not safely."""


def cache_folder(part: str = "") -> Path:
    """Return the user's cache folder, or a folder in it, which is created if necessary and not writable by others.

    The folder is ``$GAC_CACHE``, or ``gacompiler`` under ``$XDG_CACHE_HOME`` or ``~/.cache``.

    Raises
    ------
    CacheError
        If it cannot be created, belongs to another user, or can be written by others.
    """
    chosen = os.environ.get("GAC_CACHE")
    try:
        caches = users_caches()
    except RuntimeError as error:  # this user has no home
        raise CacheError("~/.cache/gacompiler", str(error), "a home folder", "set GAC_CACHE to a folder") from None
    folder = Path(chosen) if chosen else caches / "gacompiler"
    for each in (folder, folder / part):
        reason = refusal(each)
        if reason:
            expected = "a folder that only you can write to"
            remedy = f"set GAC_CACHE to another one, or run `chmod 700 {each}` if you trust what is in it"
            raise CacheError(str(each), reason, expected, remedy)
    return folder / part


def users_caches() -> Path:
    """Return the folder of the user's caches: ``$XDG_CACHE_HOME``, which is ignored unless absolute, or ``~/.cache``.

    Raises
    ------
    RuntimeError
        If this user has no home folder.
    """
    chosen = Path(os.environ.get("XDG_CACHE_HOME", ""))
    return chosen if chosen.is_absolute() else Path.home() / ".cache"


def refusal(folder: Path) -> str:
    """Return the reason why files in a folder, which is created if necessary, cannot be trusted; empty if they can."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        own, link = folder.stat(), folder.lstat()
        above = {*folder.absolute().parents, *folder.resolve().parents}
        modes = {parent: parent.stat().st_mode for parent in above}
    except OSError as error:
        return f"it cannot be used: {error.strerror}"
    if not os.access(folder, os.R_OK | os.W_OK | os.X_OK):
        return "it is not writable"
    if not hasattr(os, "geteuid"):
        return ""  # Windows, where modes carry no information and users' folders are private
    user = os.geteuid()
    if own.st_uid != user or link.st_uid not in (user, 0):
        return "it belongs to another user"
    if own.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        return f"others may write to it (mode {stat.S_IMODE(own.st_mode):o})"
    open_to_all = sorted(p for p, mode in modes.items() if mode & stat.S_IWOTH and not mode & stat.S_ISVTX)
    return f"anyone may replace it, since anyone may write to {open_to_all[0]}" if open_to_all else ""
