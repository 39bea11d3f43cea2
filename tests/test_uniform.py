"""Forms for batches in which some arguments stay the same: what they are, and that calls give the same numbers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

import gacompiler as ga
from gacompiler import SCALAR, array, kernel, sandwich
from gacompiler.algebra.catalog import CGA3, PGA3, VGA3
from gacompiler.backends import c_programs, c_source, python_programs, python_source
from gacompiler.backends.build import find_compiler
from gacompiler.backends.module import ModuleSource
from gacompiler.errors import BackendError
from gacompiler.frontend.kernel import Kernel
from gacompiler.generate import kernel_source
from gacompiler.ir.uniform import joined, split
from gacompiler.passes.pipeline import compile_kernel
from gacompiler.passes.prove import disagreement, program_reader, truths
from gacompiler.prove import verify_kernel
from gacompiler.runtime import compile

BACKENDS = ["numba", *(["c"] if find_compiler() else [])]


@kernel(m=PGA3.MOTOR, p=PGA3.POINT)
def move_point(m, p):  # type: ignore[no-untyped-def]
    return sandwich(m, p)


@kernel(m=CGA3.MOTOR, p=CGA3.POINT)
def move_conformal(m, p):  # type: ignore[no-untyped-def]
    return sandwich(m, p)


@kernel(line=PGA3.UNIT_LINE, angle=SCALAR, distance=SCALAR, p=PGA3.POINT)
def screw(line, angle, distance, p):  # type: ignore[no-untyped-def]
    m = (ga.cos(angle / 2) - ga.sin(angle / 2) * line) * (1 - distance / 2 * line * PGA3.multivector({"e0123": 1}))
    return m * p * ~m, ga.norm_squared(m)


@kernel(matrix=array(SCALAR, 3, 3), v=array(SCALAR, 3))
def quadratic(matrix, v):  # type: ignore[no-untyped-def]
    return sum(v[i] * matrix[i][j] * v[j] for i in range(3) for j in range(3)) / (1 + matrix[0][0] * matrix[0][0])


@kernel(a=VGA3.VECTOR, b=VGA3.VECTOR, a_b=VGA3.VECTOR, prepared=VGA3.ROTOR)
def awkward_names(a, b, a_b, prepared):  # type: ignore[no-untyped-def]
    return sandwich(prepared, (a ^ b) * a_b)


@kernel(m=PGA3.MOTOR, i=PGA3.PLANE)
def branches(m, i):  # type: ignore[no-untyped-def]
    return ga.select(m["1"] < 0, -1, 1) * sandwich(m, i)


@kernel(double=PGA3.MOTOR, p=PGA3.POINT)
def reserved_name(double, p):  # type: ignore[no-untyped-def]
    return sandwich(double, p)


KERNELS = [move_point, move_conformal, screw, quadratic, awkward_names, branches, reserved_name]


@pytest.fixture(scope="module")
def records() -> Mapping[str, Any]:
    return {definition.name: compile_kernel(definition) for definition in KERNELS}


@pytest.mark.parametrize("definition", KERNELS, ids=lambda definition: definition.name)
def test_forms_are_the_definition(definition: Kernel, records: Mapping[str, Any]) -> None:
    record = records[definition.name]
    known = truths(record)
    assert record.uniform
    for form in record.uniform:
        assert disagreement(program_reader(joined(form, record.program)), known) == ""
        own = {component for a in record.program.arguments if a.name in form.same for component in a.components}
        assert {component for a in form.prepare.arguments for component in a.components} == own
        once, each = form.costs
        least, alone = form.least(record.program), record.cost.total
        assert once.total + least * each.total < least * alone or least == 1
        assert least == 1 or once.total + (least - 1) * each.total >= (least - 1) * alone


def test_counts_of_a_motor_on_points(records: Mapping[str, Any]) -> None:
    """A matrix takes nine products and nine sums a point, and that is what is found."""
    (form,) = records["move_point"].uniform
    assert form.same == ("m",)
    assert (form.costs[1].mul, form.costs[1].add) == (9, 9)


def test_nothing_that_stays_gives_no_form(records: Mapping[str, Any]) -> None:
    assert split(records["move_point"].program, ()) is None


def unit_motors(n: int, dtype: type) -> np.ndarray[Any, Any]:
    from generated import pga3

    return np.asarray(pga3.motor_exponential(np.random.default_rng(4).normal(size=(n, 6))), dtype)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_calls_with_one_motor_give_what_many_equal_ones_give(backend: str, dtype: type) -> None:
    move = compile(move_point, backend=backend)
    rng, limit = np.random.default_rng(5), 200 * np.finfo(dtype).eps
    m = unit_motors(1, dtype)[0]
    for n in (0, 1, 2, 3, 15, 16, 17, 130, 1000):
        for points in (
            rng.normal(size=(n, 3)).astype(dtype),
            np.asfortranarray(rng.normal(size=(n, 3)).astype(dtype)),
            rng.normal(size=(2 * n, 6)).astype(dtype)[::2, ::2],
            rng.normal(size=(n, 3)).astype(dtype)[::-1],
        ):
            points.flags.writeable = False
            expected = move(np.repeat(m[None], n, axis=0), points)
            for motor in (m, np.broadcast_to(m, (n, 8)), m[None]):
                found = move(motor, points)
                assert found.shape == expected.shape and np.abs(found - expected).max(initial=0) <= limit
            out = points.copy()
            assert move(m, out, out=out) is out
            assert np.abs(out - expected).max(initial=0) <= limit
    grid = rng.normal(size=(5, 40, 3)).astype(dtype)
    motors = unit_motors(5, dtype)[:, None]
    expected = move(np.repeat(motors, 40, axis=1), grid)
    assert np.abs(move(motors, grid) - expected).max() <= limit
    grid[2, 7] = np.nan
    found = move(m, grid)
    assert np.isnan(found[2, 7]).all() and np.isnan(found).sum() == 3


@pytest.mark.parametrize("backend", BACKENDS)
def test_calls_with_several_results_and_scalars(backend: str) -> None:
    function = compile(screw, backend=backend)
    rng = np.random.default_rng(6)
    line = np.array([0.6, 0.0, 0.8, 0.1, 0.3, -0.075])
    angle, distance, points = rng.normal(size=50), rng.normal(size=50), rng.normal(size=(50, 3))
    for same in ((0.3, 1.5), (angle, 1.5), (angle, distance)):
        found = function(line, *same, points)
        many = [np.broadcast_to(value, (50,)).copy() for value in same]
        expected = function(np.repeat(line[None], 50, axis=0), *many, points)
        for a, b in zip(found, expected, strict=True):
            assert np.abs(a - b).max() < 1e-13


def texts(record: Any) -> dict[str, str]:
    module = ModuleSource(record.kernel.name, "", "", "", (kernel_source(record),))
    return {"py": python_source(module), "c": c_source(module)}


@pytest.mark.parametrize("definition", KERNELS, ids=lambda definition: definition.name)
def test_forms_are_read_back(definition: Kernel, records: Mapping[str, Any]) -> None:
    whole = texts(records[definition.name])
    verdict = verify_kernel(records[definition.name], python_programs(whole["py"]), c_programs(whole["c"]))
    assert verdict.is_proved


@pytest.mark.parametrize("ending", ["py", "c"])
def test_changes_of_a_form_in_the_text_are_found(ending: str, records: Mapping[str, Any]) -> None:
    record = records["move_point"]
    whole = texts(record)
    (form,) = record.uniform
    line = next(line for line in form.prepare.lines if line.op.value == "subtract")
    target, (a, b) = line.target, line.operands
    wrong = {
        "py": {
            f"{target} = {a} - {b}": f"{target} = {a} + {b}",
            "prepared[1] = ": "prepared[2] = ",
            "_prepare_m(m[0], prepared)": "_prepare_m(m[1], prepared)",
            '(("m",), 3,': '(("m",), 1,',
            '(("m",), 3, ': '(("p",), 3, ',
        },
        "c": {
            f"{target} = {a} - {b};": f"{target} = {b} - {a};",
            "prepared[1] = ": "prepared[2] = ",
            "(const REAL *)args[0]": "(const REAL *)args[1]",
            "forms[] = {{1, 3,": "forms[] = {{1, 1,",
            "forms[] = {{1, ": "forms[] = {{2, ",
        },
    }[ending]
    for old, new in wrong.items():
        assert old in whole[ending], old
        changed = dict(whole) | {ending: whole[ending].replace(old, new, 1)}
        try:
            verdict = verify_kernel(record, python_programs(changed["py"]), c_programs(changed["c"]))
        except BackendError:
            continue
        assert not verdict.is_proved, old


def test_a_kernel_may_not_have_the_name_of_a_form() -> None:
    record = compile_kernel(move_point)
    sources = [kernel_source(record)]
    other = compile_kernel(Kernel("move_point_apply_m", move_point.function, move_point.parameters, None, "Other."))
    sources.append(kernel_source(other))
    with pytest.raises(BackendError, match="move_point_apply_m"):
        python_source(ModuleSource("both", "", "", "", tuple(sources)))
