"""The command that builds wheels: ``gac package``."""

from __future__ import annotations

import os
import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path

import click

from ..errors import SpecError, needs
from ..generation.cache import Cache
from ..generation.files import write
from ..generation.spec_files import load_spec
from ..wheels.targets import PLATFORMS, compiler_for
from .arguments import rendered
from .framework import command
from .options import algebra_option, cache_option, jobs_option
from .output import near

_LEVELS = {"v1": 1, "v3": 3, "v4": 4}
"""The levels of x86-64, by the suffixes of library names."""


@command(
    "gac package my_kernels.py            dist/my_kernels-0.1.0-py3-none-manylinux_2_17_x86_64.whl",
    "gac package arm.py camera.py --name my-robot --version 1.2",
    "gac package my_kernels.py --no-build     for every platform; the C is compiled on first use",
    "CC=aarch64-linux-gnu-gcc gac package my_kernels.py",
    "gac package my_kernels.py --platform windows-amd64 --platform macos-arm64   by zig: pip install ziglang",
    "gac package some-1.0-py3-none-any.whl    add compiled libraries to a wheel with generated modules",
)
@click.argument("specs", nargs=-1, required=True)
@click.option("-o", "--output", type=click.Path(path_type=Path), default=Path("dist"), show_default=True)
@click.option("--name", help="Name of the distribution and its package [default: the name of a single spec].")
@click.option("--version", help="Version of the distribution [default: 0.1.0].")
@click.option("--no-build", is_flag=True, help="Write a wheel without compiled libraries.")
@click.option(
    "--platform",
    "platforms",
    type=click.Choice(PLATFORMS),
    multiple=True,
    help="System to compile for, by zig; may be repeated, for one wheel each [default: that of the compiler CC].",
)
@click.option(
    "--target-level",
    "levels",
    type=click.Choice(list(_LEVELS)),
    multiple=True,
    help="Level of x86-64 to compile for; may be repeated [default: all levels; the best one is selected on loading].",
)
@click.option(
    "--python",
    "pythons",
    multiple=True,
    help="Interpreter to build the extension for, which makes calls faster; may be repeated [default: this one].",
)
@jobs_option
@cache_option
@algebra_option
def package(
    specs: tuple[str, ...],
    output: Path,
    name: str | None,
    version: str | None,
    no_build: bool,
    platforms: tuple[str, ...],
    levels: tuple[str, ...],
    pythons: tuple[str, ...],
    jobs: int,
    cache: Cache | None,
    algebra: str | None,
) -> None:
    """Build a wheel of generated modules, a package that depends only on numpy.

    The package contains its own runtime, and compiled libraries for the architecture that the C compiler (CC) targets.
    The best library for the processor is loaded when a kernel is first called. On a machine with no matching library,
    the C in the package is compiled; without a compiler, kernels run with numba or as array expressions. Builds are
    reproducible: the same specs give the same bytes.

    Other systems than Linux get one portable library per module, which is called through ctypes or cffi.

    If the argument is a wheel instead of spec files, compiled libraries are added for all generated modules in it.
    """
    with needs("compiler", "gac package"):
        from ..wheels.archive import read_wheel
        from ..wheels.distribution import Distribution, distribution, package_files, retagged

    if no_build and (levels or pythons or platforms):
        raise click.UsageError("--no-build compiles nothing, so --target-level, --python and --platform cannot be used")
    compilers: list[Sequence[str] | None] = [*map(compiler_for, platforms)] or [None]
    if any(spec.endswith(".whl") for spec in specs):
        if len(specs) > 1 or name or version or no_build:
            raise click.UsageError("a wheel must be the only argument, without --name, --version or --no-build")
        found, wheel_version, files = read_wheel(Path(specs[0]))
        known = Distribution(found, wheel_version)
    else:
        if len(specs) > 1 and name is None:
            raise click.UsageError("several specs are given; name their package with --name")
        loaded = [load_spec(Path(spec), algebra=algebra) for spec in specs]
        modules = {spec.name: spec.summary for spec in loaded}
        if len(modules) < len(loaded):
            raise SpecError(" ".join(specs), "two specs have the same name", "different names", "rename a file")
        known = distribution(name or loaded[0].name, version or "0.1.0")
        texts: dict[str, str] = {}
        for each in rendered(loaded, jobs, cache):
            texts |= each
        files = package_files(known, modules, texts)
    for compiler in compilers:
        platform, built = "any", dict[str, bytes]()
        if not no_build:
            platform, built = _compiled(files, [_LEVELS[level] for level in levels], pythons, compiler)
        wheel, content = retagged(known, platform, files | built)
        unchanged = "" if write({wheel: content}, output) else ", unchanged"
        click.echo(f"{near(output / wheel)}: {len(content) / 1e6:.2f} MB{unchanged}")


def _compiled(
    files: Mapping[str, bytes], levels: Sequence[int], pythons: Sequence[str], compiler: Sequence[str] | None
) -> tuple[str, dict[str, bytes]]:
    """Compile the modules of a wheel by a compiler, which is that of the environment if it is None."""
    with needs("compiler", "gac package"):
        from ..wheels.libraries import compiled_files

    chosen = os.environ.get("CC")
    if compiler is not None:
        os.environ["CC"] = shlex.join(compiler)
    try:
        return compiled_files(files, levels, pythons)
    finally:
        if chosen is None:
            os.environ.pop("CC", None)
        else:
            os.environ["CC"] = chosen
