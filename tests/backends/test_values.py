"""Values of one element behave the same with and without the extension and equal the results of kernels."""

from __future__ import annotations

import copy
import gc
import pickle
import re
import sys
import threading
import tracemalloc
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from alone import alone
from backend_programs import extension_of, load
from one_element import load_implementations, outcome

from gacompiler.backends.module import KernelSource, ModuleSource
from gacompiler.backends.values import value_types
from gacompiler.gac_runtime.layout import Layout
from gacompiler.generation.compiling import compile_spec
from gacompiler.generation.sources import kernel_source
from gacompiler.generation.spec_files import load_spec
from gacompiler.passes.pipeline import compile_kernel
from tests.support.all_cases import all_cases
from tests.support.unoptimised import without_optimisation

SPEC = '''
"""Kernels that are operators, and some that are not."""
import gacompiler as ga
from gacompiler import SCALAR, array, kernel
from gacompiler.algebra.catalog import PGA3, VGA2

MOTOR, POINT, LINE, PLANE, EVEN, DIRECTION = PGA3.MOTOR, PGA3.POINT, PGA3.LINE, PGA3.PLANE, PGA3.EVEN, PGA3.DIRECTION

@kernel(a=MOTOR, b=MOTOR, returns=MOTOR)
def composed(a, b):
    """A product."""
    return a * b

@kernel(a=EVEN, b=EVEN)
def even(a, b):
    """A product of even elements."""
    return ga.geometric_product(a, b)

@kernel(p=POINT, m=MOTOR)
def moved(p, m):
    """A sandwich as a product with its arguments in reverse order."""
    return m * p * ~m

@kernel(m=MOTOR, line=LINE)
def moved_line(m, line):
    """A sandwich by name."""
    return ga.sandwich(m, line)

@kernel(m=MOTOR, p=POINT)
def moved_back(m, p):
    """No operator."""
    return ~m * p * m

@kernel(a=POINT, b=POINT)
def joined(a, b):
    """A join."""
    return ga.join(a, b)

@kernel(p=POINT, plane=PGA3.UNIT_PLANE)
def distance(p, plane):
    """A scalar from arguments in reverse order."""
    return plane & p

@kernel(line=LINE, plane=PLANE)
def met(line, plane):
    """A meet."""
    return line ^ plane

@kernel(m=MOTOR, returns=MOTOR)
def undone(m):
    """The reverse."""
    return ~m

@kernel(a=LINE, b=LINE)
def total(a, b):
    """A sum."""
    return a + b

@kernel(a=POINT, b=POINT)
def between(a, b):
    """A difference."""
    return b - a

@kernel(d=DIRECTION)
def opposite(d):
    """A sign."""
    return -d

@kernel(points=array(POINT, 2), m=MOTOR)
def several(points, m):
    """No operator: an array of points."""
    return points[0] & points[1]

@kernel(a=VGA2.full, b=VGA2.full)
def product(a, b):
    """The product of any elements."""
    return a * b

@kernel(v=array(SCALAR, 3), returns=PGA3.TRANSLATOR)
def translator(v):
    """No operator."""
    return 1 - (v[0] * PGA3.multivector({"e01": 1}) + v[1] * PGA3.multivector({"e02": 1})
                + v[2] * PGA3.multivector({"e03": 1})) / 2

@kernel(i=PGA3.layout("VOLUME", "e0123"), j=PGA3.layout("VOLUME", "e0123"))
def volumes(i, j):
    """A sum of elements with one coefficient."""
    return i + j
'''

OPERATORS = {
    "composed": ("*", ("a", "b")),
    "even": ("*", ("a", "b")),
    "moved": ("()", ("m", "p")),
    "moved_line": ("()", ("m", "line")),
    "joined": ("&", ("a", "b")),
    "distance": ("&", ("plane", "p")),
    "met": ("^", ("line", "plane")),
    "undone": ("~", ("m",)),
    "total": ("+", ("a", "b")),
    "between": ("-", ("b", "a")),
    "opposite": ("-", ("d",)),
    "product": ("*", ("a", "b")),
    "volumes": ("+", ("i", "j")),
}


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> ModuleSource:
    path = tmp_path_factory.mktemp("spec") / "values.py"
    path.write_text(SPEC)
    return compile_spec(load_spec(path), effort=0)


