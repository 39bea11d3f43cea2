"""The mode that checks relations of arguments: what violates one is named, what satisfies all of them is accepted."""

from __future__ import annotations

import inspect
import re
from typing import Any

import numpy as np
import pytest

from gacompiler.objects import CGA2, CGA3, PGA2, PGA3, QUATERNIONS, STA, VGA2, VGA3
from generated import cga2, cga3, motor_filters, pga2, pga3, quaternion, sta, vga2, vga3
from generated.gac_runtime import checked as module
from generated.gac_runtime.checked import checked
from tests.support.all_cases import all_cases

RANDOM = np.random.default_rng(8)
POINT = RANDOM.normal(size=3)
SPREAD = RANDOM.normal(size=(4, 3))
MOTOR = np.asarray(PGA3.random_motor(generator=RANDOM).values)
UNITS: dict[str, tuple[Any, Any, tuple[Any, ...]]] = {
    "pga3": (pga3.move_point, MOTOR, (POINT,)),
    "pga2": (pga2.move_point, PGA2.motor(0.5, 1, 2).values, (POINT[:2],)),
    "cga2": (cga2.move_point, CGA2.motor(0.5, 1, 2).values, (POINT[:2],)),
    "cga3": (cga3.move_point, CGA3.motor([0, 1, 2], 0.5, 1.0).values, (POINT,)),
    "vga2": (vga2.rotate_vector, VGA2.rotor(0.5).values, (POINT[:2],)),
    "vga3": (vga3.rotate_vector, VGA3.rotor([1, 2, 3], 0.5).values, (POINT,)),
    "quaternion": (quaternion.rotate_vector, QUATERNIONS.rotation([1, 2, 3], 0.5).values, (POINT,)),
    "sta": (sta.transform_vector, (STA.boost(0.5, 0.1, 0) * STA.rotor([0, 0, 1], 1)).values, (np.arange(4.0),)),
}
LINE = np.asarray(PGA3.line([1, 2, 3], [4, 5, 7]).values)
BLADES: dict[str, tuple[Any, Any]] = {
    "PGA3.LINE": (pga3.line_support, LINE),
    "CGA3.LINE": (cga3.line_polarity, CGA3.line([1, 2, 3], [4, 5, 7]).values),
    "CGA3.CIRCLE": (cga3.circle_centre, CGA3.circle(*SPREAD[:3]).values),
    "CGA3.POINT_PAIR": (cga3.point_pair_centre, CGA3.point_pair(*SPREAD[:2]).values),
    "CGA2.POINT_PAIR": (cga2.point_pair_centre, CGA2.point_pair(SPREAD[0, :2], SPREAD[1, :2]).values),
}


@all_cases("name", UNITS)
def test_unit_elements(name: str) -> None:
    kernel, unit, rest = UNITS[name]
    expected = kernel(unit, *rest)
    with checked():
        np.testing.assert_array_equal(kernel(unit, *rest), expected)
        assert kernel(np.stack([unit, -np.asarray(unit)]), *rest).shape == (2, *np.shape(expected))
        if name in ("pga3", "vga3"):  # those of which other tests compile functions of floats
            kernel(np.asarray(unit, np.float32), *(x.astype(np.float32) for x in rest))
        for factor, off in ((1.1, 0.21), (1 + 1e-7, 2e-7)):
            rows = np.stack([unit, unit, factor * np.asarray(unit)])
            first = next(iter(inspect.signature(kernel).parameters))
            with pytest.raises(ValueError, match=rf"^{kernel.name}: argument {first}, row 2, has x ~x - 1 = ") as error:
                kernel(rows, *rest)
            residual = re.search(r"= (\S+);", str(error.value))
            assert residual is not None and float(residual[1]) == pytest.approx(off, rel=0.02)
    assert kernel(2 * np.asarray(unit), *rest) is not None


