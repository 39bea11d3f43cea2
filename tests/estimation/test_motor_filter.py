"""Motor filters: derivatives, consistency, convergence from afar, comparison with batches, bad input."""

from __future__ import annotations

import numpy as np
import pytest
from line_scenes import direction_and_moment, disturbed, error, far_away, lines, moved, seen
from scipy.optimize import least_squares
from scipy.stats import chi2

from algorithms.arguments import Reals
from algorithms.estimation import EstimationStatus, LinearMotorFilter, MotorFilter, filter_lines, observability
from algorithms.estimation.motor_filter import Model
from algorithms.estimation.motor_objects import POINTS
from algorithms.estimation.motor_starts import Update
from algorithms.evidence.triangles import to_triangle
from algorithms.precision import HUGE
from generated import motor_filters, pga3
from tests.support.selection import some_slow

SIGMA = (0.01, 0.02)
NEAR = np.diag([0.1**2] * 3 + [0.2**2] * 3)
WIDE = np.diag([np.pi**2] * 3 + [10.0**2] * 3)


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(5)


def motor(rng: np.random.Generator) -> Reals:
    return np.asarray(pga3.motor_exponential(rng.normal(size=6)))


def unit_error(m: Reals) -> float:
    """The largest coefficient of ``m ~m - 1``."""
    study = 2 * (m[..., 0] * m[..., 7] - m[..., 1] * m[..., 6] + m[..., 2] * m[..., 5] - m[..., 3] * m[..., 4])
    return float(max(np.abs((m[..., :4] ** 2).sum(-1) - 1).max(), np.abs(study).max()))


@pytest.mark.parametrize(
    ("name", "size", "move", "rank"),
    [("line", 6, pga3.move_line, 4), ("point", 3, pga3.move_point, 3), ("plane", 4, pga3.move_plane, 3)],
)
def test_derivatives(rng: np.random.Generator, name: str, size: int, move: object, rank: int) -> None:
    """The rows are the derivatives of the residuals of exactly moved objects, by central differences."""
    m, x = motor(rng), lines(rng, 1)[0] if name == "line" else rng.normal(size=size)
    equations = getattr(motor_filters, f"{name}_equations")
    residuals, rows = equations(m, x, move(m, x))  # type: ignore[operator]
    assert np.abs(residuals).max() < 1e-14
    h = 1e-5
    for k, unit in enumerate(np.eye(6)):
        ahead, back = (
            equations(m, x, move(pga3.motor_product(pga3.motor_exponential(-s * h / 2 * unit), m), x))[0]  # type: ignore[operator]
            for s in (1, -1)
        )
        assert np.abs((ahead - back) / (2 * h) - rows[:, k]).max() < 1e-8
    assert np.linalg.matrix_rank(rows, tol=1e-9) == rank


def test_rows_of_a_line_are_its_motion(rng: np.random.Generator) -> None:
    """The rows span the motion of the line under twists, `twist_on_line`: they vanish for the same twists."""
    m, x = motor(rng), lines(rng, 1)[0]
    rows = motor_filters.line_equations(m, x, x)[1]
    motion = np.stack([pga3.twist_on_line(unit, pga3.move_line(m, x)) for unit in np.eye(6)], 1)
    assert np.linalg.matrix_rank(np.concatenate([rows, motion]), tol=1e-9) == 4


