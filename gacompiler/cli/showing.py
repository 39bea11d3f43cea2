"""Commands that describe kernels, specs and algebras: ``gac show``, ``cost``, ``list`` and ``classify``."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import Any

import click
from rich.console import Console

from ..algebra.catalog import CATALOG, orthogonal
from ..errors import SpecError
from ..frontend.kernel import Parameter
from ..frontend.rows import IndexOf, RowsOf
from ..generation.cache import Cache
from ..generation.checked_in import own_specs
from ..generation.compiled import Compiled, CompiledLoops
from ..generation.spec_files import load_spec
from ..inspect import SHOWN, STAGES, described, latex, stage_text
from ..inspect import why as why_text
from ..inspect_loops import LOOP_STAGES, SHOWN_OF_LOOPS, loop_stage_text, refuse_latex
from ..inspect_loops import why as why_of_loops
from ..ir.cost_models import COUNTS, MODELS
from ..ir.procedure_cost import costs_as_dict, costs_text
from ..passes.bounds import lower_bound
from ..passes.loops import compile_loops
from ..passes.pipeline import compile_kernel
from .arguments import compiled_kernels, find_kernel, find_kernels, find_spec
from .framework import command
from .options import algebra_option, cache_option, effort_option, json_option, model_option
from .output import print_table, searching


@command(
    "gac show my_kernels.py:move",
    "gac show my_kernels.py:move --stage candidates",
    "gac show my_kernels.py:move --why",
    "gac show my_kernels.py:move --latex",
)
@click.argument("target", metavar="SPEC:KERNEL")
@click.option("--stage", type=click.Choice(list(dict.fromkeys([*STAGES, *LOOP_STAGES]))), help="Show only this stage.")
@click.option("--why", is_flag=True, help="Show what each step to the chosen program saves, and what was not tried.")
@click.option("--latex", "as_latex", is_flag=True, help="Print the definition and the program as LaTeX.")
@algebra_option
@effort_option
@model_option
def show(
    target: str, stage: str | None, why: bool, as_latex: bool, algebra: str | None, effort: int, model: str
) -> None:
    """Show how a kernel is compiled, stage by stage."""
    kernel = find_kernel(target, algebra)
    if kernel.has_loops:
        with searching():
            loops = compile_loops(kernel, effort=effort, cost=model)
        if as_latex:
            refuse_latex(loops)
        explained = why_of_loops(loops) if why else ""
        shown: tuple[str, ...] = SHOWN_OF_LOOPS
        text = partial(loop_stage_text, loops)
    else:
        with searching():
            record = compile_kernel(kernel, effort=effort, cost=model)
        if as_latex:
            click.echo(latex(record))
            return
        explained, shown = why_text(record) if why else "", SHOWN
        text = partial(stage_text, record)
    if why:
        click.echo(explained)
        return
    chosen = (stage,) if stage else shown
    console = Console(highlight=False, soft_wrap=True, emoji=False)
    for name in chosen:
        if len(chosen) > 1:
            console.print(f"[bold cyan]{name}[/]")
        click.echo(text(name) + ("\n" if len(chosen) > 1 else ""))


def _explain(context: click.Context, _: click.Parameter, wanted: bool) -> None:
    if wanted:
        print_table(["model", "what it counts"], [[model.name, model.counted] for model in MODELS.values()])
        context.exit()


@command(
    "gac cost my_kernels.py",
    "gac cost my_kernels.py:move",
    "gac cost my_kernels.py --json",
    "gac cost pga3            a module under generated/",
    "gac cost pga3 --cost latency",
    "gac cost pga3 --bound    with lower bounds for every program",
    "gac cost --explain       list the cost models",
)
@click.argument("spec", metavar="SPEC[:KERNEL]")
@json_option
@cache_option
@algebra_option
@effort_option
@model_option
@click.option(
    "--explain", is_flag=True, is_eager=True, expose_value=False, callback=_explain, help="List the cost models."
)
@click.option("--bound", is_flag=True, help="Add lower bounds for the products and for all operations.")
def cost(
    spec: str, as_json: bool, cache: Cache | None, algebra: str | None, effort: int, model: str, bound: bool
) -> None:
    """Count the operations of each kernel by type (mul, add, div, sqrt, call, choice, fma).

    With another cost model than the default, its number is in the last column. Kernels with loops have only counts.
    With --bound, no program can have fewer products (with divisions and functions) and fewer operations than the last
    two columns. There are no bounds for kernels with functions.

    Cheaper forms that lose digits are listed with their errors, in units in the last place. Write such a form yourself
    to have it: errors are compared with those of the form that is written.
    """
    found = compiled_kernels(find_kernels(spec, algebra), cache, effort, model, keep_best=True)
    chosen = MODELS[model]
    counts: dict[str, dict[str, Any]] = {}
    refused: dict[str, str] = {}
    for each in found:
        if isinstance(each, Compiled):
            row = counts[each.kernel.name] = each.source.cost.as_dict()
            if each.refused:
                refused[each.kernel.name] = each.refused
            if chosen is not COUNTS:
                row["cost"] = chosen.of(each.source.program)
            if bound and (least := lower_bound(each.kernel, each.source.program)):
                row |= {"mul at least": least.products, "all at least": least.operations}
    loops = {each.kernel.name: each.source.costs for each in found if isinstance(each, CompiledLoops)}
    if as_json:
        for name, text in refused.items():
            counts[name]["refused"] = text
        click.echo(json.dumps(counts | {name: costs_as_dict(costs) for name, costs in loops.items()}, indent=2))
        return
    if counts:
        names = list(dict.fromkeys(name for each in counts.values() for name in each))
        header = [f"{model} ({chosen.unit})" if name == "cost" else name for name in names]
        rows = [[n, *(str(c.get(name, "–")) for name in names)] for n, c in counts.items()]
        print_table(["kernel", *header], rows)
    if refused:
        click.echo()
        print_table(["kernel", "refused, because it loses digits"], [list(each) for each in refused.items()])
    if loops:
        print_table(["kernel with loops", "operations"], [[name, costs_text(costs)] for name, costs in loops.items()])


@command(
    "gac list                     list algebras and checked-in modules",
    "gac list my_kernels.py       list the kernels of a spec",
    "gac list PGA3                list the layouts of an algebra",
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
                ", ".join(f"{p.name}: {_type(p)}" for p in k.parameters),
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


def _type(parameter: Parameter) -> str:
    """Format the type of a parameter: ``PGA3.POINT[3]``, ``PGA3.LINE[n]``, ``index n into m``."""
    given = parameter.type
    if isinstance(given, IndexOf):
        columns = f", {given.columns}" if given.columns else ""
        return f"index {given.length}{columns}" + (f" into {given.into}" if given.into != given.length else "")
    lengths = given.lengths if isinstance(given, RowsOf) else ()
    shape = ", ".join([*lengths, *map(str, parameter.outer_shape)])
    return f"{parameter.layout}[{shape}]" if shape else str(parameter.layout)


@command(
    "gac classify 3 0 1           the projective geometric algebra of space",
    "gac classify 1 3 --matrices  also print the matrices of the basis vectors",
    "gac classify 4 1 --json",
)
@click.argument("p", type=click.IntRange(0))
@click.argument("q", type=click.IntRange(0), default=0)
@click.argument("r", type=click.IntRange(0), default=0)
@click.option("--matrices", is_flag=True, help="Also print the exact matrices of the basis vectors.")
@json_option
def classify(p: int, q: int, r: int, matrices: bool, as_json: bool) -> None:
    """Find the matrix algebra isomorphic to G(P, Q, R).

    P, Q and R are the numbers of basis vectors with square +1, -1 and 0. R(n), C(n) and H(n) denote the n x n matrices
    over the real numbers, the complex numbers and the quaternions, 2R(n) and 2H(n) denote pairs of these matrices, and
    the symbol that follows denotes the Grassmann algebra of the degenerate part.
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
    print_table(["property", "value"], [[name, text] for name, text in found.items()])
    if representation is not None:
        click.echo()
        print_table(["vector", "square", "matrix"], generator_rows(representation))