@pytest.fixture(scope="module")
def implementations(source: ModuleSource, tmp_path_factory: pytest.TempPathFactory) -> dict[str, ModuleType]:
    with without_optimisation():
        return load_implementations(source, tmp_path_factory.mktemp("values"))


@pytest.fixture(params=["extension", "c", "arrays"])
def module(request: pytest.FixtureRequest, implementations: dict[str, ModuleType]) -> ModuleType:
    if request.param not in implementations:
        pytest.skip("not built")
    return implementations[request.param]


def random_values(module: ModuleType, seed: int = 0) -> dict[str, Any]:
    random = np.random.default_rng(seed)
    names = ("Motor", "Even", "Point", "Line", "Plane", "UnitPlane", "Direction", "Full", "Translator", "Volume")
    types = [getattr(module, name) for name in names]
    return {each.__name__: each(random.normal(size=len(each.layout.blades))) for each in types}


def test_operators_are_read_from_definitions(source: ModuleSource) -> None:
    found = {kernel.program.name: kernel.operator for kernel in source.kernels if kernel.operator}
    assert found == OPERATORS


def test_an_operator_is_its_kernel(module: ModuleType) -> None:
    for seed in range(5):
        v = random_values(module, seed)
        motor, other, point, line = v["Motor"], random_values(module, seed + 9)["Motor"], v["Point"], v["Line"]
        for _ in range(3):  # the first call looks up the kernel, later ones run it
            cases = [
                (motor * other, module.Motor, module.composed(motor, other)),
                (motor(point), module.Point, module.moved(point, motor)),
                (motor(line), module.Line, module.moved_line(motor, line)),
                (point & point, module.Line, module.joined(point, point)),
                (line ^ v["Plane"], module.Trivector, module.met(line, v["Plane"])),
                (~motor, module.Motor, module.undone(motor)),
                (line + line, module.Line, module.total(line, line)),
                (point - random_values(module, 3)["Point"], module.Direction, None),
                (-v["Direction"], module.Direction, module.opposite(v["Direction"])),
                (v["Full"] * v["Full"], module.Full, module.product(v["Full"], v["Full"])),
                (v["Volume"] + v["Volume"], module.Volume, [2 * v["Volume"].e0123]),
            ]
            for found, kind, wanted in cases:
                assert type(found) is kind
                if wanted is not None:
                    np.testing.assert_array_equal(found.values, getattr(wanted, "values", wanted))
            difference = point - random_values(module, 3)["Point"]
            np.testing.assert_array_equal(difference.values, point.values - random_values(module, 3)["Point"].values)
            number = v["UnitPlane"] & point
            assert type(number) is float and number == module.distance(point, v["UnitPlane"])


def test_operators_of_known_types_call_no_python(implementations: dict[str, ModuleType]) -> None:
    """After the first call, the extension calls the compiled function."""
    if "extension" not in implementations:
        pytest.skip("not built")
    called: list[str] = []
    v = random_values(implementations["extension"])
    for _ in range(2):
        called.clear()
        sys.setprofile(lambda frame, event, argument: called.append(frame.f_code.co_name) if event == "call" else None)
        try:
            v["Motor"] * v["Motor"], ~v["Motor"]
            v["Motor"](v["Point"]), v["Point"] & v["Point"], v["UnitPlane"] & v["Point"]
        finally:
            sys.setprofile(None)
    assert not called


def test_more_specific_types_are_accepted(module: ModuleType) -> None:
    """A motor is an even element and a unit plane is a plane, but the converse is false."""
    v = random_values(module)
    product = v["Motor"] * v["Even"]
    assert type(product) is module.Even and product == module.Even(v["Motor"].values) * v["Even"]
    assert type(v["Even"] * v["Motor"]) is module.Even
    assert (v["Line"] ^ v["UnitPlane"]) == (v["Line"] ^ module.Plane(v["UnitPlane"]))
    with pytest.raises(TypeError):
        v["Plane"] & v["Point"]
    with pytest.raises(TypeError):
        v["Even"](v["Point"])


