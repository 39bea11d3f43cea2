"""Folders of packages that descriptions of robots name: ``package://name/...`` and ``$(find name)``."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

_NAME = re.compile(r"<name>\s*([^<>\s]+)\s*</name>")


def folders_of(name: str, start: Path) -> Iterator[Path]:
    """Yield the folders of a package, nearest first: those above a file that have its name, or contain a folder of it.

    The name of a package is that in its ``package.xml``, and mostly that of its folder, too.
    """
    for folder in (start, *start.parents):
        if name in (folder.name, _name_of(folder)):
            yield folder
        if (folder / name).is_dir():
            yield folder / name


def _name_of(folder: Path) -> str | None:
    """Return the name in the ``package.xml`` of a folder, None if there is none."""
    try:
        found = _NAME.search((folder / "package.xml").read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError):
        return None
    return found[1] if found else None
