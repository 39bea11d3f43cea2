"""The pages for beginners: the rows of the cheat sheet are true, and the site shows live scenes."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from website import scenes
from website.places import DOCS


def rows() -> Iterator[tuple[str, str]]:
    """The example and the result of each row of the cheat sheet."""
    for line in (DOCS / "cheat-sheet.md").read_text().splitlines():
        cells = [each.strip() for each in re.split(r"(?<!\\)\|", line)[1:-1]]
        if len(cells) == 4 and cells[2].startswith("`"):
            yield cells[2].strip("`").replace("\\|", "|"), cells[3].strip("`")


def test_every_row_of_the_cheat_sheet_is_true() -> None:
    names: dict[str, Any] = {}
    (block,) = re.findall(r"```python\n(.*?)```", (DOCS / "cheat-sheet.md").read_text(), re.DOTALL)
    exec(block, names)
    found = list(rows())
    assert len(found) >= 30
    for example, result in found:
        left, right = eval(example, names), eval(result, names)
        close = left.isclose(right) if hasattr(left, "isclose") else np.isclose(float(left), float(right))
        assert np.all(close), f"{example} is {left}, not {right}"


def test_the_other_libraries_are_those_of_the_page() -> None:
    text = (DOCS / "tutorials" / "coming-from.md").read_text()
    names = ("kingdon", "clifford", "galgebra", "ganja.js", "Gaalop", "Pinocchio", "OpenCV", "scipy")
    assert re.findall(r"^## (.*)$", text, re.MULTILINE) == list(names)


@pytest.mark.slow
def test_the_front_page_has_a_scene() -> None:
    text, files = scenes.shown((DOCS / "README.md").read_text(), "index.md")
    assert list(files) == ["index-mirror_scene.html", "index-sphere_scene.html"]
    assert all(f'src="scenes/{name}"' in text for name in files)


PAGE = """# A page

```python
from gacompiler.objects import PGA2, view
my_scene = view(lambda p: [p], drag=PGA2.point(1, 2))
my_scene
```

After.

```python
x = 1
```
"""


def test_the_site_shows_scenes_after_their_blocks() -> None:
    text, files = scenes.shown(PAGE, "docs/tutorials/page.md")
    assert list(files) == ["page-my_scene.html"] and "Live scene" in files["page-my_scene.html"]
    before, frame, after = re.split(r"(```\{raw\} html\n.*?```\n)", text, flags=re.DOTALL)
    assert before == PAGE.partition("After.")[0] and after.lstrip("\n").startswith("After.")
    assert 'src="../../scenes/page-my_scene.html"' in frame
    assert scenes.shown("# No scene\n", "docs/x.md") == ("# No scene\n", {})
    with pytest.raises(NameError):
        scenes.shown("```python\nother_scene\n```\n", "docs/x.md")
