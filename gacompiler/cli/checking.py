"""Commands that prove generated modules: ``gac check`` and ``gac verify``."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import click

from ..backends import runtime_files
from ..errors import StaleError
from ..gac_runtime.names import RUNTIME
from ..generation.cache import Cache
from ..generation.checked_in import generated_folder, own_specs
from ..generation.compiling import AnyCompiled, Progress, compile_kernels, source_of
from ..generation.files import compare
from ..generation.rendering import render
from ..generation.selection import select
from ..generation.spec_files import Spec
from ..generation.workers import each_spec
from ..runtime import load_module
from ..verify import Verdict, verify_module
from .arguments import compiled_kernels, find_spec, is_own, own_modules, rendered
from .framework import command
from .options import algebra_option, cache_option, effort_option, jobs_option, json_option, model_option, only_option
from .output import near, print_table, progress_bar


@command("gac check", "gac check pga3", "gac check --prove")
@click.argument("names", nargs=-1)
@click.option("--prove", is_flag=True, help="Also verify the files, like `gac verify`.")
@jobs_option
@cache_option
def check(names: tuple[str, ...], prove: bool, jobs: int, cache: Cache | None) -> None:
    """Check that the modules under generated/ are up to date with their specs.

    Each module is generated again and compared with the files on disk. If they differ, the differences are printed and
    the exit status is 1.
    """
    folder = generated_folder()
    found = own_modules(names)
    verdicts: list[tuple[str, Verdict]] = []
    if prove:
        with progress_bar(sum(len(spec.kernels) for spec in found)) as advance:
            results = each_spec(partial(_rendered_and_proved, folder=folder, cache=cache), found, advance, jobs)
        texts = [files for files, _ in results]
        verdicts = [verdict for _, rows in results for verdict in rows]
    else:
        texts = rendered(found, jobs, cache)
    files = runtime_files() | {name: text for each in texts for name, text in each.items()}
    diffs = compare(files, folder)
    known = {f"{path.stem}.{ending}" for path in own_specs() for ending in ("py", "pyi", "c", "h")} | {"__init__.py"}
    known |= set(runtime_files())
    paths = [*folder.glob("*.*"), *(folder / RUNTIME).rglob("*.*")]
    names_found = {path.relative_to(folder).as_posix() for path in paths if path.suffix in (".py", ".pyi", ".c", ".h")}
    orphans = sorted(names_found - known)
    for diff in diffs:
        click.echo(diff)
    if diffs or orphans:
        stale = f"{len(diffs)} files differ" + (f", no spec generates {' '.join(orphans)}" if orphans else "")
        raise StaleError(str(folder), stale, remedy="run `make generated`, and delete files that no spec generates")
    click.echo(f"{near(folder)}: {len(files)} files are up to date")
    if prove:
        _end_with(verdicts)
        click.echo(f"{len(verdicts)} kernels are proved")


@command(
    "gac verify my_kernels.py            verify the files in out/",
    "gac verify my_kernels.py -o build   verify the files in build/",
    "gac verify pga3                     verify a module under generated/",
)
@click.argument("specs", nargs=-1)
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    default=None,
    help="Folder of the generated files [default: out].",
)
@click.option("--all", "own", is_flag=True, help="Verify every module under generated/.")
@json_option
@cache_option
@algebra_option
@effort_option
@model_option
@only_option
def verify(
    specs: tuple[str, ...],
    output: Path | None,
    own: bool,
    as_json: bool,
    cache: Cache | None,
    algebra: str | None,
    effort: int,
    model: str,
    only: tuple[str, ...],
) -> None:
    """Prove that generated files on disk compute what their specs define.

    The files are read back, and every kernel is compared with its definition at exact rational points that satisfy the
    relations of its arguments. The rounding error of the code that runs is then measured in ulp. The exit status is 1
    if any kernel is not proved. --effort and --cost are those that the files were generated with.
    """
    found = own_modules(()) if own else [find_spec(spec, algebra) for spec in specs]
    if not found:
        raise click.UsageError("name at least one spec, or give --all")
    rows: list[tuple[str, Verdict]] = []
    for spec in select(found, only):
        folder = output or (generated_folder() if is_own(spec) else Path("out"))
        rows += _verdicts(spec, compiled_kernels(spec, cache, effort, model), folder)
    if as_json:
        click.echo(json.dumps([{"module": m, **_verdict(v)} for m, v in rows], indent=2))
    else:
        print_table(
            ["kernel", "proved", "points", "error/ulp", "runs on", "difference"],
            [
                [f"{m}.{v.kernel}", _proved(v), str(v.points), f"{v.error:.1f}", v.runs_on, v.python or v.c]
                for m, v in rows
            ],
        )
    _end_with(rows)


def _rendered_and_proved(
    spec: Spec, progress: Progress, folder: Path, cache: Cache | None
) -> tuple[dict[str, str], list[tuple[str, Verdict]]]:
    """Return the files of a spec as generated now, and the verdicts on its files in a folder."""
    compiled = compile_kernels(spec, progress, cache)
    return render(source_of(spec, compiled)), _verdicts(spec, compiled, folder)


def _verdicts(spec: Spec, compiled: Sequence[AnyCompiled], folder: Path) -> list[tuple[str, Verdict]]:
    """Return a verdict on each kernel of a spec from its files on disk and the module that they give, by module."""
    path = folder / f"{spec.name}.py"
    module = load_module(path, f"_gac_verify_{spec.name}") if path.is_file() else None
    return [(spec.name, verdict) for verdict in verify_module(folder, spec.name, compiled, module)]


def _end_with(rows: Sequence[tuple[str, Verdict]]) -> None:
    """Exit with status 1 if any kernel is not proved."""
    failed = [f"{m}.{v.kernel}" for m, v in rows if not v.is_proved]
    if failed:
        click.echo(f"{len(failed)} of {len(rows)} kernels are not proved: {' '.join(failed)}", err=True)
        sys.exit(1)


def _verdict(verdict: Verdict) -> dict[str, Any]:
    return {name: getattr(verdict, name) for name in Verdict.__slots__} | {"proved": verdict.is_proved}


def _proved(verdict: Verdict) -> str:
    return ("exactly" if verdict.is_rational else "to 40 digits") if verdict.is_proved else "NO"