def test_errors_list_alternatives(module: ModuleType) -> None:
    v = random_values(module)
    motor, point = v["Motor"], v["Point"]
    for wrong in (
        lambda: motor * point,
        lambda: motor * np.ones(8),
        lambda: np.ones(8) * motor,
        lambda: motor * 2j,
        lambda: motor * [1.0],
    ):
        with pytest.raises(TypeError, match=r"\* .*: not defined by .*: Motor \* Motor \(composed\)") as caught:
            wrong()
        assert "Motor" in str(caught.value).partition(":")[0]
    with pytest.raises(TypeError, match=r"Point\(Motor\): .*Motor\(Point\) \(moved\)"):
        point(motor)
    with pytest.raises(TypeError, match=r"Motor\(\): "):
        motor()
    with pytest.raises(TypeError, match=r"Motor\(Point, Point\): "):
        motor(point, point)
    with pytest.raises(TypeError, match=r"Motor\(ndarray\): "):
        motor(np.ones(3))
    with pytest.raises(TypeError, match=r"^~Point: "):
        _ = ~point
    with pytest.raises(TypeError, match="keyword"):
        motor(point, out=point)


def test_other_types_may_define_the_operator(module: ModuleType) -> None:
    class Other:
        def __rmul__(self, value: Any) -> str:
            return "right"

        def __mul__(self, value: Any) -> Any:
            return NotImplemented

    motor = random_values(module)["Motor"]
    assert motor * Other() == "right"
    with pytest.raises(TypeError, match="unsupported operand"):
        Other() * motor


def test_values_of_other_modules_are_operands(implementations: dict[str, ModuleType]) -> None:
    for one in implementations.values():
        for other in implementations.values():
            a, b = random_values(one)["Motor"], random_values(other)["Motor"]
            assert a == b and hash(a) == hash(b)
            even = other.Even(*a.values)
            assert a == even and even == a and hash(even) == hash(a) and a != other.Even(*(2 * a.values))
            identity = other.Translator(*(0 * other.Translator.array(np.eye(3)).values[0]))
            assert identity == 1 == one.Motor(1, *7 * [0]) and hash(identity) == hash(1)
            np.testing.assert_array_equal((a * b).values, (a * a).values)
            assert one.composed(a, b) == one.composed(a, a)


@all_cases(
    "arguments",
    [
        (1, 2, 3),
        (1.0, 2, np.float64(3)),
        ([1, 2, 3],),
        ((1, 2, 3),),
        (np.array([1.0, 2.0, 3.0]),),
        (np.array([1, 2, 3]),),
        (np.array([1, 2, 3], np.float32),),
        (np.array([1, 2, 3], ">f8"),),
        (np.array([1.0, 0, 2, 0, 3])[::2],),
        (np.array([3.0, 2.0, 1.0])[::-1],),
        (np.float32(1), np.int64(2), np.array(3.0)),
        (memoryview(np.array([1.0, 2.0, 3.0])),),
    ],
)
def test_constructed_from_anything_with_its_numbers(module: ModuleType, arguments: Any) -> None:
    point = module.Point(*arguments)
    assert point.values.tolist() == [1, 2, 3] and type(point.e032) is type(point["e032"]) is float
    assert point == module.Point(point) and (point.e032, point.e013, point.e021, point.e123) == (1, 2, 3, 1)


@all_cases(
    "arguments, error, words",
    [
        ((), TypeError, ["Point", "0 arguments", "3 numbers", "e032 e013 e021"]),
        ((1, 2), TypeError, ["2 arguments"]),
        ((1, 2, 3, 4), TypeError, ["4 arguments"]),
        ((1,), ValueError, ["()", "(3,)"]),
        (([1, 2],), ValueError, ["(2,)", "(3,)", "e032"]),
        ((np.ones((2, 3)),), ValueError, ["(2, 3)"]),
        (([1, 2, 3], 2, 3), ValueError, ["array of numbers"]),
        (([[1], [1, 2]],), ValueError, ["array of numbers"]),
        (([1, 2, 3j],), TypeError, ["complex128", "real"]),
        ((1, 2, 3j), TypeError, ["complex128"]),
        ((True, True, True), TypeError, ["bool"]),
        (("abc",), TypeError, ["Point"]),
        ((None,), TypeError, ["object"]),
        (("1", "2", "3"), TypeError, ["real"]),
        ((10**400, 1, 1), TypeError, ["object"]),
    ],
)
def test_constructed_from_wrong_arguments(module: ModuleType, arguments: Any, error: Any, words: list[str]) -> None:
    with pytest.raises(error) as caught:
        module.Point(*arguments)
    assert all(word in str(caught.value) for word in words), caught.value
    assert "\n" not in str(caught.value)


