"""The kernels that are measured, their arguments, and the calls of other libraries that give the same results.

A peer receives its arguments in the form that suits it best, such as matrices or objects of scipy. They are prepared
before the time is measured. The results of peer and kernel are compared before the peer is timed.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from generated import cga3, pga3, quaternion, vga3

Array = np.ndarray
Lead = tuple[int, ...]


def _same(result: Any) -> Array:
    return np.asarray(result)


@dataclass(frozen=True, slots=True)
class Peer:
    """A call of another library that gives the same result.

    Attributes
    ----------
    library : str
        The package.
    text : str
        A description of the computation, for the report.
    prepare : callable
        Returns the function to time, given the arguments of the kernel.
    read, expect : callable
        Convert the result of the peer, and that of the kernel, to a form in which they are equal.
    largest : int
        The maximum number of elements; 1 if the peer only accepts single elements.
    """

    library: str
    text: str
    prepare: Callable[..., Callable[[], Any]]
    read: Callable[[Any], Array] = _same
    expect: Callable[[Array], Array] = _same
    largest: int = 10**9


@dataclass(frozen=True, slots=True)
class Case:
    """One kernel with one kind of arguments.

    Attributes
    ----------
    module, kernel : str
    arguments : callable
        Returns the arguments in float64, given a random generator and the leading shape.
    peers : tuple of Peer
    formula : str
        The key in `libraries.FORMULAS`; empty if the libraries of geometric algebra have no such formula.
    note : str
        A property of the arguments, for the title.
    """

    module: str
    kernel: str
    arguments: Callable[[np.random.Generator, Lead], tuple[Array, ...]]
    peers: tuple[Peer, ...] = ()
    formula: str = ""
    note: str = field(default="")

    @property
    def title(self) -> str:
        """Return module, kernel and note."""
        return f"{self.module}.{self.kernel}" + (f", {self.note}" if self.note else "")


# Arguments.


def _normal(*sizes: int) -> Callable[[np.random.Generator, Lead], tuple[Array, ...]]:
    return lambda rng, lead: tuple(rng.normal(size=(*lead, size)) for size in sizes)


def _motors(rng: np.random.Generator, lead: Lead) -> Array:
    return pga3.motor_exponential(0.4 * rng.normal(size=(*lead, 6)))


def _conformal_motors(rng: np.random.Generator, lead: Lead) -> Array:
    rotors = vga3.rotor_from_rotation_vector(rng.normal(size=(*lead, 3)))
    return cga3.motor_from_rotor_translation(rotors, rng.normal(size=(*lead, 3)))


def _quaternions(rng: np.random.Generator, lead: Lead) -> Array:
    return quaternion.normalize(rng.normal(size=(*lead, 4)))


def _with_motors(size: int) -> Callable[[np.random.Generator, Lead], tuple[Array, ...]]:
    return lambda rng, lead: (_motors(rng, lead), rng.normal(size=(*lead, size)))


# Peers.


def _apply(matrix: Array, x: Array) -> Array:
    return (matrix @ x[..., None])[..., 0]


def _map(kernel: Any, size: int) -> Callable[..., Callable[[], Array]]:
    """Apply the linear map of a kernel's last argument as a matrix, by matmul."""

    def prepare(versor: Array, x: Array) -> Callable[[], Array]:
        columns = kernel(versor[..., None, :], np.eye(size))
        matrix = np.ascontiguousarray(np.swapaxes(columns, -1, -2))
        return lambda: _apply(matrix, x)

    return prepare


def _move_points(m: Array, p: Array) -> Callable[[], Array]:
    matrix = pga3.motor_to_matrix(m)
    turn, shift = np.ascontiguousarray(matrix[..., :3, :3]), np.ascontiguousarray(matrix[..., :3, 3])
    if m.ndim == 1:
        return lambda: p @ turn.T + shift
    return lambda: _apply(turn, p) + shift


def _rigid(m: Array) -> RigidTransform:
    return RigidTransform.from_matrix(pga3.motor_to_matrix(m))


def _scipy_points(m: Array, p: Array) -> Callable[[], Array]:
    transform = _rigid(m)
    return lambda: transform.apply(p)


def _matrices(a: Array, b: Array) -> Callable[[], Array]:
    a, b = pga3.motor_to_matrix(a), pga3.motor_to_matrix(b)
    return lambda: a @ b


def _scipy_motors(a: Array, b: Array) -> Callable[[], RigidTransform]:
    left, right = _rigid(a), _rigid(b)
    return lambda: left * right