@pytest.mark.parametrize("n_runs", some_slow([100, 1000], 1000))
def test_innovations_and_errors_have_their_covariance(rng: np.random.Generator, n_runs: int) -> None:
    """Normalised errors and innovations of all runs are in the 95 % band of their chi-square distributions."""
    n_lines, n_steps = 5, 2
    errors, innovations = np.zeros((n_runs, n_steps)), np.zeros((n_runs, n_steps))
    for k in range(n_runs):
        start = motor(rng)
        f, truth = MotorFilter(start, NEAR), disturbed(rng, start, NEAR)
        for j in range(n_steps):
            model = lines(rng, n_lines)
            assert f.update_lines(model, seen(rng, truth, model, SIGMA), SIGMA) == EstimationStatus.OK
            innovations[k, j] = f.innovation[0]
            x = error(truth, f.motor)
            errors[k, j] = x @ np.linalg.solve(f.covariance, x)
    for j in range(n_steps):
        low, high = chi2.interval(0.95, 6 * n_runs)
        assert low < errors[:, j].sum() < high
        low, high = chi2.interval(0.95, 4 * n_lines * n_runs)
        assert low < innovations[:, j].sum() < high


@pytest.mark.parametrize(("n_lines", "n_steps", "n_runs"), [(6, 2, 60), (1, 15, 15)])
def test_converges_from_afar(rng: np.random.Generator, n_lines: int, n_steps: int, n_runs: int) -> None:
    """From 180 degrees and 10 m, all runs converge, with several lines at a time or with one."""
    for _ in range(n_runs):
        start, truth = far_away(rng)
        f = MotorFilter(-start, WIDE)
        for _ in range(n_steps):
            model = lines(rng, n_lines)
            f.update_lines(model, seen(rng, truth, model, SIGMA), SIGMA)
            assert unit_error(f.motor) < 1e-12
        assert f.status == EstimationStatus.OK
        x = error(truth, f.motor)
        assert x @ np.linalg.solve(f.covariance, x) < chi2.isf(1e-7, 6)
        assert np.abs(x).max() < 0.2


@pytest.mark.slow
def test_many_runs_converge_from_afar(rng: np.random.Generator) -> None:
    """No failure of 300 runs: with 95 % confidence, fewer than one run in a hundred fails."""
    test_converges_from_afar(rng, 6, 2, 300)
    test_converges_from_afar(rng, 1, 15, 60)
    test_converges_from_afar(rng, 2, 7, 300)


def batch(start: Reals, model: Reals, measured: Reals) -> Reals:
    """The least-squares motor of all lines, by scipy, with residuals in the frames of the measured lines."""
    d, m = direction_and_moment(measured)
    d, m = d / np.linalg.norm(d, axis=1)[:, None], m / np.linalg.norm(d, axis=1)[:, None]

    def at(x: Reals) -> Reals:
        return np.asarray(pga3.motor_product(pga3.motor_exponential(-x / 2), start))

    def residuals(x: Reals) -> Reals:
        e, n = moved(at(x), model)
        own = n - np.cross(np.cross(d, m), e)
        return np.concatenate(
            [((e - d) / SIGMA[0]).ravel(), ((own - (own * e).sum(1)[:, None] * e) / SIGMA[1]).ravel()]
        )

    return at(least_squares(residuals, np.zeros(6), method="lm").x)


@pytest.mark.slow
def test_as_good_as_the_batch(rng: np.random.Generator) -> None:
    """The root mean square error of lines one after the other is at most 1.02 times that of least squares for all."""
    ours, theirs = [], []
    for _ in range(80):
        start = motor(rng)
        truth = disturbed(rng, start, NEAR)
        model = lines(rng, 30)
        measured = seen(rng, truth, model, SIGMA)
        motors, _, _ = filter_lines(start, 1e4 * NEAR, model, measured, SIGMA)
        f = MotorFilter(start, 1e4 * NEAR)
        for k in range(0, 30, 3):
            f.update_lines(model[k : k + 3], measured[k : k + 3], SIGMA)
        theirs.append(error(truth, batch(truth, model, measured)))
        ours.append(error(truth, f.motor))
        assert np.isfinite(motors).all()
    for part in (slice(0, 3), slice(3, 6)):
        ratio = np.sqrt(np.mean(np.square(ours)[:, part]) / np.mean(np.square(theirs)[:, part]))
        assert ratio < 1.02