def test_one_coefficient(module: ModuleType) -> None:
    for made in (module.Volume(2), module.Volume([2]), module.Volume(np.array([2.0])), module.Volume(np.float32(2))):
        assert made.e0123 == 2 and made.values.shape == (1,)
    with pytest.raises(ValueError, match=r"\(2,\)"):
        module.Volume([1, 2])


def test_nothing_can_be_changed(module: ModuleType) -> None:
    point = module.Point(1, 2, 3)
    for name in ("e032", "e123", "layout", "anything", "_array"):
        with pytest.raises(AttributeError):
            setattr(point, name, 5.0)
    with pytest.raises(AttributeError):
        del point.e032
    with pytest.raises(TypeError):
        point[0] = 1.0
    with pytest.raises(ValueError, match="read-only"):
        point.values[0] = 1
    with pytest.raises(ValueError):
        point.values.flags.writeable = True
    with pytest.raises(TypeError, match="cannot be subclassed"):
        type("Mine", (module.Point,), {})
    if extension_of(module) is not None:
        with pytest.raises(TypeError, match="not safe"):
            object.__new__(module.Point)
    with pytest.raises(TypeError, match="layout"):
        module.Value(1.0)
    assert point.values.tolist() == [1, 2, 3]


def test_coefficients_are_an_array_without_a_copy(module: ModuleType) -> None:
    gc.freeze()  # what other tests have made, of which a collection takes a second
    point = module.Point(1, 2, 3)
    array = point.values
    assert array.dtype == float and array.shape == (3,) and np.shares_memory(array, point.values)
    assert np.shares_memory(array, np.asarray(point, float)) and np.array(point, float).flags.writeable
    assert np.asarray(point, np.float32).dtype == np.float32 and np.asarray(point, np.float32).tolist() == [1, 2, 3]
    del point
    gc.collect()
    assert array.tolist() == [1, 2, 3]
    motor = random_values(module)["Motor"]
    points = np.random.default_rng(0).normal(size=(5, 3))
    np.testing.assert_array_equal(module.moved(points, motor), module.moved(points, motor.values))


def test_entries_of_arrays_are_elements(module: ModuleType) -> None:
    """Functions of numpy on lists mean coefficients until version 0.4, but not without a visible warning."""
    point, other = module.Line(1, 2, 3, 4, 5, 6), module.Line(0, 0, 1, 0, 2, 0)
    single, several = np.asarray(point, object), np.array([point, other], object)
    assert single.shape == () and single.item() is point
    assert several.shape == (2,) and several[1] is other and np.sum(several) == point + other
    for function in (np.asarray, lambda x: np.array([x])[0], lambda x: np.random.default_rng(0).permutation([x])[0]):
        with pytest.warns(FutureWarning, match=r"numpy.asarray\(x\) of an element"):
            np.testing.assert_array_equal(function(point), point.values)
    with pytest.raises((BufferError, TypeError)):
        memoryview(point)
    assert (point.shape, point.ndim, point.size) == ((), 0, 1)


