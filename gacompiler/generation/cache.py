"""Results of the compiler on disk, found again by a digest of all that they depend on.

Each entry is a file: a line that says what it is, its key, a digest of its content, and the content, compressed JSON.
Files appear by a rename, whole or not at all, so that any number of processes can write at the same time; what is not
an entry of that key, or not whole, is no entry. The files used longest ago are removed where the limit is passed.
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
from pathlib import Path
from typing import Any

from ..cache_folder import cache_part, lasting_folder
from ..errors import BackendError

PART = "compilations"
"""The folder in the cache folder."""
MEGABYTES = 256
"""The limit, unless ``$GAC_CACHE_SIZE`` says otherwise."""

_HEAD = b"gacompiler cache entry, format 1\n"
_MEGABYTE = 1_000_000


@dataclass(frozen=True, slots=True)
class Cache:
    """A folder of entries.

    Attributes
    ----------
    folder : Path
        It belongs to the user alone; see `gacompiler.cache_folder`.
    limit : int
        The size of all entries, in bytes, that `prune` leaves.
    """

    folder: Path
    limit: int = MEGABYTES * _MEGABYTE

    def get(self, key: str) -> Any | None:
        """The value of a key, plain data; None where there is none, or its file is not whole."""
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
        """Keep a value. Where that fails, for want of space perhaps, there is no entry."""
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

    def prune(self) -> None:
        """Remove what was used longest ago, until the rest is within the limit."""
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


def _digest(content: bytes) -> bytes:
    return hashlib.sha256(content).hexdigest().encode()


def key_of(*parts: str) -> str:
    """A key from all that a value depends on."""
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()


def open_cache() -> Cache | None:
    """The user's cache; None where there is no place for one, or ``$GAC_CACHE_SIZE`` is 0.

    Raises
    ------
    BackendError
        When ``$GAC_CACHE`` cannot be used, or ``$GAC_CACHE_SIZE`` is no number.
    """
    limit = size_limit()
    if not limit or lasting_folder() is None:
        return None
    return Cache(cache_part(PART), limit)


def size_limit() -> int:
    """The size in bytes that entries may have together."""
    text = os.environ.get("GAC_CACHE_SIZE") or str(MEGABYTES)
    if not text.isdecimal():
        raise BackendError("GAC_CACHE_SIZE", repr(text), "a number of megabytes; 0 for no cache")
    return int(text) * _MEGABYTE
