"""Options that several commands share."""

from __future__ import annotations

import click

from ..backends.build import processors
from ..generation.cache import Cache, open_cache
from ..ir.cost_models import COUNTS, MODELS
from ..passes.effort import DEFAULT, LEVELS

algebra_option = click.option(
    "--algebra",
    "algebra",
    default=None,
    help="Algebra of scripts (.clu): cga, 3dpga, ..., or a folder that contains definition.csv.",
)
json_option = click.option("--json", "as_json", is_flag=True, help="Print JSON instead of a table.")
jobs_option = click.option(
    "-j",
    "--jobs",
    type=click.IntRange(min=1),
    default=processors,
    help="Number of modules to compile in parallel [default: the number of processors].",
)

effort_option = click.option(
    "--effort",
    type=click.IntRange(0, len(LEVELS) - 1),
    default=DEFAULT,
    show_default=True,
    help="Work spent on reducing operations: 0 keeps the author's structure, 3 may take hours.",
)

model_option = click.option(
    "--cost",
    "model",
    type=click.Choice(list(MODELS)),
    default=COUNTS.name,
    show_default=True,
    help="What is minimised: operations, cycles of one element, fused multiply-adds, or the size of the code "
    "(see `gac cost --explain`).",
)


def _names(_: click.Context, __: click.Parameter, texts: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(name.strip() for text in texts for name in text.split(",") if name.strip())


only_option = click.option(
    "--only",
    "only",
    multiple=True,
    metavar="NAMES",
    callback=_names,
    help="Only the kernels of these names, separated by commas; may be repeated.",
)


def _opened(_: click.Context, __: click.Parameter, unwanted: bool) -> Cache | None:
    return None if unwanted else open_cache()


cache_option = click.option(
    "--no-cache",
    "cache",
    is_flag=True,
    callback=_opened,
    help="Compile every kernel from scratch instead of using cached results (see `gac cache`).",
)
"""Passes the user's cache to the command, or None."""
