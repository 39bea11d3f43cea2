"""Compile the kernels of a text, for the playground: counts, stages and texts in other languages as JSON.

The worker of the page runs this file in Pyodide. It needs the compiler, jinja2, mpmath and sympy, but no numpy.
"""

from __future__ import annotations

import json
import math
import os
import tempfile
import time
from pathlib import Path
from typing import Any

from gacompiler.errors import GacError
from gacompiler.frontend.kernel import Kernel
from gacompiler.generation.compiled import Compiled, CompiledLoops
from gacompiler.generation.compiling import source_of
from gacompiler.generation.rendering import render, render_targets
from gacompiler.generation.spec_files import load_spec
from gacompiler.inspect import SHOWN, stage_text
from gacompiler.inspect_loops import SHOWN_OF_LOOPS, loop_stage_text
from gacompiler.ir.procedure_cost import costs_text
from gacompiler.passes.loops import compile_loops
from gacompiler.passes.pipeline import compile_kernel

NAME = "kernels.py"


def report(text: str) -> str:
    """Compile the spec in `text`.

    Returns
    -------
    str
        JSON with ``kernels``, ``files`` by language and ``seconds``, or with ``error``, a message.
    """
    start = time.perf_counter()
    before = os.getcwd()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)  # messages name the file without its folder
        try:
            Path(NAME).write_text(text, encoding="utf-8")
            found = _compiled(Path(NAME))
        except GacError as error:
            return json.dumps({"error": str(error)})
        finally:
            os.chdir(before)
    return json.dumps(found | {"seconds": time.perf_counter() - start})


def _compiled(path: Path) -> dict[str, Any]:
    spec = load_spec(path)
    kernels: list[dict[str, Any]] = []
    sources: list[Compiled | CompiledLoops] = []
    for kernel in spec.kernels:
        if kernel.has_loops:
            loops = compile_loops(kernel)
            with_loops = CompiledLoops.of(loops)
            sources.append(with_loops)
            stages = [(name, loop_stage_text(loops, name)) for name in SHOWN_OF_LOOPS]
            cost = costs_text(with_loops.source.costs)
            kernels.append(_described(kernel, cost, stages) | {"inputs": None, "outputs": None})
        else:
            record = compile_kernel(kernel)
            compiled = Compiled.of(record)
            sources.append(compiled)
            stages = [(name, stage_text(record, name)) for name in SHOWN]
            kernels.append(_described(kernel, str(compiled.source.cost), stages) | _parts(compiled))
    module = source_of(spec, sources)
    texts = render(module) | render_targets(module, ["rust", "javascript"])
    names = {"C": ".c", "Rust": ".rs", "JavaScript": ".mjs", "Python": ".py"}
    return {"kernels": kernels, "files": {name: texts[path.stem + ending] for name, ending in names.items()}}


def _described(kernel: Kernel, cost: str, stages: list[tuple[str, str]]) -> dict[str, Any]:
    return {"name": kernel.name, "summary": kernel.summary.strip(), "cost": cost, "stages": stages}


def _parts(compiled: Compiled) -> dict[str, Any]:
    """Return the names, blades and units of arguments and results."""
    program, layouts = compiled.source.program, dict(compiled.source.layouts)

    def part(name: str, shape: tuple[int, ...]) -> dict[str, Any]:
        layout = layouts[name]
        size = math.prod(shape)
        blades = list(layout.blades) if len(layout.blades) == size else [""] * size
        return {"name": name, "scalar": not shape, "blades": blades or [""], "unit": layout.unit}

    return {
        "inputs": [part(each.name, each.shape) for each in program.arguments],
        "outputs": [part(each.name, each.shape) for each in program.results],
    }
