"""The command line: ``gac``. All commands are in one file: they share how specs are found and errors are told."""

from __future__ import annotations

import compileall
import json
import os
import sys
import traceback
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import click
from rich import progress as bars
from rich.console import Console
from rich.table import Table

from . import __version__
from .algebra.catalog import CATALOG, orthogonal
from .backends import build_library, no_compiler, runtime_files
from .backends.build import processors
from .backends.python import RUNTIME
from .errors import GacError, SpecError, StaleError
from .frontend.kernel import Kernel
from .generate import (
    TARGETS,
    Progress,
    Spec,
    compare,
    compile_kernels,
    compile_spec,
    generated_folder,
    load_spec,
    own_specs,
    render,
    render_targets,
    source_of,
    write,
)
from .inspect import SHOWN, STAGES, described, latex, stage_text
from .inspect import why as why_text
from .passes.pipeline import compile_kernel
from .passes.record import Compilation
from .prove import Verdict, verify_module
from .robots.descriptions import robot_spec
from .runtime import load_module
from .workers import each_spec


def _wants_traceback(context: click.Context, _: click.Parameter, wanted: bool) -> None:
    if wanted:
        context.find_root().meta[_DEBUG] = True


_DEBUG = "gacompiler.debug"
"""Where the root's context notes that ``--debug`` was given, before a command's name or after it."""


class Command(click.Command):
    """A command with ``--debug``."""

    def __init__(self, *arguments: Any, **named: Any) -> None:
        super().__init__(*arguments, **named)
        about = "Print the traceback of an error too."
        self.params.append(
            click.Option(["--debug"], is_flag=True, expose_value=False, callback=_wants_traceback, help=about)
        )


class Commands(click.Group):
    """Turns errors people can act on into one line and exit status 1."""

    command_class = Command

    def invoke(self, context: click.Context) -> Any:
        """Run a command."""
        try:
            return super().invoke(context)
        except GacError as error:
            if context.meta.get(_DEBUG):
                traceback.print_exception(error)
            Console(stderr=True, highlight=False, soft_wrap=True).print(f"[red]gac: error:[/] {_plain(str(error))}")
            sys.exit(1)


def _plain(text: str) -> str:
    return text.replace("[", r"\[")


def _examples(*lines: str) -> str:
    return "\b\nExamples:\n" + "\n".join(f"  {line}" for line in lines)


@click.group(
    cls=Commands,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog=_examples(
        "gac new my_kernels          write a starter spec",
        "gac generate my_kernels.py  write my_kernels.py, .c and .h into out/, and build the C",
        "gac show my_kernels.py:move_point",
    ),
)
@click.version_option(__version__)
@click.option(
    "--debug", is_flag=True, expose_value=False, callback=_wants_traceback, help="Print the traceback of an error too."
)
def main() -> None:
    """Compile geometric-algebra definitions into specialised, proved kernels."""


_algebra = click.option(
    "--algebra", "algebra", default=None, help="Of scripts (.clu): cga, 3dpga, ..., or a folder with definition.csv."
)
_json = click.option("--json", "as_json", is_flag=True, help="Print JSON instead of a table.")
_jobs = click.option(
    "-j",
    "--jobs",
    type=click.IntRange(min=1),
    default=processors,
    help="Compile so many modules at a time [default: as many as there are processors].",
)


