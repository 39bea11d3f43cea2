"""Draw the moving picture of the README: a screw motion of a box about a line, by ``python -m website.motion``.

The picture is an SVG file whose paths are animated, computed with `gacompiler.objects`. Its text depends on the program
only.
"""

from __future__ import annotations

import itertools
import sys
from typing import Any

import numpy as np

from gacompiler.objects import PGA3

from .places import DOCS

PICTURE = DOCS / "motion.svg"
_FRAMES, _SECONDS, _TURNS, _RISE = 48, 6, 1.0, 2.0
_WIDTH, _HEIGHT, _SCALE = 720, 300, 86.0
_CORNERS = np.array(list(itertools.product((-0.35, 0.35), (0.25, 0.75), (0.2, 0.65))))
_FACES = ((0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5))
_AXIS = np.array([[-2.6, 0.0, 0.0], [2.6, 0.0, 0.0]])

_HEAD = f"""\
<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH} {_HEIGHT}" role="img"
 aria-label="A box turns about a line and moves along it; a corner draws a helix.">
<style>
text {{ font: 600 15px system-ui, sans-serif; fill: #57606a; }}
.axis {{ stroke: #2ca02c; }} .trail {{ stroke: #d62728; }} .box {{ stroke: #1f77b4; fill: #1f77b4; }}
@media (prefers-color-scheme: dark) {{
text {{ fill: #9aa3ad; }} .axis {{ stroke: #5cc65c; }} .trail {{ stroke: #ff7b72; }}
.box {{ stroke: #79b8ff; fill: #79b8ff; }}
}}
</style>
"""


def picture() -> str:
    """Return the text of the picture."""
    line = PGA3.line([0, 0, 0], [1, 0, 0])
    times = np.linspace(0, 1, _FRAMES + 1)
    motors = PGA3.motor(line, 2 * np.pi * _TURNS * times, _RISE * (times - 0.5) * 2)
    moved = PGA3.coordinates(motors[:, None] >> PGA3.point(_CORNERS))
    flat = _projected(moved)
    corner = flat[:, 7]
    trail = _path(corner)
    faces = [[_path(frame[list(face)], True) for frame in flat] for face in _FACES]
    axis = _path(_projected(_AXIS))
    parts = [f'<path class="axis" d="{axis}" stroke-width="3" stroke-linecap="round"/>']
    parts.append(f'<path class="trail" d="{trail}" fill="none" stroke-width="2" stroke-dasharray="2 5"/>')
    shown = 'class="box" fill-opacity="0.14" stroke-width="1.6" stroke-linejoin="round"'
    parts += [f'<path {shown} d="{texts[0]}">{_animated("d", texts)}</path>' for texts in faces]
    x, y = ([f"{value:.0f}" for value in corner[:, k]] for k in range(2))
    parts.append(f'<circle class="trail" fill="#d62728" r="4">{_animated("cx", x)}{_animated("cy", y)}</circle>')
    words = "line = p &amp; q", "motor = PGA3.motor(line, angle, distance)", "motor &gt;&gt; box"
    parts += [f'<text x="18" y="{26 + 22 * k}">{word}</text>' for k, word in enumerate(words)]
    return _HEAD + "\n".join(parts) + "\n</svg>\n"


def _projected(places: Any) -> Any:
    """Return positions in the picture of places, seen from the front, the right and above."""
    right, up = np.array([0.96, 0.28, 0.0]), np.array([-0.1, 0.34, 0.93])
    return np.stack([_WIDTH / 2 + _SCALE * (places @ right), 0.56 * _HEIGHT - _SCALE * (places @ up)], -1)


def _path(places: Any, is_closed: bool = False) -> str:
    return "M" + "L".join(f"{x:.0f} {y:.0f}" for x, y in places) + "Z" * is_closed


def _animated(name: str, values: list[str]) -> str:
    return f'<animate attributeName="{name}" dur="{_SECONDS}s" repeatCount="indefinite" values="{";".join(values)}"/>'


if __name__ == "__main__":
    PICTURE.write_text(picture())
    sys.stdout.write(f"{PICTURE.name}\n")
