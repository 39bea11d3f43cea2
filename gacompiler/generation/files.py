"""Write generated files, and compare existing files with their expected text."""

from __future__ import annotations

import difflib
import os
import tempfile
from collections.abc import Mapping
from pathlib import Path

from ..errors import BackendError


def write(files: Mapping[str, str | bytes], folder: Path) -> list[Path]:
    """Write files atomically: all are first written under temporary names in the same folder, then renamed.

    Returns the paths of the files whose content changed.

    Raises
    ------
    BackendError
        If the folder cannot be written; existing files are then unchanged.
    """
    temporary: dict[Path, Path] = {}
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in files.items():
            path, content = folder / name, text.encode() if isinstance(text, str) else text
            if path.is_file() and path.read_bytes() == content:
                continue
            path.parent.mkdir(parents=True, exist_ok=True)
            handle, scratch = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
            temporary[path] = Path(scratch)
            with os.fdopen(handle, "wb") as stream:
                stream.write(content)
            os.chmod(scratch, 0o644)
        for path, scratch_path in temporary.items():
            os.replace(scratch_path, path)
    except OSError as error:
        for scratch_path in temporary.values():
            scratch_path.unlink(missing_ok=True)
        raise BackendError(
            str(folder), error.strerror or str(error), "a writable folder", "choose another with -o"
        ) from error
    return list(temporary)


def compare(files: Mapping[str, str], folder: Path) -> list[str]:
    """Return unified diffs from the files in `folder` to their expected text; empty if all are up to date."""
    diffs = []
    for name, text in files.items():
        path = folder / name
        found = path.read_text().splitlines(keepends=True) if path.is_file() else []
        diff = difflib.unified_diff(found, text.splitlines(keepends=True), f"{path}", f"{path} (as generated now)")
        diffs.append("".join(diff))
    return [diff for diff in diffs if diff]