def _join(a: Array, b: Array) -> Callable[[], Array]:
    return lambda: np.concatenate([b - a, np.cross(a, b)], -1)


def _pluecker(line: Array) -> Array:
    """Return the directions and moments of lines of `pga3`."""
    e12, e13, e23, e01, e02, e03 = np.moveaxis(line, -1, 0)
    return np.stack([e23, -e13, e12, e01, e02, e03], -1)


def _three_planes(p: Array, q: Array, r: Array) -> Callable[[], Array]:
    def solve() -> Array:
        rows = np.stack([p, q, r], -2)
        return np.linalg.solve(rows[..., :3], -rows[..., 3:])[..., 0]

    return solve


def _scipy_exponential(b: Array) -> Callable[[], RigidTransform]:
    coordinates = _rigid(pga3.motor_exponential(b)).as_exp_coords()
    return lambda: RigidTransform.from_exp_coords(coordinates)


def _scipy_logarithm(m: Array) -> Callable[[], Array]:
    transform = _rigid(m)
    return transform.as_exp_coords


def _sphere(a: Array, b: Array, c: Array, d: Array) -> Callable[[], Array]:
    def centre() -> Array:
        rows = np.stack([b, c, d], -2) - a[..., None, :]
        return a + np.linalg.solve(rows, 0.5 * np.sum(rows * rows, -1, keepdims=True))[..., 0]

    return centre


def _centre(sphere: Array) -> Array:
    weight, _, z, y, x = np.moveaxis(sphere, -1, 0)
    return np.stack([-x, y, -z], -1) / weight[..., None]


def _table(a: Array, b: Array) -> Callable[[], Array]:
    table = cga3.geometric_product(np.eye(32)[:, None, :], np.eye(32))
    flat = table.reshape(32, 1024)
    return lambda: (b[..., None, :] @ (a @ flat).reshape(*a.shape, 32))[..., 0, :]


def _parts(q: Array) -> tuple[Array, Array]:
    return np.ascontiguousarray(q[..., :1]), np.ascontiguousarray(q[..., 1:])


def _rotate(r: Array, v: Array) -> Callable[[], Array]:
    w, u = _parts(vga3.rotor_to_quaternion(r))

    def rotate() -> Array:
        t = 2 * np.cross(u, v)
        return v + w * t + np.cross(u, t)

    return rotate


def _scipy_rotate(r: Array, v: Array) -> Callable[[], Array]:
    rotation = Rotation.from_quat(vga3.rotor_to_quaternion(r), scalar_first=True)
    return lambda: rotation.apply(v)


def _multiply(p: Array, q: Array) -> Callable[[], Array]:
    def multiply() -> Array:
        (a, b, c, d), (w, x, y, z) = np.moveaxis(p, -1, 0), np.moveaxis(q, -1, 0)
        return np.stack(
            [
                a * w - b * x - c * y - d * z,
                a * x + b * w + c * z - d * y,
                a * y - b * z + c * w + d * x,
                a * z + b * y - c * x + d * w,
            ],
            -1,
        )

    return multiply


def _scipy_multiply(p: Array, q: Array) -> Callable[[], Rotation]:
    left, right = Rotation.from_quat(p, scalar_first=True), Rotation.from_quat(q, scalar_first=True)
    return lambda: left * right


def _slerp(p: Array, q: Array, t: Array) -> Callable[[], Array]:
    t = np.asarray(t)

    def slerp() -> Array:
        cosine = np.sum(p * q, -1)
        angle = np.arccos(np.minimum(np.abs(cosine), 1.0))
        a, b = np.sin((1 - t) * angle), np.copysign(np.sin(t * angle), cosine)
        return (a[..., None] * p + b[..., None] * q) / np.sin(angle)[..., None]

    return slerp


def _scipy_matrix(matrix: Array) -> Callable[[], Rotation]:
    return lambda: Rotation.from_matrix(matrix)


def _as_matrix(rotation: Any) -> Array:
    return rotation.as_matrix()


# pytransform3d, numpy-quaternion and pin are imported on demand, because they are optional.


def _dual_quaternions(m: Array) -> Array:
    trajectories = importlib.import_module("pytransform3d.trajectories")
    return np.asarray(trajectories.dual_quaternions_from_transforms(pga3.motor_to_matrix(m)))


def _dual_matrices(dual_quaternions: Any) -> Array:
    trajectories = importlib.import_module("pytransform3d.trajectories")
    return np.asarray(trajectories.transforms_from_dual_quaternions(dual_quaternions))