def test_one_element_is_no_sequence(module: ModuleType) -> None:
    """Coefficients by number are deprecated, as they are not those of objects."""
    point = module.Point(1, 2, 3)
    assert [point[name] for name in ("e032", "e013", "e021", "e123")] == [1, 2, 3, 1]
    with pytest.raises(KeyError, match="no coefficient 'e1'; expected one of e032"):
        point["e1"]
    with pytest.raises(TypeError, match="truth value"):
        bool(point)
    cases: list[tuple[Any, Any]] = [(lambda: len(point), 3), (lambda: point[-1], 3), (lambda: point[np.int64(1)], 2),
                                    (lambda: list(point), [1, 2, 3]), (lambda: 2.0 in point, True)]  # fmt: skip
    for call, wanted in cases:
        with pytest.warns(DeprecationWarning, match="mean elements, not coefficients, from version 0.4") as caught:
            assert call() == wanted
        assert caught[0].filename == __file__
    for index in (3, -4):
        with pytest.raises(IndexError), pytest.warns(DeprecationWarning):
            point[index]
    with pytest.raises(TypeError):
        point[0:2]


def test_arrays_of_elements_are_their_elements(module: ModuleType) -> None:
    """Operators, kernels, sums and indices of an array give for each element what they give for it alone."""
    v, random = random_values(module), np.random.default_rng(3)
    points, lines = module.Point.array(random.normal(size=(2, 3, 3))), module.Line.array(random.normal(size=(3, 6)))
    motor, point = v["Motor"], v["Point"]
    cases: list[Any] = [
        lambda p, q: motor(p), lambda p, q: p & point, lambda p, q: point & p, lambda p, q: module.moved(p, motor),
        lambda p, q: p - point, lambda p, q: point + p, lambda p, q: 2 * p, lambda p, q: p / 4 - p, lambda p, q: -p,
        lambda p, q: -(p - point), lambda p, q: q ^ v["Plane"], lambda p, q: q + q, lambda p, q: v["UnitPlane"] & p,
        lambda p, q: ~motor * motor,
    ]  # fmt: skip
    for case in cases:
        found = case(points, lines)
        for i, k in np.ndindex(2, 3):
            one, of = case(points[i, k], lines[k]), found
            for index in (i, k)[2 - np.ndim(found) :]:
                of = of[index]
            assert type(of) is type(one) or isinstance(of, float)
            np.testing.assert_array_equal(getattr(of, "values", of), getattr(one, "values", one))
    assert (points.shape, len(points), points.ndim, points.size) == ((2, 3), 2, 2, 6)
    assert points[1].shape == (3,) and [type(p) for p in points[1]] == 3 * [module.Point]
    np.testing.assert_array_equal(points.e013, points.values[..., 1])
    np.testing.assert_array_equal(points["e123"], np.ones((2, 3)))
    assert (points == points[0, 1]).tolist() == (points[0, 1] == points).tolist() == [[False, True, False], 3 * [False]]
    assert (points.reshape(6)[4] == points[1, 1]) and (points.reshape((3, 2)).reshape(2, 3) == points).all()
    again = pickle.loads(pickle.dumps(points))
    assert type(again) is type(points) and (again == points).all()


def test_type_and_precision_of_sums_do_not_depend_on_numbers(module: ModuleType) -> None:
    for value in random_values(module).values():
        assert type(0.0 * value) is type(2.0 * value) and (0.0 * value).values.any() == 0
    shifts = module.Translator.array(np.ones((2, len(module.Translator.layout.blades)), np.float32))
    motors = module.Motor.array(np.arange(16, dtype=np.float32).reshape(2, 8))
    for found in (shifts + motors, motors - shifts, shifts + 2, 3 * shifts):
        assert found.values.dtype == np.float32 and found.shape == (2,)
    single = module.Motor(*range(8))
    assert (shifts + single).values.dtype == np.float64
    np.testing.assert_array_equal((shifts + motors)[0].values, (shifts + single)[0].values)


def test_arrays_of_elements_are_no_arrays_of_numbers(module: ModuleType) -> None:
    points, motor = module.Point.array(np.eye(3)), random_values(module)["Motor"]
    for wrong in (lambda: motor * points, lambda: ~points, lambda: points * np.ones(3), lambda: np.ones(3) + points):
        with pytest.raises(TypeError, match="not defined by"):
            wrong()
    with pytest.raises(ValueError, match=r"shape \(3, 2\); expected \(..., 3\): e032 e013 e021"):
        module.Point.array(np.ones((3, 2)))
    with pytest.raises(TypeError, match="not hashable"):
        hash(points)
    with pytest.raises(AttributeError, match="immutable"):
        points.values = np.ones(3)
    with pytest.raises(AttributeError, match="no coefficient 'e1'"):
        _ = points.e1
    single = module.moved(module.Point.array(np.ones((2, 3), np.float32)), motor)
    assert single.values.dtype == np.float64 and np.asarray(points, np.float32).dtype == np.float32
    assert np.asarray(points).tolist() == list(points) and "Point of shape (3,)" in repr(points)


