"""A cache on disk of results of the compiler, indexed by a digest of everything they depend on.

Each entry is a file with a header line, its key, a digest of its content, and the content as compressed JSON. Files are
written under a temporary name and renamed, so that several processes can write at the same time. A file that is
incomplete, or has a different key, is ignored. The least recently used files are removed when the size limit is
exceeded.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import tempfile
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from ..cache_folder import cache_part, lasting_folder
from ..errors import BackendError

PART = "compilations"
"""The name of the folder inside the cache folder."""
MEGABYTES = 256
"""The default limit, which ``$GAC_CACHE_SIZE`` overrides."""

_HEAD = b"gacompiler cache entry, format 1\n"
_MEGABYTE = 1_000_000


@dataclass(frozen=True, slots=True)
class Cache:
    """A folder of entries.

    Attributes
    ----------
    folder : Path
        A folder to which only the user can write; see `gacompiler.cache_folder`.
    limit : int
        The maximum total size of all entries after `prune`, in bytes.
    """

    folder: Path
    limit: int = MEGABYTES * _MEGABYTE

    def get(self, key: str) -> Any | None:
        """Return the value of a key as plain data, or None if there is no complete entry."""
        path = self.folder / key
        try:
            content = path.read_bytes()
        except OSError:
            return None
        head = _HEAD + f"{key}\n".encode()
        if not content.startswith(head):
            return None
        found, _, packed = content[len(head) :].partition(b"\n")
        if found != _digest(packed):
            return None
        with contextlib.suppress(OSError):
            os.utime(path)
        try:
            return json.loads(zlib.decompress(packed))
        except (zlib.error, ValueError):
            return None

    def put(self, key: str, value: Any) -> None:
        """Store a value. Errors, such as a full disk, are ignored and leave no entry.

        After its first entry, a process removes what is beyond the limit: the folder may have ten thousands of files.
        """
        packed = zlib.compress(json.dumps(value, separators=(",", ":")).encode(), 1)
        content = b"\n".join([_HEAD + key.encode(), _digest(packed), packed])
        with contextlib.suppress(OSError):
            handle, scratch = tempfile.mkstemp(dir=self.folder, prefix=".")
            try:
                with os.fdopen(handle, "wb") as stream:
                    stream.write(content)
                os.replace(scratch, self.folder / key)
            except OSError:
                os.unlink(scratch)
        _prune_once(self)

    def prune(self) -> None:
        """Remove the least recently used entries until the rest is within the limit."""
        used = sorted(self._files(), key=lambda each: (each[1].st_mtime_ns, each[0]), reverse=True)
        size = 0
        for path, state in used:
            size += state.st_size
            if size > self.limit:
                with contextlib.suppress(OSError):
                    os.unlink(path)

    def _files(self) -> Iterator[tuple[str, os.stat_result]]:
        with contextlib.suppress(OSError), os.scandir(self.folder) as entries:
            for entry in entries:
                with contextlib.suppress(OSError):  # another process has removed it
                    yield entry.path, entry.stat()


@cache
def _prune_once(folder: Cache) -> None:
    folder.prune()


def _digest(content: bytes) -> bytes:
    return hashlib.sha256(content).hexdigest().encode()


def key_of(*parts: str) -> str:
    """Compute a key from everything that a value depends on."""
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()


def open_cache() -> Cache | None:
    """Open the user's cache; return None if no folder can be used, or ``$GAC_CACHE_SIZE`` is 0.

    Raises
    ------
    BackendError
        If ``$GAC_CACHE`` cannot be used, or ``$GAC_CACHE_SIZE`` is not a number.
    """
    limit = size_limit()
    if not limit or lasting_folder() is None:
        return None
    return Cache(cache_part(PART), limit)


def size_limit() -> int:
    """Return the maximum total size of the entries in bytes."""
    text = os.environ.get("GAC_CACHE_SIZE") or str(MEGABYTES)
    if not text.isdecimal():
        raise BackendError("GAC_CACHE_SIZE", repr(text), "a number of megabytes, or 0 to disable the cache")
    return int(text) * _MEGABYTE
