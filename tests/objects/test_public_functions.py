"""The functions for writing kernels, on objects, numbers and all else: the exact result, or an error."""

from __future__ import annotations

import inspect
import warnings
from decimal import Decimal
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
import sympy

import gacompiler as ga
from gacompiler import kernel, symbolic
from gacompiler.algebra import catalog
from gacompiler.algebra.catalog import PGA3
from gacompiler.algebra.meanings import MEANINGS
from gacompiler.algebra.operations import Kind, Operation
from gacompiler.errors import GacError, KernelError, OperandError
from gacompiler.frontend.expression import evaluate, lift
from gacompiler.frontend.kernel import Parameter
from gacompiler.objects import CGA3, QUATERNIONS, STA, VGA3
from gacompiler.objects import PGA3 as SPACE
from gacompiler.objects.arrays import from_exact
from generated import cga3, pga3, sta, vga3
from tests.support.all_cases import all_cases

FUNCTIONS = [each for each in Operation if each.row.kind is Kind.MULTIVECTOR]
SCALARS = [Operation.SQRT, Operation.SIN, Operation.ATAN2, Operation.EXP, Operation.ABS, Operation.MINIMUM]
OTHERS: list[Any] = ["x", [3, 4, 0], (1, 2), None, {"e1": 3}, np.array([3.0, 4, 0]), np.array(["x"]), object()]
ONE = np.ones(1)
MOTOR, POINT = SPACE.motor(SPACE.line([1, 0, 0], [0, 0, 1]), 1.0), SPACE.point(1, 2, 3)

_CIRCLE = CGA3.circle(CGA3.point(1, 2, 3), [0, 0, 1], 1.5)
VALUES: dict[str, tuple[Any, ...]] = {
    "VGA3": (vga3.Vector(1, 2, 3), vga3.Rotor(VGA3.rotor([0, 0, 1], 0.5).values)),
    "PGA3": (pga3.Point(1, 2, 3), pga3.Motor(MOTOR.values)),
    "CGA3": (cga3.Point(1, 2, 3), cga3.Circle(_CIRCLE.values)),
    "STA": (sta.Vector(1, 2, 3, 4), sta.Bivector(1, 2, 3, 4, 5, 6)),
}
"""Values of generated modules."""


@kernel(m=PGA3.MOTOR, p=PGA3.POINT)
def move_point(m, p):
    """Move a point."""
    return ga.sandwich(m, p)


@kernel(numbers=ga.array(ga.SCALAR, "n"))
def sum_of_squares(numbers):
    """The sum of the squares of numbers."""
    return ga.total(lambda x: x * x, numbers)


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
            function = getattr(ga, operation.value)
            traced = function(*map(lift, given))
            found = {
                "object": function(*(objects[each] for each in given)),
                "array": function(*(objects[each] * ONE for each in given)),
                "symbolic": function(*map(_symbolic, given)),
                "traced": evaluate([traced], {})[0],
                "method": getattr(given[0], operation)(*given[1:]),
            }
            for kind, value in found.items():
                value = {"1": value} if isinstance(value, np.ndarray) else value
                value = {"1": value.scalar} if getattr(value, "algebra", None) == ga.SCALAR.algebra else value
                wrong = [name for name in blades if abs(_coefficient(value, name) - float(wanted[name])) > 1e-10]
                assert not wrong, (operation, kind, given, value, wanted)


def _symbolic(x: Any) -> Any:
    return symbolic.multivector(
        x.algebra, {x.algebra.spelling(blade)[1]: x[x.algebra.spelling(blade)[1]] for blade in x.terms}
    )


def _coefficient(value: Any, name: str) -> float:
    return float(np.ravel(value.get(name, 0.0) if isinstance(value, dict) else value[name])[0])


def _required(function: Any) -> int:
    parameters = inspect.signature(function).parameters.values()
    return max(1, sum(each.default is each.empty and each.kind is not each.VAR_POSITIONAL for each in parameters))


