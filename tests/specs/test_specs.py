"""Compiled specs against results without geometric algebra: matrices, scipy rotations, vector formulas.

The programs are read from the generated modules, which ``gac check --prove`` compares with the specs.
"""

from __future__ import annotations

import ast
from collections.abc import Mapping
from functools import cache
from importlib import import_module
from itertools import combinations, permutations
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

import gacompiler.specs
from gacompiler import Kernel
from gacompiler.backends import python_programs
from gacompiler.backends.readers import Read
from gacompiler.generation.checked_in import generated_folder
from gacompiler.generation.spec_contents import kernels_of
from gacompiler.ir.interpret import interpret
from gacompiler.runtime import load_module
from tests.support.all_cases import all_cases

FOLDER = Path(gacompiler.specs.__file__).parent
MODULES = sorted(path.stem for path in FOLDER.glob("*.py") if path.stem != "__init__")
WITH_ALL_PRODUCTS = ("cga2", "cga3", "pga2", "pga3", "sta", "vga2", "vga3")
N = 40
AHEAD = np.array([0.0, 0, 10])
HALF_TURN = np.pi * np.vstack([np.eye(3), -np.eye(3), [[0.6, 0.8, 0], [0, -0.6, 0.8], [2 / 3, -1 / 3, 2 / 3]]])


@cache
def programs(module: str) -> Mapping[str, Read]:
    """The checked-in programs; ``gac check`` compares them with the output of the spec."""
    return python_programs((generated_folder() / f"{module}.py").read_text())


def blades_of(module: str, name: str) -> tuple[str, ...]:
    """Names of the coefficients of a kernel's first result."""
    loaded = load_module(generated_folder() / f"{module}.py", f"_{module}_in_specs", "arrays")
    return tuple(getattr(loaded, name).layouts["out"].blades)


class Spec:
    """The kernels of a spec as functions of float arrays with leading axes, run by the interpreter."""

    def __init__(self, module: str) -> None:
        self._module = module

    def __getattr__(self, name: str) -> Any:
        def run(*arrays: Any) -> Any:
            program = programs(self._module)[name].program
            inputs, batch = {}, ()
            for argument, given in zip(program.arguments, arrays, strict=True):
                array = np.asarray(given, dtype=float)
                outer = array.shape[: array.ndim - len(argument.shape)]
                assert array.shape[len(outer) :] == argument.shape, (name, argument.name, array.shape)
                flat = array.reshape(*outer, len(argument.components))
                inputs[argument.name] = [flat[..., k] + 0.0 for k in range(flat.shape[-1])]
                batch = np.broadcast_shapes(batch, outer)
            found = interpret(program, inputs, float)
            results = [
                np.stack([np.broadcast_to(value, batch) for value in found[r.name]], -1).reshape(batch + r.shape)
                for r in program.results
            ]
            return results[0] if len(results) == 1 else tuple(results)

        return run


pga3, pga2, cga3, vga3, vga2 = Spec("pga3"), Spec("pga2"), Spec("cga3"), Spec("vga3"), Spec("vga2")
sta, quaternion, projective3 = Spec("sta"), Spec("quaternion"), Spec("projective3")


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20)


def close(found: Any, expected: Any, tolerance: float = 1e-12) -> None:
    np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance)


def same_up_to_sign(found: Any, expected: Any, tolerance: float = 1e-12) -> None:
    sign = np.sign(np.sum(np.asarray(found) * expected, -1, keepdims=True))
    close(found * sign, expected, tolerance)


def rotation_vectors(rng: np.random.Generator) -> np.ndarray:
    """Random, zero and tiny rotations, exact and nearly half turns, each in many directions."""
    directions = rng.normal(size=(N, 3))
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    angles = np.concatenate([rng.uniform(0, np.pi, N - 9), [0, 1e-12, 1e-9, 1e-7, 1e-4, np.pi, np.pi - 1e-9, 3.1, 1]])
    return np.vstack([directions * angles[:, None], HALF_TURN])


def poses(rng: np.random.Generator) -> np.ndarray:
    vectors = rotation_vectors(rng)
    matrices = np.tile(np.eye(4), (len(vectors), 1, 1))
    matrices[:, :3, :3] = Rotation.from_rotvec(vectors).as_matrix()
    matrices[:, :3, 3] = rng.normal(size=(len(vectors), 3)) * 10
    return matrices


def apply(matrices: np.ndarray, points: np.ndarray) -> np.ndarray:
    return np.einsum("...ij,...j->...i", matrices[..., :-1, :-1], points) + matrices[..., :-1, -1]