@main.command(
    epilog=_examples(
        "gac generate my_kernels.py -o out",
        "gac generate my_kernels.py --target rust --target cuda   out/my_kernels.rs and .cu, no C",
        "gac generate --all           the modules under generated/",
        "gac generate --all pga3 cga3",
        "gac generate horizon.clu --algebra cga3   a script of Gaalop's language",
    )
)
@click.argument("specs", nargs=-1)
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), default=None, help="Folder to write to [default: out]."
)
@click.option("--all", "own", is_flag=True, help="Regenerate the modules under generated/ (or those named).")
@click.option("--no-build", is_flag=True, help="Do not compile the C.")
@click.option(
    "--target",
    "targets",
    type=click.Choice(["c", *TARGETS]),
    multiple=True,
    default=("c",),
    show_default=True,
    help="A language to write; may be given again. c is C with the Python module; the others are one file for a spec.",
)
@_jobs
@_algebra
def generate(
    specs: tuple[str, ...],
    output: Path | None,
    own: bool,
    no_build: bool,
    targets: tuple[str, ...],
    jobs: int,
    algebra: str | None,
) -> None:
    """Write a module (.py, .c, .h) for each spec file, and compile its C if a compiler is there.

    Other languages are written as one file, with functions of one element and over batches; what they are given is
    described at its top. A module under generated/ goes to out/ in these.
    """
    if not specs and not own:
        raise click.UsageError("name at least one spec file, or give --all")
    others = [target for target in TARGETS if target in targets]
    elsewhere = output or Path("out")
    found = _own(specs) if own else [load_spec(Path(spec), algebra=algebra) for spec in specs]
    with _progress(sum(len(spec.kernels) for spec in found)) as advance:
        modules = each_spec(compile_spec, found, advance, jobs)
    in_others = [render_targets(module, others) for module in modules]
    in_c = [render(module) for module in modules] if "c" in targets else []
    for spec, files in zip(found, in_others, strict=True):
        for name, text in files.items():
            unchanged = "" if write({name: text}, elsewhere) else ", unchanged"
            click.echo(f"{_near(elsewhere / name)}: {len(spec.kernels)} kernels{unchanged}")
    folder = generated_folder() if own and output is None else elsewhere
    if in_c:
        write(runtime_files(), folder)
    for spec, files in zip(found, in_c, strict=False):
        changed = write(files, folder)
        built = None if no_build else build_library(folder / f"{spec.name}.c")
        state = f"{len(spec.kernels)} kernels" + (", unchanged" if not changed else "")
        click.echo(f"{_near(folder / spec.name)}.py .c .h: {state}" + (f", built {built.name}" if built else ""))
    if in_c and not no_build and build_library(folder / f"{found[0].name}.c") is None:
        click.echo(f"note: {no_compiler()}", err=True)


@main.command(epilog=_examples("gac build             the modules under generated/", "gac build out"))
@click.argument("folder", required=False, type=click.Path(path_type=Path))
@click.option("--force", is_flag=True, help="Compile again even where a library is current.")
def build(folder: Path | None, force: bool) -> None:
    """Compile the C files of a folder of generated modules."""
    place = folder or generated_folder()
    sources = sorted(place.glob("*.c"))
    if not sources:
        raise SpecError(str(place), "no generated C file in it", remedy="run `gac generate` first")
    for source in sources:
        if Console(stderr=True).is_terminal:
            click.echo(f"{_near(source)} ...", err=True)
        compileall.compile_file(source.with_suffix(".py"), quiet=2)  # reading the text is most of an import
        library = build_library(source, force=force)
        if library is None:
            click.echo(f"note: {no_compiler()}", err=True)
            return
        click.echo(f"{_near(source)}: {library.name}, {library.stat().st_size / 1e6:.2f} MB")


@main.command(epilog=_examples("gac check", "gac check pga3", "gac check --prove"))
@click.argument("names", nargs=-1)
@click.option("--prove", is_flag=True, help="Also prove the files, as `gac verify` does.")
@_jobs
def check(names: tuple[str, ...], prove: bool, jobs: int) -> None:
    """Compare generated/ with what the specs give now; print the differences and exit 1 if there are any."""
    folder = generated_folder()
    found = _own(names)
    work = partial(_rendered_and_proved, folder=folder if prove else None)
    with _progress(sum(len(spec.kernels) for spec in found)) as advance:
        results = each_spec(work, found, advance, jobs)
    files = runtime_files() | {name: text for texts, _ in results for name, text in texts.items()}
    verdicts = [verdict for _, rows in results for verdict in rows]
    diffs = compare(files, folder)
    known = {f"{path.stem}.{ending}" for path in own_specs() for ending in ("py", "c", "h")} | {"__init__.py"}
    known |= set(runtime_files())
    paths = [*folder.glob("*.*"), *(folder / RUNTIME).rglob("*.*")]
    names_found = {path.relative_to(folder).as_posix() for path in paths if path.suffix in (".py", ".c", ".h")}
    orphans = sorted(names_found - known)
    for diff in diffs:
        click.echo(diff)
    if diffs or orphans:
        stale = f"{len(diffs)} files differ" + (f", no spec makes {' '.join(orphans)}" if orphans else "")
        raise StaleError(str(folder), stale, remedy="run `make generated`, or delete what no spec makes")
    click.echo(f"{_near(folder)}: {len(files)} files are what the specs give")
    if prove:
        _end_with(verdicts)
        click.echo(f"{len(verdicts)} kernels are proved")


