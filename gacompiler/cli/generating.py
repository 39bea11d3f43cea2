"""Commands that write generated modules: ``gac generate``, ``build`` and ``robot``."""

from __future__ import annotations

import compileall
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import click

from ..backends import build_libraries, no_compiler, runtime_files
from ..backends.module import ModuleSource
from ..errors import SpecError
from ..generation.cache import Cache
from ..generation.checked_in import generated_folder
from ..generation.compiling import compile_spec
from ..generation.files import write
from ..generation.projects import PACKAGES, package_name
from ..generation.rendering import TARGETS, WITHOUT_LOOPS, render, render_header, render_standalone, render_targets
from ..generation.selection import select
from ..generation.spec_files import Spec, load_spec
from ..generation.workers import each_spec
from ..ir.cost_models import COUNTS
from ..robots.descriptions import robot_spec
from ..robots.kernel_texts import DEFAULT, METHODS
from .arguments import own_modules, rendered
from .framework import command
from .options import algebra_option, cache_option, effort_option, jobs_option, model_option, only_option
from .output import near, progress_bar, searching

target_option = click.option(
    "--target",
    "targets",
    type=click.Choice(["c", *TARGETS]),
    multiple=True,
    default=("c",),
    show_default=True,
    help="Language to generate; may be repeated. c generates C and the Python module; the others, one file per spec.",
)


def _package_option(name: str, what: str) -> Callable[[Callable[..., None]], Callable[..., None]]:
    path = click.Path(path_type=Path, file_okay=False)
    return click.option(f"--{name}", type=path, metavar="DIR", help=f"Write {what} into DIR, which is its name.")


@command(
    "gac generate my_kernels.py -o out",
    "gac generate my_kernels.py --target rust --target cuda   write out/my_kernels.rs and .cu, but no C",
    "gac generate my_kernels.py --standalone   write out/my_kernels.py and .c that need no other file",
    "gac generate my_kernels.py --header-only  write out/my_kernels_inline.h, for C99 and C++",
    "gac generate my_kernels.py --cmake kernels  write the C library kernels, which find_package finds",
    "gac generate my_kernels.py --cargo kernels  write the crate kernels; --npm, a package with types",
    "gac generate --all           regenerate the modules under generated/",
    "gac generate --all pga3 cga3",
    "gac generate horizon.clu --algebra cga3   compile a script in Gaalop's language",
    "gac generate my_kernels.py --effort 3     search for hours, for kernels that ship",
    "gac generate my_kernels.py --cost latency  minimise the time of one element",
    "gac generate my_kernels.py --only move,join_points",
)
@click.argument("specs", nargs=-1)
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), default=None, help="Folder to write to [default: out]."
)
@click.option("--all", "own", is_flag=True, help="Regenerate all modules under generated/, or those named.")
@click.option("--no-build", is_flag=True, help="Do not compile the C files.")
@target_option
@click.option("--standalone", is_flag=True, help="Include the runtime in each .py and .c, so that they can be copied.")
@click.option("--header-only", is_flag=True, help="Write one header of inline C and C++ functions, without runtime.")
@_package_option("cmake", "a C library with CMakeLists.txt")
@_package_option("cargo", "a crate with Cargo.toml")
@_package_option("npm", "a JavaScript package with types and package.json")
@jobs_option
@cache_option
@algebra_option
@effort_option
@model_option
@only_option
def generate(
    specs: tuple[str, ...],
    output: Path | None,
    own: bool,
    no_build: bool,
    targets: tuple[str, ...],
    standalone: bool,
    header_only: bool,
    jobs: int,
    cache: Cache | None,
    algebra: str | None,
    effort: int,
    model: str,
    only: tuple[str, ...],
    **packages: Path | None,
) -> None:
    """Generate a module (.py, .pyi, .c, .h) from each spec file, and compile its C if a compiler is available.

    A module in another language is one file, with functions for single elements and for batches; a comment at its top
    describes their arguments. Kernels with loops have functions for single elements, and for batches in CUDA and OpenCL
    only. With --all, files in other languages are written to out/ rather than generated/.

    Packages (--cmake, --cargo, --npm) build as they are. They are written instead of a module.
    """
    folders = {kind: folder for kind, folder in packages.items() if folder is not None}
    if not specs and not own:
        raise click.UsageError("name at least one spec file, or give --all")
    if folders and (standalone or header_only or targets != ("c",) or output is not None):
        raise click.UsageError(
            "a package is a folder of its own; give --cmake, --cargo and --npm without other outputs"
        )
    if (standalone or header_only) and own and output is None:
        option = "--standalone" if standalone else "--header-only"
        raise click.UsageError(f"{option} writes copies of modules; choose their folder with -o")
    if header_only and (standalone or targets != ("c",)):
        raise click.UsageError("--header-only writes one file; give it without --standalone and --target")
    if only and own and output is None and not folders:
        raise click.UsageError("--only writes modules with some kernels; choose their folder with -o")
    found = own_modules(specs) if own else [load_spec(Path(spec), algebra=algebra) for spec in specs]
    _check_distinct(found)
    elsewhere = output or Path("out")
    folder = generated_folder() if own and output is None else elsewhere
    chosen = select(found, only)
    if folders:
        _write_packages(chosen, folders, jobs, cache, effort, model)
        return
    if header_only:
        _write_headers(chosen, elsewhere, jobs, cache, effort, model)
        return
    _write_modules(chosen, targets, standalone, folder, elsewhere, jobs, cache, no_build, effort, model)