def turn(matrices: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    return np.einsum("...ij,...j->...i", matrices[..., :3, :3], vectors)


def unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.sum(a * b, -1)


def scalar_first(rotation: Rotation) -> np.ndarray:
    return np.roll(rotation.as_quat(), 1, -1)


def hamilton(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """The product of quaternions, scalar first, written out."""
    a, b, c, d = np.moveaxis(np.asarray(p), -1, 0)
    e, f, g, h = np.moveaxis(np.asarray(q), -1, 0)
    return np.stack(
        [
            a * e - b * f - c * g - d * h,
            a * f + b * e + c * h - d * g,
            a * g - b * h + c * e + d * f,
            a * h + b * g - c * f + d * e,
        ],
        -1,
    )


def line_of(p: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Coefficients e12 e13 e23 e01 e02 e03 of the line through p along d."""
    return np.concatenate([d[..., 2:], -d[..., 1:2], d[..., :1], np.cross(p, d)], -1)


def pga_plane(n: np.ndarray, distance: np.ndarray) -> np.ndarray:
    return np.concatenate([n, -np.asarray(distance)[..., None]], -1)


def hat(w: np.ndarray) -> np.ndarray:
    return np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])


# All specs


def test_there_is_a_spec_for_every_algebra_that_the_readme_names() -> None:
    assert set(MODULES) >= {"pga3", "pga2", "cga3", "vga3", "vga2", "sta", "quaternion", "projective3", "cga2", "arms"}


@all_cases("module", MODULES)
def test_every_kernel_is_documented(module: str) -> None:
    spec = import_module(f"gacompiler.specs.{module}")
    names = {id(value): name for name, value in vars(spec).items() if isinstance(value, Kernel)}
    emitted = kernels_of(spec, ast.parse(Path(spec.__file__ or "").read_text()))
    kernels = {names[id(each)]: each for each in emitted}
    assert spec.__doc__ and kernels and (module in WITH_ALL_PRODUCTS) == ("geometric_product" in kernels)
    for name, kernel in kernels.items():
        assert name == kernel.name
        assert kernel.summary.strip().endswith("."), name


@pytest.mark.parametrize("module", WITH_ALL_PRODUCTS)
def test_products_of_all_pairs_of_basis_blades_are_those_of_an_independent_table(module: str) -> None:
    spec = import_module(f"gacompiler.specs.{module}")
    program, stored = programs(module)["geometric_product"].program, blades_of(module, "geometric_product")
    algebra, size = spec.geometric_product.parameters[0].layout.algebra, len(stored)
    matrices = matrix_representation(algebra.gram)
    blades = np.array([signed_blade(matrices, algebra, name) for name in stored])
    inverse = np.linalg.pinv(blades.reshape(size, -1).T)
    a, b = np.repeat(np.eye(size), size, axis=0).T, np.tile(np.eye(size), (size, 1)).T
    (found,) = interpret(program, {"a": list(a), "b": list(b)}, float).values()
    products = np.einsum("iab,jbc->ijac", blades, blades).reshape(size * size, -1)
    expected = products @ inverse.T
    off = np.abs(np.array(np.broadcast_arrays(*found)).T - expected).max(1)
    wrong = [(stored[pair // size], stored[pair % size]) for pair in np.flatnonzero(~(off <= 1e-9))]
    assert len(off) == size * size and not wrong


def matrix_representation(gram: Any) -> list[np.ndarray]:
    """Matrices with ``a b + b a = 2 gram``, on the exterior algebra: ``v . + v ^`` for the given metric."""
    n = len(gram)
    matrices = []
    for k in range(n):
        matrix = np.zeros((2**n, 2**n))
        for blade in range(2**n):
            members = [m for m in range(n) if blade >> m & 1]
            if not blade >> k & 1:
                matrix[blade | 1 << k, blade] += (-1) ** sum(m < k for m in members)
            for place, m in enumerate(members):
                matrix[blade ^ 1 << m, blade] += (-1) ** place * float(gram[k][m])
        matrices.append(matrix)
    return matrices


def signed_blade(matrices: list[np.ndarray], algebra: Any, name: str) -> np.ndarray:
    """The antisymmetrised product of the vectors of a blade, with the sign of its spelling."""
    sign, bitmap = algebra.blade(name)
    members = [k for k in range(len(matrices)) if bitmap >> k & 1]
    total = np.zeros_like(matrices[0]) if members else np.eye(len(matrices[0]))
    orders = list(permutations(range(len(members)))) if members else []
    for order in orders:
        swaps = sum(order[i] > order[j] for i, j in combinations(range(len(order)), 2))
        product = np.eye(len(matrices[0]))
        for place in order:
            product = product @ matrices[members[place]]
        total += (-1) ** swaps * product / len(orders)
    return sign * total


# Plane-based geometric algebra of space


def test_motors_of_matrices_are_those_matrices_in_every_branch(rng: np.random.Generator) -> None:
    matrices = poses(rng)
    motors = pga3.motor_from_matrix(matrices)
    close(pga3.motor_to_matrix(motors), matrices, 1e-13)
    close(pga3.motor_to_matrix(-motors), matrices, 1e-13)
    close(dot(motors[:, :4], motors[:, :4]), 1, 1e-15 * 4)
    assert np.all(motors[:, 0] >= 0)
    rotors = pga3.rotor_from_matrix(matrices[:, :3, :3])
    close(rotors, motors[:, :4], 1e-15)
    close(pga3.rotor_to_matrix(rotors), matrices[:, :3, :3], 1e-14)
    close(pga3.motor_from_matrix(np.eye(4)), [1, 0, 0, 0, 0, 0, 0, 0], 0)


def test_a_motor_of_a_matrix_that_is_nearly_orthogonal_is_unit(rng: np.random.Generator) -> None:
    matrices = poses(rng)
    matrices[:, :3, :3] += 1e-6 * rng.normal(size=matrices[:, :3, :3].shape)
    motors = pga3.motor_from_matrix(matrices)
    close(dot(motors[:, :4], motors[:, :4]), 1, 1e-15 * 4)
    close(pga3.motor_to_matrix(motors), matrices, 1e-5)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("mirror", [(-1, 1, 1), (-1, -1, -1), (1, -1, 1)])
def test_reflections_have_no_rotor(rng: np.random.Generator, mirror: tuple[int, ...], dtype: type) -> None:
    matrices = poses(rng).astype(dtype)
    turns = matrices[:, :3, :3]
    with np.errstate(invalid="ignore"):
        for rotor_of in (vga3.rotor_from_matrix, pga3.rotor_from_matrix, quaternion.from_matrix):
            assert np.isfinite(rotor_of(turns)).all()
            assert np.isnan(rotor_of(turns * np.array(mirror, dtype))).all()
        assert np.isnan(pga3.motor_from_matrix(matrices * np.array([*mirror, 1], dtype))[:, :4]).all()


def test_singular_matrices_have_no_rotor() -> None:
    with np.errstate(all="ignore"):
        for matrix in (np.ones((4, 4)), np.diag([0.0, 1, 1, 1]), np.zeros((4, 4))):
            assert np.isnan(pga3.motor_from_matrix(matrix)[:4]).all()
        for flat in (np.diag([-1.0, 1]), np.ones((2, 2)), np.array([[0.6, 0.8], [0.8, -0.6]]), np.zeros((2, 2))):
            assert np.isnan(vga2.rotor_from_matrix(flat)).all()
            assert np.isnan(pga2.motor_from_matrix(np.block([[flat, np.zeros((2, 1))], [0, 0, 1]]))[:2]).all()


def test_motors_move_everything_as_matrices_do(rng: np.random.Generator) -> None:
    matrices = poses(rng)
    motors = pga3.motor_from_matrix(matrices)
    p, d, n = rng.normal(size=(3, len(matrices), 3))
    t = matrices[:, :3, 3]
    for m in (motors, -motors):
        close(pga3.move_point(m, p), apply(matrices, p))
        close(pga3.move_point_back(m, apply(matrices, p)), p)
        close(pga3.move_direction(m, d), turn(matrices, d))
        close(pga3.move_line(m, line_of(p, d)), line_of(apply(matrices, p), turn(matrices, d)), 1e-11)
        turned = turn(matrices, n)
        close(pga3.move_plane(m, pga_plane(n, dot(n, p))), pga_plane(turned, dot(n, p) + dot(turned, t)), 1e-11)
        lines = line_of(p, d)
        close(np.einsum("nij,nj->ni", pga3.motor_to_adjoint(m), lines), pga3.move_line(m, lines), 1e-11)
    close(pga3.move_point(motors[0], p), apply(matrices[0], p))


def test_motors_compose_and_invert_as_matrices_do(rng: np.random.Generator) -> None:
    first, second = poses(rng), poses(rng)[::-1]
    a, b = pga3.motor_from_matrix(first), pga3.motor_from_matrix(second)
    close(pga3.motor_to_matrix(pga3.motor_product(a, b)), first @ second, 1e-11)
    close(pga3.even_product(a, b), pga3.motor_product(a, b), 0)
    close(pga3.motor_to_matrix(pga3.motor_inverse(a)), np.linalg.inv(first), 1e-11)
    close(pga3.motor_to_matrix(pga3.move_motor(a, b)), first @ second @ np.linalg.inv(first), 1e-10)
    even = rng.normal(size=(N, 8))
    close(pga3.even_product(even, pga3.even_inverse(even)), np.tile([1.0] + 7 * [0.0], (N, 1)), 1e-9)


def test_normalised_motors_are_on_the_study_quadric_and_dual_numbers_drop_out(rng: np.random.Generator) -> None:
    motors = pga3.motor_from_matrix(poses(rng))
    dual = np.zeros_like(motors)
    dual[:, 0], dual[:, 7] = rng.uniform(0.2, 5, len(motors)), rng.normal(size=len(motors))
    close(pga3.normalize_motor(pga3.even_product(motors, dual)), motors, 1e-12)
    close(pga3.normalize_motor(motors), motors, 1e-13)
    anything = rng.normal(size=(N, 8))
    found = pga3.normalize_motor(anything)
    close(pga3.even_product(found, found * [1, -1, -1, -1, -1, -1, -1, 1]), np.tile([1.0] + 7 * [0.0], (N, 1)))
    same_up_to_sign(found[:, :4], unit(anything[:, :4]))


def test_right_hand_rule() -> None:
    x, y, z = np.eye(3)
    quarter = np.pi / 2
    for module in (pga3, cga3):
        rotor = module.rotor_from_axis_angle(z * 7, quarter)
        motor = module.motor_from_rotor_translation(rotor, np.zeros(3))
        close(module.move_point(motor, x), y, 1e-15)
        close(module.move_point(motor, y), -x, 1e-15)
    close(vga3.rotate_vector(vga3.rotor_from_axis_angle(z, quarter), x), y, 1e-15)
    close(quaternion.rotate_vector(quaternion.from_axis_angle(z, quarter), x), y, 1e-15)
    close(sta.transform_vector(sta.rotor_from_axis_angle(z, quarter), [0, 1, 0, 0]), [0, 0, 1, 0], 1e-15)
    close(vga2.rotate_vector(vga2.rotor_from_angle(quarter), [1, 0]), [0, 1], 1e-15)
    close(pga2.move_point(pga2.motor_from_point([1, 1], quarter), [2, 1]), [1, 2], 1e-15)
    line = pga3.join_points([1, 1, 0], [1, 1, 1])
    close(pga3.move_point(pga3.motor_from_line(line, quarter), [2, 1, 5]), [1, 2, 5], 1e-15)
    close(pga3.move_point(pga3.motor_from_screw(line, quarter, 3), [2, 1, 5]), [1, 2, 8], 1e-15)
    conformal = cga3.line_from_points([1, 1, 0], [1, 1, 4])
    close(cga3.move_point(cga3.motor_from_line(conformal, quarter), [2, 1, 5]), [1, 2, 5], 1e-15)
    close(vga3.cross_product(x, y), z, 0)
    close(quaternion.product([0, 1, 0, 0], [0, 0, 1, 0]), [0, 0, 0, 1], 0)


def test_pga3_constructors_are_those_of_scipy(rng: np.random.Generator) -> None:
    vectors = rotation_vectors(rng)
    rotation, t = Rotation.from_rotvec(vectors), rng.normal(size=(len(vectors), 3))
    rotors = pga3.rotor_from_rotation_vector(vectors)
    close(pga3.rotor_to_matrix(rotors), rotation.as_matrix(), 1e-14)
    angles = np.linalg.norm(vectors, axis=-1)
    axes = np.where(angles[:, None] > 0, vectors, 1)
    same_up_to_sign(pga3.rotor_from_axis_angle(axes * 3, angles), rotors, 1e-14)
    close(pga3.rotor_from_quaternion(pga3.rotor_to_quaternion(rotors)), rotors, 0)
    same_up_to_sign(pga3.rotor_to_quaternion(rotors), scalar_first(rotation), 1e-14)
    motors = pga3.motor_from_rotor_translation(rotors, t)
    matrices = np.tile(np.eye(4), (len(vectors), 1, 1))
    matrices[:, :3, :3], matrices[:, :3, 3] = rotation.as_matrix(), t
    close(pga3.motor_to_matrix(motors), matrices, 1e-13)
    back, translation = pga3.motor_to_rotor_translation(motors)
    close(back, rotors, 0)
    close(translation, t, 1e-13)
    pure = pga3.motor_from_rotor_translation([1, 0, 0, 0], t)
    close(pure[:, 4:7], pga3.translator_from_vector(t), 0)
    close(pga3.move_point(pure, -t), np.zeros_like(t), 1e-14)


def test_dual_quaternions_are_half_the_translation_times_the_rotation(rng: np.random.Generator) -> None:
    matrices = poses(rng)
    real = scalar_first(Rotation.from_matrix(matrices[:, :3, :3]))
    translation = np.concatenate([np.zeros((len(matrices), 1)), matrices[:, :3, 3]], -1)
    dual = np.concatenate([real, hamilton(translation, real) / 2], -1)
    motors = pga3.motor_from_dual_quaternion(dual)
    close(pga3.motor_to_matrix(motors), matrices)
    close(pga3.motor_to_dual_quaternion(motors), dual, 0)


def test_motors_about_lines_and_screws(rng: np.random.Generator) -> None:
    p, d = rng.normal(size=(N, 3)), unit(rng.normal(size=(N, 3)))
    angle, along = rng.uniform(-7, 7, N), rng.normal(size=N)
    x = rng.normal(size=(N, 3))
    expected = p + Rotation.from_rotvec(d * angle[:, None]).apply(x - p)
    line = line_of(p, d)
    close(pga3.move_point(pga3.motor_from_line(line, angle), x), expected)
    close(pga3.move_point(pga3.motor_from_screw(line, angle, along), x), expected + along[:, None] * d)
    conformal = cga3.line_from_point_direction(p, d * 5)
    close(cga3.move_point(cga3.motor_from_line(conformal, angle), x), expected)


def denavit_hartenberg(theta: float, d: float, a: float, alpha: float, modified: bool) -> np.ndarray:
    def about(axis: int, angle: float, shift: float) -> np.ndarray:
        matrix = np.eye(4)
        matrix[:3, :3] = Rotation.from_rotvec(angle * np.eye(3)[axis]).as_matrix()
        matrix[axis, 3] = shift
        return matrix

    z, x = about(2, theta, d), about(0, alpha, a)
    return x @ z if modified else z @ x


def test_denavit_hartenberg_rows(rng: np.random.Generator) -> None:
    for row in [*rng.uniform(-3, 3, (10, 4)), np.zeros(4), np.array([np.pi, 0, 1, -np.pi / 2])]:
        for kernel, modified in (
            (pga3.motor_from_denavit_hartenberg, False),
            (pga3.motor_from_modified_denavit_hartenberg, True),
        ):
            close(pga3.motor_to_matrix(kernel(*row)), denavit_hartenberg(*row, modified), 1e-14)


def test_motor_exponential_is_that_of_the_twist_matrix(rng: np.random.Generator) -> None:
    twists = rng.normal(size=(N, 6))
    twists[-8:, :3] *= np.array([0, 0, 1e-12, 1e-9, 1e-8, 1e-6, 1e-4, 1e-2])[:, None]
    twists[-8] = 0
    for w, v in zip(twists[:, :3], twists[:, 3:], strict=True):
        generator = np.zeros((4, 4))
        generator[:3, :3], generator[:3, 3] = hat(w), v
        b = -0.5 * np.array([w[2], -w[1], w[0], *v])
        close(pga3.motor_to_matrix(pga3.motor_exponential(b)), expm(generator), 1e-13)
        x = rng.normal(size=3)
        close(pga3.twist_on_point(-2 * b, x), np.cross(w, x) + v, 1e-14)


def test_motor_logarithm_is_the_least_exponent_for_both_signs(rng: np.random.Generator) -> None:
    matrices = poses(rng)
    motors = pga3.motor_from_matrix(matrices)
    for m in (motors, -motors):
        b = pga3.motor_logarithm(m)
        close(pga3.motor_to_matrix(pga3.motor_exponential(b)), matrices, 1e-12)
        assert np.all(2 * np.linalg.norm(b[:, :3], axis=-1) <= np.pi + 1e-12)
    translations = pga3.motor_from_rotor_translation([1, 0, 0, 0], matrices[:, :3, 3])
    close(pga3.motor_logarithm(translations)[:, 3:], -matrices[:, :3, 3] / 2, 1e-15)
    root = pga3.motor_square_root(motors)
    done_twice = pga3.motor_to_matrix(root) @ pga3.motor_to_matrix(root)
    close(done_twice, matrices, 1e-12)


def test_interpolated_motors_go_from_one_to_the_other_at_constant_twist(rng: np.random.Generator) -> None:
    first, second = poses(rng), poses(rng)
    second[::5] = first[::5]
    a, b = pga3.motor_from_matrix(first), pga3.motor_from_matrix(second)
    for sign in (1, -1):
        close(pga3.motor_to_matrix(pga3.interpolate_motors(a, sign * b, 0.0)), first, 1e-11)
        close(pga3.motor_to_matrix(pga3.interpolate_motors(a, sign * b, 1.0)), second, 1e-9)
        third = pga3.motor_to_matrix(pga3.interpolate_motors(a, sign * b, 1 / 3))
        step = np.linalg.inv(first) @ third
        close(first @ step @ step @ step, second, 1e-9)


def test_motors_between_lines_and_planes(rng: np.random.Generator) -> None:
    p, q = rng.normal(size=(2, N, 3))
    d, e = unit(rng.normal(size=(2, N, 3)))
    first, second = line_of(p, d), line_of(q, e)
    close(pga3.move_line(pga3.motor_between_lines(first, second), first), second, 1e-10)
    parallel = line_of(q, d)
    close(pga3.move_line(pga3.motor_between_lines(first, parallel), first), parallel, 1e-11)
    one, other = pga_plane(d, dot(d, p)), pga_plane(e, dot(e, q))
    close(pga3.move_plane(pga3.motor_between_planes(one, other), one), other, 1e-10)
    shifted = pga_plane(d, dot(d, q))
    motor = pga3.motor_between_planes(one, shifted)
    close(pga3.move_plane(motor, one), shifted, 1e-12)
    close(motor[:, 1:4], np.zeros((N, 3)), 1e-15)


@pytest.mark.parametrize("scale", [1.0, 1e3])
def test_pga3_joins_meets_and_distances_are_those_of_vectors(rng: np.random.Generator, scale: float) -> None:
    a, b, c, d = rng.normal(size=(4, N, 3)) * scale
    tolerance = 1e-12 * scale**3
    close(pga3.join_points(a, b), line_of(a, b - a), tolerance)
    close(pga3.join_point_direction(a, b), line_of(a, b), tolerance)
    normal = np.cross(b - a, c - a)
    close(pga3.join_three_points(a, b, c), pga_plane(normal, dot(normal, a)), tolerance)
    close(pga3.join_point_line(a, line_of(b, c - b)), pga_plane(normal, dot(normal, a)), tolerance)
    close(pga3.join_four_points(a, b, c, d), np.linalg.det(np.stack([b - a, c - a, d - a], 1)), tolerance)
    close(pga3.distance_points(a, b), np.linalg.norm(b - a, axis=-1), 1e-12 * scale)
    close(pga3.distance_squared_points(a, b), dot(b - a, b - a), tolerance)
    n, direction = unit(normal), unit(b - a)
    plane, line = pga_plane(n, dot(n, a)), line_of(a, direction)
    height = dot(d - a, n)
    close(pga3.signed_distance_point_plane(d, plane), height, tolerance)
    close(pga3.distance_point_line(d, line), np.linalg.norm(np.cross(d - a, direction), axis=-1), tolerance)
    on_plane = d - height[:, None] * n
    for factor, kernel in ((2.5, pga3.project_point_on_plane), (1, pga3.project_point_on_unit_plane)):
        close(kernel(d, factor * plane), on_plane, tolerance)
    on_line = a + dot(d - a, direction)[:, None] * direction
    for factor, kernel in ((-2.5, pga3.project_point_on_line), (1, pga3.project_point_on_unit_line)):
        close(kernel(d, factor * line), on_line, tolerance)
    close(pga3.reflect_point(d, plane), d - 2 * height[:, None] * n, tolerance)
    other = unit(d - c)
    close(pga3.mutual_moment(line, line_of(c, other)), dot(a - c, np.cross(direction, other)), tolerance)
    close(pga3.line_orthogonal_to_plane(d, plane), line_of(d, n), tolerance)
    close(pga3.plane_orthogonal_to_line(d, line), pga_plane(direction, dot(direction, d)), tolerance)
    close(pga3.plane_through_point(d, plane), pga_plane(n, dot(n, d)), tolerance)
    flattened = other - dot(other, n)[:, None] * n
    foot = c - dot(c - a, n)[:, None] * n
    close(pga3.project_line_on_unit_plane(line_of(c, other), plane), line_of(foot, flattened), tolerance)
    close(pga3.normalize_line(3 * line), line, 1e-12 * scale)
    close(pga3.normalize_plane(3 * plane), plane, 1e-12 * scale)


def test_pga3_meets_are_solutions_of_linear_systems(rng: np.random.Generator) -> None:
    normals, distances = rng.normal(size=(N, 3, 3)), rng.normal(size=(N, 3))
    p, q, r = (pga_plane(normals[:, k], distances[:, k]) for k in range(3))
    point = np.linalg.solve(normals, distances[..., None])[..., 0]
    weighted = pga3.meet_three_planes(p, q, r)
    close(weighted[:, 0], np.linalg.det(normals), 1e-12)
    close(pga3.point_from_trivector(weighted), point, 1e-9)
    line = pga3.meet_planes(p, q)
    close(line, line_of(point, np.cross(normals[:, 0], normals[:, 1])), 1e-9)
    close(pga3.point_from_trivector(pga3.meet_line_plane(line, r)), point, 1e-9)
    parallel = pga_plane(normals[:, 0], distances[:, 1])
    close(pga3.meet_planes(p, parallel)[:, :3], np.zeros((N, 3)), 1e-15)
    close(pga3.meet_three_planes(p, parallel, r)[:, 0], np.zeros(N), 1e-15)


def test_angles_are_accurate_where_they_are_small() -> None:
    angle = np.array([0, 1e-12, 1e-6, 0.5, np.pi / 2, np.pi - 1e-6, np.pi])
    zero = np.zeros_like(angle)
    turned = np.stack([np.cos(angle), np.sin(angle), zero], -1)
    x = np.array([1.0, 0, 0])
    close(vga3.angle_between_vectors(2 * x, 3 * turned), angle, 1e-15)
    close(pga3.angle_between_planes(pga_plane(x, 2.0), pga_plane(turned, zero + 1)), angle, 1e-15)
    close(pga3.angle_between_lines(line_of(x, x), line_of(np.ones_like(turned), turned)), angle, 1e-15)
    close(vga2.angle_between_vectors([2, 0], turned[:, :2] * [3, -3]), -angle, 1e-15)


def test_rates_of_change_are_derivatives(rng: np.random.Generator) -> None:
    v, b = rng.normal(size=(2, N, 6))
    plane = rng.normal(size=(N, 4))
    h = 1e-6
    plus, minus = pga3.motor_exponential(-h / 2 * v), pga3.motor_exponential(h / 2 * v)
    for moved, rate, x in (
        (pga3.move_line, pga3.twist_on_line, b),
        (pga3.move_plane, pga3.twist_on_plane, plane),
        (pga3.move_point, pga3.twist_on_point, plane[:, :3]),
    ):
        close(rate(v, x), (moved(plus, x) - moved(minus, x)) / (2 * h), 1e-8)
    close(pga3.line_commutator(b, v), pga3.twist_on_line(v, b), 1e-14)
    flat, point = rng.normal(size=(N, 3)), rng.normal(size=(N, 2))
    plus, minus = pga2.motor_exponential(-h / 2 * flat), pga2.motor_exponential(h / 2 * flat)
    close(
        pga2.twist_on_point(flat, point), (pga2.move_point(plus, point) - pga2.move_point(minus, point)) / (2 * h), 1e-8
    )


def test_norms_of_pga3_elements() -> None:
    point = np.zeros(16)
    layout = blades_of("pga3", "reverse")
    for name, value in (("e123", 2.0), ("e032", 3.0), ("e013", 4.0), ("e021", 12.0)):
        point[layout.index(name)] = value
    close(pga3.norm(point), 2, 0)
    close(pga3.ideal_norm(point), 13, 0)


# The plane


def test_pga2_motors_are_those_of_matrices(rng: np.random.Generator) -> None:
    angle = np.concatenate([rng.uniform(-np.pi, np.pi, N), [0, np.pi, -np.pi, np.pi / 2, 1e-12, np.pi - 1e-12]])
    t, x = rng.normal(size=(2, len(angle), 2)) * 3
    matrices = np.tile(np.eye(3), (len(angle), 1, 1))
    matrices[:, 0, 0] = matrices[:, 1, 1] = np.cos(angle)
    matrices[:, 1, 0], matrices[:, 0, 1] = np.sin(angle), -np.sin(angle)
    matrices[:, :2, 2] = t
    motors = pga2.motor_from_angle_translation(angle, t)
    for m in (motors, -motors, pga2.motor_from_matrix(matrices)):
        close(pga2.motor_to_matrix(m), matrices, 1e-13)
        close(pga2.move_point(m, x), apply(matrices, x))
        close(pga2.move_point_back(m, apply(matrices, x)), x)
        close(pga2.move_direction(m, x), np.einsum("nij,nj->ni", matrices[:, :2, :2], x), 1e-13)
        found, translation = pga2.motor_to_angle_translation(m)
        close(np.cos(found - angle), 1, 1e-14)
        close(translation, t, 1e-13)
        close(pga2.motor_to_matrix(pga2.motor_exponential(pga2.motor_logarithm(m))), matrices)
        line = np.concatenate([x, -dot(x, t)[:, None]], -1)
        moved = pga2.move_line(m, line)
        close(
            moved,
            np.concatenate(
                [turned := (matrices[:, :2, :2] @ x[..., None])[..., 0], -dot(turned, apply(matrices, t))[:, None]], -1
            ),
            1e-11,
        )
    assert np.all(pga2.motor_from_matrix(matrices)[:, 0] >= 0)
    close(pga2.motor_to_matrix(pga2.motor_product(motors, motors[::-1])), matrices @ matrices[::-1], 1e-12)
    close(pga2.motor_to_matrix(pga2.motor_inverse(motors)), np.linalg.inv(matrices), 1e-12)
    close(pga2.normalize_motor(3 * motors), motors, 1e-14)
    half = pga2.motor_to_matrix(pga2.interpolate_motors(motors, -motors[::-1], 0.5))
    step = np.linalg.inv(matrices) @ half
    close(matrices @ step @ step, matrices[::-1], 1e-9)
    close(pga2.move_point(pga2.motor_from_angle_translation(0.0, t), x), x + t, 1e-14)
    close(pga2.motor_from_angle_translation(0.0, t)[:, 2:], pga2.translator_from_vector(t), 0)


def test_pga2_joins_meets_and_distances_are_those_of_vectors(rng: np.random.Generator) -> None:
    a, b, c, d = rng.normal(size=(4, N, 2))
    along = b - a
    normal = np.stack([-along[:, 1], along[:, 0]], -1)
    close(pga2.join_points(a, b), np.concatenate([normal, -dot(normal, a)[:, None]], -1), 1e-14)
    close(pga2.join_point_direction(a, along), pga2.join_points(a, b), 1e-14)
    close(pga2.distance_points(a, b), np.linalg.norm(along, axis=-1), 1e-14)
    close(pga2.distance_squared_points(a, b), dot(along, along), 1e-13)
    close(pga2.signed_area(a, b, c), along[:, 0] * (c - a)[:, 1] - along[:, 1] * (c - a)[:, 0], 1e-13)
    line = pga2.normalize_line(pga2.join_points(a, b))
    n = unit(normal)
    height = dot(c - a, n)
    close(pga2.signed_distance_point_line(c, line), height, 1e-13)
    close(pga2.project_point_on_unit_line(c, line), c - height[:, None] * n, 1e-13)
    close(pga2.project_point_on_line(c, -2 * line), c - height[:, None] * n, 1e-13)
    close(pga2.reflect_point(c, line), c - 2 * height[:, None] * n, 1e-13)
    crossing = pga2.point_from_bivector(pga2.meet_lines(line, pga2.join_points(c, d)))
    close(pga2.signed_area(a, b, crossing), np.zeros(N), 1e-10)
    close(pga2.signed_area(c, d, crossing), np.zeros(N), 1e-10)
    orthogonal = pga2.line_orthogonal_to_line(c, line)
    close(np.abs(pga2.angle_between_lines(line, orthogonal)), np.pi / 2, 1e-14)
    close(pga2.signed_distance_point_line(c, orthogonal), np.zeros(N), 1e-13)


def test_vga2_rotors(rng: np.random.Generator) -> None:
    angle = np.concatenate([rng.uniform(-np.pi, np.pi, N), [0, np.pi, -np.pi, 1e-12, np.pi / 2]])
    matrices = np.moveaxis(np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]), -1, 0)
    v = rng.normal(size=(len(angle), 2))
    rotated = np.einsum("nij,nj->ni", matrices, v)
    rotors = vga2.rotor_from_angle(angle)
    for r in (rotors, -rotors, vga2.rotor_from_matrix(matrices), vga2.rotor_between_vectors(3 * v, rotated)):
        close(vga2.rotor_to_matrix(r), matrices, 1e-14)
        close(vga2.rotate_vector(r, v), rotated, 1e-14)
        close(vga2.rotate_vector_back(r, rotated), v, 1e-14)
        close(np.cos(vga2.rotor_to_angle(r) - angle), 1, 1e-14)
    close(vga2.rotor_to_matrix(vga2.rotor_product(rotors, rotors[::-1])), matrices @ matrices[::-1], 1e-14)
    close(vga2.rotor_between_vectors([1, 0], [-2, 0]), [0, -1], 0)
    z, w = v[:, 0] + 1j * v[:, 1], rotated[::-1, 0] + 1j * rotated[::-1, 1]
    close(vga2.even_product(v, rotated[::-1]), np.stack([(z * w).real, (z * w).imag], -1), 1e-14)
    close(vga2.quarter_turn(v), np.stack([-v[:, 1], v[:, 0]], -1), 0)
    n = unit(rotated[::-1])
    close(vga2.reflect_vector(v, 2 * n), v - 2 * dot(v, n)[:, None] * n, 1e-13)
    close(vga2.project_vector_on_vector(v, 2 * n), dot(v, n)[:, None] * n, 1e-13)


# Vectors, rotors and quaternions of space


def test_vga3_vectors(rng: np.random.Generator) -> None:
    a, b, c = rng.normal(size=(3, N, 3))
    close(vga3.cross_product(a, b), np.cross(a, b), 1e-14)
    close(vga3.triple_product(a, b, c), np.linalg.det(np.stack([a, b, c], 1)), 1e-13)
    close(vga3.dual_bivector(vga3.wedge_vectors(a, b)), np.cross(a, b), 1e-14)
    close(vga3.dual_vector(np.cross(a, b)), vga3.wedge_vectors(a, b), 1e-14)
    close(vga3.bivector_norm(vga3.wedge_vectors(a, b)), np.linalg.norm(np.cross(a, b), axis=-1), 1e-13)
    n = unit(b)
    close(vga3.project_vector_on_vector(a, b), dot(a, n)[:, None] * n, 1e-13)
    close(vga3.reflect_vector(a, b), a - 2 * dot(a, n)[:, None] * n, 1e-13)
    normal = unit(np.cross(b, c))
    close(vga3.project_vector_on_plane(a, vga3.wedge_vectors(b, c)), a - dot(a, normal)[:, None] * normal, 1e-11)
    commutator = vga3.dual_bivector(vga3.bivector_commutator(vga3.dual_vector(a), vga3.dual_vector(b)))
    close(commutator, -np.cross(a, b), 1e-14)
    element = rng.normal(size=(N, 8))
    close(vga3.geometric_product(element, vga3.inverse(element)), np.tile([1.0] + 7 * [0.0], (N, 1)), 1e-9)


ROTORS = SimpleNamespace(
    from_matrix=vga3.rotor_from_matrix,
    to_matrix=vga3.rotor_to_matrix,
    product=vga3.rotor_product,
    from_rotation_vector=vga3.rotor_from_rotation_vector,
    to_rotation_vector=vga3.rotor_to_rotation_vector,
    from_axis_angle=vga3.rotor_from_axis_angle,
    from_roll_pitch_yaw=vga3.rotor_from_roll_pitch_yaw,
    rotate_vector=vga3.rotate_vector,
    rotate_vector_back=vga3.rotate_vector_back,
    slerp=vga3.interpolate_rotors,
    between_vectors=vga3.rotor_between_vectors,
)
BOTH = pytest.mark.parametrize("kernels", [ROTORS, quaternion], ids=["rotor", "quaternion"])


@BOTH
def test_rotations_are_those_of_scipy(rng: np.random.Generator, kernels: Any) -> None:
    vectors = rotation_vectors(rng)
    rotation = Rotation.from_rotvec(vectors)
    matrices = rotation.as_matrix()
    found = kernels.from_matrix(matrices)
    close(dot(found, found), 1, 4e-15)
    assert np.all(found[:, 0] >= 0)
    v = rng.normal(size=(len(vectors), 3))
    for each in (found, -found, kernels.from_rotation_vector(vectors)):
        close(kernels.to_matrix(each), matrices, 1e-14)
        close(kernels.rotate_vector(each, v), rotation.apply(v), 1e-13)
        close(kernels.rotate_vector_back(each, v), rotation.inv().apply(v), 1e-13)
        close(Rotation.from_rotvec(kernels.to_rotation_vector(each)).as_matrix(), matrices, 1e-13)
    short = np.linalg.norm(vectors, axis=-1) < 3
    close(kernels.to_rotation_vector(found)[short], vectors[short], 1e-13)
    close(kernels.to_rotation_vector(-found)[short], vectors[short], 1e-13)
    close(kernels.to_matrix(kernels.product(found, found[::-1])), matrices @ matrices[::-1], 1e-13)
    close(kernels.to_matrix(kernels.from_axis_angle([0, 0, 2], 0.3)), Rotation.from_euler("z", 0.3).as_matrix(), 1e-15)
    close(
        kernels.to_matrix(kernels.from_roll_pitch_yaw(0.1, 0.2, 0.3)),
        Rotation.from_euler("xyz", [0.1, 0.2, 0.3]).as_matrix(),
        1e-15,
    )
    step = np.linalg.inv(matrices) @ kernels.to_matrix(kernels.slerp(found, -found[::-1], 0.5))
    close(matrices @ step @ step, matrices[::-1], 1e-12)
    quarter = kernels.to_rotation_vector(kernels.product(conjugate_of(found), kernels.slerp(found, found[::-1], 0.25)))
    assert np.all(np.linalg.norm(quarter, axis=-1) <= np.pi / 4 + 1e-12)
    same_up_to_sign(kernels.slerp(found, -found, 0.7), found, 1e-14)


def conjugate_of(q: np.ndarray) -> np.ndarray:
    return q * [1, -1, -1, -1]


def test_rotors_and_bivectors_and_quaternions_convert(rng: np.random.Generator) -> None:
    rotation = Rotation.from_rotvec(rotation_vectors(rng))
    q = scalar_first(rotation)
    rotors = vga3.rotor_from_quaternion(q)
    close(vga3.rotor_to_matrix(rotors), rotation.as_matrix(), 1e-14)
    close(vga3.rotor_to_quaternion(rotors), q, 0)
    close(pga3.rotor_from_quaternion(q), rotors, 0)
    b = rng.normal(size=(len(q), 3))
    dual = vga3.dual_bivector(b)
    close(vga3.dual_bivector(vga3.rotate_bivector(rotors, b)), rotation.apply(dual), 1e-13)
    close(vga3.rotor_to_matrix(vga3.rotor_exponential(vga3.rotor_logarithm(-rotors))), rotation.as_matrix(), 1e-13)
    close(vga3.normalize_rotor(-3 * rotors), -rotors, 1e-15)


@BOTH
def test_rotations_between_vectors_also_where_these_are_opposite(rng: np.random.Generator, kernels: Any) -> None:
    between, rotate = kernels.between_vectors, kernels.rotate_vector
    a = unit(rng.normal(size=(N, 3)))
    side = unit(np.cross(a, rng.normal(size=(N, 3))))
    axes = np.vstack([np.eye(3), -np.eye(3)])
    for gap in (0.0, 1e-300, 1e-16, 1e-15, 1e-14, 1e-12, 1e-9, 1e-7, 0.9e-4, 1.1e-4, 1e-2, 1.0, 3.0, np.pi):
        b = -np.cos(gap) * a + np.sin(gap) * side
        r = between(2 * a, 5 * b)
        close(dot(r, r), 1, 1e-14)
        close(rotate(r, a), b, 1e-11)
    r = between(axes, -3 * axes)
    close(rotate(r, axes), -axes, 1e-15)
    close(between(axes, axes), np.tile([1.0, 0, 0, 0], (6, 1)), 0)


def test_quaternion_functions_are_those_of_their_matrices(rng: np.random.Generator) -> None:
    p, q = rng.normal(size=(2, N, 4))
    q[-4:] = [[1, 0, 0, 0], [0.5, 1e-12, 0, 0], [-0.5, 1e-12, 0, 0], [0, 0, 2, 0]]
    close(quaternion.product(p, q), hamilton(p, q), 1e-14)
    close(quaternion.product(q, quaternion.inverse(q)), np.tile([1.0, 0, 0, 0], (N, 1)), 1e-13)
    close(quaternion.conjugate(q), conjugate_of(q), 0)
    close(quaternion.norm(q), np.linalg.norm(q, axis=-1), 1e-14)
    close(quaternion.normalize(q), unit(q), 1e-15)

    def left(x: np.ndarray) -> np.ndarray:
        return hamilton(x, np.eye(4)).T

    for each in q:
        close(left(quaternion.exponential(each)), expm(left(each)), 1e-12)
        logarithm = quaternion.logarithm(each)
        close(quaternion.exponential(logarithm), each, 1e-13)
        assert np.linalg.norm(logarithm[1:]) <= np.pi + 1e-15
        close(quaternion.power(each, 2.0), hamilton(each, each), 1e-12)
    close(quaternion.logarithm([-1, 0, 0, 0]), [0, np.pi, 0, 0], 0)
    close(quaternion.exponential([0, 0, 0, 0]), [1, 0, 0, 0], 0)
    unit_p, unit_q = unit(p), unit(q)
    rotations = [Rotation.from_quat(np.roll(x, -1, -1)) for x in (unit_p, unit_q)]
    close(quaternion.angle_between(unit_p, -unit_q), (rotations[0].inv() * rotations[1]).magnitude(), 1e-13)


def test_two_complex_transforms_are_the_two_sided_quaternion_transform(rng: np.random.Generator) -> None:
    rows, columns = 4, 3
    field = rng.normal(size=(rows, columns, 4))
    direct = np.zeros_like(field)
    for u, v, x, y in np.ndindex(rows, columns, rows, columns):
        s, t = -2 * np.pi * u * x / rows, -2 * np.pi * v * y / columns
        left, right = np.array([np.cos(s), np.sin(s), 0, 0]), np.array([np.cos(t), 0, np.sin(t), 0])
        direct[u, v] += hamilton(hamilton(left, field[x, y]), right)
    plus, minus = (z[..., 0] + 1j * z[..., 1] for z in quaternion.pack_two_sided(field))
    plus = np.fft.fft(np.fft.ifft(plus, axis=1) * columns, axis=0)
    minus = np.fft.fft2(minus)
    parts = (np.stack([z.real, z.imag], -1) for z in (plus, minus))
    close(quaternion.unpack_two_sided(*parts), direct, 1e-12)
    close(quaternion.unpack_two_sided(*quaternion.pack_two_sided(field)), field, 1e-15)


# Conformal geometry


def test_conformal_points(rng: np.random.Generator) -> None:
    a, b = rng.normal(size=(2, N, 3)) * 10
    embedded = cga3.embed_point(a)
    close(embedded, np.concatenate([a, np.ones((N, 1)), dot(a, a)[:, None] / 2], -1), 1e-12)
    close(cga3.extract_point(-3 * embedded), a, 1e-13)
    close(cga3.normalize_vector(-3 * embedded), embedded, 1e-12)
    close(cga3.inner_product_of_vectors(embedded, embedded), np.zeros(N), 1e-11)
    close(cga3.inner_product_of_points(a, b), -dot(a - b, a - b) / 2, 1e-11)
    close(cga3.distance_squared_points(a, b), dot(a - b, a - b), 1e-11)
    close(cga3.distance_points(a, b), np.linalg.norm(a - b, axis=-1), 1e-13)
    close(cga3.distance_points(a + 1e6, a + 1e6), np.zeros(N), 0)


def test_spheres_and_planes(rng: np.random.Generator) -> None:
    centre, direction = rng.normal(size=(N, 3)), unit(rng.normal(size=(N, 4, 3)))
    radius = rng.uniform(0.3, 3, N)
    points = centre[:, None] + radius[:, None, None] * direction
    sphere = cga3.sphere_from_points(*np.moveaxis(points, 1, 0))
    close(cga3.sphere_centre(sphere), centre, 1e-7)
    close(cga3.sphere_radius_squared(sphere), radius**2, 1e-7)
    dual = cga3.dual_sphere_from_centre(centre, radius)
    close(cga3.normalize_vector(cga3.sphere_polarity(sphere)), dual, 1e-7)
    close(cga3.sphere_polarity(cga3.sphere_from_centre(centre, radius)), dual, 1e-13)
    close(cga3.dual_sphere_through_point(centre, points[:, 0]), dual, 1e-13)
    close(cga3.inner_product_of_vectors(dual, dual), radius**2, 1e-12)
    x = rng.normal(size=(N, 3))
    close(cga3.power_of_point(x, -2 * dual), dot(x - centre, x - centre) - radius**2, 1e-12)
    away = (x - centre) / dot(x - centre, x - centre)[:, None]
    close(cga3.invert_point(x, 3 * dual), centre + radius[:, None] ** 2 * away, 1e-10)
    a, b, c = np.moveaxis(points[:, :3], 1, 0)
    normal = np.cross(b - a, c - a)
    plane = cga3.dual_plane_from_normal(normal, dot(normal, a))
    close(cga3.plane_polarity(cga3.plane_from_points(a, b, c)), -plane, 1e-12)
    n = unit(normal)
    height = dot(x - a, n)
    close(cga3.signed_distance_point_plane(x, plane), height, 1e-10)
    close(cga3.reflect_point(x, plane), x - 2 * height[:, None] * n, 1e-9)
    bisector = cga3.bisector_plane(a, b)
    close(cga3.signed_distance_point_plane((a + b) / 2, bisector), np.zeros(N), 1e-12)
    close(cga3.reflect_point(a, bisector), b, 1e-10)
    with np.errstate(all="ignore"):
        assert not np.any(np.isfinite(cga3.invert_point(np.zeros(3), [0, 0, 0, 1, -0.5])))


def test_circles_lines_and_point_pairs(rng: np.random.Generator) -> None:
    centre = rng.normal(size=(N, 3))
    x = unit(rng.normal(size=(N, 3)))
    y = unit(np.cross(x, rng.normal(size=(N, 3))))
    normal = np.cross(x, y)
    radius = rng.uniform(0.3, 3, (N, 1))
    angles = rng.uniform(0, 2, (3, N, 1)) + np.array([0.0, 2.1, 4.2])[:, None, None]
    a, b, c = centre + radius * (np.cos(angles) * x + np.sin(angles) * y)
    circle = cga3.circle_from_points(a, b, c)
    close(cga3.circle_centre(circle), centre, 1e-9)
    close(cga3.circle_radius_squared(circle), radius[:, 0] ** 2, 1e-9)
    axis = cga3.circle_axis(circle)
    close(cga3.distance_point_line(centre, axis), np.zeros(N), 1e-6)
    close(cga3.distance_point_line(centre + 2 * normal, axis), np.zeros(N), 1e-6)
    dual = cga3.plane_polarity(cga3.circle_plane(circle))
    close(cga3.signed_distance_point_plane(centre + normal, dual), np.full(N, -1.0), 1e-10)
    first, second = cga3.point_pair_points(cga3.point_pair_from_points(a, b))
    close(first, a, 1e-10)
    close(second, b, 1e-10)
    pair = cga3.point_pair_from_points(a, b)
    close(cga3.point_pair_centre(pair), (a + b) / 2, 1e-10)
    close(cga3.point_pair_radius_squared(pair), dot(a - b, a - b) / 4, 1e-10)
    line = cga3.line_from_points(a, b)
    close(line, cga3.line_from_point_direction(a, b - a), 1e-12)
    along = unit(b - a)
    close(cga3.distance_point_line(c, line), np.linalg.norm(np.cross(c - a, along), axis=-1), 1e-10)


def test_conformal_meets(rng: np.random.Generator) -> None:
    close_to = 1e-9
    one = cga3.sphere_from_centre([0, 0, 0], 2.0)
    two = cga3.sphere_from_centre([2, 0, 0], 2.0)
    circle = cga3.meet_spheres(one, two)
    close(cga3.circle_centre(circle), [1, 0, 0], close_to)
    close(cga3.circle_radius_squared(circle), 3, close_to)
    level = cga3.plane_from_points([0, 0, 1], [1, 0, 1], [0, 1, 1])
    cut = cga3.meet_sphere_plane(one, level)
    close(cga3.circle_centre(cut), [0, 0, 1], close_to)
    close(cga3.circle_radius_squared(cut), 3, close_to)
    missed = cga3.meet_sphere_plane(cga3.sphere_from_centre([0, 0, 4], 1.0), level)
    close(cga3.circle_radius_squared(missed), 1 - 9, close_to)
    three = cga3.sphere_from_centre([0, 2, 0], 2.0)
    expected = {(1.0, 1.0, round(z, 6)) for z in (-np.sqrt(2), np.sqrt(2))}
    for pair in (cga3.meet_three_spheres(one, two, three), cga3.meet_circle_sphere(circle, three)):
        assert {tuple(np.round(p, 6) + 0.0) for p in cga3.point_pair_points(pair)} == expected
    line = cga3.line_from_points([-5, 0, 1], [5, 0, 1])
    hits = cga3.point_pair_points(cga3.meet_line_sphere(line, one))
    assert {tuple(np.round(p, 6) + 0.0) for p in hits} == {(-round(np.sqrt(3), 6), 0, 1), (round(np.sqrt(3), 6), 0, 1)}
    pair = cga3.meet_circle_plane(circle, level)
    assert {tuple(np.round(p, 6) + 0.0) for p in cga3.point_pair_points(pair)} == {
        (1, -round(np.sqrt(2), 6), 1),
        (1, round(np.sqrt(2), 6), 1),
    }
    a, b, c, p, q = rng.normal(size=(5, N, 3))
    n = np.cross(b - a, c - a)
    hit = p + (dot(a - p, n) / dot(q - p, n))[:, None] * (q - p)
    close(cga3.meet_line_plane(cga3.line_from_points(p, q), cga3.plane_from_points(a, b, c)), hit, 1e-8)
    common = cga3.meet_planes(cga3.plane_from_points(a, b, c), cga3.plane_from_points(a, b, p))
    close(cga3.distance_point_line(a, common), np.zeros(N), 1e-6)
    close(cga3.distance_point_line(b, common), np.zeros(N), 1e-6)


@pytest.mark.slow
def test_conformal_versors(rng: np.random.Generator) -> None:
    matrices = poses(rng)
    x, y, z, w = rng.normal(size=(4, len(matrices), 3))
    rotors = vga3.rotor_from_matrix(matrices[:, :3, :3])
    t = matrices[:, :3, 3]
    motors = cga3.motor_from_rotor_translation(rotors, t)
    close(motors, pga3.motor_from_matrix(matrices), 1e-14)
    close(cga3.motor_to_matrix(-motors), matrices, 1e-13)
    close(cga3.motor_to_matrix(cga3.motor_product(motors, motors[::-1])), matrices @ matrices[::-1], 1e-11)
    close(cga3.motor_to_matrix(cga3.motor_inverse(motors)), np.linalg.inv(matrices), 1e-11)
    moved = [apply(matrices, p) for p in (x, y, z, w)]
    close(cga3.move_point(motors, x), moved[0])
    close(cga3.rotate_point(rotors, x), turn(matrices, x), 1e-13)
    close(cga3.translate_point(cga3.translator_from_vector(t), x), x + t, 1e-13)
    for make, move, count in (
        (cga3.point_pair_from_points, cga3.move_point_pair, 2),
        (cga3.line_from_points, cga3.move_line, 2),
        (cga3.circle_from_points, cga3.move_circle, 3),
        (cga3.plane_from_points, cga3.move_plane, 3),
        (cga3.sphere_from_points, cga3.move_sphere, 4),
    ):
        close(move(motors, make(*(x, y, z, w)[:count])), make(*moved[:count]), 1e-8)
    dual, sphere = cga3.dual_sphere_from_centre(x, 0.7), cga3.dual_sphere_from_centre(moved[0], 0.7)
    close(cga3.move_vector(motors, dual), sphere, 1e-10)
    for scale in (0.25, 1.0, 3.0):
        dilator = cga3.dilator_from_scale(scale)
        close(cga3.dilate_point(dilator, x), scale * x, 1e-13)
        even = np.zeros(16)
        blades = blades_of("cga3", "even_reverse")
        even[[blades.index("1"), blades.index("e0inf")]] = dilator
        scaled = cga3.transform_vector(even, cga3.embed_point(x))
        close(cga3.extract_point(scaled), scale * x, 1e-13)


# Spacetime


def test_lorentz_rotors_are_lorentz_matrices(rng: np.random.Generator) -> None:
    metric = np.diag([1.0, -1, -1, -1])
    direction, rapidity = rng.normal(size=(N, 3)), rng.normal(size=N)
    boosts = sta.boost_from_rapidity(direction, rapidity)
    n = unit(direction)
    expected = np.concatenate([np.cosh(rapidity)[:, None], np.sinh(rapidity)[:, None] * n], -1)
    close(sta.transform_vector(boosts, [1, 0, 0, 0]), expected, 1e-12)
    velocity = np.tanh(rapidity)[:, None] * n
    close(sta.boost_from_velocity(velocity), boosts, 1e-11)
    close(sta.proper_velocity(velocity), expected, 1e-11)
    close(sta.boost_from_velocity([0, 0, 0]), [1, 0, 0, 0, 0, 0, 0, 0], 0)
    vectors = rng.normal(size=(N, 3))
    turns = sta.rotor_from_axis_angle(vectors, np.linalg.norm(vectors, axis=-1))
    matrix = np.tile(np.eye(4), (N, 1, 1))
    matrix[:, 1:, 1:] = Rotation.from_rotvec(vectors).as_matrix()
    close(sta.rotor_to_matrix(turns), matrix, 1e-14)
    rotors = sta.rotor_product(boosts, turns)
    lorentz = sta.rotor_to_matrix(rotors)
    close(lorentz, sta.rotor_to_matrix(boosts) @ matrix, 1e-11)
    close(np.swapaxes(lorentz, 1, 2) @ metric @ lorentz, np.tile(metric, (N, 1, 1)), 1e-10)
    close(sta.rotor_to_matrix(sta.rotor_inverse(rotors)), np.linalg.inv(lorentz), 1e-9)
    v = rng.normal(size=(N, 4))
    close(sta.transform_vector(-rotors, v), np.einsum("nij,nj->ni", lorentz, v), 1e-11)
    close(sta.interval(v), np.einsum("ni,ij,nj->n", v, metric, v), 1e-13)
    other = sta.proper_velocity(0.5 * unit(vectors))
    close(sta.transform_vector(sta.boost_between_velocities(expected, other), expected), other, 1e-10)
    even = np.zeros((N, 8))
    even[:, 0], even[:, 7] = rng.uniform(0.5, 2, N), rng.normal(size=N) * 0.2
    close(sta.normalize_rotor(sta.even_product(rotors, even)), rotors, 1e-11)


def test_electromagnetic_fields(rng: np.random.Generator) -> None:
    e, b = rng.normal(size=(2, N, 3))
    f = sta.field_from_electric_magnetic(e, b)
    for found, expected in zip(sta.field_to_electric_magnetic(f), (e, b), strict=True):
        close(found, expected, 0)
    first, second = sta.field_invariants(f)
    close(first, dot(e, e) - dot(b, b), 1e-13)
    close(second, dot(e, b), 1e-13)
    speed = 0.6
    gamma = 1 / np.sqrt(1 - speed**2)
    frame = sta.rotor_inverse(sta.boost_from_velocity([speed, 0, 0]))
    e_seen, b_seen = sta.field_to_electric_magnetic(sta.transform_bivector(frame, f))
    v = np.array([speed, 0, 0])
    for seen, along, across in ((e_seen, e, e + np.cross(v, b)), (b_seen, b, b - np.cross(v, e))):
        close(seen[:, 0], along[:, 0], 1e-12)
        close(seen[:, 1:], gamma * across[:, 1:], 1e-12)
    velocity = 0.5 * unit(rng.normal(size=(N, 3)))
    force = sta.lorentz_force(f, sta.proper_velocity(velocity))
    gamma = 1 / np.sqrt(1 - 0.25)
    close(force[:, 1:], gamma * (e + np.cross(velocity, b)), 1e-12)
    close(force[:, 0], gamma * dot(e, velocity), 1e-12)
    flux = sta.field_stress_energy(f, [1, 0, 0, 0])
    close(flux[:, 0], (dot(e, e) + dot(b, b)) / 2, 1e-12)
    close(flux[:, 1:], np.cross(e, b), 1e-12)
    psi = rng.normal(size=(N, 8))
    current, spin = sta.dirac_current(psi), sta.dirac_spin(psi)
    assert np.all(sta.interval(current) >= -1e-10) and np.all(current[:, 0] > 0)
    close(sta.dot_product(current, spin), np.zeros(N), 1e-10)
    time, place = sta.spacetime_split(current)
    close(np.concatenate([time[:, None], place], -1), current, 0)


# Projective space


def cameras(rng: np.random.Generator, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Calibrated cameras, their matrices of intrinsics, and centres."""
    intrinsics = np.tile(np.array([[800.0, 0, 320], [0, 820, 240], [0, 0, 1]]), (n, 1, 1))
    rotation = Rotation.from_rotvec(0.2 * rng.normal(size=(n, 3))).as_matrix()
    centre = rng.normal(size=(n, 3))
    return intrinsics @ np.concatenate([rotation, -(rotation @ centre[..., None])], -1), intrinsics, centre


def test_two_views(rng: np.random.Generator) -> None:
    (first, _, c1), (second, _, c2) = cameras(rng, N), cameras(rng, N)
    places = rng.normal(size=(N, 3)) + AHEAD
    homogeneous = np.concatenate([places, np.ones((N, 1))], -1)
    images = []
    for camera in (first, second):
        raw = np.einsum("nij,nj->ni", camera, homogeneous)
        close(projective3.project_homogeneous_point(camera, homogeneous), raw, 1e-9)
        images.append(raw[:, :2] / raw[:, 2:])
        close(projective3.project_point(camera, places), images[-1], 1e-9)
    fundamental = projective3.fundamental_matrix_from_cameras(first, second)
    epipole = projective3.epipole_from_cameras(first, second)
    seen = np.einsum("nij,nj->ni", second, np.concatenate([c1, np.ones((N, 1))], -1))
    same_up_to_sign(unit(epipole), unit(seen), 1e-9)
    x, y, z = np.moveaxis(seen, -1, 0)
    o = np.zeros(N)
    cross = np.moveaxis(np.array([[o, -z, y], [z, o, -x], [-y, x, o]]), -1, 0)
    expected = (cross @ second @ np.linalg.pinv(first)).reshape(N, 9)
    same_up_to_sign(unit(fundamental.reshape(N, 9)), unit(expected), 1e-9)
    scale = np.linalg.norm(fundamental, axis=(1, 2))[:, None, None]
    close(np.linalg.det(fundamental / scale), np.zeros(N), 1e-12)
    line = projective3.epipolar_line(fundamental, images[0])
    close(projective3.distance_to_epipolar_line(fundamental, *images), np.zeros(N), 1e-6)
    off = images[1] + 3 * unit(line[:, :2])
    close(projective3.distance_to_epipolar_line(fundamental, images[0], off), np.full(N, 3.0), 1e-6)
    nearest = np.abs(projective3.sampson_distance(fundamental, images[0], off))
    assert np.all(nearest < 3) and np.all(nearest > 0.3)
    found = projective3.triangulate(first, second, *images)
    close(found[:, :3] / found[:, 3:], places, 1e-5)
    guess = projective3.triangulate(first, second, images[0], off)
    close(projective3.project_point(second, guess[:, :3] / guess[:, 3:]), images[1], 1e-4)
    for camera, centre in ((first, c1), (second, c2)):
        at = projective3.camera_centre(camera)
        close(at[:, :3] / at[:, 3:], centre, 1e-9)


def test_brackets_joins_and_sights(rng: np.random.Generator) -> None:
    a, b, c, d = rng.normal(size=(4, N, 4))
    close(projective3.bracket(a, b, c, d), np.linalg.det(np.stack([a, b, c, d], 1)), 1e-13)
    plane = projective3.join_three_points(a, b, c)
    for point in (a, b, c):
        close(dot(plane, point), np.zeros(N), 1e-13)
    close(dot(plane, d) ** 2, np.linalg.det(np.stack([a, b, c, d], 1)) ** 2, 1e-11)
    line = projective3.join_points(a, b)
    for k, (i, j) in enumerate(((0, 1), (0, 2), (1, 2), (0, 3), (1, 3), (2, 3))):
        close(line[:, k], a[:, i] * b[:, j] - a[:, j] * b[:, i], 1e-14)
    camera, _, _ = cameras(rng, N)
    places = rng.normal(size=(N, 3)) + AHEAD
    pixel = projective3.project_point(camera, places)
    sight = projective3.back_project_pixel(camera, pixel)
    p, q = camera[:, 0] - pixel[:, :1] * camera[:, 2], camera[:, 1] - pixel[:, 1:] * camera[:, 2]
    close(sight, projective3.join_points(p, q), 1e-6)
