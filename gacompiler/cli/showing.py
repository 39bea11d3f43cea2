"""Commands that show what a kernel, a spec or an algebra is: ``gac show``, ``cost``, ``list`` and ``classify``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click
from rich.console import Console

from ..algebra.catalog import CATALOG, orthogonal
from ..errors import SpecError
from ..generation.cache import Cache
from ..generation.checked_in import own_specs
from ..generation.spec_files import load_spec
from ..inspect import SHOWN, STAGES, described, latex, stage_text
from ..inspect import why as why_text
from ..passes.pipeline import compile_kernel
from .arguments import compiled_kernels, find_kernel, find_spec
from .framework import algebra_option, cache_option, command, json_option
from .output import print_table


@command(
    "gac show my_kernels.py:move_point",
    "gac show my_kernels.py:move_point --stage candidates",
    "gac show my_kernels.py:move_point --why",
    "gac show my_kernels.py:move_point --latex",
)
@click.argument("target", metavar="SPEC:KERNEL")
@click.option("--stage", type=click.Choice(list(STAGES)), help="Only this stage.")
@click.option("--why", is_flag=True, help="What each step of the program taken saves, and what was not tried.")
@click.option("--latex", "as_latex", is_flag=True, help="The definition and the program as LaTeX.")
@algebra_option
def show(target: str, stage: str | None, why: bool, as_latex: bool, algebra: str | None) -> None:
    """Show how a kernel is made, stage by stage."""
    record = compile_kernel(find_kernel(target, algebra))
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


@command(
    "gac cost my_kernels.py", "gac cost my_kernels.py --json", "gac cost pga3            a module under generated/"
)
@click.argument("spec")
@json_option
@cache_option
@algebra_option
def cost(spec: str, as_json: bool, cache: Cache | None, algebra: str | None) -> None:
    """Count the operations of every kernel: mul, add, div, sqrt, call, choice, fma."""
    found = compiled_kernels(find_spec(spec, algebra), cache)
    counts = {each.kernel.name: each.source.cost.as_dict() for each in found}
    if as_json:
        click.echo(json.dumps(counts, indent=2))
        return
    print_table(
        ["kernel", "mul", "add", "div", "sqrt", "call", "choice", "fma"],
        [[n, *map(str, c.values())] for n, c in counts.items()],
    )


@command(
    "gac list                     algebras and checked-in modules",
    "gac list my_kernels.py       its kernels",
    "gac list PGA3                its layouts",
    name="list",
)
@click.argument("what", required=False)
@json_option
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
            for k in find_spec(what).kernels
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
        print_table(header, rows)


@command(
    "gac classify 3 0 1           projective geometry of space",
    "gac classify 1 3 --matrices  the matrices of the basis vectors, exactly",
    "gac classify 4 1 --json",
)
@click.argument("p", type=click.IntRange(0))
@click.argument("q", type=click.IntRange(0), default=0)
@click.argument("r", type=click.IntRange(0), default=0)
@click.option("--matrices", is_flag=True, help="Print the matrices of the basis vectors.")
@json_option
def classify(p: int, q: int, r: int, matrices: bool, as_json: bool) -> None:
    """Which algebra of matrices G(P, Q, R) is: P vectors of square +1, Q of -1 and R of 0.

    R(n), C(n) and H(n) are n x n matrices of real and complex numbers and quaternions, 2R(n) and 2H(n) pairs of them,
    and the sign after them the Grassmann algebra of the degenerate part.
    """
    from ..structure.representation import Representation
    from ..structure.summary import generator_rows, summary

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
    print_table(["what", "it is"], [[name, text] for name, text in found.items()])
    if representation is not None:
        click.echo()
        print_table(["vector", "square", "matrix"], generator_rows(representation))