@main.command(
    epilog=_examples(
        "gac show my_kernels.py:move_point",
        "gac show my_kernels.py:move_point --stage candidates",
        "gac show my_kernels.py:move_point --why",
        "gac show my_kernels.py:move_point --latex",
    )
)
@click.argument("target", metavar="SPEC:KERNEL")
@click.option("--stage", type=click.Choice(list(STAGES)), help="Only this stage.")
@click.option("--why", is_flag=True, help="What each step of the program taken saves, and what was not tried.")
@click.option("--latex", "as_latex", is_flag=True, help="The definition and the program as LaTeX.")
@_algebra
def show(target: str, stage: str | None, why: bool, as_latex: bool, algebra: str | None) -> None:
    """Show how a kernel is made, stage by stage."""
    record = compile_kernel(_kernel(target, algebra))
    if as_latex:
        click.echo(latex(record))
        return
    if why:
        click.echo(why_text(record))
        return
    chosen = (stage,) if stage else SHOWN
    console = Console(highlight=False, soft_wrap=True)
    for name in chosen:
        if len(chosen) > 1:
            console.print(f"[bold cyan]{name}[/]")
        click.echo(stage_text(record, name) + ("\n" if len(chosen) > 1 else ""))


@main.command(
    epilog=_examples(
        "gac cost my_kernels.py", "gac cost my_kernels.py --json", "gac cost pga3            a module under generated/"
    )
)
@click.argument("spec")
@_json
@_algebra
def cost(spec: str, as_json: bool, algebra: str | None) -> None:
    """Count the operations of every kernel: mul, add, div, sqrt, call, choice, fma."""
    records = _compiled(_spec(spec, algebra))
    counts = {record.kernel.name: record.cost.as_dict() for record in records}
    if as_json:
        click.echo(json.dumps(counts, indent=2))
        return
    _table(
        ["kernel", "mul", "add", "div", "sqrt", "call", "choice", "fma"],
        [[n, *map(str, c.values())] for n, c in counts.items()],
    )


@main.command(
    epilog=_examples(
        "gac verify my_kernels.py          the files in out/, if they are there",
        "gac verify pga3",
        "gac verify my_kernels.py -o build",
    )
)
@click.argument("specs", nargs=-1)
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    default=None,
    help="Folder of the generated files [default: out].",
)
@click.option("--all", "own", is_flag=True, help="Every module under generated/.")
@_json
@_algebra
def verify(specs: tuple[str, ...], output: Path | None, own: bool, as_json: bool, algebra: str | None) -> None:
    """Prove the generated files on disk: read them back and compare every kernel with its definition.

    Exact rational points that satisfy the relations decide; what runs is then measured in ulp. Exit status 1 if any
    kernel is not proved.
    """
    found = _own(()) if own else [_spec(spec, algebra) for spec in specs]
    if not found:
        raise click.UsageError("name at least one spec, or give --all")
    rows: list[tuple[str, Verdict]] = []
    for spec in found:
        folder = output or (generated_folder() if _is_own(spec) else Path("out"))
        rows += _verdicts(spec, _compiled(spec), folder)
    if as_json:
        click.echo(json.dumps([{"module": m, **_verdict(v)} for m, v in rows], indent=2))
    else:
        _table(
            ["kernel", "proved", "points", "error/ulp", "runs on", "difference"],
            [
                [f"{m}.{v.kernel}", _proved(v), str(v.points), f"{v.error:.1f}", v.runs_on, v.python or v.c]
                for m, v in rows
            ],
        )
    _end_with(rows)


def _rendered_and_proved(
    spec: Spec, progress: Progress, folder: Path | None
) -> tuple[dict[str, str], list[tuple[str, Verdict]]]:
    """The files of a spec, and what is known of those in a folder if one is given."""
    records = compile_kernels(spec, progress)
    return render(source_of(spec, records)), _verdicts(spec, records, folder) if folder else []


def _verdicts(spec: Spec, records: Sequence[Compilation], folder: Path) -> list[tuple[str, Verdict]]:
    """What is known of the files of a spec on disk, and of what runs, by module."""
    path = folder / f"{spec.name}.py"
    module = load_module(path, f"_gac_verify_{spec.name}") if path.is_file() else None
    return [(spec.name, verdict) for verdict in verify_module(folder, spec.name, records, module)]


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


