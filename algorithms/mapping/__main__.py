"""The command ``python -m algorithms.mapping``: build a map of line segments from a log of laser scans."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import Progress as Bar
from rich.progress import SpinnerColumn, TextColumn, TimeElapsedColumn

from ..extras import extra
from .building import build_map
from .built_map import BuildSettings, BuiltMap, Progress
from .carmen import CarmenLog
from .g2o import read_g2o

_EXAMPLES = """examples:
  python -m algorithms.mapping office.log.gz -o map.svg
  python -m algorithms.mapping graph.g2o.zip -o map.png --map map.npz --poses poses.csv
  python -m algorithms.mapping office.log --no-loops --lines 2000 -o drift.pdf

A log has lines FLASER or ROBOTLASER1 with scans and, as a rule, ODOM with odometry; it may be compressed by
gzip. A file .g2o, .g2o.gz or .zip has ROBOTLASER1 lines after the vertices that serve as odometry.
The exit status is 0 if a map was built, and 1 if not."""


def main(arguments: list[str] | None = None) -> int:
    """Run the command.

    Parameters
    ----------
    arguments : list of str, optional
        Command-line arguments. By default those of the process.

    Returns
    -------
    int
        The exit status.
    """
    parser = argparse.ArgumentParser(
        prog="python -m algorithms.mapping", description="Build a map of line segments from a log of laser scans.",
        epilog=_EXAMPLES, formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.add_argument("log", type=Path, help="the log")
    parser.add_argument("-o", "--output", type=Path, metavar="FILE", help="picture of the map: .svg, .png or .pdf")
    parser.add_argument("--map", type=Path, metavar="FILE", help="write the segments as .npz (LineMap.load reads it)")
    parser.add_argument("--poses", type=Path, metavar="FILE", help="write x, y, angle and status of each scan as .csv")
    parser.add_argument("--no-loops", action="store_true", help="do not recognise earlier places")
    parser.add_argument("--lines", type=int, default=600, metavar="N", help="keep the N longest segments [%(default)s]")
    options = parser.parse_args(arguments)
    console = Console(stderr=True)
    try:
        for path in (options.output, options.map, options.poses):
            if path is not None and not path.parent.is_dir():
                raise ValueError(f"{path.parent}: no such folder; expected one to write {path.name} to")
        settings = BuildSettings(close_loops=not options.no_loops, most_lines=options.lines)
        built = _built(options.log, settings, console)
        if not len(built.added):
            raise ValueError(f"{options.log}: {len(built.motors)} scans, none with enough readings; no map was written")
        _write(built, options)
    except (OSError, ValueError, ImportError) as error:
        print(f"mapping: {error}", file=sys.stderr)
        return 1
    _report(built, console)
    return 0


def _built(log: Path, settings: BuildSettings, console: Console) -> BuiltMap:
    columns = (SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
    with Bar(*columns, console=console, transient=True) as bar:
        task = bar.add_task(f"Reading {log.name}", total=None)

        def show(progress: Progress) -> None:
            stage = {"scans": "Matching scans", "poses": "Optimising poses", "lines": "Fusing segments"}[progress.stage]
            numbers = f"{progress.n_scans} scans, {progress.n_added} in the map, {progress.n_loops} loops closed"
            bar.update(task, description=f"{stage}: {numbers}")

        return build_map(log, settings, show)


def _write(built: BuiltMap, options: argparse.Namespace) -> None:
    if options.map is not None:
        built.line_map.save(options.map)
    if options.poses is not None:
        table = np.column_stack([built.poses, built.statuses])
        np.savetxt(options.poses, table, "%.6f,%.6f,%.8f,%d", header="x,y,angle,status", comments="")
    if options.output is not None:
        with extra("pictures", "the picture of a map"):
            from .pictures_of_maps import draw_map
        readings = read_g2o(options.log).readings if _is_graph(options.log) else CarmenLog(options.log)
        draw_map(built, [reading.scan for reading in readings]).savefig(options.output, dpi=150)


def _is_graph(path: Path) -> bool:
    return path.name.endswith((".g2o", ".g2o.gz", ".zip"))


def _report(built: BuiltMap, console: Console) -> None:
    lines = [
        f"{len(built.motors)} scans, {len(built.added)} in the map",
        f"{len(built.line_map)} segments, {built.line_map.lengths.sum():.0f} m, residual {100 * built.residual:.1f} cm",
        f"{len(built.closures)} loops closed, {built.n_wrong_closures} of them contradicted by others",
    ]
    lines += [f"{count} scans refused: {reason}" for reason, count in built.refused.items()]
    lines += [f"line {problem.line}: {problem.reason}" for problem in built.problems]
    console.print("\n".join(lines), highlight=False, markup=False)


if __name__ == "__main__":
    sys.exit(main())
