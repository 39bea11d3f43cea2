"""The command that shows and empties the folder of what was compiled: ``gac cache``."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
from pathlib import Path

import click

from ..cache_folder import cache_part, lasting_folder
from ..generation.cache import PART, size_limit
from .framework import command, json_option
from .output import print_table

PARTS = {
    PART: "programs with their proof, and printed modules",
    "modules": "of gacompiler.compile, with their libraries",
    "objects": "libraries of operations on numeric objects",
    "_build": "the extension that calls kernels",
    "libraries": "of modules in folders that cannot be written",
    "runtime": "the compiled runtime, which is linked into libraries",
    "locks": "files that keep two processes from building the same",
}
"""The folders in the cache folder, and what is in them."""


@command(
    "gac cache                     where it is, and how large",
    "gac cache --clear             remove all that is in it",
    "GAC_CACHE_SIZE=50 gac generate my_kernels.py    keep at most 50 MB of compilations",
    "gac generate my_kernels.py --no-cache",
)
@click.option("--clear", is_flag=True, help="Remove what is in it.")
@json_option
def cache(clear: bool, as_json: bool) -> None:
    """Show where compiled kernels are kept and how much space they take, or remove them.

    GAC_CACHE names the folder; it must be one that only you can write. GAC_CACHE_SIZE is the size in MB that
    compilations may have together (256 by default, 0 to keep none): those used longest ago are removed.
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
        click.echo("nothing is kept: the folder of caches cannot be used; name another one by GAC_CACHE")
        return
    click.echo(f"{place}: at most {_megabytes(limit)} of compilations")
    header = ["part", "files", "size", "what it holds"]
    print_table(header, [[part, str(n), _megabytes(size), PARTS[part]] for part, (n, size) in rows.items()])


def _empty(folder: Path) -> None:
    """Remove what is in a folder, but not the folder: a program that runs may be about to write to it."""
    for path in folder.iterdir():
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink(missing_ok=True)


def _size(folder: Path) -> tuple[int, int]:
    """The number of files below a folder, and the sum of their sizes."""
    sizes = []
    for place, _, names in os.walk(folder):
        for name in names:
            with contextlib.suppress(OSError):  # another process has removed it
                sizes.append(os.lstat(os.path.join(place, name)).st_size)
    return len(sizes), sum(sizes)


def _megabytes(size: int) -> str:
    return f"{size / 1e6:.1f} MB"
