"""Proof of emitted kernels: the text on disk is equal to the definition, and running code agrees up to rounding."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from .backends import Read, body_is_intact, c_procedures, c_programs, python_procedures, python_programs
from .backends.c_loop_names import named_in_c
from .errors import ProofError
from .frontend.kernel import trace
from .generation.compiled import Compiled, CompiledLoops
from .ir.interpret import Tape
from .ir.procedure import Procedure
from .ir.program import Program
from .ir.uniform import joined
from .passes.accuracy import ulps, without_rounding
from .passes.prove import truths
from .passes.samples import sample
from .passes.truth import Truth
from .program_text import difference_of_program, has_formulas, without_names
from .verify_loops import POINTS, called_programs, error_of_loops, loops_difference, part_truths


@dataclass(frozen=True, slots=True)
class Verdict:
    """The result of the verification of one emitted kernel.

    Attributes
    ----------
    kernel : str
        The name of the kernel.
    python, c : str
        The difference between the text and the definition; empty if they are equal.
    error : float
        Largest error measured when running the kernel, in ulp of the largest result; NaN if it was not run.
    runs_on : str
        The backend that was run.
    points : int
        Number of exact points.
    is_rational : bool
        Whether the comparison used exact rationals; otherwise it used 40 digits.
    """

    kernel: str
    python: str
    c: str
    error: float
    runs_on: str
    points: int
    is_rational: bool

    @property
    def is_proved(self) -> bool:
        """Whether both texts agree with the definition, and the code that was run agrees up to rounding."""
        return not self.python and not self.c and not self.error > LARGEST_ERROR


ROWS = 7 * POINTS
"""Size of the batch that is run, in which each point occurs several times, at other places of vectors."""

LARGEST_ERROR = 1e6
"""The largest accepted error in ulp; a wrong sign gives an error of 1e15."""


def verify_module(
    folder: Path, name: str, records: Sequence[Compiled | CompiledLoops], module: Any = None
) -> list[Verdict]:
    """Read the files of a generated module and compare every kernel with its definition.

    If the imported `module` is given, the errors of the functions in it are measured too.

    Raises
    ------
    ProofError
        If a file of the module does not exist.
    """
    texts = []
    for ending in ("py", "c"):
        path = folder / f"{name}.{ending}"
        if not path.is_file():
            raise ProofError(str(path), "no such file", "a generated module", "run `gac generate` first")
        texts.append(path.read_text(encoding="utf-8"))
    python, c = python_programs(texts[0]), c_programs(texts[1])
    edited = ["" if body_is_intact(text) else "was edited after generation" for text in texts]
    whole = [Verdict("(text)", edited[0], edited[1], float("nan"), "", 0, True)] if any(edited) else []
    python_loops, c_loops = python_procedures(texts[0]), c_procedures(texts[1])
    backend = getattr(module, "backend", "")
    verdicts = []
    for record in records:
        run = getattr(module, record.kernel.name, None)
        if isinstance(record, CompiledLoops):
            verdicts.append(verify_loops(record, python_loops, c_loops, run, backend))
        else:
            verdicts.append(verify_kernel(record, python, c, run, backend))
    return whole + verdicts


def verify_kernel(
    record: Compiled, python: Mapping[str, Read], c: Mapping[str, Read], run: Any = None, backend: str = ""
) -> Verdict:
    """Compare the texts of one kernel with its definition at exact points, and measure the rounding error of `run`.

    Programs that the compilation in this process has proved, at the same points or for all inputs, are not evaluated
    again.
    """
    kernel, program, proof = record.kernel, record.source.program, record.proof
    name = kernel.name
    texts = [text[name] for text in (python, c) if name in text]
    is_known = proof is not None and all(has_formulas(_functions(text), proof.programs) for text in texts)
    if proof and (is_known or not proof.is_for_all):
        known: Sequence[Truth] = proof.known
    else:
        known = truths(kernel, trace(kernel).expressions, record.slots, program)
    in_python, in_c = "is not in the Python text", "is not in the C text"
    if name in python:
        in_python = "" if is_known else _difference(python[name], record, known)
    if name in c:
        # Both texts are usually one program, which is evaluated once.
        is_same = name in python and without_names(_functions(python[name])) == without_names(_functions(c[name]))
        in_c = in_python if is_same else "" if is_known else _difference(c[name], record, known)
    error, runs_on = float("nan"), ""
    if run is not None:
        error, runs_on = _error_of(run, record), backend
    return Verdict(
        name,
        in_python,
        in_c,
        error,
        runs_on,
        len(known),
        all(truth.is_exact for truth in known),
    )


def verify_loops(
    record: CompiledLoops,
    python: Mapping[str, Procedure],
    c: Mapping[str, Procedure],
    run: Any = None,
    backend: str = "",
) -> Verdict:
    """Compare one kernel with loops with its definition, and measure the error of `run` in doubles.

    The verification checks that the loops in both texts are the compiled ones, that their programs agree with the
    definitions of the straight-line parts at exact points, and that the procedure agrees with the unrolled function for
    several lengths.
    """
    name = record.kernel.name
    known = part_truths(record, *(text[name] for text in (python, c) if name in text))
    all_truths = [truth for each in known for truth in each]
    in_python = loops_difference(python.get(name), record, known)
    proved = () if in_python else called_programs(python[name])
    return Verdict(
        name,
        in_python,
        loops_difference(c.get(name), record, known, lambda procedure: named_in_c(procedure)[0], proved),
        float("nan") if run is None else error_of_loops(run, record),
        "" if run is None else backend,
        len(all_truths),
        all(truth.is_exact for truth in all_truths),
    )


def _functions(found: Read) -> list[Program]:
    return [found.program, *(joined(form, found.program) for form in found.forms)]


def _difference(found: Read, record: Compiled, known: Sequence[Truth]) -> str:
    """Describe how a text that was read differs from the definition, in the kernel itself or in one of its forms."""
    program, forms = record.source.program, record.source.uniform
    difference = difference_of_program(found.program, program, known)
    if not difference and len(found.forms) != len(forms):
        return f"has {len(found.forms)} forms, expected {len(forms)}"
    for form, own in zip(found.forms, forms, strict=False):
        if not difference:
            difference = difference_of_program(joined(form, found.program), joined(own, program), known)
            difference = difference and f"the form for the same {', '.join(form.same)}: {difference}"
    return difference


def _error_of(run: Any, record: Compiled) -> float:
    """Return the largest error in ulp of a generated function on random elements, relative to the exact program."""
    program, random = record.source.program, Random(6)
    points = [sample(record.kernel, random, near_one=True) for _ in range(POINTS)]
    flat = [
        np.array([[float(point[name]) for name in argument.components] for point in points])
        for argument in program.arguments
    ]
    # The points are repeated, so that batches consist of several vectors and a remainder.
    found = run(*(np.resize(each, (ROWS, *a.shape)) for each, a in zip(flat, program.arguments, strict=True)))
    # A kernel without arguments has no batch: every point has the same result.
    results = [
        np.broadcast_to(values, (ROWS, *result.shape)).reshape(ROWS, -1)
        for values, result in zip(found if isinstance(found, tuple) else (found,), program.results, strict=True)
    ]
    rows = np.concatenate(results, axis=1)
    tape, worst = Tape(program), 0.0
    for k in range(POINTS):
        try:
            exact = without_rounding(tape, [value for array in flat for value in array[k].tolist()])
            worst = max([worst, *(ulps(rounded, exact) for rounded in np.unique(rows[k::POINTS], axis=0).tolist())])
        except (ArithmeticError, ValueError):
            continue
    return worst