@pytest.mark.parametrize("name", BLADES)
def test_outer_products(name: str) -> None:
    kernel, blade = BLADES[name]
    blade = np.asarray(blade)
    other = blade + 0.1 * RANDOM.normal(size=blade.shape)
    expected = kernel(blade)
    with checked():
        np.testing.assert_array_equal(kernel(blade), expected)
        kernel(1e-8 * blade)
        message = rf"^{kernel.name}: argument \w+, row \(1, 0\), has a Pluecker relation = .*; expected a {name}"
        for scale in (1.0, 1e-8):
            with pytest.raises(ValueError, match=message):
                kernel(scale * np.stack([blade, other])[:, None])
    kernel(other)


def test_study_condition_and_twists() -> None:
    motor, twist = MOTOR.copy(), RANDOM.normal(size=6)
    motor[-1] += 0.1
    with checked():
        with pytest.raises(ValueError, match="argument m has x ~x - 1 = "):
            pga3.move_point(motor, POINT)
        assert pga3.motor_from_twist(twist).shape == (8,)  # a twist is no line


def test_matrices_and_nan() -> None:
    with checked():
        pga3.motor_from_matrix(pga3.motor_to_matrix(MOTOR))
        vga3.rotor_from_matrix(np.eye(3))
        pga2.motor_from_matrix(np.eye(3))
        bent = np.eye(4)
        bent[3, 0] = 0.5
        for kernel, wrong in (
            (pga3.motor_from_matrix, np.diag([-1.0, 1, 1, 1])), (pga3.motor_from_matrix, np.ones((4, 4))),
            (pga3.motor_from_matrix, bent), (vga3.rotor_from_matrix, 2 * np.eye(3)),
            (vga2.rotor_from_matrix, np.ones((2, 2))),
        ):  # fmt: skip
            with pytest.raises(ValueError, match=rf"^{kernel.name}: argument matrix has R\^T R - 1"):
                kernel(wrong)
        with pytest.raises(ValueError, match=r"move_point: argument p is NaN at index \(1, 2\)"):
            pga3.move_point(MOTOR, [[1, 2, 3], [4, 5, np.nan]])
        with pytest.raises(ValueError, match="argument distance is NaN; expected"):
            pga3.plane_from_normal([0, 0, 1.0], np.nan)
    assert np.isnan(pga3.move_point(MOTOR, [np.nan, 0, 0])).any()


def test_the_mode_applies_to_elements_and_loops_and_ends_with_the_block() -> None:
    moved = pga3.move_point(PGA3.of(PGA3.MOTOR, MOTOR), PGA3.point(POINT))
    loop = motor_filters.filter_lines
    arguments = {
        t.name: np.zeros((2,) * len(t.lengths) + t.shape) + (LINE if t.shape == (6,) else 0)
        for t in loop.definition.parameters
    }
    units = [name for name, layout in loop.layouts.items() if layout.unit and name in arguments]
    arguments |= {name: np.broadcast_to(MOTOR, arguments[name].shape) for name in units}
    expected = loop(**arguments)
    with checked():
        assert pga3.move_point(PGA3.of(PGA3.MOTOR, MOTOR), PGA3.point(POINT)) == moved
        with checked():
            loop(**arguments)
        arguments[units[0]] = 2 * arguments[units[0]]
        for _ in range(3):  # the kernel does not return to the extension within the block
            with pytest.raises(ValueError, match=rf"^filter_lines: argument {units[0]}.* has x ~x - 1 = 3"):
                loop(**arguments)
            with pytest.raises(ValueError, match="argument m has x ~x - 1 = 3"):
                pga3.move_point(2 * MOTOR, POINT)
    arguments[units[0]] = arguments[units[0]] / 2
    for a, b in zip(loop(**arguments), expected, strict=True):
        np.testing.assert_array_equal(a, b)
    with pytest.raises(ZeroDivisionError), checked():
        raise ZeroDivisionError
    assert module.active == 0 and pga3.move_point.attempt(MOTOR, POINT) is not None
