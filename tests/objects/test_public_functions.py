"""The functions for writing kernels, on objects, numbers and all else: the exact result, or an error."""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

import gacompiler as ga
from gacompiler import kernel
from gacompiler.algebra.catalog import PGA3
from gacompiler.algebra.meanings import MEANINGS
from gacompiler.algebra.operations import Kind, Operation
from gacompiler.errors import GacError, KernelError, OperandError
from gacompiler.objects import CGA3, QUATERNIONS, STA, VGA3
from gacompiler.objects import PGA3 as SPACE
from gacompiler.objects.arrays import from_exact

FUNCTIONS = [each for each in Operation if each.row.kind is Kind.MULTIVECTOR]
SCALARS = [Operation.SQRT, Operation.SIN, Operation.ATAN2, Operation.EXP, Operation.ABS, Operation.MINIMUM]
OTHERS: list[Any] = ["x", [3, 4, 0], (1, 2), None, {"e1": 3}, np.array([3.0, 4, 0]), np.array(["x"]), object()]
MOTOR, POINT = SPACE.motor(SPACE.line([1, 0, 0], [0, 0, 1]), 1.0), SPACE.point(1, 2, 3)


@kernel(m=PGA3.MOTOR, p=PGA3.POINT)
def move_point(m, p):
    """Move a point."""
    return ga.sandwich(m, p)


@pytest.mark.parametrize("space", [VGA3, SPACE, CGA3, STA], ids=lambda space: space.algebra.name)
def test_functions_of_objects_are_those_of_exact_multivectors(space: Any) -> None:
    names = space.algebra.vectors
    blades = [space.algebra.spelling(blade)[1] for blade in range(1 << len(names))]
    vector = sum((k + 2) * space.algebra.multivector({name: 1}) for k, name in enumerate(names))
    even = vector * space.algebra.multivector({names[0]: 1, names[1]: 3})
    objects = {exact: from_exact(exact) for exact in (vector, even)}
    for operation in FUNCTIONS:
        for exact in ((vector, even), (even, vector)):
            given = exact[: operation.row.operands]
            try:
                wanted = MEANINGS[operation](*given)
            except GacError:  # no inverse, or no exact root
                continue
            found = getattr(ga, operation.value)(*(objects[each] for each in given))
            wrong = [name for name in blades if abs(found[name] - float(wanted[name])) > 1e-10]
            assert not wrong, (operation, given, found, wanted)


@pytest.mark.parametrize("operation", [*FUNCTIONS, *SCALARS], ids=str)
def test_what_is_no_multivector_is_refused(operation: Operation) -> None:
    function = getattr(ga, operation.value if operation is not Operation.ABS else "absolute")
    rest = (2,) * (operation.row.operands - 1)
    for other in OTHERS:
        if operation.row.kind is Kind.SCALAR and isinstance(other, np.ndarray) and other.dtype.kind == "f":
            assert function(np.array([1.0, 0.5]), *rest).shape == (2,)
            continue
        with pytest.raises(OperandError, match=type(other).__name__):
            function(other, *rest)


def test_functions_without_an_operation_accept_objects() -> None:
    half = MOTOR.power(0.5)
    assert (
        ga.power(MOTOR, 0.5).isclose(half) and ga.sqrt(MOTOR).isclose(half) and (ga.exp(ga.log(MOTOR))).isclose(MOTOR)
    )
    assert ga.interpolate(MOTOR, MOTOR * MOTOR, 0.5).isclose(MOTOR * half)
    assert ga.join(POINT, SPACE.point(0, 0, 0)).isclose(POINT & SPACE.point(0, 0, 0))
    assert ga.grade(MOTOR, 2).isclose(MOTOR.grade(2)) and ga.coefficient(POINT, "e123") == 1
    assert ga.select(1, MOTOR, POINT) is MOTOR
    with pytest.raises(OperandError, match="numbers"):
        ga.sin(MOTOR)
    with pytest.raises(OperandError, match="select"):
        ga.select("x", MOTOR, POINT)


def test_a_kernel_is_a_function_of_multivectors_until_it_is_compiled() -> None:
    assert move_point(MOTOR, POINT).isclose(MOTOR >> POINT)
    for others in ((np.ones(8), np.ones(3)), ([1] * 8, [1, 2, "x"]), (MOTOR, np.ones(3))):
        with pytest.raises(KernelError, match=r"compile it, as in `f = gacompiler.compile\(move_point\)`"):
            move_point(*others)


def test_lists_of_coordinates_are_no_scalars() -> None:
    for call in (lambda: MOTOR >> [1, 0, 0], lambda: MOTOR >> np.ones(3), lambda: POINT ^ [1, 2, 3]):
        with pytest.raises(OperandError, match="do not say which blades"):
            call()
    assert (2 * np.arange(3.0) * POINT).shape == (3,)
    turn = QUATERNIONS.rotation([0, 0, 1], np.pi / 2)
    assert QUATERNIONS.rotate(turn, [1, 0, 0]).isclose(QUATERNIONS.imaginary(0, 1, 0))
    assert VGA3.reflect([0, 0, 1], [1, 2, 3]).isclose(VGA3.vector(1, 2, -3))
    assert VGA3.rotor_between([1, 0, 0], [0, 1, 0]).isclose(VGA3.rotor([0, 0, 1], np.pi / 2))


def test_numbers_of_every_type_are_numbers() -> None:
    for number in (2, 2.0, Fraction(2), Decimal(2), np.float32(2), 2 + 0j):
        assert ga.geometric_product(number, number) == 4
