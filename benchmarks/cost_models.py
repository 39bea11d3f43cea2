"""List the kernels of checked-in modules for which cost models select different programs, with measured times."""

from __future__ import annotations

import argparse
import ctypes
import math
import subprocess
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from gacompiler.backends.build import find_compiler
from gacompiler.generation.checked_in import own_specs
from gacompiler.generation.spec_files import Spec, load_spec
from gacompiler.generation.workers import each_spec
from gacompiler.ir.cost import cost
from gacompiler.ir.cost_models import COUNTS, MODELS
from gacompiler.ir.program import Program
from gacompiler.passes.pipeline import compile_kernel

from . import pages
from .markdown import paragraph, ratio, table
from .program_c import BATCHES, c_text

PAGE = Path("docs/cost-model-times.md")
FLAGS = ("-O2", "-march=native", "-ffp-contract=fast", "-fno-math-errno", "-fno-ipa-icf")
SMALL_FLAGS = ("-Os", "-march=native", "-ffp-contract=off", "-fno-math-errno", "-fno-ipa-icf")
MODULES = ("vga2", "vga3", "quaternion", "pga2", "pga3", "sta")
"""The modules whose kernels are compiled."""
ROUNDS = 15
CALLS = 20_000


@dataclass(frozen=True, slots=True)
class Difference:
    """A kernel for which a model selects another program than the default, and both programs."""

    name: str
    model: str
    programs: tuple[Program, Program]

    @property
    def predicted(self) -> tuple[int, int]:
        """The cost of both programs in the model."""
        first, second = (MODELS[self.model].of(program) for program in self.programs)
        return first, second


@dataclass(frozen=True, slots=True)
class Row:
    """A difference, with the measured times in nanoseconds or sizes in bytes of both programs."""

    difference: Difference
    measured: tuple[float, float]


def differences(spec: Spec, progress: Callable[[str], None]) -> list[Difference]:
    """Compile the kernels without loops of a module by all models."""
    found = []
    for kernel in spec.kernels:
        progress(f"{spec.name}.{kernel.name}")
        if kernel.has_loops or not kernel.parameters:
            continue
        usual = compile_kernel(kernel, forms=False).program
        for model in MODELS.values():
            program = usual if model is COUNTS else compile_kernel(kernel, forms=False, cost=model.name).program
            each = Difference(f"{spec.name}.{kernel.name}", model.name, (usual, program))
            if each.predicted[1] < each.predicted[0]:
                found.append(each)
    return found


def measure(found: Sequence[Difference], compiler: Sequence[str]) -> list[Row]:
    """Measure both programs of every difference: times for `latency` and `fma`, sizes for `size`."""
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "programs.c"
        programs = [program for each in found for program in each.programs]
        source.write_text(c_text(programs))
        fast, small = Path(folder) / "fast.so", Path(folder) / "small.so"
        for library, flags in ((fast, FLAGS), (small, SMALL_FLAGS)):
            subprocess.run([*compiler, *flags, "-shared", "-fPIC", "-o", library, source, "-lm"], check=True)
        library, sizes = ctypes.CDLL(str(fast)), _sizes(small)
        rows = []
        for k, each in enumerate(found):
            names = (f"program_{2 * k}", f"program_{2 * k + 1}")
            if each.model == "size":
                rows.append(Row(each, (sizes[names[0]], sizes[names[1]])))
            else:
                rows.append(Row(each, _times(library, names, each, "chained" if each.model == "latency" else "apart")))
    return rows


