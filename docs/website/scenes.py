"""Show live scenes on the site: after each block of a page whose last line is the name of one, such as ``my_scene``."""

from __future__ import annotations

import re
from pathlib import PurePosixPath
from typing import Any

from .places import BUILD

SCENES = BUILD / "site-scenes"
"""The folder of additional files of the site; its folder ``scenes`` has the pages of scenes."""

_BLOCK = re.compile(r"```python\n(.*?)```\n", re.DOTALL)
_SHOWN = re.compile(r"^(\w+_scene)\n\Z", re.MULTILINE)


def blocks(text: str) -> dict[str, str]:
    """Return the blocks of a page that show scenes, by the names of these."""
    return {found[1]: block for block in _BLOCK.findall(text) if (found := _SHOWN.search(block))}


def file_of(page: str, scene: str) -> str:
    """Return the name of the page of a scene."""
    return f"{PurePosixPath(page).stem}-{scene}.html"


def frame(page: str, file: str, height: int) -> str:
    """Return what shows a scene on a page, by the path of that page from the root."""
    up = "../" * (len(PurePosixPath(page).parts) - 1)
    style = f"width:100%;height:{height}px;border:1px solid #8884;border-radius:8px"
    text = f'<iframe src="{up}scenes/{file}" title="live scene" loading="lazy" style="{style}"></iframe>'
    return f"```{{raw}} html\n{text}\n```\n"


def shown(text: str, page: str) -> tuple[str, dict[str, str]]:
    """Return a page with its scenes, and the pages of these scenes by name.

    Parameters
    ----------
    text : str
        If a block shows a scene, all blocks are executed in order, as in a notebook.
    page : str
        The path from the root of the repository.
    """
    if not blocks(text):
        return text, {}
    names: dict[str, Any] = {"__name__": page}
    files: dict[str, str] = {}

    def with_scene(match: re.Match[str]) -> str:
        exec(compile(match[1], page, "exec"), names)
        found = _SHOWN.search(match[1])
        if not found:
            return match[0]
        live = names[found[1]]
        name = file_of(page, found[1])
        files[name] = live.html()
        return f"{match[0]}\n{frame(page, name, 400 + 44 * len(live.sliders))}"

    return _BLOCK.sub(with_scene, text), files
