"""Compare single calls and batches of the methods of robots with Pinocchio (``python -m benchmarks robots``)."""

from __future__ import annotations

import sysconfig
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any
from warnings import catch_warnings, simplefilter

import numpy as np

from . import inverse, markdown, pages, robot_tasks
from .libraries import installed
from .timing import minimum_times

_SPAN = 1e-3
"""Minimum duration of a measurement in seconds; short calls are repeated."""
_ROBOTS = {"ur5": ("ur_description/urdf/ur5_robot.urdf", ()), "panda": ("panda_description/urdf/panda.urdf", (7, 8))}
"""Files of example-robot-data, and their locked joints (fingers)."""
_TREE = "talos_data/robots/talos_reduced.urdf"
_FLOATING = {
    "anymal": "anymal_b_simple_description/robots/anymal.urdf",
    "g1": "g1_description/urdf/g1_29dof_rev_1_0.urdf",
    "talos": _TREE,
}
_COUPLED = {"panda": _ROBOTS["panda"][0], "baxter": "baxter_description/urdf/baxter.urdf"}
"""Robots with fingers that follow others."""
_BATCH, _LARGE = 10_000, 4_000
_SINGLE = {
    "forward": "q",
    "forward_all": "q",
    "jacobian": "q",
    "jacobian_rate": "qv",
    "mass_matrix": "q",
    "inverse_dynamics": "qva",
    "gravity": "q",
    "coriolis": "qv",
    "coriolis_matrix": "qv",
    "forward_dynamics": "qva",
    "inverse_mass_matrix": "q",
    "inverse_dynamics_derivatives": "qva",
    "forward_dynamics_derivatives": "qva",
    "torque_regressor": "qva",
    "centre_of_mass": "q",
    "centroidal_momentum_matrix": "q",
    "kinetic_energy": "qv",
    "potential_energy": "q",
}
_ARMS = {
    "spherical wrist": ("puma560", {}),
    "spherical wrist, affine": ("puma560", {"method": "affine"}),
    "spherical wrist, conformal": ("puma560", {"method": "conformal"}),
    "three parallel axes": ("ur5", {}),
    "elbow circle": ("iiwa", {"elbow": 0.5}),
    "elimination": ("general", {}),
    "three slides": ("general", {"slides": (0, 2, 5)}),
    "grid of one angle, two slides": ("general", {"slides": (1, 4)}),
}
"""For each method of inverse kinematics: the robot, and options. `general` is a robot with random parameters."""
_COMPLETE = ("puma560", "stanford", "ur3", "ur5", "ur10", "ur20", "irb140", "kr5", "jaco", "crx10ia")
_MANY, _FEW, _SINGLES, _COMPARED = 100_000, 2_000, 20, 500


def main(arguments: list[str] | None = None) -> int:
    """Measure, and write the page; arguments are those of the command line, or by default of the process."""
    options = pages.options("robots", __doc__, Path("docs/robot-speed.md")).parse_args(arguments)
    what = f"{len(_ROBOTS)} robots, {len(_ARMS)} methods of inverse kinematics"
    return pages.publish("robots", options.out, page(options.quick), what)


