"""Reader of graphs of poses, with the scans taken there, in the text format of g2o."""

from __future__ import annotations

import codecs
import gzip
import io
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import numpy as np

from ..arguments import Reals
from ..precision import NEGLIGIBLE
from .carmen import FARTHEST, Problem, Reading, read_robotlaser

_NAMED = 3
"""A limit on work: kinds of lines that an error names."""


@dataclass(frozen=True, slots=True, eq=False)
class PoseGraphFile:
    """A graph of poses in the plane, as read from a file."""

    poses: Reals
    """(n, 3) x, y and the angle of each vertex, in the order of the file."""
    edges: Reals
    """(m, 2) int. The indices of the two poses of each edge."""
    motions: Reals
    """(m, 3) x, y and the angle of the second pose in the frame of the first."""
    information: Reals
    """(m, 3, 3) The inverse covariances of x, y and the angle, in this order."""
    readings: tuple[Reading, ...]
    """The scans, each with the pose of the vertex before it in the file as its odometry."""
    problems: tuple[Problem, ...]
    """Lines that could not be used."""


def read_g2o(path: str | Path, max_range: float = FARTHEST) -> PoseGraphFile:
    """Read lines ``VERTEX_SE2``, ``EDGE_SE2`` and ``ROBOTLASER1``; lines of other kinds are skipped.

    Parameters
    ----------
    path : path
        A text file, one compressed by gzip, or a zip archive with one such file.
    max_range : float, optional
        Ranges from this on count as not measured.

    Returns
    -------
    PoseGraphFile

    Raises
    ------
    OSError, ValueError
        If the file cannot be read, has no valid line of these kinds, such as a graph of poses in space, or if an
        archive is damaged or has no file whose name ends in ``.g2o``.

    Notes
    -----
    An edge whose vertices are missing, or whose information has a negative eigenvalue, is a problem, not an error. Of
    repeated vertices the first is used.
    """
    index: dict[int, int] = {}
    poses: list[list[float]] = []
    edges: list[tuple[int, int, int, list[float]]] = []
    readings: list[Reading] = []
    problems: list[Problem] = []
    kinds: dict[str, None] = {}
    with _opened(Path(path)) as file:
        for number, line in enumerate(_decoded(file, problems), 1):
            words = line.split()
            kinds.update(dict.fromkeys(words[:1]))
            try:
                if words[:1] == ["VERTEX_SE2"]:
                    pose = _numbers(words[2:5], 3)
                    if int(words[1]) in index:
                        raise ValueError(f"vertex {words[1]} appears twice")
                    index[int(words[1])] = len(poses)
                    poses.append(pose)
                elif words[:1] == ["EDGE_SE2"]:
                    edges.append((number, int(words[1]), int(words[2]), _numbers(words[3:12], 9)))
                elif words[:1] == ["ROBOTLASER1"]:
                    reading = read_robotlaser(line, max_range)
                    readings.append(reading._replace(odometry=np.array(poses[-1])) if poses else reading)
            except (ValueError, IndexError) as error:
                problems.append(Problem(number, f"{words[0]}: {error}; the line was left out"))
    if problems and not (poses or edges or readings):
        raise ValueError(
            f"{path}, line {problems[0].line}: {problems[0].reason}; expected a graph of poses in the plane"
        )
    if not (poses or edges or readings):
        raise ValueError(
            f"{path}: {'lines ' + ', '.join([repr(kind)[1:-1] for kind in kinds][:_NAMED]) if kinds else 'no line'}; "
            "expected VERTEX_SE2, EDGE_SE2 or ROBOTLASER1, a graph of poses in the plane"
        )
    table = np.array([values for *_, values in edges]).reshape(-1, 9)
    matrix = table[:, [3, 4, 5, 4, 6, 7, 5, 7, 8]].reshape(-1, 3, 3)
    values = np.linalg.eigvalsh(matrix)
    definite = values[:, 0] >= -NEGLIGIBLE * np.abs(values).max(1, initial=0)
    known = []
    for k, (number, a, b, _) in enumerate(edges):
        if a in index and b in index and definite[k]:
            known.append((k, index[a], index[b]))
            continue
        missing = f"no vertex {a if a not in index else b}" if a not in index or b not in index else ""
        reason = missing or "an information matrix with a negative eigenvalue"
        problems.append(Problem(number, f"EDGE_SE2: {reason}; the line was left out"))
    rows = np.array(known, np.int64).reshape(-1, 3)
    pairs, table, matrix = rows[:, 1:], table[rows[:, 0]], matrix[rows[:, 0]]
    return PoseGraphFile(
        np.array(poses).reshape(-1, 3), pairs, table[:, :3], matrix, tuple(readings), tuple(sorted(problems))
    )


def _numbers(words: list[str], n: int) -> list[float]:
    if len(words) < n:
        raise ValueError(f"{len(words)} numbers; expected {n}")
    numbers = [float(word) for word in words[:n]]
    if not np.isfinite(numbers).all():
        raise ValueError(f"{' '.join(words)}; expected finite numbers")
    return numbers


def _decoded(file: IO[bytes], problems: list[Problem]) -> Iterator[str]:
    number = 0
    try:
        for line in file:
            number += 1
            yield (line.removeprefix(codecs.BOM_UTF8) if number == 1 else line).decode("ascii", "replace")
    except (EOFError, OSError, zipfile.BadZipFile, zlib.error) as error:
        problems.append(Problem(number + 1, f"{error}; the file ends here"))


@contextmanager
def _opened(path: Path) -> Iterator[IO[bytes]]:
    with path.open("rb") as raw:
        start = raw.read(2)
        raw.seek(0)
        if start == b"\x1f\x8b":
            with gzip.GzipFile(fileobj=raw) as file:
                yield io.BufferedReader(file)
        elif start == b"PK":
            try:
                archive = zipfile.ZipFile(raw)
            except zipfile.BadZipFile as error:
                raise ValueError(f"{path}: {error}; expected a graph of poses in the plane") from None
            with archive:
                # Archives made on macOS have copies of attributes beside each file.
                names = [name for name in archive.namelist() if name.endswith(".g2o") and "__MACOSX" not in name]
                if not names:
                    raise ValueError(
                        f"{path}: files {', '.join(archive.namelist()) or 'none'}; expected one named *.g2o"
                    )
                with archive.open(names[0]) as file:
                    yield file
        else:
            yield raw
