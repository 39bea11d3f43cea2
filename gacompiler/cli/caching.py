"""The command that shows and clears the cache: ``gac cache``."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
from pathlib import Path

import click

from ..cache_folder import cache_part, lasting_folder
from ..generation.cache import PART, size_limit
from .framework import command
from .options import json_option
from .output import print_table

PARTS = {
    PART: "proved programs and generated text",
    "modules": "modules made by gacompiler.compile, with their libraries",
    "objects": "libraries of operations on numeric objects",
    "_build": "the extension module that calls kernels",
    "libraries": "libraries of modules in read-only folders",
    "runtime": "the compiled runtime, which is linked into libraries",
    "locks": "lock files that prevent two processes from building the same library",
}
"""The folders in the cache, and their contents."""


@command(
    "gac cache                     show its location and size",
    "gac cache --clear             remove its contents",
    "GAC_CACHE_SIZE=50 gac generate my_kernels.py    limit compilations to 50 MB",
    "gac generate my_kernels.py --no-cache",
)
@click.option("--clear", is_flag=True, help="Remove the contents of the cache.")
@json_option
def cache(clear: bool, as_json: bool) -> None:
    """Show the location and size of the cache of compiled kernels, or clear it.

    The environment variable GAC_CACHE sets the folder, to which only you may have write permission. GAC_CACHE_SIZE
    limits the total size of the compilations in MB (default 256; 0 disables the cache). The least recently used
    compilations are removed first.
    """
    place, limit = lasting_folder(), size_limit()
    folders = {part: cache_part(part) for part in PARTS} if place else {}
    if clear:
        for folder in folders.values():
            _empty(folder)
    rows = {part: _size(folder) for part, folder in folders.items()}
    if as_json:
        sizes = {part: {"files": n, "bytes": size} for part, (n, size) in rows.items()}
        click.echo(json.dumps({"place": place and str(place), "limit": limit, "parts": sizes}, indent=2))
        return
    if place is None:
        click.echo("nothing is cached: the cache folder cannot be used; set GAC_CACHE to another folder")
        return
    click.echo(f"{place}: at most {_megabytes(limit)} of compilations")
    header = ["part", "files", "size", "what it holds"]
    print_table(header, [[part, str(n), _megabytes(size), PARTS[part]] for part, (n, size) in rows.items()])


def _empty(folder: Path) -> None:
    """Remove the contents of a folder, but keep the folder: a running program may be about to write to it."""
    for path in folder.iterdir():
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink(missing_ok=True)


def _size(folder: Path) -> tuple[int, int]:
    """Return the number of files below a folder and the sum of their sizes in bytes."""
    sizes = []
    for place, _, names in os.walk(folder):
        for name in names:
            with contextlib.suppress(OSError):  # another process has removed it
                sizes.append(os.lstat(os.path.join(place, name)).st_size)
    return len(sizes), sum(sizes)


def _megabytes(size: int) -> str:
    return f"{size / 1e6:.1f} MB"