@main.command(
    "list",
    epilog=_examples(
        "gac list                     algebras and checked-in modules",
        "gac list my_kernels.py       its kernels",
        "gac list PGA3                its layouts",
    ),
)
@click.argument("what", required=False)
@_json
def list_(what: str | None, as_json: bool) -> None:
    """List algebras and modules, the kernels of a spec, or the layouts of an algebra."""
    if what in CATALOG:
        algebra = CATALOG[what]
        rows = [[layout.name, described(layout)] for layout in algebra.layouts.values()]
        header = ["layout", "what it holds"]
    elif what is not None and not Path(what).is_file() and what not in {path.stem for path in own_specs()}:
        known = f"an algebra ({' '.join(CATALOG)}), a module ({' '.join(path.stem for path in own_specs())}) or a file"
        raise SpecError(what, "no algebra, module or file of that name", known)
    elif what is not None:
        header = ["kernel", "parameters", "summary"]
        rows = [
            [
                k.name,
                ", ".join(f"{p.name}: {p.layout}{list(p.outer_shape) or ''}" for p in k.parameters),
                k.summary.split("\n")[0],
            ]
            for k in _spec(what).kernels
        ]
    else:
        header = ["name", "kind", "about"]
        rows = [[a.name, "algebra", " ".join(a.vectors)] for a in CATALOG.values()]
        for path in own_specs():
            spec = load_spec(path)
            rows.append([f"generated.{path.stem}", f"{len(spec.kernels)} kernels", spec.summary.split("\n")[0]])
    if as_json:
        click.echo(json.dumps([dict(zip(header, row, strict=True)) for row in rows], indent=2))
    else:
        _table(header, rows)


@main.command(
    epilog=_examples(
        "gac robot panda.urdf -o out",
        "gac robot panda.urdf --tip panda_link8 --lock panda_finger_joint1 --lock panda_finger_joint2",
        "gac robot ur5                one that algorithms.kinematics knows by name",
    )
)
@click.argument("robot")
@click.option("-o", "--output", type=click.Path(path_type=Path), default=Path("out"), show_default=True)
@click.option("--name", help="Of the module [default: the robot's].")
@click.option("--tip", help="The link that is the end effector [default: the one most joints away].")
@click.option("--lock", multiple=True, help="A joint that is held at 0; may be given again.")
@click.option("--no-build", is_flag=True, help="Do not compile the C.")
def robot(robot: str, output: Path, name: str | None, tip: str | None, lock: tuple[str, ...], no_build: bool) -> None:
    """Write a module (.py, .c, .h) for one robot, a URDF file or a name, with its constants folded.

    Its kernels are forward, jacobian, inverse_dynamics and mass_matrix, each over the vector of all joints. The spec is
    kept in specs/ beside them, for `gac show` and `gac verify`.
    """
    module, text = robot_spec(robot, name, tip, lock)
    path = output / "specs" / f"{module}.py"
    write({path.name: text}, path.parent)
    spec = load_spec(path, f"gac robot {robot}")
    with _progress(len(spec.kernels)) as advance:
        files = render(compile_spec(spec, advance))
    write(files, output)
    built = None if no_build else build_library(output / f"{module}.c")
    click.echo(
        f"{_near(output / module)}.py .c .h: {len(spec.kernels)} kernels" + (f", built {built.name}" if built else "")
    )
    if built is None and not no_build:
        click.echo(f"note: {no_compiler()}", err=True)


@main.command(epilog=_examples("gac new my_kernels", "gac new my_kernels --algebra CGA3"))
@click.argument("name")
@click.option("--algebra", type=click.Choice(list(CATALOG)), default="PGA3", show_default=True)
def new(name: str, algebra: str) -> None:
    """Write a commented starter spec NAME.py in this folder."""
    stem = name.removesuffix(".py")
    if not stem.isidentifier():
        raise SpecError(name, "cannot name a module", "letters, digits and _")
    path = Path(f"{stem}.py")
    if path.exists():
        raise SpecError(str(path), "exists already", remedy="choose another name")
    template = Path(__file__).parent / "backends" / "templates" / "spec.py.txt"
    first = next(layout.name for layout in CATALOG[algebra].layouts.values() if layout.size > 1)
    write({path.name: template.read_text().replace("ALGEBRA", algebra).replace("LAYOUT", first)}, path.parent)
    click.echo(f"{path}: edit it, then run `gac generate {path}`")


@main.command(
    epilog=_examples(
        "gac record arm.py -o arm_kernels.py        then: gac generate arm_kernels.py",
        "gac record arm.py -o arm_kernels.py -- --steps 100    what follows -- is for the program",
    )
)
@click.argument("script", type=click.Path(path_type=Path))
@click.argument("arguments", nargs=-1, type=click.UNPROCESSED)
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="The spec to write.")
@click.option("--force", is_flag=True, help="Write over a spec that is there.")
def record(script: Path, arguments: tuple[str, ...], output: Path, force: bool) -> None:
    """Run a program that uses numeric objects, and write a spec of exactly the kernels that it used."""
    from .objects.recording import record as recorded

    if output.suffix != ".py" or not output.stem.isidentifier():
        raise SpecError(str(output), "cannot name a spec", "a name of letters, digits and _ that ends in .py")
    if output.exists() and not force:
        raise SpecError(str(output), "exists already", remedy="choose another name, or give --force")
    write({output.name: recorded(script, arguments)}, output.parent)
    click.echo(f"{output}: {len(load_spec(output).kernels)} kernels; run `gac generate {output}`")