def _dual_points(m: Array, p: Array) -> Callable[[], Array]:
    move, motion = importlib.import_module("pytransform3d.trajectories").batch_dq_prod_vector, _dual_quaternions(m)
    return lambda: move(motion, p)


def _dual_product(a: Array, b: Array) -> Callable[[], Array]:
    multiply = importlib.import_module("pytransform3d.trajectories").batch_concatenate_dual_quaternions
    left, right = _dual_quaternions(a), _dual_quaternions(b)
    return lambda: multiply(left, right)


def _dual_exponential(b: Array) -> Callable[[], Array]:
    trajectories = importlib.import_module("pytransform3d.trajectories")
    coordinates = _rigid(pga3.motor_exponential(b)).as_exp_coords()
    return lambda: trajectories.transforms_from_exponential_coordinates(coordinates)


def _dual_logarithm(m: Array) -> Callable[[], Array]:
    trajectories = importlib.import_module("pytransform3d.trajectories")
    matrix = pga3.motor_to_matrix(m)
    return lambda: trajectories.exponential_coordinates_from_transforms(matrix)


def _exponential_coordinates(out: Array) -> Array:
    return np.asarray(_rigid(pga3.motor_exponential(out)).as_exp_coords())


def _batch_quaternions(p: Array, q: Array) -> Callable[[], Array]:
    multiply = importlib.import_module("pytransform3d.batch_rotations").batch_concatenate_quaternions
    return lambda: multiply(p, q)


def _quaternion_array(p: Array, q: Array) -> Callable[[], Any]:
    as_quat_array = importlib.import_module("quaternion").as_quat_array
    left, right = as_quat_array(p), as_quat_array(q)
    return lambda: left * right


def _quaternion_coefficients(q: Any) -> Array:
    return np.asarray(importlib.import_module("quaternion").as_float_array(q))


def _pin(m: Array) -> Any:
    return importlib.import_module("pinocchio").SE3(pga3.motor_to_matrix(m))


def _pin_points(m: Array, p: Array) -> Callable[[], Array]:
    motion = _pin(m)
    return lambda: motion.act(p)


def _pin_product(a: Array, b: Array) -> Callable[[], Any]:
    left, right = _pin(a), _pin(b)
    return lambda: left * right


def _pin_exponential(b: Array) -> Callable[[], Any]:
    pin = importlib.import_module("pinocchio")
    twist = pin.log6(_pin(pga3.motor_exponential(b)))
    return lambda: pin.exp6(twist)


def _pin_logarithm(m: Array) -> Callable[[], Any]:
    log6, motion = importlib.import_module("pinocchio").log6, _pin(m)
    return lambda: log6(motion)


def _pin_matrix(motion: Any) -> Array:
    return np.asarray(motion.homogeneous)


_POINTS = (
    Peer("numpy", "matmul with 3 × 3 matrices, and a sum", _move_points),
    Peer("scipy", "`RigidTransform.apply`", _scipy_points),
    Peer("pin", "`SE3.act`", _pin_points, largest=1),
)
_DUAL_POINTS = Peer("pytransform3d", "`batch_dq_prod_vector`", _dual_points, largest=100_000)
"""It requires as many motors as points."""

OPTIONAL = ("pytransform3d", "numpy-quaternion", "pin")
"""Libraries of peers that are omitted if they are not installed."""

