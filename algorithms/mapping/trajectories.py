"""Readers and writers of trajectories: the text format of TUM, and tables of EuRoC."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from generated import pga3

from ..arguments import Reals, finite, real_array
from .named_columns import read_columns
from .text_files import UNIT, lines_of, text_of

_TUM = "timestamp tx ty tz qx qy qz qw"
_PLACE = [f"p_RS_R_{axis}" for axis in "xyz"]
_TURN = [f"q_RS_{axis}" for axis in "wxyz"]
_SPEED = [f"v_RS_R_{axis}" for axis in "xyz"]
_BIASES = [f"b_{kind}_RS_S_{axis}" for kind in "wa" for axis in "xyz"]
_INERTIAL = [f"{kind}_RS_S_{axis}" for kind in "wa" for axis in "xyz"]


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory:
    """Poses over time, with the numbers of a file."""

    times: Reals
    """(n,) In seconds."""
    places: Reals
    """(n, 3)"""
    quaternions: Reals
    """(n, 4) w, x, y, z."""
    nanoseconds: Reals | None = None
    """(n,) int64. The time stamps of EuRoC, which are exact."""
    velocities: Reals | None = None
    """(n, 3) In the frame of reference, as in files of EuRoC."""
    biases: Reals | None = None
    """(n, 6) Of angular rates and of specific forces, as in files of EuRoC."""

    @classmethod
    def of_motors(cls, times: Reals, motors: Reals) -> Trajectory:
        """Return the trajectory of times in seconds (n,) and unit motors (n, 8) of `generated.pga3`.

        Raises
        ------
        TypeError, ValueError
            If shapes or types differ from these, or numbers are not finite.
        """
        poses = finite(real_array(motors, "motors", (-1, 8)).astype(float), "motors")
        stamps = finite(real_array(times, "times", (len(poses),)).astype(float), "times")
        quaternions, places = pga3.motor_to_quaternion_translation(poses)
        return cls(stamps, np.asarray(places), np.asarray(quaternions))

    @property
    def motors(self) -> Reals:
        """(n, 8) The poses as unit motors of `generated.pga3`."""
        motors = pga3.motor_from_quaternion_translation(self.quaternions, self.places)
        return np.asarray(pga3.normalize_motor(motors))


class InertialRecording(NamedTuple):
    """Samples of an inertial sensor."""

    times: Reals
    """(n,) In seconds."""
    rates: Reals
    """(n, 3) In radians per second."""
    forces: Reals
    """(n, 3) Specific forces in metres per square second."""
    nanoseconds: Reals
    """(n,) int64. The time stamps of the file."""


def read_tum(path: str | Path) -> Trajectory:
    """Read a trajectory of lines ``timestamp tx ty tz qx qy qz qw``, as of the RGB-D benchmark of TUM.

    Parameters
    ----------
    path : path
        A text file, or one compressed by gzip. Lines that begin with ``#`` are comments.

    Raises
    ------
    OSError, ValueError
        If the file cannot be read, is of another kind, is cut off, or has numbers that are not finite or quaternions
        whose norm is not 1.
    """
    rows = []
    for line in lines_of(path, f"lines {_TUM}"):
        words = line.text.split()
        if not words or words[0].startswith("#"):
            continue
        if len(words) != 8:
            raise line.wrong(repr(line.text[:60]), f"8 numbers: {_TUM}")
        numbers = line.numbers(words, f"8 numbers: {_TUM}")
        line.unit(numbers[4:])
        rows.append(numbers)
    table = np.array(rows).reshape(-1, 8)
    return Trajectory(table[:, 0], table[:, 1:4], table[:, [7, 4, 5, 6]])


def write_tum(path: str | Path, trajectory: Trajectory) -> None:
    """Write a trajectory as `read_tum` reads it, with all digits.

    Parameters
    ----------
    path : path
    trajectory : Trajectory
        Its velocities and biases are left out.

    Raises
    ------
    ValueError
        If numbers are not finite, or quaternions have not the norm 1.
    """
    _check(trajectory)
    rows = np.column_stack([trajectory.times, trajectory.places, trajectory.quaternions[:, [1, 2, 3, 0]]])
    Path(path).write_text("\n".join([f"# {_TUM}", *text_of(rows, " ")]) + "\n", encoding="ascii")


def read_euroc(path: str | Path) -> Trajectory:
    """Read the ground truth of EuRoC: a table with the columns ``timestamp``, ``p_RS_R_x`` and so on.

    Velocities and biases are read if the file has them.

    Parameters
    ----------
    path : path
        A text file, or one compressed by gzip.

    Raises
    ------
    OSError, ValueError
        If the file cannot be read, lacks a column, is cut off, or has numbers that are not finite or quaternions whose
        norm is not 1.
    """
    table = read_columns(path)
    for name in ("timestamp", *_PLACE, *_TURN):
        if name not in table:
            raise ValueError(
                f"{path}, line 1: columns {', '.join(table)}; expected {name!r}, as in ground truth of EuRoC"
            )
    turns = _joined(table, _TURN)
    off = np.flatnonzero(np.abs(np.linalg.norm(turns, axis=1) - 1) > UNIT)
    if len(off):
        size = np.linalg.norm(turns[off[0]])
        raise ValueError(f"{path}: a quaternion of norm {size:.4g} in row {off[0] + 1}; expected norm 1")
    stamps = _stamps(path, table)
    return Trajectory(
        stamps * 1e-9, _joined(table, _PLACE), turns, stamps,
        _joined(table, _SPEED) if set(_SPEED) <= set(table) else None,
        _joined(table, _BIASES) if set(_BIASES) <= set(table) else None,
    )  # fmt: skip


def write_euroc(path: str | Path, trajectory: Trajectory) -> None:
    """Write a trajectory as a table of EuRoC, with all digits; times without nanoseconds are rounded to these.

    Parameters
    ----------
    path : path
    trajectory : Trajectory
        Its velocities and biases are written if it has them.

    Raises
    ------
    TypeError, ValueError
        If numbers are not finite, quaternions have not the norm 1, or velocities or biases have another shape.
    """
    _check(trajectory)
    stamps = trajectory.nanoseconds
    if stamps is None:
        stamps = np.round(trajectory.times * 1e9).astype(np.int64)
    names, parts = [*_PLACE, *_TURN], [trajectory.places, trajectory.quaternions]
    for name, more, values in (
        ("velocities", _SPEED, trajectory.velocities), ("biases", _BIASES, trajectory.biases),
    ):  # fmt: skip
        if values is not None:
            rows = finite(real_array(values, name, (len(trajectory.places), len(more))), name)
            names, parts = [*names, *more], [*parts, rows]
    texts = text_of(np.column_stack(parts), ",")
    lines = [
        f"#{','.join(['timestamp', *names])}",
        *(f"{stamp},{text}" for stamp, text in zip(stamps.tolist(), texts, strict=True)),
    ]
    Path(path).write_text("\n".join(lines) + "\n", encoding="ascii")


def read_euroc_inertial(path: str | Path) -> InertialRecording:
    """Read the inertial samples of EuRoC: a table with the columns ``timestamp``, ``w_RS_S_x`` and so on.

    Parameters
    ----------
    path : path
        A text file, or one compressed by gzip.

    Raises
    ------
    OSError, ValueError
        If the file cannot be read, lacks a column, is cut off, or has numbers that are not finite.
    """
    table = read_columns(path, ["timestamp", *_INERTIAL])
    stamps, values = _stamps(path, table), _joined(table, _INERTIAL)
    return InertialRecording(stamps * 1e-9, values[:, :3], values[:, 3:], stamps)


def _joined(table: dict[str, Reals], names: list[str]) -> Reals:
    return np.column_stack([table[name] for name in names]).astype(float)


def _stamps(path: str | Path, table: dict[str, Reals]) -> Reals:
    stamps = table["timestamp"]
    if len(stamps) and stamps.dtype.kind != "i":
        raise ValueError(f"{path}: time stamps {stamps[0]!r} and so on; expected whole nanoseconds")
    return stamps.astype(np.int64)


def _check(trajectory: Trajectory) -> None:
    for name in ("times", "places", "quaternions"):
        finite(np.asarray(getattr(trajectory, name)), name)
    if (np.abs(np.linalg.norm(trajectory.quaternions, axis=1) - 1) > UNIT).any():
        raise ValueError("quaternions: a norm that is not 1; expected unit quaternions")