@main.command(
    epilog=_examples(
        "gac classify 3 0 1           projective geometry of space",
        "gac classify 1 3 --matrices  the matrices of the basis vectors, exactly",
        "gac classify 4 1 --json",
    )
)
@click.argument("p", type=click.IntRange(0))
@click.argument("q", type=click.IntRange(0), default=0)
@click.argument("r", type=click.IntRange(0), default=0)
@click.option("--matrices", is_flag=True, help="Print the matrices of the basis vectors.")
@_json
def classify(p: int, q: int, r: int, matrices: bool, as_json: bool) -> None:
    """Which algebra of matrices G(P, Q, R) is: P vectors of square +1, Q of -1 and R of 0.

    R(n), C(n) and H(n) are n x n matrices of real and complex numbers and quaternions, 2R(n) and 2H(n) pairs of them,
    and the sign after them the Grassmann algebra of the degenerate part.
    """
    from .structure.representation import Representation
    from .structure.summary import generator_rows, summary

    found = summary(p, q, r)
    representation = Representation(orthogonal(p, q, r)) if matrices else None
    if as_json:
        data: dict[str, Any] = dict(found)
        if representation is not None:
            data["units"] = list(representation.numbers.names)
            data["generators"] = {
                name: generator.tolist()
                for name, generator in zip(representation.algebra.vectors, representation.generators, strict=True)
            }
        click.echo(json.dumps(data, indent=2, ensure_ascii=False))
        return
    _table(["what", "it is"], [[name, text] for name, text in found.items()])
    if representation is not None:
        click.echo()
        _table(["vector", "square", "matrix"], generator_rows(representation))


# What the commands share.


def _near(path: Path) -> str:
    """A path as seen from here."""
    return os.path.relpath(path) if path.is_absolute() else str(path)


def _own(names: tuple[str, ...]) -> list[Spec]:
    known = {path.stem: path for path in own_specs()}
    unknown = [name for name in names if name not in known]
    if unknown:
        raise SpecError(unknown[0], "no such module", "one of " + " ".join(known))
    return [load_spec(known[name], f"gac generate --all {name}") for name in (names or known)]


def _is_own(spec: Spec) -> bool:
    return spec.command.startswith("gac generate --all")


def _spec(text: str, algebra: str | None = None) -> Spec:
    """A spec by path, or a checked-in module by name."""
    own = {path.stem for path in own_specs()}
    return _own((text,))[0] if text in own and not Path(text).is_file() else load_spec(Path(text), algebra=algebra)


def _kernel(target: str, algebra: str | None = None) -> Kernel:
    if target.endswith(".clu"):
        target = f"{target}:{Path(target).stem}"
    path, colon, name = target.rpartition(":")
    if not colon:
        raise SpecError(target, "no kernel named", "SPEC:KERNEL, such as my_kernels.py:move_point")
    kernels = {kernel.name: kernel for kernel in _spec(path, algebra).kernels}
    if name not in kernels:
        raise SpecError(path, f"no kernel {name}", "one of " + " ".join(kernels))
    return kernels[name]


def _compiled(spec: Spec) -> list[Compilation]:
    with _progress(len(spec.kernels)) as advance:
        return compile_kernels(spec, advance)


class _progress:
    """A bar on standard error when that is a terminal, nothing otherwise."""

    def __init__(self, total: int) -> None:
        self._total = total

    def __enter__(self) -> Any:
        console = Console(stderr=True)
        self._bar = bars.Progress(
            bars.TextColumn("{task.description}"),
            bars.BarColumn(),
            bars.MofNCompleteColumn(),
            console=console,
            transient=True,
            disable=not console.is_terminal,
        )
        self._bar.start()
        task = self._bar.add_task("", total=self._total)
        return lambda name: self._bar.update(task, advance=1, description=name)

    def __exit__(self, *error: object) -> None:
        self._bar.stop()


def _table(header: list[str], rows: list[list[str]]) -> None:
    """A coloured table on a terminal, aligned plain text elsewhere."""
    if Console().is_terminal:
        table = Table(*header, header_style="bold cyan")
        for row in rows:
            table.add_row(*map(_plain, row))
        Console().print(table)
        return
    widths = [max(map(len, column)) for column in zip(header, *rows, strict=True)]
    for row in [header, *rows]:
        click.echo("  ".join(text.ljust(width) for text, width in zip(row, widths, strict=True)).rstrip())
