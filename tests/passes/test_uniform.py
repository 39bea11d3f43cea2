"""Forms of kernels for batches in which some arguments are uniform: their structure, and equality of results."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from itertools import combinations
from random import Random
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from backend_programs import traced, write
from compiled_once import compiled_once
from example_kernels import move_point
from selection import some_slow
from text_mutations import Mutation, mutations
from unmeasured import errors_are_not_measured

import gacompiler as ga
from gacompiler import SCALAR, array, kernel, sandwich
from gacompiler.algebra.catalog import CGA2, PGA2, VGA2
from gacompiler.backends import c_programs, c_source, python_programs, python_source
from gacompiler.backends.build import build_library, find_compiler
from gacompiler.backends.module import ModuleSource
from gacompiler.errors import BackendError, ProofError
from gacompiler.frontend.kernel import Kernel
from gacompiler.generation.checked_in import own_specs
from gacompiler.generation.compiled import Compiled
from gacompiler.generation.sources import kernel_source
from gacompiler.generation.spec_files import load_spec
from gacompiler.ir.cost import cost
from gacompiler.ir.program import Program
from gacompiler.ir.uniform import MOST, Uniform, joined, split
from gacompiler.ir.verify import verify
from gacompiler.passes.pipeline import compile_kernel
from gacompiler.passes.prove import disagreement, program_reader, truths
from gacompiler.passes.record import Compilation
from gacompiler.passes.samples import sample
from gacompiler.runtime import load_module
from gacompiler.verify import verify_kernel
from tests.support.all_cases import all_cases
from tests.support.unoptimised import without_optimisation

BACKENDS = ["numba", *(["c"] if find_compiler() else [])]


@kernel(m=CGA2.MOTOR, p=CGA2.POINT)
def move_conformal(m, p):  # type: ignore[no-untyped-def]
    return sandwich(m, p) + p


@kernel(center=VGA2.VECTOR, angle=SCALAR, size=SCALAR, p=VGA2.VECTOR)
def turn(center, angle, size, p):  # type: ignore[no-untyped-def]
    r = ga.cos(angle) - ga.sin(angle) * VGA2.multivector({"e12": 1})
    return center + size * (r * p), ga.norm_squared(p)


@kernel(matrix=array(SCALAR, 3, 3), v=array(SCALAR, 3))
def quadratic(matrix, v):  # type: ignore[no-untyped-def]
    return sum(v[i] * matrix[i][j] * v[j] for i in range(3) for j in range(3)) / (1 + matrix[0][0] * matrix[0][0])


@kernel(a=array(SCALAR, 2, 2), b=array(SCALAR, 2, 2), returns=array(SCALAR, 2, 2))
def matrices(a, b):  # type: ignore[no-untyped-def]
    def times(a, b):  # type: ignore[no-untyped-def]
        return [[sum(a[i][k] * b[k][j] for k in range(2)) for j in range(2)] for i in range(2)]

    return times(times(a, a), b)


@kernel(a=VGA2.VECTOR, b=VGA2.VECTOR, a_b=VGA2.VECTOR, prepared=VGA2.ROTOR)
def awkward_names(a, b, a_b, prepared):  # type: ignore[no-untyped-def]
    return (a * b) * sandwich(prepared, a_b)


@kernel(a=SCALAR, b=SCALAR, a_b=SCALAR)
def ambiguous(a, b, a_b):  # type: ignore[no-untyped-def]
    return ga.sin(a * b) + ga.cos(a_b * a_b)


@kernel(i=VGA2.ROTOR, w=SCALAR, n=VGA2.VECTOR, args=SCALAR)
def letters(i, w, n, args):  # type: ignore[no-untyped-def]
    return (w * args + w * w) * sandwich(i, n) + args * args * n


@kernel(empty=VGA2.ROTOR, double=VGA2.VECTOR, len=SCALAR)
def reserved_words(empty, double, len):  # type: ignore[no-untyped-def]
    return (len * len + len) * sandwich(empty, double) + double


@kernel(strides=PGA2.MOTOR, dimensions=PGA2.LINE)
def branches(strides, dimensions):  # type: ignore[no-untyped-def]
    return ga.select(strides["1"] < 0, -1, 1) * sandwich(strides, dimensions)


OWN = [
    *(move_point, move_conformal, turn, quadratic, matrices),
    *(awkward_names, ambiguous, letters, reserved_words, branches),
]
FROM_SPECS = {"projective3": "sampson_distance join_three_points"}
"""A matrix, and a number as the result; three arguments."""


def from_specs() -> list[Kernel]:
    """The kernels of `FROM_SPECS`; their names are distinct."""
    found = []
    for path in own_specs():
        wanted = FROM_SPECS.get(path.stem, "").split()
        found += [each for each in (load_spec(path).kernels if wanted else ()) if each.name in wanted]
    return found


KERNELS = [*OWN, *from_specs()]
NAMES = [definition.name for definition in KERNELS]
Records = Mapping[str, Compilation]


@pytest.fixture(scope="module")
def records() -> Records:
    return {definition.name: compiled_once(definition, effort=1, cost="counts") for definition in KERNELS}


@pytest.fixture(scope="module", autouse=True)
def no_measurements() -> Iterator[None]:
    with errors_are_not_measured():
        yield


# The structure of forms.


def test_all_kinds_of_kernels_are_here(records: Records) -> None:
    programs = [record.program for record in records.values()]
    assert len(KERNELS) == 12 == len(records)
    assert {len(program.arguments) for program in programs} == {2, 3, 4}
    assert {len(argument.shape) for program in programs for argument in program.arguments} == {0, 1, 2}
    assert {len(result.shape) for program in programs for result in program.results} == {0, 1, 2}
    assert any(len(program.results) > 1 for program in programs) and any(cost(program).choice for program in programs)


@all_cases("name", [definition.name for definition in KERNELS])
def test_forms_equal_the_definition(name: str, records: Records) -> None:
    record = records[name]
    assert record.trace is not None and record.decision is not None
    known = truths(record.kernel, record.trace.expressions, record.decision.slots, record.program)
    assert record.uniform
    assert len(record.uniform) == len({form.same for form in record.uniform}) <= len(record.program.arguments)
    for form in record.uniform:
        assert disagreement(program_reader(joined(form, record.program)), known) == ""
        check_arguments(form, record.program)
        once, each = form.costs
        least, alone = form.least(record.program), record.cost.total
        assert least >= 2 and once.total + least * each.total < least * alone
        assert least == 2 or once.total + (least - 1) * each.total >= (least - 1) * alone


def check_arguments(form: Uniform, program: Program) -> None:
    """Prepared values depend only on uniform arguments, and all of them are used."""
    arguments = {argument.name: argument for argument in program.arguments}
    fixed = {component for name in form.same for component in arguments[name].components}
    verify(form.prepare)
    verify(form.apply)
    assert {component for argument in form.prepare.arguments for component in argument.components} == fixed
    (made,) = form.prepare.results
    held, *rest = form.apply.arguments
    assert made.shape == held.shape == (len(held.components),)
    assert [argument.shape for argument in rest] == [a.shape for name, a in arguments.items() if name not in form.same]
    read = {operand for line in form.apply.lines for operand in line.operands}
    read |= {operand for result in form.apply.results for operand in result.operands}
    assert read >= set(held.components)
    assert not (read & fixed) - set(held.components)
    assert not {line.target for line in form.prepare.lines} & {line.target for line in form.apply.lines}


@all_cases("name", [definition.name for definition in KERNELS])
def test_a_split_keeps_the_lines(name: str, records: Records) -> None:
    """Each line is in exactly one part, in the original order."""
    program = records[name].program
    names = [argument.name for argument in program.arguments]
    for same in (same for size in range(1, len(names)) for same in combinations(names, size)):
        form = split(program, same)
        if form is None:
            continue
        check_arguments(form, program)
        once, each = form.prepare.lines, form.apply.lines
        assert [line for line in program.lines if line in each] == list(each)
        assert [line for line in program.lines if line in once] == list(once)
        assert len(once) + len(each) == len(program.lines)
        assert form.apply.results == program.results
        first, second = form.costs
        assert first.total + second.total == cost(program).total


def test_counts_of_a_motor_on_points(records: Records) -> None:
    """The form applies a matrix with nine products and nine sums per point."""
    (form,) = records["move_point"].uniform
    assert form.same == ("m",)
    assert (form.costs[1].mul, form.costs[1].add) == (9, 9)


def test_names_of_arguments_may_be_ambiguous(records: Records) -> None:
    """Uniform a and b, and uniform a_b."""
    assert {("a", "b"), ("a_b",)} <= {form.same for form in records["ambiguous"].uniform}


def test_no_form_without_uniform_arguments(records: Records) -> None:
    assert split(records["move_point"].program, ()) is None
    unused = traced("second", {"a": (3,), "b": (3,)}, lambda a, b: [x * x for x in b])
    assert split(unused, ("a",)) is None


def test_prepared_values_have_unique_names() -> None:
    program = traced(
        "both",
        {"prepared": (2,), "b": (2,)},
        lambda a, b: [a[0] * a[1] * b[0], a[0] * a[1] * b[1]],
        {"prepared_": (2,)},
    )
    form = split(program, ("prepared",))
    assert form is not None
    names = [part.name for part in (*form.apply.arguments, *form.apply.results)]
    assert len(set(names)) == len(names) and "prepared_" in names


def test_more_parts_than_a_word_has_bits_are_not_split() -> None:
    """A loop over a batch uses one bit per part."""
    for n in (MOST - 1, MOST):
        shapes: dict[str, tuple[int, ...]] = {f"x{k}": () for k in range(n)}
        program = traced("long", shapes, lambda *x: [x[0] * x[0] * sum(x[1:], x[0])])
        assert (split(program, ("x0",)) is None) == (n == MOST)


@pytest.mark.parametrize("name", some_slow(NAMES, *(name for k, name in enumerate(NAMES) if k % 3)))
def test_both_texts_are_read_back(name: str, records: Records) -> None:
    """Test all forms, for any names of arguments."""
    record = records[name]
    text = texts(record)
    python, c = python_programs(text["py"]), c_programs(text["c"])
    assert verify_kernel(Compiled.of(record), python, c).is_proved
    for read in (python[name], c[name]):
        assert len(read.forms) == len(record.uniform)
        for form, other in zip(record.uniform, read.forms, strict=True):
            positions = [argument.name in form.same for argument in record.program.arguments]
            assert [argument.name in other.same for argument in read.program.arguments] == positions
            assert other.costs == form.costs


# Calls.


Array = np.ndarray[Any, Any]
FEW = ("move_point", "quadratic", "turn")
"""Kernels that numba compiles here: vectors, a matrix and a number as the result, four arguments and two results."""
LIMIT = 100
"""Units of the last place of the largest coefficient: a form is a different program with the same accuracy."""


@pytest.fixture(scope="module")
def modules(records: Records, tmp_path_factory: pytest.TempPathFactory) -> Mapping[str, ModuleType]:
    sources = tuple(kernel_source(record) for record in records.values())
    path = write(ModuleSource("uniform", "", "", "", sources), tmp_path_factory.mktemp("generated"))
    with without_optimisation():
        build_library(path)
    return {name: load_module(path.with_suffix(".py"), f"uniform_{name}", name) for name in BACKENDS}


def elements(record: Compilation, n: int, dtype: Any = float) -> list[Array]:
    """Arguments that satisfy the relations of their layouts; a few distinct ones, repeated."""
    random = Random(12)
    points = [sample(record.kernel, random, near_one=True) for _ in range(min(n, 13))]
    found = []
    for argument in record.program.arguments:
        values = [[float(point[name]) for name in argument.components] for point in points]
        found.append(np.resize(np.array(values, dtype), (n, *argument.shape)))
    return found


def as_tuple(results: Any) -> tuple[Array, ...]:
    return results if isinstance(results, tuple) else (results,)


def assert_same(found: Any, expected: Any) -> None:
    for a, b in zip(as_tuple(found), as_tuple(expected), strict=True):
        assert a.shape == b.shape and a.dtype == b.dtype
        assert np.abs(a - b).max(initial=0) <= LIMIT * np.finfo(b.dtype).eps * np.abs(b).max(initial=0)


def each_form(records: Records, names: tuple[str, ...]) -> Iterator[tuple[Compilation, Uniform, list[bool]]]:
    """Yield a kernel, one of its forms, and which arguments are uniform in it."""
    for name in names:
        record = records[name]
        for form in record.uniform:
            yield record, form, [argument.name in form.same for argument in record.program.arguments]


def many(arrays: list[Array], same: list[bool]) -> list[Array]:
    """Repeat the first element of uniform arguments; the results must equal those of a call with that element."""
    return [np.repeat(x[:1], len(x), axis=0) if uniform else x for x, uniform in zip(arrays, same, strict=True)]


UNIFORM: Mapping[str, Callable[[Array], Array]] = {
    "without the axis": lambda x: x[0],
    "an axis of one": lambda x: x[:1],
    "an axis without strides": lambda x: np.broadcast_to(x[0], x.shape),
    "an axis without strides, Fortran order": lambda x: np.broadcast_to(np.array(x[0], order="F"), x.shape),
}
"""Kinds of uniform arguments."""


def reversed_in_memory(x: Array) -> Array:
    """The same numbers with a negative stride along every axis."""
    turn = (slice(None, None, -1),) * x.ndim
    return np.ascontiguousarray(x[turn])[turn]


def apart(x: Array) -> Array:
    """The same numbers, with gaps along every axis."""
    wide = np.full([2 * size for size in x.shape], np.nan, x.dtype)
    wide[(slice(None, None, 2),) * x.ndim] = x
    return wide[(slice(None, None, 2),) * x.ndim]


def read_only(x: Array) -> Array:
    x = x.copy()
    x.flags.writeable = False
    return x


ORDERS: Mapping[str, Callable[[Array], Array]] = {
    "C": np.ascontiguousarray,
    "Fortran": np.asfortranarray,
    "strided": apart,
    "negative": reversed_in_memory,
    "read-only": read_only,
}


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("backend", some_slow(BACKENDS, "numba"))
def test_batches_of_every_size(backend: str, dtype: type, records: Records, modules: Mapping[str, ModuleType]) -> None:
    names = tuple(records) if backend == "c" else FEW if dtype is np.float64 else FEW[:1]
    for record, form, same in each_form(records, names):
        function, least = getattr(modules[backend], record.kernel.name), form.least(record.program)
        for n in sorted({0, 1, least - 1, least, least + 1, 15, 16, 17, 1000}):
            arrays = elements(record, n, dtype)
            expected = function(*many(arrays, same))
            one = elements(record, 1, dtype)
            given = [x[0] if uniform else y for x, y, uniform in zip(one, arrays, same, strict=True)]
            assert_same(function(*given), expected)


@pytest.mark.parametrize("order", some_slow(ORDERS, "Fortran", "negative", "read-only"))
@pytest.mark.parametrize("backend", some_slow(BACKENDS, "numba"))
def test_batches_in_every_order(backend: str, order: str, records: Records, modules: Mapping[str, ModuleType]) -> None:
    """Test every order of the varying arguments and every kind of uniform argument."""
    names = tuple(records) if backend == "c" else FEW[:2]
    for record, _, same in each_form(records, names):
        function = getattr(modules[backend], record.kernel.name)
        arrays = elements(record, 37)
        expected = function(*many(arrays, same))
        for change in UNIFORM.values():
            given = [change(x) if uniform else ORDERS[order](x) for x, uniform in zip(arrays, same, strict=True)]
            assert_same(function(*given), expected)
        single = [ORDERS[order](x)[0] if uniform else x for x, uniform in zip(arrays, same, strict=True)]
        assert_same(function(*single), expected)


@pytest.mark.parametrize("backend", some_slow(BACKENDS, "numba"))
def test_leading_axes_broadcast(backend: str, records: Records, modules: Mapping[str, ModuleType]) -> None:
    for record, _, same in each_form(records, tuple(records) if backend == "c" else FEW):
        function = getattr(modules[backend], record.kernel.name)
        arrays = elements(record, 35)
        cores = [argument.shape for argument in record.program.arguments]
        for common, varying in (((5, 1), (1, 7)), ((5, 1), (5, 7)), ((7,), (5, 7)), ((1, 7), (5, 1)), ((), (5, 7))):
            leads = [common if uniform else varying for uniform in same]
            given = [
                x[: int(np.prod(lead, dtype=int))].reshape(lead + core)
                for x, lead, core in zip(arrays, leads, cores, strict=True)
            ]
            whole = [np.broadcast_to(x, (5, 7, *core)).copy() for x, core in zip(given, cores, strict=True)]
            expected = function(*whole)
            assert_same(function(*given), expected)
            assert_same(function(*map(np.asfortranarray, given)), expected)
        everything = [np.broadcast_to(x[0], (5, 7, *core)) for x, core in zip(arrays, cores, strict=True)]
        assert_same(function(*everything), function(*(x.copy() for x in everything)))


@pytest.mark.parametrize("backend", BACKENDS)
def test_results_in_given_arrays(backend: str, records: Records, modules: Mapping[str, ModuleType]) -> None:
    for record, _, same in each_form(records, tuple(records) if backend == "c" else FEW):
        function = getattr(modules[backend], record.kernel.name)
        arrays = elements(record, 37)
        expected = as_tuple(function(*many(arrays, same)))
        given = [x[0] if uniform else x for x, uniform in zip(arrays, same, strict=True)]
        for order in ("C", "Fortran", "strided", "negative"):
            outs = tuple(ORDERS[order](np.zeros_like(result)) for result in expected)
            out = outs if len(outs) > 1 else outs[0]
            assert function(*given, out=out) is out
            assert_same(out, expected if len(outs) > 1 else expected[0])


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("backend", BACKENDS)
def test_results_over_an_argument(
    backend: str, dtype: type, records: Records, modules: Mapping[str, ModuleType]
) -> None:
    """Write over the varying argument, exactly and with an offset, and over the uniform one."""
    move, record = modules[backend].move_point, records["move_point"]
    for n in (1, 2, 16, 40, 300):
        m, p = elements(record, n + 1, dtype)
        expected = move(np.repeat(m[:1], n, axis=0), p[:n])
        for order in ("C", "Fortran", "strided", "negative"):
            points = ORDERS[order](p[:n].copy())
            assert move(m[0], points, out=points) is points
            assert_same(points, expected)
            line = ORDERS[order](p.copy())
            move(m[0], line[:-1], out=line[1:])
            assert_same(line[1:], expected)
            turned = ORDERS[order](p[:n].copy())
            move(m[0], turned[::-1], out=turned)
            assert_same(turned, expected[::-1])


def test_results_over_a_uniform_argument(records: Records, modules: Mapping[str, ModuleType]) -> None:
    for module in modules.values():
        a, b, c = elements(records["join_three_points"], 40)
        expected = module.join_three_points(np.repeat(a[3:4], 40, axis=0), np.repeat(c[5:6], 40, axis=0), c)
        module.join_three_points(a[3], c[5], c, out=c)
        assert_same(c, expected)
        expected = module.join_three_points(np.repeat(a[3:4], 40, axis=0), np.repeat(a[7:8], 40, axis=0), b)
        module.join_three_points(a[3], a[7], b, out=a)
        assert_same(a, expected)


@pytest.mark.parametrize("backend", BACKENDS)
def test_nan_affects_only_its_element(backend: str, records: Records, modules: Mapping[str, ModuleType]) -> None:
    for record, _, same in each_form(records, tuple(records) if backend == "c" else FEW):
        function = getattr(modules[backend], record.kernel.name)
        for n, place in ((5, 3), (16, 0), (40, 39), (300, 77)):
            arrays = elements(record, n)
            given = [x[0] if uniform else x for x, uniform in zip(arrays, same, strict=True)]
            clean = as_tuple(function(*given))
            for value in (np.nan, np.inf):
                for x, uniform in zip(given, same, strict=True):
                    if not uniform:
                        x[place] = value
                results = as_tuple(function(*given))
                assert any(not np.isfinite(result[place]).all() for result in results)
                for found, before in zip(results, clean, strict=True):
                    np.testing.assert_array_equal(np.delete(found, place, 0), np.delete(before, place, 0))
        given = [
            np.full_like(x[0], np.nan) if uniform else x for x, uniform in zip(elements(record, 300), same, strict=True)
        ]
        assert any(np.isnan(result).any() for result in as_tuple(function(*given)))


@pytest.mark.parametrize("backend", BACKENDS)
def test_alternating_calls_of_one_shape(backend: str, records: Records, modules: Mapping[str, ModuleType]) -> None:
    """The cached plan of a call depends on strides, not only on shapes."""
    record = records["move_point"]
    move = modules[backend].move_point
    m, p = elements(record, 64)
    one, each = move(np.repeat(m[:1], 64, axis=0), p), move(m, p)
    assert not np.allclose(one, each)
    for _ in range(2):
        assert_same(move(np.broadcast_to(m[0], m.shape), p), one)
        assert_same(move(m, p), each)
        assert_same(move(np.broadcast_to(m[:1], m.shape), np.asfortranarray(p)), one)
        assert_same(move(np.asfortranarray(m), p), each)
        half = move(np.broadcast_to(m[::32, None], (2, 32, 8)), p.reshape(2, 32, 3)).reshape(64, 3)
        assert_same(half, np.concatenate([move(m[0], p[:32]), move(m[32], p[32:])]))


@pytest.mark.parametrize("backend", BACKENDS)
def test_every_combination_of_uniform_arguments(
    backend: str, records: Records, modules: Mapping[str, ModuleType]
) -> None:
    """Test also combinations without a form, which may use the form for fewer uniform arguments."""
    for name in ("turn", "letters", "ambiguous") if backend == "c" else FEW[2:]:
        record, function = records[name], getattr(modules[backend], name)
        arrays = elements(record, 50)
        for same in np.ndindex(*(2,) * len(arrays)):
            if not all(same):
                given = [x[0] if uniform else x for x, uniform in zip(arrays, same, strict=True)]
                assert_same(function(*given), function(*many(arrays, list(map(bool, same)))))


# The text.


def texts(record: Compilation) -> dict[str, str]:
    module = ModuleSource(record.kernel.name, "", "", "", (kernel_source(record),))
    return {"py": python_source(module), "c": c_source(module)}


def is_found(compiled: Compiled, whole: Mapping[str, str], ending: str, changed: str) -> bool:
    """Whether a changed text is rejected or read as a different definition."""
    both = dict(whole) | {ending: changed}
    try:
        return not verify_kernel(compiled, python_programs(both["py"]), c_programs(both["c"])).is_proved
    except (BackendError, ProofError):
        return True


@pytest.mark.parametrize(
    ("name", "ending"),
    [
        *(("move_point", "py"), ("move_point", "c"), ("quadratic", "py"), ("quadratic", "c")),
        pytest.param("sampson_distance", "c", marks=pytest.mark.slow),
        pytest.param("ambiguous", "c", marks=pytest.mark.slow),
    ],
)
def test_changes_of_a_form_in_the_text_are_detected(name: str, ending: str, records: Records) -> None:
    """Test changes of every kind, in the functions that prepare and in those that apply.

    The Python text of the slow kernels has no such functions, since the runtime separates their operations itself.
    """
    record, random = records[name], Random(4)
    whole, compiled = texts(record), Compiled.of(record)
    own = set(mutations(whole[ending], name, of_forms=False))
    found: dict[str, list[Mutation]] = {}
    for mutation in mutations(whole[ending], name):
        if mutation not in own and not (mutation.kind == "sign" and "cos(" in mutation.line.lower()):
            found.setdefault(mutation.kind, []).append(mutation)
    assert set(found) > {"operation", "operand"}
    for each in found.values():
        for mutation in random.sample(each, min(4, len(each))):
            assert is_found(compiled, whole, ending, mutation.text), mutation[:3]


def numbers_of_forms(text: str, ending: str) -> list[tuple[int, int]]:
    """Find the numbers and names in the tables and loops of forms, apart from the statements."""
    heads = {
        "c": r"^#define (?:PARTS|SAME)_\w+\(.*?[^\\]$|^GAC_(?:FORM|KERNEL_AND_FORMS)\(.*?\)$",
        "py": r"^_module\.form\(.*?\)$",
    }[ending]
    found = []
    for block in re.finditer(heads, text, re.DOTALL | re.MULTILINE):
        found += [
            (block.start() + m.start(), block.start() + m.end()) for m in re.finditer(r"(?<![\w.])\d+(?!\w)", block[0])
        ]
    return found


@pytest.mark.parametrize("ending", ["py", "c"])
@pytest.mark.parametrize("name", some_slow(["move_point", "sampson_distance"], "sampson_distance"))
def test_changes_around_a_form_in_the_text_are_detected(name: str, ending: str, records: Records) -> None:
    """Increase each number: the least number of elements, the uniform arguments, the places of prepared values."""
    record = records[name]
    whole, compiled = texts(record), Compiled.of(record)
    text = whole[ending]
    places = numbers_of_forms(text, ending)
    assert len(places) >= (2 if ending == "py" else 3)
    for start, end in places:
        changed = f"{text[:start]}{int(text[start:end]) + 1}{text[end:]}"
        assert is_found(compiled, whole, ending, changed), text[max(0, start - 60) : end + 20]


@all_cases(
    "ending, old, new",
    [
        ("py", 'move_point, "m", ', 'move_point, "p", '),
        ("py", 'move_point, "m", ', 'move_point, "m p", '),
        ("py", "def _move_point_apply_m(", "def _move_point_apply_p("),
        ("py", "n_prepared=12", "n_prepared=11"),
        ("py", "21 mul, 18 add", "20 mul, 18 add"),
        ("c", "SAME_move_point_m(IN, NUMBER, OUT, AND) IN(0, 0,", "SAME_move_point_m(IN, NUMBER, OUT, AND) IN(1, 1,"),
        ("c", "GAC_USE(move_point, m, DIRECT, 1, 3, 12)", "GAC_USE(move_point, m, DIRECT, 1, 3, 11)"),
        ("c", "GAC_FORM(move_point, m, 0, PLAIN, PLAIN, DIRECT)", "GAC_FORM(move_point, m, 0, PLAIN, PLAIN, TILES)"),
        ("c", "AND IN(1, 1, 3, 3, 1, 3) AND OUT(2, 2,", "AND IN(2, 2, 3, 3, 1, 3) AND OUT(1, 1,"),
    ],
)
def test_changes_of_the_call_of_a_form_are_detected(ending: str, old: str, new: str, records: Records) -> None:
    record = records["move_point"]
    whole = texts(record)
    assert old in whole[ending]
    assert is_found(Compiled.of(record), whole, ending, whole[ending].replace(old, new, 1))


def renamed(definition: Kernel, name: str) -> Kernel:
    return Kernel(name, definition.function, definition.parameters, None, "Other.")


@pytest.mark.parametrize("name", [f"move_point_{end}" for end in ("apply_m", "prepare_m", "start_m", "loop")])
def test_a_kernel_may_not_have_the_name_of_a_form(name: str, records: Records) -> None:
    other = kernel_source(compile_kernel(renamed(quadratic, name)))
    for sources in ((kernel_source(records["move_point"]), other), (other, kernel_source(records["move_point"]))):
        with pytest.raises(BackendError, match=r"move_point.* is already used by .*\bkernel\b.*rename"):
            python_source(ModuleSource("both", "", "", "", sources))


def test_a_kernel_may_have_a_name_like_that_of_a_form(records: Records) -> None:
    """A reader does not mistake another kernel for a form."""
    other = compile_kernel(renamed(quadratic, "move_point_prepare_q"))
    module = ModuleSource("both", "", "", "", (kernel_source(records["move_point"]), kernel_source(other)))
    python, c = python_programs(python_source(module)), c_programs(c_source(module))
    for read in (python, c):
        assert list(read) == ["move_point", "move_point_prepare_q"]
        assert [len(each.forms) for each in read.values()] == [1, 1]
    for record in (other, records["move_point"]):
        assert verify_kernel(Compiled.of(record), python, c).is_proved
