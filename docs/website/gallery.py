"""Write the gallery: live scenes with their programs, and all pictures in pages, the demonstration and notebooks."""

from __future__ import annotations

import base64
import inspect
import json
import posixpath
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from . import scenes
from .contents import title_of
from .markdown import first_sentence, images
from .places import CONTENTS, DOCS, ROOT, notebooks, pages

INDEX = "index.md"
"""The page that the table of contents becomes."""

_DEMO = "algorithms/demo/programs.py"
_ENDINGS = {"image/png": "png", "image/svg+xml": "svg"}


@dataclass(frozen=True, slots=True)
class Picture:
    """One picture of the gallery, with its path from the root of the site."""

    path: str
    caption: str
    made_by: str
    """The source of the picture, in Markdown."""


def page(pictures: list[Picture]) -> str:
    """Return the page of the gallery."""
    parts = ["# Gallery\n", "## Scenes\n", "Points can be dragged; each program begins with the imports of its page.\n"]
    for place in (CONTENTS, *pages()):
        name = INDEX if place == CONTENTS else place.relative_to(ROOT).as_posix()
        title = title_of(place.read_text())
        for scene, block in scenes.blocks(place.read_text()).items():
            heading = scene.removesuffix("_scene").replace("_", " ").capitalize()
            parts.append(f"### {heading}\n\nFrom [{title}](/{name}).\n")
            parts.append(scenes.frame("", scenes.file_of(name, scene), 360))
            parts.append(f"```python\n{block}```\n")
    parts += ["## Pictures\n", "Every picture links to the page, program or notebook that it belongs to.\n"]
    parts.append("````{container} pictures\n")
    for each in pictures:
        about = f"{each.caption.rstrip('.')}. {each.made_by}"
        alt = re.sub(r"[`*\n]", "", each.caption)
        parts.append(f"```{{figure}} /{each.path}\n:alt: {alt}\n\n{about}\n```\n")
    return "\n".join(parts) + "````\n"


def of_pages() -> list[Picture]:
    """Return the pictures in ``docs/``, with the descriptions in the pages that show them."""
    shown: dict[str, Picture] = {}
    for path in pages():
        text = path.read_text()
        for target, description in images(text):
            if ":" in target:
                continue
            place = path.relative_to(ROOT).as_posix()
            picture = posixpath.normpath(posixpath.join(posixpath.dirname(place), target))
            maker = re.search(r"(`[^`\n]+`) writes this page", text)
            made = f"Made by {maker[1]}: " if maker else "From "
            shown.setdefault(picture, Picture(picture, description, f"{made}[{title_of(text)}](/{place})."))
    files = sorted(path for ending in ("png", "svg", "gif") for path in DOCS.rglob(f"*.{ending}"))
    unknown = [path.name for path in files if path.relative_to(ROOT).as_posix() not in shown]
    if unknown:
        raise ValueError(f"docs: no page shows {' '.join(unknown)}; add them to a page with a description")
    return [shown[name] for name in sorted(shown)]


def of_demo(source: Path) -> list[Picture]:
    """Run the demonstration, which writes its pictures into the folder of pages, and describe them."""
    from algorithms.demo import figures

    folder = source / "pictures" / "demo"
    subprocess.run(
        [sys.executable, "-m", "algorithms.demo", "--out", folder], cwd=ROOT, check=True, capture_output=True
    )
    found = []
    for path in sorted(folder.glob("*.png")):
        about = first_sentence(inspect.getdoc(getattr(figures, f"draw_{path.stem}")) or "")
        made = f"Made by `make demo`: [{_DEMO}](/{_DEMO})."
        found.append(Picture(path.relative_to(source).as_posix(), about, made))
    target = source / _DEMO
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text((ROOT / _DEMO).read_text())
    return found


def of_notebooks(source: Path) -> list[Picture]:
    """Write the pictures stored in notebooks to the folder of pages; each is described by the text before it."""
    found = []
    for path in notebooks():
        cells = json.loads(path.read_text())["cells"]
        title = title_of("".join(cells[0]["source"]))
        link = f"From the notebook [{title}](/{path.relative_to(ROOT).as_posix()})."
        for number, (data, ending, caption) in enumerate(_stored_pictures(cells), start=1):
            target = source / "pictures" / f"{path.stem}-{number}.{ending}"
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(data)
            found.append(Picture(target.relative_to(source).as_posix(), caption or title, link))
    return found


def _stored_pictures(cells: list[dict]) -> Iterator[tuple[bytes, str, str]]:
    """Yield the pictures in the outputs of cells: their bytes, the suffix of the file, and the text before them."""
    caption = ""
    for cell in cells:
        if cell["cell_type"] == "markdown":
            text = re.sub(r"^#.*$", "", "".join(cell["source"]), flags=re.MULTILINE).strip()
            caption = first_sentence(text) or caption
        for output in cell.get("outputs", ()):
            for kind, ending in _ENDINGS.items():
                data = output.get("data", {}).get(kind)
                if data is not None:
                    text = "".join(data)
                    yield (base64.b64decode(text) if ending == "png" else text.encode()), ending, caption
                    break
