"""The proof finds every wrong sign and every swapped operand in emitted text."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from random import Random

import pytest

from gacompiler import kernel, sandwich
from gacompiler.algebra.catalog import PGA3
from gacompiler.backends import c_programs, c_source, python_programs, python_source
from gacompiler.backends.module import ModuleSource
from gacompiler.errors import BackendError, ProofError
from gacompiler.generate import kernel_source, load_spec, own_specs
from gacompiler.passes.pipeline import compile_kernel
from gacompiler.passes.record import Compilation
from gacompiler.prove import measured_error, verify_kernel

N_MUTATIONS = 200


@pytest.fixture(scope="module")
def records() -> Mapping[str, list[Compilation]]:
    return {
        path.stem: [compile_kernel(k) for k in load_spec(path).kernels]
        for path in own_specs()
        if path.stem in ("vga2", "projective2", "hand_eye")
    }


_STATEMENT = re.compile(r"^( *(?:const REAL )?(t\d+) = )(.*?)(;?)$")
_NAME = re.compile(r"\b[a-z]\w*\b(?!\()")


def _mutate(lines: list[str], random: Random) -> str | None:
    """One statement with a flipped sign, an operand exchanged for another, or an operation for another."""
    place = random.choice([k for k, line in enumerate(lines) if _STATEMENT.match(line)])
    head, target, right, tail = _STATEMENT.match(lines[place]).groups()  # type: ignore[union-attr]
    earlier = sorted({m[2] for line in lines[:place] if (m := _STATEMENT.match(line))} - {target})
    names = [name for name in _NAME.findall(right) if name not in ("REAL",)]
    changes: list[Callable[[], str | None]] = [
        lambda: right.replace(" + ", " - ") if " + " in right else None,
        lambda: right.replace(" - ", " + ") if " - " in right else None,
        lambda: right.replace(" * ", " + ") if " * " in right else None,
        lambda: f"-{right}" if re.fullmatch(r"t\d+", right) else None,
        lambda: right.replace(random.choice(names), random.choice(earlier), 1) if names and earlier else None,
    ]
    changed = random.choice(changes)()
    if changed is None or changed == right:
        return None
    return "\n".join([*lines[:place], head + changed + tail, *lines[place + 1 :]])


def _same_program(text: str, readers: Callable[[str], Mapping[str, object]]) -> bool:
    """Whether a mutated text is legal at all; what the reader refuses is caught already."""
    try:
        readers(text)
    except (BackendError, ProofError):
        return False
    return True


@pytest.mark.parametrize("ending", ["py", "c"])
def test_random_mutations_are_caught(records: Mapping[str, list[Compilation]], ending: str) -> None:
    """Mutations are made where every operation matters: in kernels without branches and even functions."""
    random = Random(2026)
    smooth = [
        record
        for compiled in records.values()
        for record in compiled
        if record.cost.choice == 0 and record.cost.mul + record.cost.add > 3
    ]
    texts = {}
    for record in smooth:
        module = ModuleSource(record.kernel.name, "", "", "", (kernel_source(record),))
        texts[record.kernel.name] = (python_source(module), c_source(module))
    survivors, made = [], 0
    while made < N_MUTATIONS // 2:
        record = random.choice(smooth)
        python_text, c_text = texts[record.kernel.name]
        mutated = _mutate((python_text if ending == "py" else c_text).split("\n"), random)
        if mutated is None:
            continue
        made += 1
        reader = python_programs if ending == "py" else c_programs
        if not _same_program(mutated, reader):
            continue
        python = python_programs(mutated if ending == "py" else python_text)
        c = c_programs(mutated if ending == "c" else c_text)
        if verify_kernel(record, python, c).is_proved:
            original = (python_text if ending == "py" else c_text).split("\n")
            survivors += [
                (record.kernel.name, a, b) for a, b in zip(original, mutated.split("\n"), strict=True) if a != b
            ]
    assert survivors == []


def test_a_missing_kernel_is_not_proved() -> None:
    @kernel(m=PGA3.MOTOR, p=PGA3.PLANE)
    def move(m, p):  # type: ignore[no-untyped-def]
        return sandwich(m, p)

    record = compile_kernel(move)
    verdict = verify_kernel(record, {}, {})
    assert not verdict.is_proved
    assert "not in" in verdict.python and "not in" in verdict.c


def test_a_wrong_library_is_found() -> None:
    """What runs is measured too: a function that returns something else has an error no rounding explains."""

    @kernel(a=PGA3.POINT, b=PGA3.POINT)
    def line(a, b):  # type: ignore[no-untyped-def]
        return a & b

    record = compile_kernel(line)
    module = ModuleSource("line", "", "", "", (kernel_source(record),))
    python, c = python_programs(python_source(module)), c_programs(c_source(module))
    wrong = verify_kernel(record, python, c, lambda a, b: (a * 0 + 1).repeat(2, -1), "c")
    assert not wrong.python and not wrong.c and not wrong.is_proved


def test_measured_error_is_small_and_repeatable() -> None:
    @kernel(m=PGA3.MOTOR, p=PGA3.POINT)
    def move(m, p):  # type: ignore[no-untyped-def]
        return sandwich(m, p)

    record = compile_kernel(move)
    first, n = measured_error(record.program, move)
    assert 0 < first < 10
    assert (first, n) == measured_error(record.program, move) and n == 64