def page(quick: bool = False) -> str:
    """Measure, and return the page as Markdown."""
    rounds, batch = (3, 100) if quick else (25, _BATCH)
    parts = ["# Robots compared with Pinocchio", "", _opening(rounds, batch), ""]
    for name in _ROBOTS:
        parts += [f"## {name}\n", _methods(name, rounds, batch)]
    large = 100 if quick else _LARGE
    parts += [f"## Batches of {large:,}, generic kernels\n", _batches(rounds, large)]
    parts += [
        f"## Floating bases, batches of {large // 4:,}\n",
        markdown.paragraph(
            "The base is a free flyer, `JointModelFreeFlyer` of Pinocchio. Kernels are generic: of each robot a single",
            "call, a batch, and Pinocchio.",
        ),
        "",
        _floating(rounds, large // 4),
        "## Joints that follow others\n",
        markdown.paragraph(
            "Single calls for robots with mimic joints, and Pinocchio's where it has them, with `mimic=True`.",
            "It has neither forward dynamics nor derivatives of robots with such joints.",
        ),
        "",
        _coupled(rounds),
        "## Inverse kinematics\n",
        markdown.paragraph(
            "All solution branches are computed, in batches.",
            "*Recall* is the fraction of random configurations that are found among the solutions for their own poses.",
            f"Times are microseconds per pose of a batch, and of {_SINGLES} single calls, the minimum of "
            f"{max(rounds // 4, 1)} runs.",
        ),
        "",
        _inverse(max(rounds // 4, 1), batch),
        "## Inverse kinematics beside EAIK and ssik\n",
        inverse.page(10 if quick else _COMPARED),
        "## Tasks\n",
        robot_tasks.page(10 if quick else _FEW),
        "## Completeness\n",
        markdown.paragraph(
            "Regular configurations that are not among the solutions for their own poses.",
            "Their Jacobians have no singular value below 0.01.",
            f"Each entry has {_MANY:,} configurations, regular or not, and {_FEW:,} where the method is an",
            "elimination.",
            "They are random, have the fourth angle 0, multiples of 90 degrees for the last three, or of 15 degrees",
            "for all.",
        ),
        "",
        _completeness(quick),
    ]
    return "\n".join(parts)


def _opening(rounds: int, batch: int) -> str:
    return markdown.paragraph(
        "`python -m benchmarks robots` writes this page.",
        f"Times are microseconds per configuration, the minimum of {rounds} runs on one thread, with float64 arrays in "
        "C order.",
        "*Specialised* kernels are written by `gac robot` for one robot; *generic* kernels accept any robot.",
        f"Robots are evaluated by single calls and by batches of {batch:,} configurations.",
        "Pinocchio is called once per configuration, and stores its results in preallocated memory.",
        "The calls of a row are measured alternately.",
    )


def _methods(name: str, rounds: int, batch: int) -> str:
    from algorithms.kinematics import Robot

    own = Robot.named(name)
    robots = {"specialised": own, "generic": replace(own, module=None)}
    rows = dict(zip("qva", np.random.default_rng(0).uniform(-1, 1, (3, batch, own.n_joints)), strict=True))
    one = {key: value[0].copy() for key, value in rows.items()}
    calls: dict[tuple[str, str], Callable[[], object]] = {}
    for method, letters in _SINGLE.items():
        for kind, robot in robots.items():
            function = getattr(robot, method)
            calls[method, kind] = _bound(function, *(one[key] for key in letters))
            calls[method, f"{kind}, batch"] = _bound(function, *(rows[key] for key in letters))
    for method, call in _pinocchio(*_ROBOTS[name], *one.values()).items():
        calls[method, "Pinocchio"] = call
    spent: dict[tuple[str, str], float] = {}
    for method in _SINGLE:
        here = {kind: call for (what, kind), call in calls.items() if what == method}
        spent |= {(method, kind): seconds for kind, seconds in minimum_times(here, rounds, _SPAN).items()}
    kinds = ("specialised", "generic", "specialised, batch", "generic, batch", "Pinocchio")
    lines = []
    for method in _SINGLE:
        figures = []
        for kind in kinds:
            seconds = spent.get((method, kind))
            count = batch if "batch" in kind else 1
            figures.append(markdown.MISSING if seconds is None else f"{1e6 * seconds / count:.3f}")
        lines.append((f"`{method}`", *figures))
    return markdown.table(("", *kinds), lines)


def _batches(rounds: int, batch: int) -> str:
    from algorithms.kinematics import Robot

    robots = {name: replace(Robot.named(name), module=None) for name in _ROBOTS}
    if _file(_TREE).exists():
        robots["talos"] = Robot.from_urdf(_file(_TREE))
    spent = {}
    for name, robot in robots.items():
        rows = dict(zip("qva", np.random.default_rng(0).uniform(-1, 1, (3, batch, robot.n_joints)), strict=True))
        for method, letters in _SINGLE.items():
            call = _bound(getattr(robot, method), *(rows[key] for key in letters))
            spent[method, name] = minimum_times({name: call}, rounds, _SPAN)[name]
    lines = [(f"`{method}`", *(f"{1e6 * spent[method, name] / batch:.3f}" for name in robots)) for method in _SINGLE]
    return markdown.table(("", *robots), lines)


def _floating(rounds: int, batch: int) -> str:
    from algorithms.kinematics import InertiaWarning, Robot
    from generated import pga3

    columns: list[str] = []
    figures: dict[str, list[str]] = {method: [] for method in _SINGLE}
    for name, path in _FLOATING.items():
        if not installed("pinocchio") or not _file(path).exists():
            continue
        import pinocchio as pin

        with catch_warnings():  # ANYmal's base has the inertia of a line
            simplefilter("ignore", InertiaWarning)
            robot = Robot.from_urdf(_file(path), base="floating")
        rng = np.random.default_rng(0)
        motors = pga3.motor_from_rotation_vector_translation(*rng.uniform(-1, 1, (2, batch, 3)))
        joints = rng.uniform(-1, 1, (batch, robot.n_positions - motors.shape[1]))
        v, a = rng.uniform(-1, 1, (2, batch, robot.n_joints))
        rows = {"q": np.concatenate([motors, joints], axis=1), "v": v, "a": a}
        model = pin.buildModelFromUrdf(str(_file(path)), pin.JointModelFreeFlyer())
        place = pin.neutral(model)
        place[-joints.shape[1] :] = joints[0]
        theirs = _calls(pin, model, place, v[0].copy(), a[0].copy())
        columns += [name, f"{name}, batch", f"{name}, Pinocchio"]
        for method, letters in _SINGLE.items():
            function = getattr(robot, method)
            here = {
                "one": _bound(function, *(rows[key][0].copy() for key in letters)),
                "batch": _bound(function, *(rows[key] for key in letters)),
                "Pinocchio": theirs[method],
            }
            spent = minimum_times(here, rounds, _SPAN)
            figures[method] += [
                f"{1e6 * seconds / (batch if kind == 'batch' else 1):.3f}" for kind, seconds in spent.items()
            ]
    return markdown.table(("", *columns), [(f"`{method}`", *row) for method, row in figures.items()])


def _coupled(rounds: int) -> str:
    from algorithms.kinematics import Robot

    columns: list[str] = []
    figures: dict[str, list[str]] = {method: [] for method in _SINGLE}
    for name, path in _COUPLED.items():
        if not installed("pinocchio") or not _file(path).exists():
            continue
        import pinocchio as pin

        robot = Robot.from_urdf(_file(path))
        rows = dict(zip("qva", np.random.default_rng(0).uniform(-1, 1, (3, robot.n_joints)), strict=True))
        theirs = _calls(pin, pin.buildModelFromUrdf(str(_file(path)), True), *rows.values())
        columns += [name, f"{name}, Pinocchio"]
        for method, letters in _SINGLE.items():
            calls = {"ours": _bound(getattr(robot, method), *(rows[key] for key in letters))}
            try:
                theirs[method]()
                calls["Pinocchio"] = theirs[method]
            except RuntimeError:  # says that mimic joints are not supported
                pass
            spent = minimum_times(calls, rounds, _SPAN)
            figures[method] += [
                f"{1e6 * spent[kind]:.3f}" if kind in spent else markdown.MISSING for kind in ("ours", "Pinocchio")
            ]
    return markdown.table(("", *columns), [(f"`{method}`", *row) for method, row in figures.items()])


def _bound(function: Callable[..., Any], *values: Any) -> Callable[[], object]:
    return lambda: function(*values)


def _file(path: str) -> Path:
    """Return the path of a file of example-robot-data, which may not be installed."""
    return Path(sysconfig.get_paths()["purelib"]) / "cmeel.prefix/share/example-robot-data/robots" / path


def _pinocchio(path: str, locked: tuple[int, ...], q: Any, v: Any, a: Any) -> dict[str, Callable[[], object]]:
    """Return the calls of Pinocchio, by the names of the methods of `Robot`. Empty if it is not installed."""
    if not installed("pinocchio") or not _file(path).exists():
        return {}
    import pinocchio as pin

    model = pin.buildModelFromUrdf(str(_file(path)))
    if locked:
        model = pin.buildReducedModel(model, [joint + 1 for joint in locked], pin.neutral(model))
    return _calls(pin, model, q, v, a)


def _calls(pin: Any, model: Any, q: Any, v: Any, a: Any) -> dict[str, Callable[[], object]]:
    data = model.createData()
    return {
        "forward": lambda: pin.forwardKinematics(model, data, q),
        "forward_all": lambda: pin.framesForwardKinematics(model, data, q),
        "jacobian": lambda: pin.computeJointJacobians(model, data, q),
        "jacobian_rate": lambda: pin.computeJointJacobiansTimeVariation(model, data, q, v),
        "mass_matrix": lambda: pin.crba(model, data, q),
        "inverse_dynamics": lambda: pin.rnea(model, data, q, v, a),
        "gravity": lambda: pin.computeGeneralizedGravity(model, data, q),
        "coriolis": lambda: pin.nonLinearEffects(model, data, q, v),
        "coriolis_matrix": lambda: pin.computeCoriolisMatrix(model, data, q, v),
        "forward_dynamics": lambda: pin.aba(model, data, q, v, a),
        "inverse_mass_matrix": lambda: pin.computeMinverse(model, data, q),
        "inverse_dynamics_derivatives": lambda: pin.computeRNEADerivatives(model, data, q, v, a),
        "forward_dynamics_derivatives": lambda: pin.computeABADerivatives(model, data, q, v, a),
        "torque_regressor": lambda: pin.computeJointTorqueRegressor(model, data, q, v, a),
        "centre_of_mass": lambda: pin.centerOfMass(model, data, q),
        "centroidal_momentum_matrix": lambda: pin.computeCentroidalMap(model, data, q),
        "kinetic_energy": lambda: pin.computeKineticEnergy(model, data, q, v),
        "potential_energy": lambda: pin.computePotentialEnergy(model, data, q),
    }


def _inverse(rounds: int, batch: int) -> str:
    from algorithms.kinematics import Robot, elbow_angle

    rng = np.random.default_rng(1)
    numbers = rng.uniform((-0.5, -0.5, -np.pi), (0.5, 0.5, np.pi), (6, 3))
    lines = []
    for name, (robot, given) in _ARMS.items():
        options: dict[str, Any] = dict(given)
        slides = options.pop("slides", ())
        kinds = ["prismatic" if joint in slides else "revolute" for joint in range(6)]
        rows = [
            {**dict(zip(("d", "a", "alpha"), map(float, row), strict=True)), "kind": kind}
            for row, kind in zip(numbers, kinds, strict=True)
        ]
        arm = Robot.from_dh(rows) if robot == "general" else Robot.named(robot)
        count = max(batch // 10, 10) if robot == "general" else batch
        q = rng.uniform(-np.pi, np.pi, (count, arm.n_joints))
        if "elbow" in options:
            options["elbow"] = elbow_angle(arm, q)
        motors = arm.forward(q)
        found = arm.inverse(motors, **options)
        away = np.abs((found.q - q[:, None] + np.pi) % (2 * np.pi) - np.pi).max(-1)
        recall = np.mean(np.where(found.valid, away, np.inf).min(-1) < 1e-5)
        call = _bound(partial(arm.inverse, **options), motors)
        elbows = options.get("elbow")
        ones = [
            partial(arm.inverse, motor, **(options if elbows is None else {**options, "elbow": elbows[k]}))
            for k, motor in enumerate(motors[:_SINGLES])
        ]
        spent = minimum_times({"batch": call, "ones": partial(_all, ones)}, rounds, _SPAN)
        times = (f"{1e6 * spent['batch'] / count:.2f}", f"{1e6 * spent['ones'] / len(ones):.0f}")
        lines.append((name, arm.name, str(found.valid.sum(-1).max()), f"{recall:.4f}", *times))
    return markdown.table(("method", "robot", "maximum number of branches", "recall", "batch", "single"), lines)


def _all(calls: Sequence[Callable[[], object]]) -> None:
    for call in calls:
        call()


def _completeness(quick: bool) -> str:
    from algorithms.kinematics import Robot

    rng, lines = np.random.default_rng(77), []
    for name in _COMPLETE:
        arm = Robot.named(name)
        n, slides = arm.n_joints, np.array([kind.value == "prismatic" for kind in arm.kinds])
        method = arm.inverse(arm.forward(np.ones(n))).method
        count = 100 if quick else _FEW if method == "elimination" else _MANY
        missing = []
        for kind in ("random", "fourth", "wrist", "all"):
            q = rng.uniform(-np.pi, np.pi, (count, n))
            if kind == "fourth":
                q[:, 3] = 0.0
            elif kind == "wrist":
                q[:, 3:] = rng.integers(-1, 3, (count, 3)) * np.pi / 2
            elif kind == "all":
                q = rng.integers(-11, 13, (count, n)) * np.pi / 12
            q[:, slides] = rng.uniform(0.1, 1.0, (count, int(slides.sum())))
            q = q[np.linalg.svd(arm.jacobian(q), compute_uv=False)[:, -1] > 0.01]
            found = arm.inverse(arm.forward(q))
            turns = np.where(slides, np.inf, 2 * np.pi)
            away = np.abs(found.q - q[:, None])
            away = np.where(found.valid, np.minimum(away, np.abs(away - turns)).max(-1), np.inf).min(-1)
            missing.append(f"{int((away > 1e-4).sum())} of {len(q):,}")
        lines.append((name, method, *missing))
    return markdown.table(
        ("robot", "method", "random", "fourth angle 0", "wrist, 90 degrees", "all, 15 degrees"), lines
    )