def _check_distinct(specs: Sequence[Spec]) -> None:
    """Raise an error if two specs would be written to the same files."""
    seen: dict[str, Spec] = {}
    for spec in specs:
        other = seen.setdefault(spec.name, spec)
        if other is not spec and other.path.resolve() != spec.path.resolve():
            raise SpecError(
                str(spec.path), f"it has the module name of {other.path}, {spec.name}", "different names of files",
                "rename one, or generate them into different folders",
            )  # fmt: skip


def _write_packages(
    specs: Sequence[Spec], folders: Mapping[str, Path], jobs: int, cache: Cache | None, effort: int, model: str
) -> None:
    """Write all modules as one package of each kind."""
    names = {kind: package_name(folder) for kind, folder in folders.items()}
    modules = _compiled(specs, jobs, cache, effort, model)
    for kind, folder in folders.items():
        unchanged = "" if write(PACKAGES[kind](names[kind], modules), folder) else ", unchanged"
        click.echo(f"{near(folder)}: {sum(len(spec.kernels) for spec in specs)} kernels for {kind}{unchanged}")


def _compiled(specs: Sequence[Spec], jobs: int, cache: Cache | None, effort: int, model: str) -> list[ModuleSource]:
    """Compile the kernels of specs, with a progress bar."""
    with progress_bar(sum(len(spec.kernels) for spec in specs)) as advance, searching(advance):
        return each_spec(partial(compile_spec, cache=cache, effort=effort, cost=model), specs, advance, jobs)


def _write_headers(
    specs: Sequence[Spec], folder: Path, jobs: int, cache: Cache | None, effort: int, model: str
) -> None:
    """Write the headers of modules."""
    modules = _compiled(specs, jobs, cache, effort, model)
    for spec, module in zip(specs, modules, strict=True):
        unchanged = "" if write(render_header(module), folder) else ", unchanged"
        click.echo(f"{near(folder / spec.name)}_inline.h: {len(spec.kernels)} kernels{unchanged}")


def _write_modules(
    specs: Sequence[Spec],
    targets: Sequence[str],
    standalone: bool,
    folder: Path,
    elsewhere: Path,
    jobs: int,
    cache: Cache | None,
    no_build: bool,
    effort: int,
    model: str,
) -> None:
    """Write modules to `folder` and files in other languages to `elsewhere`, and compile the C files."""
    if model != COUNTS.name:
        specs = [replace(spec, command=f"{spec.command} --cost {model}") for spec in specs]
    others = [target for target in TARGETS if target in targets]
    modules, in_others, in_c = list[ModuleSource](), list[dict[str, str]](), list[dict[str, str]]()
    if others or standalone:
        modules = _compiled(specs, jobs, cache, effort, model)
        in_others = [render_targets(module, others) for module in modules]
        in_c = [(render_standalone if standalone else render)(module) for module in modules] if "c" in targets else []
    else:
        in_c = rendered(specs, jobs, cache, effort, model, keep_best=True)
    for module, files in zip(modules, in_others, strict=True):
        for target, (name, text) in zip(others, files.items(), strict=True):
            unchanged = "" if write({name: text}, elsewhere) else ", unchanged"
            loops, count = len(module.loops), len(module.kernels)
            if target in WITHOUT_LOOPS and loops:
                unchanged = f", {loops} with loops left out{unchanged}"
            else:
                count += loops
            click.echo(f"{near(elsewhere / name)}: {count} kernels{unchanged}")
    if in_c and not standalone:
        write(runtime_files(), folder)
    for spec, files in zip(specs, in_c, strict=False):
        unchanged = "" if write(files, folder) else ", unchanged"
        click.echo(f"{near(folder / spec.name)}.py .pyi .c .h: {len(spec.kernels)} kernels{unchanged}")
    if in_c and not no_build:
        _build([folder / f"{spec.name}.c" for spec in specs])


