"""The user's folder for what is compiled where modules are in a folder that cannot be written."""

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
    """A cache that cannot be used, or not safely."""


def cache_folder(part: str = "") -> Path:
    """The user's cache, or a folder in it, which nobody else can write; it is made if it is not there.

    It is ``$GAC_CACHE``, or ``gacompiler`` under ``$XDG_CACHE_HOME`` or ``~/.cache``.

    Raises
    ------
    CacheError
        When it cannot be made, belongs to somebody else, or can be written by others.
    """
    chosen = os.environ.get("GAC_CACHE")
    try:
        home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
        folder = _own_folder(Path(chosen) if chosen else home / "gacompiler")
        return _own_folder(folder / part) if part else folder
    except (OSError, RuntimeError) as error:
        where = chosen or "~/.cache/gacompiler"
        raise CacheError(where, str(error), "a folder that can be written", "set GAC_CACHE to one") from error


def _own_folder(folder: Path) -> Path:
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    found = folder.stat()
    if hasattr(os, "getuid") and found.st_uid != os.getuid():
        raise CacheError(str(folder), "it belongs to another user", "a cache of one's own", "set GAC_CACHE to one")
    if os.name == "posix" and found.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        raise CacheError(
            str(folder), "others can write to it", "a folder that only its owner can write", f"chmod 700 {folder}"
        )
    return folder
