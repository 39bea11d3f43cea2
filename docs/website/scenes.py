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


def shown(text: str, page: str) -> tuple[str, dict[str, str]]:
    """Return a page with its scenes, and the pages of these scenes by name.

    Parameters
    ----------
    text : str
        If a block shows a scene, all blocks are executed in order, as in a notebook.
    page : str
        The path from the root of the repository.
    """
    if not any(_SHOWN.search(block) for block in _BLOCK.findall(text)):
        return text, {}
    names: dict[str, Any] = {"__name__": page}
    files: dict[str, str] = {}
    place = PurePosixPath(page)

    def with_scene(match: re.Match[str]) -> str:
        exec(compile(match[1], page, "exec"), names)
        found = _SHOWN.search(match[1])
        if not found:
            return match[0]
        live = names[found[1]]
        name = f"{place.stem}-{found[1]}.html"
        files[name] = live.html()
        up = "../" * (len(place.parts) - 1)
        style = f"width:100%;height:{400 + 44 * len(live.sliders)}px;border:1px solid #8884;border-radius:8px"
        frame = f'<iframe src="{up}scenes/{name}" title="live scene" loading="lazy" style="{style}"></iframe>'
        return f"{match[0]}\n```{{raw}} html\n{frame}\n```\n"

    return _BLOCK.sub(with_scene, text), files