@command(
    "gac build             compile the modules under generated/",
    "gac build out --floats     also compile functions of single precision",
    "gac build out --portable   build libraries that can be copied to other processors",
)
@click.argument("folder", required=False, type=click.Path(path_type=Path))
@click.option("--force", is_flag=True, help="Compile even if a library is up to date.")
@click.option("--floats", is_flag=True, help="Also compile functions of floats, in twice the time.")
@click.option("--portable", is_flag=True, help="Compile all for all processors, not only this kind; takes longer.")
def build(folder: Path | None, force: bool, floats: bool, portable: bool) -> None:
    """Compile the C files of a folder of generated modules.

    Functions of floats are compiled when one of a module is first called, unless floats are requested here.

    A library contains the loops over batches for the vector instructions of this machine (AVX2 or AVX-512). On another
    kind of machine, it is rebuilt when the module is loaded. A portable library contains the loops for every kind of
    machine and is never rebuilt.
    """
    place = folder or generated_folder()
    sources = sorted(place.glob("*.c"))
    if not sources:
        raise SpecError(str(place), "no generated C file in it", remedy="run `gac generate` first")
    for source in sources:
        compileall.compile_file(source.with_suffix(".py"), quiet=2)  # parsing takes most of the import time
    libraries = _build(sources, force, portable, floats)
    if libraries:  # without a compiler, a note says why there are none
        click.echo(f"{near(place)}: {len(libraries)} libraries are current")


def _build(sources: list[Path], force: bool = False, portable: bool = False, floats: bool = False) -> list[Path]:
    """Compile C files that have no current library, and report each library; print a note if no compiler is found.

    The result has the library of doubles of each file.
    """

    def report(library: Path) -> None:
        click.echo(f"built {near(library)}, {library.stat().st_size / 1e6:.2f} MB")

    precisions = [""] if portable else ["f64", "f32"] if floats else ["f64"]
    built, *_ = [
        build_libraries(sources, force=force, portable=portable, only=only, progress=report) for only in precisions
    ]
    libraries = [library for library in built if library is not None]
    if len(libraries) < len(sources):
        click.echo(f"note: {no_compiler()}", err=True)
    return libraries


@command(
    "gac robot panda.urdf -o out",
    "gac robot panda.urdf --tip panda_link8 --lock panda_finger_joint1 --lock panda_finger_joint2",
    "gac robot anymal.urdf --base floating",
    "gac robot ur5                a robot known by name to algorithms.kinematics",
    "gac robot ur5 --method gravity --method forward_dynamics",
    "gac robot ur5 --method all --target rust   write out/ur5.rs, but no C",
    "gac robot ur5 --inverse      also all configurations that reach a pose",
)
@click.argument("robot")
@click.option("-o", "--output", type=click.Path(path_type=Path), default=Path("out"), show_default=True)
@click.option("--name", help="Name of the module [default: the name of the robot].")
@click.option("--tip", help="Link of the end effector [default: the link most joints away from the base].")
@click.option("--lock", multiple=True, help="Joint to lock at position 0; may be repeated.")
@click.option(
    "--base",
    type=click.Choice(["fixed", "floating", "euler"]),
    default="fixed",
    show_default=True,
    help="How the first link moves: not at all, by a motor and a twist, or by six joints.",
)
@click.option(
    "--method",
    "methods",
    type=click.Choice([*METHODS, "all"]),
    multiple=True,
    help=f"Kernel to generate; may be repeated [default: {', '.join(DEFAULT)}].",
)
@click.option(
    "--inverse", is_flag=True, help="Also generate the kernel of inverse kinematics, where it has a closed form."
)
@target_option
@click.option("--no-build", is_flag=True, help="Do not compile the C files.")
@jobs_option
@cache_option
@effort_option
@model_option
def robot(
    robot: str,
    output: Path,
    name: str | None,
    tip: str | None,
    lock: tuple[str, ...],
    base: str,
    methods: tuple[str, ...],
    inverse: bool,
    targets: tuple[str, ...],
    no_build: bool,
    jobs: int,
    cache: Cache | None,
    effort: int,
    model: str,
) -> None:
    """Generate a module (.py, .pyi, .c, .h) for one robot, with its constants folded into the kernels.

    ROBOT is a file of URDF or MuJoCo, or the name of a known robot. The kernels take vectors of all joint variables.
    The spec is saved in the folder specs/ next to the module, for use with `gac show` and `gac verify`.
    """
    module, text = robot_spec(robot, name, tip, lock, methods, base, inverse)
    path = output / "specs" / f"{module}.py"
    write({path.name: text}, path.parent)
    spec = load_spec(path, f"gac robot {robot}")
    _write_modules([spec], targets, False, output, output, jobs, cache, no_build, effort, model)