def test_recording_is_the_same_filter(rng: np.random.Generator) -> None:
    start = motor(rng)
    truth = disturbed(rng, start, 0.01 * NEAR)
    model = lines(rng, 40)
    measured = seen(rng, truth, model, SIGMA)
    noise = np.diag([1e-5] * 6)
    motors, covariances, numbers = filter_lines(start, 0.01 * NEAR, model, measured, SIGMA, noise=noise, dt=0.1)
    f = MotorFilter(start, 0.01 * NEAR, noise=noise)
    for k in range(40):
        f.predict(0.1)
        f.update_lines(model[k : k + 1], measured[k : k + 1], SIGMA)
    assert np.abs(error(f.motor, motors[-1])).max() < 2e-4
    assert np.allclose(f.covariance, covariances[-1], rtol=0.02, atol=1e-7)
    assert numbers[:, 1].all() and 2 < numbers[:, 0].mean() < 6
    assert max(unit_error(m) for m in motors) < 1e-12


@pytest.mark.parametrize("model_of_motion", ["random walk", "constant twist"])
def test_lists_and_arrays_give_the_same(rng: np.random.Generator, model_of_motion: Model) -> None:
    """Arrays of double precision are not checked if the kernel takes them: the result is that of checked arguments."""
    start = motor(rng)
    fast, checked = (MotorFilter(start, NEAR, model=model_of_motion, noise=1e-5, gate=40.0) for _ in range(2))
    for k in range(30):
        model = lines(rng, 2 if k != 12 else 3)
        measured = seen(rng, start, model, SIGMA)
        if k == 7:
            measured[1] = np.nan
        if k == 11:
            measured[0] = pga3.move_line(motor(rng), model[0])
        sigma = 0.01 + 0.001 * (k // 10)
        for f, one, two in ((fast, model, measured), (checked, model.tolist(), measured.tolist())):
            assert f.predict(0.1 if f is fast else np.float64(0.1)) == f.status
            f.update_lines(one, two, sigma)
        assert np.array_equal(fast.motor, checked.motor) and np.array_equal(fast.covariance, checked.covariance)
        assert np.array_equal(fast.twist, checked.twist) and fast.status == checked.status
        assert fast.innovation == checked.innovation and fast.rank == checked.rank
    assert fast.n_skipped == checked.n_skipped == 2


def test_a_direction_that_is_never_observed(rng: np.random.Generator) -> None:
    """A single line leaves two directions undetermined, however often it is measured."""
    start, model = motor(rng), lines(rng, 1)
    f = MotorFilter(start, 0.01 * NEAR)
    for _ in range(50):
        assert f.update_lines(model, seen(rng, start, model, SIGMA), 0.02) == EstimationStatus.UNOBSERVED
    assert f.rank == 4
    other = lines(rng, 1)
    assert f.update_lines(other, pga3.move_line(f.motor, other), 0.02) == EstimationStatus.OK and f.rank == 6
    with pytest.raises(ValueError, match=r"measured: shape \(3, 1, 6\)"):
        f.update_lines(np.stack([model] * 3), np.stack([model] * 3), 0.02)


def test_covariance_that_is_not_finite(rng: np.random.Generator) -> None:
    """After an infinite uncertainty of the position, updates are rejected and leave the motor as it is."""
    start, model = motor(rng), lines(rng, 3)
    f = MotorFilter(start, 0.01 * NEAR, noise=[0, 0, 0, 1e10, 1e10, 1e10])
    f.update_lines(model, seen(rng, start, model, SIGMA), 0.02)
    before = f.motor
    with np.errstate(over="ignore"):
        f.predict(1e300)
    assert f.update_lines(model, seen(rng, start, model, SIGMA), 0.02) == EstimationStatus.REJECTED
    assert np.array_equal(f.motor, before)


def test_long_recording_remains_a_unit_motor(rng: np.random.Generator) -> None:
    start = motor(rng)
    model = lines(rng, 20000)
    motors, _, _ = filter_lines(start, NEAR, model, seen(rng, start, model, SIGMA), SIGMA, noise=1e-6)
    assert unit_error(motors) < 1e-12 and np.abs(error(start, motors[-1])).max() < 0.05


def test_points_and_planes(rng: np.random.Generator) -> None:
    squares = {"points": [], "planes": []}  # type: dict[str, list[float]]
    for _ in range(80):
        start = motor(rng)
        truth = disturbed(rng, start, NEAR)
        f = MotorFilter(start, NEAR)
        points = rng.normal(size=(5, 3))
        f.update_points(points, pga3.move_point(truth, points) + 0.02 * rng.normal(size=(5, 3)), 0.02)
        x = error(truth, f.motor)
        squares["points"].append(float(x @ np.linalg.solve(f.covariance, x)))
        f = MotorFilter(start, NEAR)
        normals = rng.normal(size=(5, 3))
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        planes = np.concatenate([normals, rng.normal(size=(5, 1))], 1)
        exact = pga3.move_plane(truth, planes)
        n = exact[:, :3] + 0.01 * rng.normal(size=(5, 3))
        n /= np.linalg.norm(n, axis=1)[:, None]
        offset = exact[:, 3] * (n * exact[:, :3]).sum(1) + 0.02 * rng.normal(size=5)
        f.update_planes(planes, np.concatenate([n, offset[:, None]], 1), SIGMA)
        assert f.status == EstimationStatus.OK
        x = error(truth, f.motor)
        squares["planes"].append(float(x @ np.linalg.solve(f.covariance, x)))
    for values in squares.values():
        low, high = chi2.interval(0.99, 6 * len(values))
        assert low < sum(values) < high


def test_observability(rng: np.random.Generator) -> None:
    m, model = motor(rng), lines(rng, 2)
    assert observability(m, lines=model[:1]).rank == 4
    assert observability(m, lines=model).rank == 6
    parallel = pga3.join_points(np.array([[0, 0, 0], [1.0, 2, 0]]), np.array([[0, 0, 1], [1.0, 2, 1]]))
    found = observability(m, lines=parallel)
    assert found.rank == 5
    # What remains is the translation along the lines.
    assert np.abs(found.undetermined[0, :3]).max() < 1e-7
    along = direction_and_moment(pga3.move_line(m, parallel[0]))[0]
    assert abs(abs(found.undetermined[0, 3:] @ along) - 1) < 1e-7
    assert observability(m, points=rng.normal(size=(2, 3))).rank == 5
    assert observability(m, planes=np.eye(4)[:3]).rank == 6


def test_single_and_parallel_lines_have_a_status(rng: np.random.Generator) -> None:
    start = motor(rng)
    f = MotorFilter(start, NEAR)
    model = lines(rng, 2)
    assert f.update_lines(model[:1], seen(rng, start, model[:1], SIGMA), SIGMA) == EstimationStatus.UNOBSERVED
    assert f.rank == 4
    assert f.update_lines(model, seen(rng, start, model, SIGMA), SIGMA) == EstimationStatus.OK
    f = MotorFilter(start, NEAR)
    parallel = pga3.join_points(np.array([[0, 0, 0], [1.0, 2, 0]]), np.array([[0, 0, 1], [1.0, 2, 1]]))
    assert f.update_lines(parallel, pga3.move_line(start, parallel), SIGMA) == EstimationStatus.UNOBSERVED
    assert f.rank == 5 and np.isfinite(f.motor).all()


def test_sign_of_the_motor_does_not_matter(rng: np.random.Generator) -> None:
    start, model = motor(rng), lines(rng, 4)
    measured = seen(rng, start, model, SIGMA)
    found = []
    for sign in (1, -1):
        f = MotorFilter(sign * start, NEAR)
        f.update_lines(model, measured, SIGMA)
        found.append(f.motor * np.sign(f.motor[0]))
    assert np.abs(found[0] - found[1]).max() < 1e-14


def test_units_and_norms(rng: np.random.Generator) -> None:
    """Lines of any norm give the same estimate, and lengths in millimetres one in millimetres."""
    start, model = motor(rng), lines(rng, 4)
    measured = seen(rng, start, model, SIGMA)
    f, g = MotorFilter(start, NEAR), MotorFilter(start, NEAR)
    f.update_lines(model, measured, SIGMA)
    g.update_lines(3 * model, measured * 7, SIGMA)
    assert np.abs(f.motor - g.motor).max() < 1e-12
    scale = np.array([1, 1, 1, 1e3, 1e3, 1e3])
    long = np.array([1, 1, 1, 1, 1e3, 1e3, 1e3, 1e3])
    h = MotorFilter(start * long, NEAR * np.outer(scale, scale))
    h.update_lines(model * scale, measured * scale, (SIGMA[0], 1e3 * SIGMA[1]))
    assert np.abs(h.motor / long - f.motor).max() < 1e-9


def test_bad_input_leaves_a_finite_state(rng: np.random.Generator) -> None:
    start, model = motor(rng), lines(rng, 4)
    measured = seen(rng, start, model, SIGMA)
    f = MotorFilter(start, NEAR, gate=60.0)
    assert f.update_lines(model, np.full((4, 6), np.nan), SIGMA) == EstimationStatus.SKIPPED
    assert f.update_lines(model[:0], model[:0], SIGMA) == EstimationStatus.SKIPPED
    assert f.n_skipped == 4
    measured[1, 3] = np.nan
    assert f.update_lines(model, measured, SIGMA) == EstimationStatus.OK
    assert f.n_skipped == 5 and f.innovation[1] == 12
    before = f.motor
    wrong = pga3.move_line(motor(rng), model)
    assert f.update_lines(model, wrong, SIGMA) == EstimationStatus.REJECTED
    assert np.array_equal(before, f.motor) and f.n_skipped == 9
    for dt in (-0.1, np.nan):
        assert f.predict(dt) == EstimationStatus.BAD_TIME
    assert f.predict(10.0) == EstimationStatus.OK and np.isfinite(f.covariance).all()
    indefinite = MotorFilter(start, np.diag([1.0, 1, 1, 1, 1, -1]))
    assert indefinite.status == EstimationStatus.NOT_DEFINITE
    assert np.linalg.eigvalsh(indefinite.covariance)[0] > 0


def test_missing_objects_far_away(rng: np.random.Generator) -> None:
    """Objects of the model that are not finite, and directions that vanish, are left out from afar too."""
    for kind, exact in (("lines", pga3.move_line), ("planes", pga3.move_plane), ("points", pga3.move_point)):
        start, truth = far_away(rng)
        model = lines(rng, 8) if kind == "lines" else rng.normal(size=(8, 4 if kind == "planes" else 3))
        if kind == "planes":
            model /= np.linalg.norm(model[:, :3], axis=1)[:, None]
        measured = exact(truth, model)
        model[2, 1], measured[5, 0] = np.nan, np.inf
        if kind != "points":
            model[6, :3] = 0
        f = MotorFilter(start, WIDE)
        assert getattr(f, f"update_{kind}")(model, measured, 0.01) == EstimationStatus.OK
        assert np.abs(error(truth, f.motor)).max() < 0.05
        assert f.n_skipped == (2 if kind == "points" else 3)


def test_contradiction_is_reported(rng: np.random.Generator) -> None:
    start, model = motor(rng), lines(rng, 5)
    f = MotorFilter(start, 1e-4 * NEAR)
    assert f.update_lines(model, pga3.move_line(motor(rng), model), SIGMA) in (
        EstimationStatus.INCONSISTENT, EstimationStatus.NOT_CONVERGED,
    )  # fmt: skip
    assert np.isfinite(f.motor).all() and np.isfinite(f.covariance).all()


def test_constant_twist(rng: np.random.Generator) -> None:
    """The twist of a screw motion is found from lines, and the error of both is as large as predicted."""
    squares = []
    for _ in range(10):
        start, twist = motor(rng), 0.3 * rng.normal(size=6)
        f = MotorFilter(start, NEAR, model="constant twist", twist_covariance=0.25)
        truth = disturbed(rng, start, NEAR)
        for _ in range(20):
            truth = pga3.motor_product(pga3.motor_exponential(-0.05 * twist), truth)
            f.predict(0.1)
            model = lines(rng, 3)
            f.update_lines(model, seen(rng, truth, model, SIGMA), SIGMA)
        difference = twist - f.twist
        assert np.abs(difference).max() < 0.05
        squares.append(difference @ np.linalg.solve(f.twist_covariance, difference))
        assert f.predict(10.0) == EstimationStatus.OK and np.isfinite(f.motor).all()
    low, high = chi2.interval(0.999, 6 * len(squares))
    assert low < sum(squares) < high


def test_linear_filter_of_the_book(rng: np.random.Generator) -> None:
    """It converges, and its errors are larger than those of the error-state filter on the same lines."""
    ours, theirs = [], []
    for _ in range(20):
        start = motor(rng)
        truth = disturbed(rng, start, NEAR)
        f, g = MotorFilter(start, NEAR), LinearMotorFilter(start, np.eye(8) * 0.1)
        for _ in range(10):
            model = lines(rng, 3)
            measured = seen(rng, truth, model, SIGMA)
            f.update_lines(model, measured, SIGMA)
            g.update_lines(model, measured, SIGMA[0])
            assert unit_error(g.motor) < 1e-12
        ours.append(error(truth, f.motor))
        theirs.append(error(truth, g.motor))
    assert np.sqrt(np.mean(np.square(theirs))) < 0.05
    assert 1 < np.sqrt(np.mean(np.square(theirs)) / np.mean(np.square(ours))) < 5


def test_starts_along_axes_are_errors_of_known_size(rng: np.random.Generator) -> None:
    """The rest of an error follows its rotation: its square by the covariance is that of the rotation alone."""
    factor = np.diag([0.5, 0.9, 1.5, 1, 2, 3]) @ np.linalg.qr(rng.normal(size=(6, 6)))[0]
    covariance, now = factor @ factor.T, motor(rng)
    nothing = np.zeros((0, 3))
    update = Update(POINTS, now, to_triangle(covariance), nothing, nothing, np.ones(2), HUGE)
    starts = np.array(list(update._starts(now, covariance, np.zeros(0, bool))))
    errors = 2 * pga3.motor_logarithm(pga3.motor_product(starts, pga3.motor_inverse(now)))
    squares = np.einsum("ij,ij->i", errors, np.linalg.solve(covariance, errors.T).T)
    assert np.allclose(np.sqrt(squares).reshape(3, 6), [0.5, 0.5, 1, 1, 1.5, 1.5])
    axes = errors.reshape(3, 6, 6)[:, 0, :3]
    assert np.allclose(axes @ covariance[:3, :3] @ axes.T, np.diag(4 * np.sum(axes**2, 1) ** 2), atol=1e-12)


def test_messages() -> None:
    one = np.eye(8)[0]
    with pytest.raises(ValueError, match="expected a unit motor"):
        MotorFilter(2 * one, NEAR)
    with pytest.raises(ValueError, match=r"covariance: shape \(3, 3\); expected \(6, 6\)"):
        MotorFilter(one, np.eye(3))
    with pytest.raises(ValueError, match="model: 'walk'"):
        MotorFilter(one, NEAR, model="walk")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"measured: shape \(1, 6\); expected \(2, 6\)"):
        MotorFilter(one, NEAR).update_lines(np.ones((2, 6)), np.ones((1, 6)), 0.1)
    with pytest.raises(ValueError, match="sigma"):
        MotorFilter(one, NEAR).update_lines(np.ones((1, 6)), np.ones((1, 6)), 0.0)