@pytest.mark.parametrize("space", [VGA3, SPACE, CGA3, STA], ids=lambda space: space.algebra.name)
def test_every_public_name_gives_a_value_or_an_error_of_the_package(
    space: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Values of every type in every place, beside exact and traced multivectors: no other exception, and no hang."""
    monkeypatch.setenv("GAC_BACKEND", "arrays")
    warnings.simplefilter("ignore")
    algebra = space.algebra
    vector = algebra.multivector({name: k + 2 for k, name in enumerate(algebra.vectors)})
    traced = Parameter("x", algebra.layout("L", " ".join(algebra.vectors))).symbols()
    single = from_exact(vector)
    values = [
        vector, symbolic.multivector(algebra, {algebra.vectors[0]: sympy.Symbol("a")}), single, single * ONE, traced,
        single | single, VALUES[algebra.name][0], 3, 0.5, Fraction(1, 2), 1j, True, sympy.Symbol("a"), space, algebra,
        *OTHERS,
    ]  # fmt: skip
    problems: list[Any] = []
    for name in set(ga.__all__) - {"compile"}:
        function = getattr(ga, name)
        if not callable(function) or inspect.isclass(function):
            continue
        n = _required(function)
        calls = [(value,) * n for value in values]
        if n > 1 and algebra == VGA3.algebra:
            calls += [(other, *(value,) * (n - 1)) for value in values for other in (vector, traced, single)]
            calls += [(value, *(3,) * (n - 1)) for value in values]
        for call in calls:
            try:
                function(*call)
            except GacError:
                pass
            except ValueError as error:
                problems += [] if "math domain" in str(error) else [(name, call, error)]
            except Exception as error:
                problems.append((name, call, error))
    assert not problems, problems[:5]


@all_cases("operation", [*FUNCTIONS, *SCALARS])
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
        ga.floor(MOTOR)
    with pytest.raises(OperandError, match="select"):
        ga.select("x", MOTOR, POINT)


@pytest.mark.parametrize("space", [VGA3, SPACE, CGA3, STA], ids=lambda space: space.algebra.name)
def test_values_of_generated_modules_are_what_their_objects_are(space: Any) -> None:
    pairs = [(x, space.of(x)) for x in VALUES[space.algebra.name]]
    for name in set(ga.__all__) - {"compile"}:
        function = getattr(ga, name)
        if not inspect.isfunction(function):
            continue
        (x, a), (y, b) = pairs
        calls: list[Any] = [((x,), (a,)), ((y,), (b,)), ((y, x), (b, a)), ((a, y), (a, b)), ((y, y, 0.5), (b, b, 0.5))]
        for given, objects in calls:
            found, wanted = (_result(function, each) for each in (given, objects))
            assert type(found) is type(wanted), (name, given, found, wanted)
            if not isinstance(wanted, Exception):
                found, wanted = (getattr(each, "values", each) for each in (found, wanted))
                np.testing.assert_array_equal(found, wanted, err_msg=f"{name}{given}")


def test_only_elements_of_its_algebra_are_elements_of_a_space() -> None:
    point = SPACE.point(1, 2, 3)
    assert SPACE.of(pga3.Point(1, 2, 3)) == point and SPACE.of(point) == point
    assert SPACE.of(pga3.Point(1, 2, 3)).explain() == "point (1, 2, 3)"
    with pytest.raises(GacError, match=r"an element of CGA3\.POINT; expected one of PGA3"):
        SPACE.of(cga3.Point(1, 2, 3))
    with pytest.raises(GacError, match="list as first argument; expected a layout, or only an element"):
        SPACE.of([1, 2, 3])
    with pytest.raises(GacError, match=r"UNIT_PLANE: x ~x - 1 = 0\.812"):
        SPACE.of(pga3.UnitPlane(1, 2, 3, 4))


def _result(function: Any, arguments: tuple[Any, ...]) -> Any:
    try:
        return function(*arguments)
    except (GacError, TypeError) as error:  # too many arguments, or operands of other kinds
        return error


def test_a_kernel_is_a_function_of_multivectors_until_it_is_compiled() -> None:
    assert move_point(MOTOR, POINT).isclose(MOTOR >> POINT)
    for others in ((np.ones(8), np.ones(3)), ([1] * 8, [1, 2, "x"]), (MOTOR, np.ones(3))):
        with pytest.raises(KernelError, match=r"compile it, as in `f = gacompiler.compile\(move_point\)`"):
            move_point(*others)
    for many in ([1.0, 2.0], (3.0, 4.0), 5.0, np.ones(2)):
        with pytest.raises(KernelError, match=r"compile it, as in `f = gacompiler.compile\(sum_of_squares\)`"):
            sum_of_squares(many)


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


def test_quaternions_and_complex_numbers_have_the_norms_of_numbers() -> None:
    from scipy.spatial.transform import Rotation

    q = QUATERNIONS.quaternion(1, 2, 3, 4)
    assert q.norm() == pytest.approx(np.sqrt(30)) and q.norm_squared() == pytest.approx(30)
    np.testing.assert_allclose((~q).values, [1, -2, -3, -4])
    np.testing.assert_allclose(q.normalize().values, np.array([1, 2, 3, 4]) / np.sqrt(30))
    assert (1 + QUATERNIONS.i).normalize().isclose((1 + QUATERNIONS.i) / np.sqrt(2))
    assert (QUATERNIONS.i * QUATERNIONS.j).isclose(QUATERNIONS.k) and (q * q.inverse()).isclose(1)
    turned = q.normalize() >> QUATERNIONS.imaginary(1, -2, 5)
    expected = Rotation.from_quat([2, 3, 4, 1]).apply([1, -2, 5])
    assert turned.isclose(QUATERNIONS.imaginary(expected))
    exact = QUATERNIONS.algebra.multivector({"1": 1, "e1": 2, "e2": 3, "e12": 4})
    assert exact * ~exact == 30 and ga.sandwich(exact, exact) == 30 * exact
    number = catalog.COMPLEX.multivector({"1": 3, "e1": 4})
    assert number * ~number == 25 and catalog.VGA2 != catalog.QUATERNIONS


@all_cases("function", [ga.dual, ga.undual, ga.polarity, lambda x: ga.regressive_product(x, 2)])
def test_numbers_have_no_dual(function: Any) -> None:
    """The dual of 3 is 3 e123 in one algebra and 3 e12 in another one."""
    coefficient = Parameter("p", PGA3.POINT).symbols().e032
    number = VGA3.vector(1, 2, 3) | VGA3.vector(1, 2, 3)
    for x in (3, 0.5, Fraction(1, 2), sympy.Symbol("a"), number, np.float64(2), coefficient):
        with pytest.raises(GacError, match="numbers, which belong to no algebra"):
            function(x)
    assert ga.dual(PGA3.scalar(3)) == 3 * PGA3.pseudoscalar


def test_the_function_normalize_divides_by_the_norm_as_in_kernels() -> None:
    """An even element that is no motor: the method also makes it one, which kernels do not."""
    exact = PGA3.multivector({"1": 3, "e12": 4, "e01": 2, "e0123": 5})
    x = SPACE.of(SPACE.EVEN, from_exact(exact).as_layout(SPACE.EVEN).values)
    wanted = from_exact(ga.normalize(exact))
    assert wanted["e0123"] == 1 and ga.normalize(x).isclose(wanted)
    assert ga.normalize(np.stack([x, 2 * x])).isclose(wanted).all()
    assert (x.normalize() * ~x.normalize()).isclose(1) and not x.normalize().isclose(wanted)
    assert ga.normalize(MOTOR).isclose(MOTOR) and ga.normalize(SPACE.plane(3, 0, 4, 5)).isclose(
        SPACE.plane(0.6, 0, 0.8, 1)
    )
