"""Occupancy grids of ROS: an image in the format pgm, and a description in YAML beside it."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..arguments import Reals
from .text_files import Line, lines_of

_KEYS = ("image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh")
_MODES = ("trinary", "scale", "raw")
FREE, OCCUPIED, UNKNOWN = 0, 100, -1
"""Numbers of cells, as in messages ``nav_msgs/OccupancyGrid``."""


@dataclass(frozen=True, slots=True, eq=False)
class OccupancyGrid:
    """A map of cells, with the numbers of the files of ``map_server``."""

    pixels: Reals
    """(height, width) uint8 or uint16. The image, whose first row has the largest y."""
    resolution: float
    """The size of a cell, in metres."""
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """The place of the lower left corner, and the angle of the map."""
    negate: bool = False
    """Whether bright pixels are occupied; otherwise dark ones are."""
    occupied_thresh: float = 0.65
    """Cells with a larger probability are occupied."""
    free_thresh: float = 0.196
    """Cells with a smaller probability are free."""
    mode: str = "trinary"
    """How pixels become cells: ``trinary``, ``scale`` or ``raw``."""
    depth: int = 255
    """The number of the brightest pixel."""

    @property
    def probabilities(self) -> Reals:
        """(height, width) The probability that a cell is occupied, in the order of the image."""
        share = self.pixels / self.depth
        return np.asarray(share if self.negate else 1 - share)

    @property
    def cells(self) -> Reals:
        """(height, width) int8. As in messages of ROS: 0 free to 100 occupied, -1 unknown; row 0 has the least y."""
        if self.mode == "raw":
            found = np.where(self.pixels <= OCCUPIED, self.pixels, UNKNOWN)
        else:
            share = self.probabilities
            between: Any = UNKNOWN
            span = self.occupied_thresh - self.free_thresh
            # Between equal thresholds there is no scale.
            if self.mode == "scale" and span > 0:
                between = np.rint(1 + 98 * (share - self.free_thresh) / span)
            found = np.where(share > self.occupied_thresh, OCCUPIED, np.where(share < self.free_thresh, FREE, between))
        return found[::-1].astype(np.int8)


def read_occupancy_grid(path: str | Path) -> OccupancyGrid:
    """Read the description of a map of ROS, a file ``.yaml``, and its image in the format pgm.

    Parameters
    ----------
    path : path
        The description. The image is beside it, unless its path is absolute.

    Raises
    ------
    OSError, ValueError
        If a file cannot be read, lacks a key, is of another kind or is cut off, or if numbers are not finite.
    """
    values: dict[str, tuple[Line, str]] = {}
    kind = f"the keys {', '.join(_KEYS)} of a map"
    every = lines_of(path, kind)
    for line in every:
        key, colon, value = _entry(line.text)
        if key in ("", "---", "...") and not colon:
            continue
        if not colon:
            raise line.wrong(repr(line.text[:60]), kind)
        values[key] = line, value
    for key in _KEYS:
        if key not in values:
            raise every[-1].wrong(f"the keys {', '.join(values)}", f"{key!r} as well")
    line, text = values["origin"]
    inner = re.fullmatch(r"\[([^\[\]]*)\]", text)
    origin = line.numbers(inner[1].split(",") if inner else [text], "[x, y, angle]")
    if len(origin) != 3:
        raise line.wrong(text, "[x, y, angle]")
    resolution, negate, occupied, free = (
        values[key][0].numbers([values[key][1]], f"{key} as a number")[0]
        for key in ("resolution", "negate", "occupied_thresh", "free_thresh")
    )
    mode = values.get("mode", (every[0], "trinary"))[1]
    for key, expected in _faults(resolution, negate, occupied, free, mode):
        raise values[key][0].wrong(values[key][1], expected)
    pixels, depth = _read_pgm(Path(path).parent / values["image"][1])
    return OccupancyGrid(
        pixels, resolution, (origin[0], origin[1], origin[2]), bool(negate), occupied, free, mode, depth
    )  # fmt: skip


def write_occupancy_grid(path: str | Path, grid: OccupancyGrid) -> None:
    """Write the description of a map, a file ``.yaml``, and its image of the same name with the end ``.pgm``.

    Parameters
    ----------
    path : path
        The description, whose name ends in ``.yaml`` or ``.yml``.
    grid : OccupancyGrid

    Raises
    ------
    ValueError
        If `read_occupancy_grid` would refuse the files: the path has another end or a name that YAML would cut, the
        image has no pixels or is not (height, width) of uint8 or uint16, or numbers are not finite or out of range.
    """
    path, pixels = Path(path), np.asarray(grid.pixels)
    if path.suffix not in (".yaml", ".yml"):
        raise ValueError(f"path: {path.name}; expected a name that ends in .yaml")
    image = path.with_suffix(".pgm")
    if not image.name.isprintable() or _entry(f"image: {image.name}") != ("image", ":", image.name):
        raise ValueError(f"path: {path.name!r}; expected a name without ' #', quotes at its ends and line breaks")
    numbers = [grid.resolution, *grid.origin, grid.occupied_thresh, grid.free_thresh]
    if len(grid.origin) != 3 or not np.isfinite(numbers).all():
        raise ValueError(f"grid: {numbers}; expected finite numbers, and 3 of the origin")
    for key, expected in _faults(grid.resolution, grid.negate, grid.occupied_thresh, grid.free_thresh, grid.mode):
        raise ValueError(f"{key}: {getattr(grid, key)!r}; expected {expected}")
    if pixels.ndim != 2 or not pixels.size or pixels.dtype.kind != "u":
        raise ValueError(f"pixels: shape {pixels.shape}, {pixels.dtype}; expected (h, w) of uint8 or uint16")
    if not 0 < grid.depth < 2**16 or pixels.max() > grid.depth:
        raise ValueError(f"pixels: up to {pixels.max()}; expected at most the depth, {grid.depth}, below {2**16}")
    wide = np.dtype(">u2" if grid.depth > 255 else "u1")
    head = f"P5\n{pixels.shape[1]} {pixels.shape[0]}\n{grid.depth}\n".encode("ascii")
    image.write_bytes(head + pixels.astype(wide).tobytes())
    lines = [
        f"image: {image.name}", f"mode: {grid.mode}", f"resolution: {float(grid.resolution)!r}",
        f"origin: [{', '.join(repr(float(x)) for x in grid.origin)}]", f"negate: {int(grid.negate)}",
        f"occupied_thresh: {float(grid.occupied_thresh)!r}", f"free_thresh: {float(grid.free_thresh)!r}",
    ]  # fmt: skip
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _entry(text: str) -> tuple[str, str, str]:
    """Return the key, the colon and the value of a line of YAML. Comments begin after white space or with the line."""
    key, colon, value = re.split(r"(?:^|\s)#", text)[0].partition(":")
    return key.strip(), colon, value.strip().strip("'\"")


def _faults(resolution: float, negate: float, occupied: float, free: float, mode: str) -> list[tuple[str, str]]:
    """Return the keys whose values are wrong, and what is expected."""
    conditions = (
        (resolution > 0, "resolution", "a positive size"),
        (negate in (0, 1), "negate", "0 or 1"),
        (0 <= free <= occupied <= 1, "free_thresh", "0 to occupied_thresh, which is at most 1"),
        (mode in _MODES, "mode", "trinary, scale or raw"),
    )
    return [(key, expected) for ok, key, expected in conditions if not ok]


def _read_pgm(path: Path) -> tuple[Reals, int]:
    data = path.read_bytes()
    head = re.match(rb"(P[25])(?:\s|#[^\n]*\n)+(\d+)(?:\s|#[^\n]*\n)+(\d+)(?:\s|#[^\n]*\n)+(\d+)\s", data)
    if head is None:
        raise ValueError(f"{path}: begins with {data[:8]!r}; expected an image in the format pgm, P5 or P2")
    width, height, depth = (int(each) for each in head.groups()[1:])
    if not 0 < depth < 2**16 or not width * height:
        raise ValueError(f"{path}: {width} x {height} pixels up to {depth}; expected some pixels up to at most 65535")
    kind = np.dtype(">u2" if depth > 255 else "u1")
    body = data[head.end() :]
    if head[1] == b"P2":
        words = re.sub(rb"#[^\n]*", b"", body).split()
        try:
            pixels = np.array([int(word) for word in words])
        except ValueError:
            raise ValueError(f"{path}: pixels that are no whole numbers; expected numbers up to {depth}") from None
    else:
        pixels = np.frombuffer(body[: len(body) // kind.itemsize * kind.itemsize], kind)
    if len(pixels) != width * height or (head[1] == b"P5" and len(body) != width * height * kind.itemsize):
        raise ValueError(f"{path}: {len(pixels)} pixels; expected {width} x {height}")
    if pixels.max(initial=0) > depth or pixels.min(initial=0) < 0:
        raise ValueError(f"{path}: a pixel {pixels.max()}; expected 0 to {depth}")
    return pixels.astype(kind.newbyteorder("=")).reshape(height, width), depth
