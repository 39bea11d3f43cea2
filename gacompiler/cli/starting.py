"""Commands that write specs: ``gac new`` and ``gac record``."""

from __future__ import annotations

from pathlib import Path

import click

from ..algebra.catalog import CATALOG
from ..errors import SpecError
from ..generation.files import write
from ..generation.spec_files import check_module_name, load_spec
from .framework import command


@command("gac new my_kernels", "gac new my_kernels --algebra CGA3")
@click.argument("name")
@click.option("--algebra", type=click.Choice(list(CATALOG)), default="PGA3", show_default=True)
def new(name: str, algebra: str) -> None:
    """Write a commented starter spec NAME.py to the current folder."""
    stem = name.removesuffix(".py")
    check_module_name(stem, name)
    path = Path(f"{stem}.py")
    if path.exists():
        raise SpecError(str(path), "the file already exists", remedy="choose another name")
    template = Path(__file__).parent.parent / "backends" / "templates" / "spec.py.txt"
    first = next(layout.name for layout in CATALOG[algebra].layouts.values() if layout.size > 1)
    write(
        {path.name: template.read_text(encoding="utf-8").replace("ALGEBRA", algebra).replace("LAYOUT", first)},
        path.parent,
    )
    click.echo(f"{path}: edit it, then run `gac generate {path}`")


@command(
    "gac record arm.py -o arm_kernels.py        then: gac generate arm_kernels.py",
    "gac record arm.py -o arm_kernels.py -- --steps 100    arguments after -- are passed to the program",
)
@click.argument("script", type=click.Path(path_type=Path))
@click.argument("arguments", nargs=-1, type=click.UNPROCESSED)
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="Spec file to write.")
@click.option("--separate", is_flag=True, help="Write one kernel for each operation on each layout.")
@click.option("--force", is_flag=True, help="Overwrite an existing spec.")
def record(script: Path, arguments: tuple[str, ...], output: Path, separate: bool, force: bool) -> None:
    """Run a program that uses numeric objects, and write a spec with kernels for what it computed.

    The operations of a function of the program form one kernel, named after the function, and those outside of
    functions one for each statement. Values that come from elsewhere are arguments of the kernel.
    """
    from ..objects.recording import record as recorded

    if output.suffix != ".py":
        raise SpecError(str(output), "not a valid name of a spec", "letters, digits and _, followed by .py")
    check_module_name(output.stem, str(output))
    if output.exists() and not force:
        raise SpecError(str(output), "the file already exists", remedy="choose another name, or give --force")
    write({output.name: recorded(script, arguments, is_fused=not separate)}, output.parent)
    click.echo(f"{output}: {len(load_spec(output).kernels)} kernels; run `gac generate {output}`")