CASES: tuple[Case, ...] = (
    Case(
        "pga3",
        "move_point",
        lambda rng, lead: (_motors(rng, ()), rng.normal(size=(*lead, 3))),
        _POINTS,
        "sandwich",
        "one motor, many points",
    ),
    Case("pga3", "move_point", _with_motors(3), (*_POINTS, _DUAL_POINTS), "sandwich"),
    Case(
        "pga3",
        "motor_product",
        lambda rng, lead: (_motors(rng, lead), _motors(rng, lead)),
        (
            Peer("numpy", "matmul of 4 × 4 matrices", _matrices, expect=pga3.motor_to_matrix),
            Peer("scipy", "`RigidTransform * RigidTransform`", _scipy_motors, _as_matrix, pga3.motor_to_matrix),
            Peer(
                "pytransform3d",
                "`batch_concatenate_dual_quaternions`",
                _dual_product,
                _dual_matrices,
                pga3.motor_to_matrix,
                100_000,
            ),
            Peer("pin", "`SE3 * SE3`", _pin_product, _pin_matrix, pga3.motor_to_matrix, 1),
        ),
        "product",
    ),
    Case(
        "pga3",
        "move_line",
        _with_motors(6),
        (Peer("numpy", "matmul with 6 × 6 matrices", _map(pga3.move_line, 6)),),
        "sandwich",
    ),
    Case(
        "pga3",
        "move_plane",
        _with_motors(4),
        (Peer("numpy", "matmul with 4 × 4 matrices", _map(pga3.move_plane, 4)),),
        "sandwich",
    ),
    Case(
        "pga3",
        "join_points",
        _normal(3, 3),
        (Peer("numpy", "`concatenate([b - a, cross(a, b)])`", _join, expect=_pluecker),),
    ),
    Case(
        "pga3",
        "meet_three_planes",
        _normal(4, 4, 4),
        (Peer("numpy", "`linalg.solve`", _three_planes, expect=lambda out: out[..., 1:] / out[..., :1]),),
        "outer",
    ),
    Case(
        "pga3",
        "motor_exponential",
        lambda rng, lead: (0.4 * rng.normal(size=(*lead, 6)),),
        (
            Peer("scipy", "`RigidTransform.from_exp_coords`", _scipy_exponential, _as_matrix, pga3.motor_to_matrix),
            Peer(
                "pytransform3d",
                "`transforms_from_exponential_coordinates`",
                _dual_exponential,
                expect=pga3.motor_to_matrix,
                largest=100_000,
            ),
            Peer("pin", "`exp6`", _pin_exponential, _pin_matrix, pga3.motor_to_matrix, 1),
        ),
    ),
    Case(
        "pga3",
        "motor_logarithm",
        lambda rng, lead: (_motors(rng, lead),),
        (
            Peer("scipy", "`RigidTransform.as_exp_coords`", _scipy_logarithm, expect=_exponential_coordinates),
            Peer(
                "pytransform3d",
                "`exponential_coordinates_from_transforms`",
                _dual_logarithm,
                expect=_exponential_coordinates,
                largest=100_000,
            ),
            Peer(
                "pin",
                "`log6`",
                _pin_logarithm,
                lambda twist: np.concatenate([twist.angular, twist.linear]),
                _exponential_coordinates,
                1,
            ),
        ),
    ),
    Case(
        "cga3",
        "sphere_from_points",
        _normal(3, 3, 3, 3),
        (Peer("numpy", "`linalg.solve` for the centre only", _sphere, expect=_centre),),
    ),
    Case(
        "cga3",
        "move_sphere",
        lambda rng, lead: (_conformal_motors(rng, lead), rng.normal(size=(*lead, 5))),
        (Peer("numpy", "matmul with 5 × 5 matrices", _map(cga3.move_sphere, 5)),),
        "sandwich",
    ),
    Case(
        "cga3",
        "geometric_product",
        _normal(32, 32),
        (Peer("numpy", "matmul with the table of the product", _table, largest=100_000),),
        "product",
    ),
    Case(
        "vga3",
        "rotate_vector",
        lambda rng, lead: (vga3.rotor_from_quaternion(_quaternions(rng, lead)), rng.normal(size=(*lead, 3))),
        (
            Peer("numpy", "`t = 2 cross(u, v); v + w t + cross(u, t)`", _rotate),
            Peer("scipy", "`Rotation.apply`", _scipy_rotate),
        ),
        "sandwich",
    ),
    Case("vga3", "cross_product", _normal(3, 3), (Peer("numpy", "`cross`", lambda a, b: lambda: np.cross(a, b)),)),
    Case(
        "quaternion",
        "product",
        lambda rng, lead: (_quaternions(rng, lead), _quaternions(rng, lead)),
        (
            Peer("numpy", "sixteen products, `stack`", _multiply),
            Peer("scipy", "`Rotation * Rotation`", _scipy_multiply, _as_matrix, quaternion.to_matrix),
            Peer("numpy-quaternion", "`p * q`", _quaternion_array, _quaternion_coefficients),
            Peer("pytransform3d", "`batch_concatenate_quaternions`", _batch_quaternions),
        ),
    ),
    Case(
        "quaternion",
        "slerp",
        lambda rng, lead: (_quaternions(rng, lead), _quaternions(rng, lead), rng.uniform(size=lead)),
        (Peer("numpy", "the formula with arccos and sin", _slerp, quaternion.to_matrix, quaternion.to_matrix),),
    ),
    Case(
        "quaternion",
        "from_matrix",
        lambda rng, lead: (quaternion.to_matrix(_quaternions(rng, lead)),),
        (Peer("scipy", "`Rotation.from_matrix`", _scipy_matrix, _as_matrix, quaternion.to_matrix),),
    ),
)
"""The cases, in the order of the report."""
