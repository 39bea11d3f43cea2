"""Invalid input: a table of calls and their errors, for objects, kernels and algorithms. Empty arrays are valid."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from algorithms.calculus import dirac_spinors, free_dirac, grid_derivative
from algorithms.estimation import filter_lines, stereo_information
from algorithms.geometry import conic_type
from algorithms.gestures import mean_of_sequence
from algorithms.learning import CliffordSVC
from algorithms.mapping import optimise_poses
from algorithms.motors import (
    average_motors,
    bezier,
    motor_from_points,
    rotor_from_frames,
    rotor_from_vectors,
    sclerp,
    similarity_from_points,
)
from algorithms.registration import published_curvature, register
from algorithms.shapes import (
    gradient_vector_flow,
    marching_cubes,
    marching_spheres,
    neural_gas_of_image,
    segment,
    streamline_samples,
    trace_contour,
)
from algorithms.subspaces import Blade, FactoredBlade, factorize_blade, join, outer_product, split_bivectors
from algorithms.vision import homographies
from gacompiler.errors import AlgebraError, LayoutError
from gacompiler.objects import CGA2, CGA3, PGA2, PGA3, VGA3, load
from generated import cga3, pga3
from tests.support.all_cases import all_cases

LINES, STILL = np.eye(6)[[2, 0]], np.array([[1.0, 0, 0, 0], [1, 0, 0, 0]])
M, P, C = PGA3.motor([0, 0, 1], 1.0), PGA3.point(1, 2, 3), CGA3.point(1, 2, 3)
TWO_POINTS = PGA3.point(np.ones((2, 3)))
SKEW = PGA3.e12 + 2 * PGA3.e03
E3, E4 = Blade(np.ones(3), 3, 1), Blade(np.ones(4), 4, 1)
NO_BLADE = Blade([1.0, 0, 0, 0, 0, 1.0], 4, 2)

MIXED = r"multivectors of {} and {}; expected one algebra"
TWO = [
    ("*", lambda: P * C), ("|", lambda: P | C), ("^", lambda: P ^ C), ("&", lambda: P & C), ("+", lambda: P + C),
    ("/", lambda: P / C), (">>", lambda: M >> C), ("()", lambda: M(C)), ("isclose", lambda: P.isclose(C)),
    ("as_layout", lambda: P.as_layout(CGA3.POINT)), ("commutator", lambda: P.commutator(C)),
]  # fmt: skip
CASES: list[tuple[str, Callable[[], Any], type[Exception], str]] = [
    *((f"mixed algebras {name}", call, AlgebraError, MIXED.format("PGA3", "CGA3")) for name, call in TWO),
    ("mixed, in the plane", lambda: PGA2.point(1, 2) & P, AlgebraError, MIXED.format("PGA2", "PGA3")),
    ("mixed, a constructor", lambda: CGA3.centre(P), AlgebraError, MIXED.format("CGA3", "PGA3")),
    ("log of what is not unit", lambda: (2 * M).log(), LayoutError, r"log: x ~x - 1 = .*; call normalize\(\)"),
    ("root of what is not unit", lambda: (2 * M).sqrt(), LayoutError, r"sqrt: x ~x - 1 = .*; call normalize\(\)"),
    ("power of what is not unit", lambda: (2 * M) ** 0.5, LayoutError, r"power: x ~x - 1 = .*; call normalize\(\)"),
    ("projection on a motor", lambda: P.project(M), AlgebraError, "of grades .0, 2, 4.; expected a blade"),
    ("projection on no blade", lambda: P.project(SKEW), AlgebraError, "is not a blade: x . x = .*; expected an outer"),
    ("projection on a null blade", lambda: P.project(PGA3.e0), AlgebraError, "norm is 0; expected a blade with an in"),
    ("projection on a number", lambda: P.project(2.0), AlgebraError, "a float; expected a blade"),
    ("centre of a flat", lambda: CGA3.centre(CGA3.line(C, [1, 0, 0])), AlgebraError, "flat .*; expected a round"),
    ("coordinates too few", lambda: PGA3.point(np.zeros((3, 2))), LayoutError, r"\(3, 2\); expected \(\.\.\., 3\)"),
    ("coordinates of text", lambda: PGA3.point("a", 1, 2), LayoutError, "str of dtype .*; expected numbers"),
    ("shapes", lambda: PGA3.point(np.ones((3, 3))) & PGA3.point(np.ones((2, 3))), ValueError, "do not broadcast"),
    ("angle and shift", lambda: PGA2.motor(PGA2.point(1, 2), 0.5), LayoutError, r"motor: translation: .*\(\)"),
    ("no grade", lambda: M.grade(9), AlgebraError, r"grades \(9,\); expected integers from 0 to 4"),
    ("no blade of that name", lambda: P.e45, AttributeError, "PGA3 no blade 'e45'"),
    ("a versor on text", lambda: M("x"), TypeError, "applied to multivectors only; found str"),
    ("a number on a multivector", lambda: 2 >> P, TypeError, "the left operand of >> must be a versor; found int"),
    ("a number on multivectors", lambda: 2 >> TWO_POINTS, TypeError, "must be a versor; found int"),
    ("a list on multivectors", lambda: [1, 2] >> TWO_POINTS, TypeError, "must be a versor; found list"),
    ("a layout that does not hold it", lambda: M.as_layout(PGA3.POINT), LayoutError, "only"),
    ("kernel, too few", lambda: pga3.move_point(np.ones(7), np.ones(3)), ValueError, "m"),
    ("kernel, text", lambda: pga3.move_point(["a"] * 8, np.ones(3)), TypeError, "m"),
    ("kernel, complex", lambda: cga3.sphere_centre(np.ones(5) * 1j), TypeError, "complex"),
    ("kernel, shapes", lambda: pga3.join_points(np.ones((2, 3)), np.ones((3, 3))), ValueError, "broadcast|shape"),
    ("motors, none", lambda: average_motors(np.zeros((0, 8))), ValueError, "none"),
    ("motors, too few", lambda: sclerp(np.ones(7), np.ones(8), 0.5), ValueError, "a: shape .7,.; expected .*8"),
    ("motors, no controls", lambda: bezier(np.zeros((0, 8)), 0.5), ValueError, "control|motors|none|at least"),
    ("points, none", lambda: motor_from_points(np.zeros((0, 3)), np.zeros((0, 3))), ValueError, "at least one"),
    ("points, unequal", lambda: rotor_from_vectors(np.ones((4, 3)), np.ones((3, 3))), ValueError, "4 and 3 vectors"),
    ("frames, flat", lambda: rotor_from_frames(np.ones((2, 3)), np.ones((3, 3))), ValueError, "three vectors as rows"),
    ("leading axes of frames", lambda: rotor_from_frames(np.ones((2, 3, 3)), np.ones((3, 3, 3))), ValueError,
     r"frame, image: leading axes \(2,\), \(3,\); expected equal ones"),
    ("leading axes of points", lambda: similarity_from_points(np.ones((2, 4, 3)), np.ones((3, 4, 3))), ValueError,
     r"a, b, weights: leading axes \(2,\), \(3,\), \(\)"),
    ("leading axes of pixels", lambda: homographies(np.ones((2, 4, 2)), np.ones((3, 4, 2))), ValueError,
     "first, second: leading axes"),
    ("a part of a step", lambda: gradient_vector_flow(np.eye(9), sweeps=2.5), TypeError,
     "sweeps: 2.5; expected a whole number"),
    ("a grid without points", lambda: free_dirac(np.ones((0, 2, 2, 8)), [1, 1, 1], 1.0, 0.0), ValueError, "psi: shape"),
    ("a grid without values", lambda: grid_derivative(np.ones((0, 2)), [1.0], "spectral"), ValueError, "values: shape"),
    ("a scale of 0", lambda: published_curvature(0), ValueError, "sigma: 0.0; expected a positive number"),
    ("no distance of cameras", lambda: stereo_information([0, 0, 1], 500, None), TypeError, "baseline: None"),
    ("times that are missing", lambda: filter_lines(np.eye(8)[0], np.eye(6), LINES, LINES, 1.0, dt=np.nan), ValueError,
     "dt: nan"),
    ("an information of -1", lambda: optimise_poses(STILL, [[0, 1]], STILL[:1], [-np.eye(3)]), ValueError,
     "information: not symmetric positive semidefinite"),
    ("a window of half a frame", lambda: mean_of_sequence(np.ones((9, 2)), 0.5), TypeError, "window: 0.5"),
    ("several planes", lambda: conic_type(0.3, np.eye(4)), ValueError, "plane: shape .4, 4.; expected .4,., one plane"),
    ("factors of no blade", lambda: factorize_blade(NO_BLADE), ValueError, "blade"),
    ("join of no blade", lambda: join(NO_BLADE, NO_BLADE), ValueError, "blade"),
    ("dimensions that differ", lambda: outer_product(E3, E4), ValueError, "dim|vectors"),
    ("coefficients too few", lambda: Blade(np.ones(5), 4, 2), ValueError, "6"),
    ("vectors, not finite", lambda: FactoredBlade.of_vectors([[1.0, np.nan]]), ValueError, "finite|nan"),
    ("bivector, too few", lambda: split_bivectors(np.ones(5), 4), ValueError, "6"),
]  # fmt: skip


@pytest.mark.parametrize("case", CASES, ids=lambda case: case[0])
def test_bad_input_is_named(case: tuple[str, Callable[[], Any], type[Exception], str]) -> None:
    _, call, error, text = case
    with pytest.raises(error, match=text):
        call()


def test_normalised_motors_have_logarithms() -> None:
    """Follow the advice in the message of `log`."""
    assert (2 * M).normalize().log().isclose(M.log())
    assert (2 * M).normalize().layout == PGA3.MOTOR


NOT_NUMBERS: dict[str, Callable[[], Any]] = {
    "motor about no axis": lambda: PGA3.motor([[0, 0, 0], [0, 0, 1]], 1.0).values,
    "zero motors, normalised": lambda: (0 * PGA3.motor([0, 0, 1], [1.0])).normalize().values,
    "plane of no normal": lambda: CGA3.plane([[0, 0, 0], [0, 0, 1]], 1).values,
    "log of nan": lambda: PGA3.motor([0, 0, 1], np.nan).log().values,
    "centre of a plane": lambda: 0 * cga3.sphere_centre(cga3.sphere_from_plane([1.0, 0, 0, 1])),
    "radius of an imaginary circle": lambda: cga3.distance_point_circle(
        np.ones(3), cga3.circle_from_centre([0.0, 0, 0], [0.0, 0, 1], -1.0)
    ),
}


@all_cases("name", NOT_NUMBERS)
def test_what_does_not_exist_is_not_a_number(name: str) -> None:
    with np.errstate(all="ignore"):
        assert np.isnan(NOT_NUMBERS[name]()).any()


def test_empty_arrays_are_arrays() -> None:
    points, motors = PGA3.point(np.zeros((0, 3))), PGA3.motor([0, 0, 1], np.zeros(0))
    for found, layout in (
        (M >> points, PGA3.POINT), (points & points, PGA3.LINE), (motors * motors, PGA3.MOTOR),
        (motors.log(), PGA3.LINE), (motors.normalize(), PGA3.MOTOR), (motors / 2, None),
        (points.as_layout(PGA3.full), None),
    ):  # fmt: skip
        assert found.shape == (0,) and (layout is None or found.layout == layout)
    assert points.isclose(points).shape == (0,) and str(points) == "[]"
    assert cga3.circle_centre(np.zeros((0, 10))).shape == (0, 3)
    assert pga3.motor_to_matrix(np.zeros((0, 2, 8))).shape == (0, 2, 4, 4)
    assert sclerp(np.zeros((0, 8)), M.values, 0.5).shape == (0, 8)
    assert VGA3.vector(np.zeros((2, 0, 3))).norm().shape == (2, 0)


VOLUME = (np.indices((9, 9, 9)).sum(0) < 12).astype(float)
HIDDEN = np.ma.array(VOLUME, mask=VOLUME < 0)
HIDDEN.mask[4, 4, 4] = True
ROWS = np.arange(24.0).reshape(8, 3)
MASKED: dict[str, Callable[[], Any]] = {
    "segment": lambda: segment(HIDDEN, (4, 4, 4)),
    "segment, where it is valid": lambda: segment(HIDDEN, (4, 4, 4), valid=~HIDDEN.mask),
    "marching_cubes": lambda: marching_cubes(HIDDEN), "marching_spheres": lambda: marching_spheres(HIDDEN, 2),
    "trace_contour": lambda: trace_contour(HIDDEN[4]), "gradient_vector_flow": lambda: gradient_vector_flow(HIDDEN[4]),
    "neural_gas_of_image": lambda: neural_gas_of_image(HIDDEN[4]),
    "streamline_samples": lambda: streamline_samples(np.ma.stack([HIDDEN[4]] * 2), np.ones((1, 2))),
    "register": lambda: register(np.ma.masked_equal(ROWS, 3.0), ROWS),
    "register, a list": lambda: register(list(np.ma.masked_equal(ROWS, 3.0)), ROWS),
    "CliffordSVC": lambda: CliffordSVC().fit(np.ma.masked_equal(ROWS, 3.0), np.arange(8) % 2),
    "dirac_spinors": lambda: dirac_spinors(np.ma.masked_equal(np.arange(4.0), 3.0)),
}  # fmt: skip


@pytest.mark.parametrize("name", MASKED)
def test_masked_numbers_are_not_used(name: str) -> None:
    with pytest.raises(ValueError, match=r"[12] masked numbers; expected an array without a mask"):
        MASKED[name]()


SOME = np.ma.array([1.0, 2, 3], mask=[False, True, False])
MASKED_FOR_OBJECTS: list[Callable[[], Any]] = [
    lambda: VGA3.e1 * SOME, lambda: VGA3.vector(np.ones((3, 3))) + SOME, lambda: VGA3.e1 / SOME,
    lambda: VGA3.multivector({"e1": SOME}), lambda: VGA3.rotor([0, 0, 1], SOME), lambda: PGA3.point([SOME, SOME]),
    lambda: CGA3.sphere(np.zeros((3, 3)), SOME), lambda: M.power(SOME), lambda: pga3.move_point(M.values, [SOME, SOME]),
    lambda: PGA3.from_matrix(np.ma.array(np.eye(4), mask=np.eye(4)[::-1])),
    lambda: pga3.move_point(M.values, [1.0, np.ma.masked, 2.0]),
]  # fmt: skip


@pytest.mark.parametrize("call", MASKED_FOR_OBJECTS)
def test_masked_numbers_are_no_coefficients(call: Callable[[], Any]) -> None:
    with pytest.raises(TypeError, match=r"[124] masked numbers; expected an array without a mask"):
        call()


def test_meets_of_concentric_rounds_are_at_infinity() -> None:
    """They have neither a centre nor a radius."""
    spheres, circles = ([space([0] * n, r) for r in (3, 2)] for space, n in ((CGA3.sphere, 3), (CGA2.circle, 2)))
    assert spheres[0].meet(spheres[1]).explain() == "circle at infinity"
    assert circles[0].meet(circles[1]).explain() == "point pair at infinity"


def test_files_that_save_did_not_write_are_named(tmp_path: Path) -> None:
    for name, content in (("a.npz", b"abc"), ("b.npz", b""), ("c.json", b"\xff"), ("d.json", b'{"a": {"type": "x"}}')):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(ValueError, match=rf"{name}: not a file of objects .*; expected a file written by save"):
            load(tmp_path / name)


def test_fractions_are_coordinates() -> None:
    assert VGA3.vector(1, 2, Fraction(1, 4)).values.tolist() == [1, 2, 0.25]


def test_arguments_of_another_type_are_named() -> None:
    with pytest.raises(LayoutError, match="as_layout: an argument of type str; expected a layout"):
        P.as_layout("PGA3.POINT")
    with pytest.raises(LayoutError, match="multivector: coefficients of type list; expected coefficients by blade"):
        PGA3.multivector([1, 2])


def test_frames_of_any_size() -> None:
    frame, turn = np.array([[1.0, 2, 0], [0, 1, 1], [3, 0, 1]]), np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    for size in (1e150, 1e-150):
        rotor = rotor_from_frames(size * frame, size * frame @ turn.T)
        np.testing.assert_allclose(np.abs(rotor), [np.sqrt(0.5), np.sqrt(0.5), 0, 0], 0, 1e-14)
