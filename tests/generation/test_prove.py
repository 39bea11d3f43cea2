"""The proof detects every wrong sign and every swapped operand in emitted text."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import replace
from fractions import Fraction
from random import Random

import pytest
from text_mutations import Mutation, mutations

from gacompiler import SCALAR, equal, kernel, norm, sandwich, select, verify
from gacompiler.algebra.catalog import PGA3, VGA2
from gacompiler.backends import c_programs, c_source, python_programs, python_source
from gacompiler.backends.module import ModuleSource
from gacompiler.errors import BackendError, ProofError
from gacompiler.frontend.kernel import trace
from gacompiler.generation.cache import open_cache
from gacompiler.generation.checked_in import own_specs
from gacompiler.generation.compiled import Compiled
from gacompiler.generation.compiling import compile_definition, compile_kernels
from gacompiler.generation.spec_files import load_spec
from gacompiler.passes.accuracy import measured_error
from gacompiler.passes.pipeline import compile_kernel
from gacompiler.passes.prove import truths
from gacompiler.passes.truth import Proof
from gacompiler.program_text import same_formulas
from gacompiler.verify import verify_kernel

N_MUTATIONS = 200
EQUIVALENT = ("norm", "misfit_equations")
"""A norm is the same for components in another order, and some value of the equations is zero for all motors."""


@pytest.fixture(scope="module")
def records() -> Mapping[str, list[Compiled]]:
    return {
        spec.name: compile_kernels(replace(spec, kernels=straight), cache=open_cache(), effort=0)
        for spec in (load_spec(path) for path in own_specs() if path.stem in ("vga2", "projective2", "hand_eye"))
        if (straight := tuple(kernel for kernel in spec.kernels if not kernel.has_loops))
    }


def _is_readable(text: str, readers: Callable[[str], Mapping[str, object]]) -> bool:
    """Whether the reader accepts a mutated text; text that it rejects is already detected."""
    try:
        readers(text)
    except (BackendError, ProofError):
        return False
    return True


@pytest.mark.slow
@pytest.mark.parametrize("ending", ["py", "c"])
def test_random_mutations_are_detected(records: Mapping[str, list[Compiled]], ending: str) -> None:
    """Mutations are in kernels where every operation matters: those without branches and even functions.

    Changes of kernels with loops are tested with the readers of their text, in `tests/backends`.
    """
    random = Random(2026)
    smooth = [
        record
        for compiled in records.values()
        for record in compiled
        if record.source.cost.choice == 0
        and record.source.cost.mul + record.source.cost.add > 3
        and record.kernel.name not in EQUIVALENT
    ]
    survivors, kinds = [], Counter[str]()
    while kinds.total() < N_MUTATIONS // 2:
        record = random.choice(smooth)
        module = ModuleSource(record.kernel.name, "", "", "", (record.source,))
        texts = {"py": python_source(module), "c": c_source(module)}
        found: dict[str, list[Mutation]] = {}
        for mutation in mutations(texts[ending], record.kernel.name):
            found.setdefault(mutation.kind, []).append(mutation)
        mutation = random.choice(found[random.choice(sorted(found))])
        kinds[mutation.kind] += 1
        texts[ending] = mutation.text
        if not _is_readable(mutation.text, python_programs if ending == "py" else c_programs):
            continue
        if verify_kernel(record, python_programs(texts["py"]), c_programs(texts["c"])).is_proved:
            survivors.append((record.kernel.name, mutation.kind, mutation.line, mutation.changed))
    assert survivors == []
    assert sorted(kinds) == ["number", "operand", "operation", "order", "parentheses", "sign"]


def test_a_missing_kernel_is_not_proved() -> None:
    @kernel(m=PGA3.MOTOR, p=PGA3.PLANE)
    def move(m, p):  # type: ignore[no-untyped-def]
        return sandwich(m, p)

    record = compile_definition(move)
    verdict = verify_kernel(record, {}, {})
    assert not verdict.is_proved
    assert "not in" in verdict.python and "not in" in verdict.c


def test_what_was_proved_in_this_process_is_not_evaluated_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """A changed text is compared with the same values; kernels from the cache are not trusted."""

    @kernel(m=PGA3.MOTOR, p=PGA3.POINT)
    def move(m, p):  # type: ignore[no-untyped-def]
        return sandwich(m, p)

    record = compile_definition(move)
    text = python_source(ModuleSource("move", "", "", "", (record.source,)))
    python = python_programs(text)
    wrong = python_programs(text.replace(" + ", " - ", 1))
    again = str(verify_kernel(replace(record, proof=None), python, {}))
    evaluated: list[object] = []
    monkeypatch.setattr(verify, "truths", lambda *given: evaluated.append(given) or truths(*given))
    assert str(verify_kernel(record, python, {})) == again and "python=''" in again and not evaluated
    assert "expected" in verify_kernel(record, wrong, {}).python and not evaluated
    assert str(verify_kernel(replace(record, proof=None), python, {})) == again and len(evaluated) == 1


def test_other_texts_of_programs_that_were_proved_for_all_inputs_need_many_points() -> None:
    """Otherwise a text that is wrong in one branch could agree at the few points of the proof."""

    @kernel(a=SCALAR, b=SCALAR, c=SCALAR)
    def larger(a, b, c):  # type: ignore[no-untyped-def]
        return select(a < b, (a + b) * c, a * c / 3)

    record = compile_definition(larger)
    assert record.proof is not None and record.proof.is_for_all
    text = python_source(ModuleSource("larger", "", "", "", (record.source,)))
    own = verify_kernel(record, python_programs(text), {})
    assert own.python == "" and own.points == len(record.proof.known)
    others = [
        python_programs(each.text) for each in mutations(text, "larger") if _is_readable(each.text, python_programs)
    ]
    found = [verify_kernel(record, each, {}) for each in others]
    assert found and all(each.python and each.points > 4 * own.points for each in found)


def test_mutated_texts_have_other_formulas() -> None:
    """Otherwise a wrong text would be taken for the program that was proved."""

    @kernel(m=VGA2.EVEN, p=VGA2.VECTOR, x=SCALAR)
    def move(m, p, x):  # type: ignore[no-untyped-def]
        return sandwich(m, p) / 3 + norm(p) * x

    record = compile_definition(move)
    text, own = python_source(ModuleSource("move", "", "", "", (record.source,))), [record.source.program]
    assert same_formulas([python_programs(text)["move"].program], own)
    changed = [each for each in mutations(text, "move") if _is_readable(each.text, python_programs)]
    assert len(changed) > 20
    for each in changed:
        assert not same_formulas([python_programs(each.text)["move"].program], own), each.line


def test_wrong_branches_that_no_point_takes_are_detected() -> None:
    @kernel(a=SCALAR, b=SCALAR, c=SCALAR)
    def rare(a, b, c):  # type: ignore[no-untyped-def]
        return select(equal(a * b, c), a, b) + select(a > 10**4, b, c)

    record = compile_definition(rare)
    text = python_source(ModuleSource("rare", "", "", "", (record.source,)))
    program = record.source.program
    known = truths(rare, trace(rare).expressions, record.slots, program)
    record = replace(record, proof=Proof((program,), tuple(known)))
    assert verify_kernel(record, python_programs(text), {}).python == ""
    changed = [each for each in mutations(text, "rare") if _is_readable(each.text, python_programs)]
    found = [verify_kernel(record, python_programs(each.text), {}).python for each in changed]
    assert all(found) and found.count("has branches, and other formulas than the compiled program") > 10


def test_a_wrong_library_is_detected() -> None:
    """Compiled code is measured too: a wrong result has an error that rounding does not explain."""

    @kernel(a=PGA3.POINT, b=PGA3.POINT)
    def line(a, b):  # type: ignore[no-untyped-def]
        return a & b

    record = compile_definition(line)
    module = ModuleSource("line", "", "", "", (record.source,))
    python, c = python_programs(python_source(module)), c_programs(c_source(module))
    wrong = verify_kernel(record, python, c, lambda a, b: (a * 0 + 1).repeat(2, -1), "c")
    assert not wrong.python and not wrong.c and not wrong.is_proved


@pytest.mark.parametrize("constant", [1 + Fraction(1, 10**30), -7 - Fraction(1, 10**30), Fraction(1, 10**400)])
def test_a_constant_that_rounds_to_an_integer_is_proved(constant: Fraction) -> None:
    @kernel(x=SCALAR, y=SCALAR)
    def line(x, y):  # type: ignore[no-untyped-def]
        return constant * x + y

    record = compile_definition(line)
    module = ModuleSource("line", "", "", "", (record.source,))
    assert verify_kernel(record, python_programs(python_source(module)), c_programs(c_source(module))).is_proved


def test_measured_error_is_small_and_repeatable() -> None:
    @kernel(m=PGA3.MOTOR, p=PGA3.POINT)
    def move(m, p):  # type: ignore[no-untyped-def]
        return sandwich(m, p)

    record = compile_kernel(move)
    first, n = measured_error(record.program, move)
    assert 0 < first < 10
    assert (first, n) == measured_error(record.program, move) and n == 64