def test_equal_by_value(module: ModuleType) -> None:
    point, other = module.Point(0.0, 1, 2), module.Point(-0.0, 1, 2)
    assert point == other and hash(point) == hash(other) and (point != other) is False
    assert point != module.Point(0, 1, 3) and point != module.Direction(0, 1, 2) and point != (0, 1, 2)
    assert len({point, other, module.Point(5, 5, 5)}) == 2
    nan = module.Point(np.nan, 1, 2)
    assert nan != nan and (nan == nan) is False and hash(nan) == hash(nan)
    assert (point == 3) is False and (point == None) is False  # noqa: E711
    with pytest.raises(TypeError):
        assert point < other


def test_pickled_and_copied(module: ModuleType) -> None:
    for value in random_values(module).values():
        for again in (pickle.loads(pickle.dumps(value)), copy.copy(value), copy.deepcopy(value)):
            assert again == value and type(again) is type(value)


@all_cases(
    "make, text",
    [
        (lambda m: m.Motor(1, 0.5, 0, 0, -0.25, 0, 0, -1), "Motor(1 + 0.5*e12 - 0.25*e01 - e0123)"),
        (lambda m: m.Motor([0] * 8), "Motor(0)"),
        (lambda m: m.Point(1, -2, 3e-20), "Point(e032 - 2*e013 + 3e-20*e021 + e123)"),
        (lambda m: m.Translator(0, -1, np.nan), "Translator(-e02 + nan*e03 + 1)"),
        (lambda m: m.Motor(-1, 0, 0, 0, 0, 0, 0, -np.inf), "Motor(-1 - inf*e0123)"),
    ],
)
def test_printed_as_a_sum(module: ModuleType, make: Any, text: str) -> None:
    assert repr(make(module)) == str(make(module)) == text


def test_attributes_and_help_of_a_type(module: ModuleType) -> None:
    assert module.Motor.layout.name == "PGA3.MOTOR" and "unit" in module.Motor.__doc__
    assert module.Motor.__module__ == module.__name__ and "Motor" in module.__all__ and "Value" in module.__all__
    assert module.Motor(1, *[0] * 7).scalar == 1 and module.Translator(1, 2, 3).scalar == 1
    assert "e123 = 1" in module.Point.__doc__ and issubclass(module.Point, module.Value)


def test_names_of_types() -> None:
    layouts = [
        Layout("A.UNIT_LINE", ("e1",), unit=True),
        Layout("A.full", ("e1",)),
        Layout("B.UNIT_LINE", ("e1",)),
        Layout("A.(e1 e2)", ("e1", "e2")),
        Layout("SCALAR", ()),
        Layout("A.KERNEL", ("e1",)),
        Layout("A.MyOwn_layout", ("e1",)),
    ]
    kernel = KernelSource(None, "", tuple((str(k), each) for k, each in enumerate(layouts)), None)  # type: ignore[arg-type]
    found = value_types(ModuleSource("m", "", "", "", (kernel,)), {"Kernel"})
    assert [name for name, _ in found.values()] == ["UnitLine", "Full", "UnitLine_", "Kernel_", "MyOwnLayout"]


def test_relations_between_types() -> None:
    """A unit quaternion is a quaternion; the converse needs a kernel."""
    from gacompiler import kernel
    from gacompiler.algebra.catalog import QUATERNIONS

    @kernel(a=QUATERNIONS.UNIT_QUATERNION, b=QUATERNIONS.QUATERNION)
    def mixed(a: Any, b: Any) -> Any:
        return a * b

    record = compile_kernel(mixed)
    source = kernel_source(record)
    layouts = dict(source.layouts)
    assert source.operator == ("*", ("a", "b"))
    assert layouts["a"].has_meaning and layouts["a"].unit and not layouts["b"].has_meaning


