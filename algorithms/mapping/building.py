"""Maps from streams of scans with odometry: whole logs at once."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike

from .built_map import BuildSettings, BuiltMap, Progress
from .carmen import CarmenLog, Problem, Reading
from .g2o import read_g2o
from .mapper import Mapper
from .scan import Scan


def build_map(
    source: str | Path | Iterable[Scan | Reading | tuple[Scan, ArrayLike | None, float | None]],
    settings: BuildSettings | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> BuiltMap:
    """Build a map of line segments from scans, with or without odometry.

    Parameters
    ----------
    source : path, or iterable
        A log of CARMEN; a graph of g2o with scans (``.g2o``, or a zip archive), whose vertices are the odometry; or an
        iterable of triples of a `Scan`, the odometry or None, and the time or None, such as `CarmenLog`; or of scans
        alone. The odometry is x, y and an angle, or a motor (4,).
    settings : BuildSettings, optional
    progress : callable, optional
        Called with a `Progress` after each scan and before each later stage.

    Returns
    -------
    BuiltMap

    Raises
    ------
    OSError
        If a file cannot be read.
    TypeError, ValueError
        If an element of the iterable has no `Scan`, its odometry has another shape, or a file is of another format.

    Notes
    -----
    Scans are read one at a time. Of each scan the pose and the status are kept, and of added ones also the readings on
    surfaces and the segments. `Mapper` takes scans one at a time.
    """
    readings, log = _readings(source)
    mapper, step = Mapper(settings), None
    for item in readings:
        step = mapper.add(*_parts(item))
        if progress is not None:
            progress(Progress(step.n_scans, step.n_added, step.n_loops, "scans"))
    problems = tuple(log())
    if step is None and isinstance(source, (str, Path)):
        why = f", line {problems[0].line}: {problems[0].reason}" if problems else ""
        raise ValueError(f"{source}: no scan in it; expected a log of CARMEN or a graph of g2o with scans{why}")
    return replace(mapper.map(progress), problems=problems)


def _readings(source: Any) -> tuple[Iterable[Any], Callable[[], Iterable[Problem]]]:
    if isinstance(source, (str, Path)):
        if str(source).endswith((".g2o", ".g2o.gz", ".zip")):
            graph = read_g2o(source)
            return graph.readings, lambda: graph.problems
        source = CarmenLog(source)
    return source, lambda: getattr(source, "problems", ())


def _parts(item: Any) -> tuple[Any, ...]:
    """Return the scan of an element, and its odometry and time if it has them."""
    parts = (item,) if isinstance(item, Scan) else item
    if not isinstance(parts, (tuple, list)) or not parts or not isinstance(parts[0], Scan):
        raise TypeError(f"scans: {type(item).__name__}; expected triples of a Scan, the odometry and the time")
    return tuple(parts[:3])