def _times(library: ctypes.CDLL, names: tuple[str, str], each: Difference, batch: str) -> tuple[float, float]:
    """Return the least times of one call of both functions, which are measured alternately."""
    run = getattr(library, batch)
    run.restype = ctypes.c_double
    best = [math.inf, math.inf]
    for _ in range(ROUNDS):
        for k, (name, program) in enumerate(zip(names, each.programs, strict=True)):
            n = sum(len(argument.components) for argument in program.arguments)
            m = sum(len(result.operands) for result in program.results)
            calls = max(200, CALLS // max(1, len(program.lines) // 20))
            seconds = run(getattr(library, name), ctypes.c_int(n), ctypes.c_int(m), ctypes.c_long(calls))
            best[k] = min(best[k], 1e9 * seconds / calls)
    return best[0], best[1]


def _sizes(library: Path) -> dict[str, float]:
    """Return the sizes of the functions of a library in bytes."""
    text = subprocess.run(["nm", "-S", "--defined-only", library], check=True, capture_output=True, text=True).stdout
    rows = [line.split() for line in text.splitlines()]
    return {row[3]: int(row[1], 16) for row in rows if len(row) == 4}


def page(rows: Sequence[Row], specs: Sequence[Spec]) -> str:
    """Return the page as Markdown; `specs` are the modules that were compiled."""
    n = sum(not kernel.has_loops for spec in specs for kernel in spec.kernels)
    lines = [
        "# Times of the cost models",
        "",
        paragraph(
            "`python -m benchmarks cost_models` writes this page; do not edit it by hand.",
            f"[Cost models](cost-models.md) explains the models. Of {n} kernels without loops in the modules",
            f"{', '.join(f'`{spec.name}`' for spec in specs)}, the tables list those for which a model selects another",
            "program than the default, with the operations of both programs, their cost in the model, and what was",
            "measured. The programs were compiled with",
            f"`{' '.join(FLAGS)}`, for sizes with `{' '.join(SMALL_FLAGS)}`. Times are the CPU times of one call in",
            "nanoseconds, the least of several runs in which both programs were measured alternately: for `latency`,",
            "of calls that depend on the previous call, and for `fma`, of independent calls. They include reading",
            f"arguments and storing results. The loops are in `{BATCHES}`.",
        ),
        "",
    ]
    for name in MODELS:
        chosen = [row for row in rows if row.difference.model == name]
        if not chosen:
            continue
        ratios = [row.measured[0] / row.measured[1] for row in chosen]
        mean = math.exp(sum(map(math.log, ratios)) / len(ratios))
        unit = "bytes" if name == "size" else "ns"
        faster = sum(each > 1 for each in ratios)
        lines += [
            f"## {name}",
            "",
            paragraph(
                f"{len(chosen)} kernels differ. The measured number is less for {faster} of them, and the geometric",
                f"mean of the ratios is {mean:.2f}.",
            ),
            "",
            table(
                ("kernel", "counts", "selected", MODELS[name].unit, f"measured {unit}", "ratio"), map(_cells, chosen)
            ),
        ]
    return "\n".join(lines).rstrip() + "\n"


def _cells(row: Row) -> tuple[str, ...]:
    each, (before, after) = row.difference, row.measured
    first, second = (cost(program) for program in each.programs)
    digits = 0 if each.model == "size" else 1
    return (
        f"`{each.name}`",
        str(first),
        str(second),
        "{} → {}".format(*each.predicted),
        f"{before:.{digits}f} → {after:.{digits}f}",
        ratio(before / after),
    )


def main(arguments: list[str] | None = None) -> int:
    """Compile, measure, and write the page; arguments are those of the command line, or by default of the process."""
    options = _parser().parse_args(arguments)
    compiler = find_compiler()
    if compiler is None:
        raise SystemExit("cost_models: no C compiler found; set CC")
    known = {path.stem: path for path in own_specs()}
    specs = [load_spec(known[name]) for name in (("vga2",) if options.quick else MODULES)]
    with pages.progress() as bar:
        task = bar.add_task("compile", total=sum(len(spec.kernels) for spec in specs))

        def advance(name: str) -> None:
            bar.update(task, advance=1, description=f"compile {name}")

        found = [each for some in each_spec(differences, specs, advance, options.jobs) for each in some]
    rows = measure(found, compiler)
    return pages.publish("cost_models", options.out, page(rows, specs), f"{len(rows)} differences measured")


def _parser() -> argparse.ArgumentParser:
    parser = pages.options("cost_models", __doc__, PAGE)
    parser.add_argument("--jobs", type=int, default=1, metavar="N", help="modules to compile in parallel [%(default)s]")
    return parser
