"""Graphs of poses in space in the text format of g2o, and the writer of graphs in the plane and in space."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from generated import pga3

from ..arguments import Reals, finite
from ..evidence.triangles import from_triangle
from .g2o import PoseGraphFile
from .text_files import UNIT, Line, lines_of, text_of

_POSE = "x y z qx qy qz qw"
_KINDS = "VERTEX_SE3:QUAT and EDGE_SE3:QUAT, a graph of poses in space"
_TURNS_FIRST = [3, 4, 5, 0, 1, 2]


@dataclass(frozen=True, slots=True, eq=False)
class SpaceGraphFile:
    """A graph of poses in space, with the numbers of a file."""

    vertices: Reals
    """(n,) int64. The numbers of vertices, in the order of the file."""
    poses: Reals
    """(n, 7) x, y, z and the quaternion qx, qy, qz, qw of each vertex."""
    edges: Reals
    """(m, 2) int64. The rows of the two poses of each edge."""
    motions: Reals
    """(m, 7) The second pose in the frame of the first, as `poses`."""
    information: Reals
    """(m, 6, 6) The inverse covariances of the translation and the rotation, in this order."""
    fixed: Reals
    """(k,) int64. The rows of poses that are fixed."""

    @property
    def motors(self) -> Reals:
        """(n, 8) The poses as unit motors of `generated.pga3`: a start for `optimise_poses`."""
        return _motors(self.poses)

    @property
    def motion_motors(self) -> Reals:
        """(m, 8) The motions of edges as unit motors."""
        return _motors(self.motions)

    @property
    def turns_first(self) -> Reals:
        """(m, 6, 6) The inverse covariances of rotation vectors and translations, as `optimise_poses` takes them.

        As in gtsam and Ceres, the numbers of the file are those of rotation vectors; g2o has half of these.
        """
        return np.ascontiguousarray(self.information[:, _TURNS_FIRST][:, :, _TURNS_FIRST])


def read_g2o_space(path: str | Path) -> SpaceGraphFile:
    """Read lines ``VERTEX_SE3:QUAT``, ``EDGE_SE3:QUAT`` and ``FIX`` of a graph of poses in space.

    Parameters
    ----------
    path : path
        A text file, or one compressed by gzip. Lines that begin with ``#`` are comments.

    Raises
    ------
    OSError, ValueError
        If the file cannot be read, has lines of other kinds, such as a graph in the plane, is cut off, repeats a vertex
        or lacks one of an edge, or has numbers that are not finite or quaternions whose norm is not 1.
    """
    index: dict[int, int] = {}
    poses: list[list[float]] = []
    edges: list[tuple[Line, int, int, list[float]]] = []
    fixed: list[tuple[Line, int]] = []
    for line in lines_of(path, _KINDS):
        words = line.text.split()
        if not words or words[0].startswith("#"):
            continue
        if words[0] == "VERTEX_SE3:QUAT":
            number = _number(line, words, 1)
            if number in index:
                raise line.wrong(f"vertex {number} for the second time", "each vertex once")
            index[number] = len(poses)
            poses.append(_numbers(line, words[2:], 7, f"{_POSE} of a vertex"))
        elif words[0] == "EDGE_SE3:QUAT":
            a, b = _number(line, words, 1), _number(line, words, 2)
            edges.append((line, a, b, _numbers(line, words[3:], 28, f"{_POSE} and 21 of the information of an edge")))
        elif words[0] == "FIX":
            fixed += [(line, _number(line, words, k)) for k in range(1, max(len(words), 2))]
        else:
            raise line.wrong(repr(words[0][:40]), f"lines {_KINDS}")
    for line, *numbers in [(line, a, b) for line, a, b, _ in edges] + list(fixed):
        for number in numbers:
            if number not in index:
                raise line.wrong(f"vertex {number}, which the file lacks", "vertices of the file")
    table = np.array([values for *_, values in edges]).reshape(-1, 28)
    information = from_triangle(table[:, 7:], 6)
    pairs = np.array([(index[a], index[b]) for _, a, b, _ in edges], np.int64).reshape(-1, 2)
    return SpaceGraphFile(
        np.array(list(index), np.int64), np.array(poses).reshape(-1, 7), pairs, table[:, :7], information,
        np.array([index[number] for _, number in fixed], np.int64),
    )  # fmt: skip


def write_g2o(path: str | Path, graph: PoseGraphFile | SpaceGraphFile) -> None:
    """Write a graph of poses in the plane or in space, with all digits; the scans of the former are left out.

    Parameters
    ----------
    path : path
    graph : PoseGraphFile or SpaceGraphFile
        As from `read_g2o` or `read_g2o_space`.

    Raises
    ------
    ValueError
        If numbers are not finite, quaternions have not the norm 1, or an information is not symmetric.
    """
    for name in ("poses", "motions", "information"):
        finite(np.asarray(getattr(graph, name)), name)
    if not np.array_equal(graph.information, np.swapaxes(graph.information, 1, 2)):
        raise ValueError("information: not symmetric; expected symmetric matrices")
    lines = []
    if isinstance(graph, PoseGraphFile):
        vertex, edge, upper, numbers = "VERTEX_SE2", "EDGE_SE2", np.triu_indices(3), np.arange(len(graph.poses))
    else:
        vertex, edge, upper, numbers = "VERTEX_SE3:QUAT", "EDGE_SE3:QUAT", np.triu_indices(6), graph.vertices
        for rows in (graph.poses, graph.motions):
            if (np.abs(np.linalg.norm(rows[:, 3:], axis=1) - 1) > UNIT).any():
                raise ValueError("poses: a quaternion whose norm is not 1; expected unit quaternions")
        lines = [f"FIX {number}" for number in numbers[graph.fixed].tolist()]
    poses = text_of(graph.poses, " ")
    more = text_of(np.concatenate([graph.motions, graph.information[:, upper[0], upper[1]]], 1), " ")
    found = [f"{vertex} {number} {text}" for number, text in zip(numbers.tolist(), poses, strict=True)]
    pairs = numbers[graph.edges].tolist()
    found += [f"{edge} {a} {b} {text}" for (a, b), text in zip(pairs, more, strict=True)]
    Path(path).write_text("\n".join(found + lines) + "\n", encoding="ascii")


def _motors(rows: Reals) -> Reals:
    motors = pga3.motor_from_quaternion_translation(rows[:, [6, 3, 4, 5]], np.ascontiguousarray(rows[:, :3]))
    return np.asarray(pga3.normalize_motor(motors))


def _number(line: Line, words: list[str], place: int) -> int:
    if len(words) <= place:
        raise line.wrong(repr(line.text[:60]), "the number of a vertex")
    return line.whole(words[place], "the number of a vertex")


def _numbers(line: Line, words: list[str], n: int, meaning: str) -> list[float]:
    if len(words) != n:
        raise line.wrong(f"{len(words)} numbers", f"{n}: {meaning}")
    found = line.numbers(words, f"{n} numbers: {meaning}")
    line.unit(found[3:7])
    return found