@pytest.mark.slow
@alone
def test_values_do_not_leak(implementations: dict[str, ModuleType]) -> None:
    """Test the extension, which counts references itself."""
    if "extension" not in implementations:
        pytest.skip("not built")
    module = implementations["extension"]
    v = random_values(module)
    motor, point, line = v["Motor"], v["Point"], v["Line"]
    held = [motor, point, line, module.Motor, module.Point, module.Line, None]
    turns = 500  # a leak of 24 bytes, the size of a float, in each exceeds the limit

    def calls() -> None:
        hash((motor * motor)(point & point))
        module.Point(1.0, 2.0, 3.0).values.sum()
        outcome(lambda: motor * 2)
        assert point == point and ~motor != motor and not any((point - point).values) and point.values[1] == point.e013

    calls()
    gc.collect()
    counts = [sys.getrefcount(each) for each in held]
    tracemalloc.start()
    for _ in range(turns):  # until the free lists of the interpreter are full
        calls()
    gc.collect()
    grown = []
    for _ in range(3):  # a leak grows every time; other threads keep objects occasionally
        before = tracemalloc.get_traced_memory()[0]
        for _ in range(turns):
            calls()
        gc.collect()
        grown.append(tracemalloc.get_traced_memory()[0] - before)
    tracemalloc.stop()
    assert min(grown) < 10_000, grown
    for each, count in zip(held, counts, strict=True):
        assert abs(sys.getrefcount(each) - count) < 20, each


def test_random_operations_never_crash(implementations: dict[str, ModuleType]) -> None:
    if "extension" not in implementations:
        pytest.skip("not built")
    fast, plain = implementations["extension"], implementations["c"]
    random = np.random.default_rng(5)
    foreign: list[Any] = [2, 0.5, None, "x", np.ones(8), np.ones(3), [1.0, 2.0, 3.0], object(), 1j]
    pools = [[*random_values(fast).values(), *foreign], [*random_values(plain).values(), *foreign]]
    operations = [
        lambda a, b: a * b,
        lambda a, b: a ^ b,
        lambda a, b: a & b,
        lambda a, b: a + b,
        lambda a, b: a - b,
        lambda a, b: ~a,
        lambda a, b: -a,
        lambda a, b: a(b),
        lambda a, b: a == b,
        lambda a, b: type(a)(b) if hasattr(a, "layout") else None,
        lambda a, b: type(a)(*b.values) if hasattr(a, "layout") else None,
    ]
    for turn, (which, i, j) in enumerate(random.integers(0, 2**31, size=(20_000, 3))):
        operation, i, j = operations[which % len(operations)], i % len(pools[0]), j % len(pools[0])
        found = outcome(operation, pools[0][i], pools[0][j])
        if turn % 10 == 0:
            wanted = outcome(operation, pools[1][i], pools[1][j])
            assert found[0].__name__ == wanted[0].__name__, (found, wanted)
            assert [re.sub(r"_folder_\w+|_extension|_c\b| at 0x\w+", "", str(x)) for x in found[1:]] == [
                re.sub(r"_folder_\w+|_extension|_c\b| at 0x\w+", "", str(x)) for x in wanted[1:]
            ]


def test_values_outlive_their_module(implementations: dict[str, ModuleType]) -> None:
    gc.freeze()
    for turn, (name, module) in enumerate([*implementations.items(), *list(implementations.items())[:1]]):
        again = load(Path(str(module.__file__)), f"again_{name}_{turn}")
        motor = random_values(again)["Motor"]
        del sys.modules[again.__name__], again
        gc.collect()
        assert (~(motor * motor)).values.shape == (8,)


def test_operators_in_threads(module: ModuleType) -> None:
    v = random_values(module, 1)
    right = v["Motor"] * v["Motor"]
    wrong: list[Any] = []

    def run() -> None:
        for _ in range(300):
            if v["Motor"] * v["Motor"] != right:
                wrong.append(1)

    threads = [threading.Thread(target=run) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong
