"""The constructors of PGA2, PGA3, CGA2 and CGA3 accept the same calls and construct the same objects.

Expected results are from vector algebra: scipy's rotations, equations of lines and planes, and circumscribed circles
from linear equations.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gacompiler.errors import GacError
from gacompiler.objects import CGA2, CGA3, PGA2, PGA3, QUATERNIONS, STA, VGA2, VGA3, MultivectorArray
from tests.support.all_cases import all_cases

SPACES = [PGA2, PGA3, CGA2, CGA3]
IN_SPACE, CONFORMAL = [PGA3, CGA3], [CGA2, CGA3]
RNG = np.random.default_rng(21)
N = 20


def dimension(space: Any) -> int:
    return int(space.algebra.POINT.size)


def close(a: Any, b: Any, tolerance: float = 1e-11) -> bool:
    return np.shape(a) == np.shape(b) and bool(np.allclose(a, b, rtol=0, atol=tolerance))


def places(space: Any, count: int, shape: tuple[int, ...] = ()) -> list[np.ndarray[Any, Any]]:
    return list(RNG.normal(size=(count, *shape, dimension(space))))


def forms(space: Any, *points: Any) -> list[tuple[Any, ...]]:
    """The same points as coordinates, lists, objects, objects of another weight, and a mixture."""
    objects = [space.point(x) for x in points]
    weighted = [2.5 * x for x in objects]
    return [tuple(points), tuple(x.tolist() for x in points), tuple(objects), tuple(weighted)]


def moved(space: Any, versor: Any, x: Any) -> Any:
    return space.coordinates(versor >> space.point(x))


def turned(x: Any, point: Any, direction: Any, angle: Any, along: Any = 0.0) -> Any:
    unit = direction / np.linalg.norm(direction, axis=-1, keepdims=True)
    turn = Rotation.from_rotvec(unit * np.asarray(angle)[..., None])
    return point + turn.apply(x - point) + unit * np.asarray(along)[..., None]


def equation(space: Any, x: Any) -> Any:
    """The coefficients of lines of the plane or planes of space, ``n . x + c = 0``; of any weight and sign."""
    if space in CONFORMAL:
        values = x.polarity()
        names = ("e1", "e2", "e3")[: dimension(space)]
        found = np.stack([*(values[name] for name in names), -np.asarray(values["einf"])], -1)
        assert close(values["e0"], np.zeros(x.shape))
    else:
        found = np.stack([x[name] for name in (*("e1", "e2", "e3")[: dimension(space)], "e0")], -1)
    found = found / np.linalg.norm(found[..., :-1], axis=-1, keepdims=True)
    return found * np.sign(found[..., -1:])


def through(*points: Any) -> Any:
    """The equations of the flats through points, from the null vector of a matrix."""
    rows = np.concatenate([np.stack(points, -2), np.ones((*points[0].shape[:-1], len(points), 1))], -1)
    found = np.linalg.svd(rows)[2][..., -1, :]
    found = found / np.linalg.norm(found[..., :-1], axis=-1, keepdims=True)
    return found * np.sign(found[..., -1:])


def circumscribed(*points: Any) -> tuple[Any, Any]:
    """Centre and squared radius of the round through points: ``2 (p - a) . c = p**2 - a**2``, in their flat."""
    a, *others = points
    rows, right = np.stack([p - a for p in others], -2), np.stack([((p - a) ** 2).sum(-1) for p in others], -1) / 2
    centre = a + np.einsum("...ij,...j->...i", np.linalg.pinv(rows), right)
    return centre, ((centre - a) ** 2).sum(-1)


@all_cases("shape", [(), (N,)])
@all_cases("space", SPACES)
def test_lines(space: Any, shape: tuple[int, ...]) -> None:
    p, q, x = places(space, 3, shape)
    d = q - p
    made = [space.line(*form) for form in forms(space, p, q)]
    made += [space.line(space.point(p), space.direction(d)), space.line(space.point(p), d), space.line(p, direction=d)]
    made += [space.line(p, space.direction(d)), space.line(p, space.point(q))]
    for line in made:
        assert line.shape == shape and np.all(line.isclose(made[0])) and np.all(line.isclose(space.line(q, p) * -1))
        if space in IN_SPACE:
            assert close(moved(space, space.rotor(line, 1.3), x), turned(x, p, d, 1.3 + np.zeros(shape)))
        else:
            assert close(equation(space, line), through(p, q))


@all_cases("shape", [(), (N,)])
@all_cases("space", IN_SPACE)
def test_planes_and_lines_from_their_equations(space: Any, shape: tuple[int, ...]) -> None:
    p, q, r, normal = places(space, 4, shape)
    for form in forms(space, p, q, r):
        assert close(equation(space, space.plane(*form)), through(p, q, r))
    assert close(equation(space, space.plane(space.line(p, q), r)), through(p, q, r))
    distance = RNG.uniform(0.5, 2, shape)
    unit = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
    wanted = -np.concatenate([unit, -distance[..., None]], -1)
    coefficients = np.concatenate([normal, -distance[..., None] * np.linalg.norm(normal, axis=-1, keepdims=True)], -1)
    calls = [
        (normal, distance),
        (space.direction(normal), distance),
        (coefficients,),
        tuple(np.moveaxis(coefficients, -1, 0)),
    ]
    for call in calls:
        assert close(equation(space, space.plane(*call)), wanted)
    six = PGA3.line(p, q).values
    for line in (space.line(six), space.line(*np.moveaxis(six, -1, 0))):
        assert np.all(line.isclose(space.line(p, q)))


@pytest.mark.parametrize("space", [PGA2, CGA2], ids=lambda space: space.algebra.name)
def test_lines_of_the_plane_from_their_equations(space: Any) -> None:
    coefficients = RNG.normal(size=(N, 3)) - [0, 0, 5]
    wanted = coefficients / np.linalg.norm(coefficients[:, :2], axis=-1, keepdims=True)
    for call in ((coefficients,), tuple(coefficients.T)):
        assert close(equation(space, space.line(*call)), -wanted)
    one = space.line(*coefficients[0])
    assert one.shape == () and close(equation(space, one), -wanted[0])


@all_cases("shape", [(), (3,), (N,)])
@all_cases("space", CONFORMAL)
def test_rounds(space: Any, shape: tuple[int, ...]) -> None:
    a, b, c, e = places(space, 4, shape)
    for form in forms(space, a, b):
        assert close(space.radius_squared(space.point_pair(*form)), ((a - b) ** 2).sum(-1) / 4)
    centre, squared = circumscribed(a, b, c)
    size = 1 + np.max(squared)
    for form in forms(space, a, b, c):
        circle = space.circle(*form)
        assert circle.shape == shape and np.all(circle.isclose(space.point(a) ^ space.point(b) ^ space.point(c)))
        assert close(space.centre(circle) / size, centre / size) and close(
            space.radius_squared(circle) / size, squared / size
        )
    radius = RNG.uniform(0.5, 2, shape)
    given = (a,) if space is CGA2 else (a, b)
    for first in forms(space, *given):
        if space is CGA3:  # a normal is not a point
            first = (first[0], b)
        for circle in (space.circle(*first, radius), space.circle(*first, radius_squared=radius**2)):
            assert close(space.centre(circle), a) and close(space.radius_squared(circle), radius**2)
            assert circle.shape == shape
    if space is CGA3:
        centre, squared = circumscribed(a, b, c, e)
        size = 1 + np.max(squared)
        for form in forms(space, a, b, c, e):
            found = space.sphere(*form)
            assert close(space.centre(found) / size, centre / size)
            assert close(space.radius_squared(found) / size, squared / size)
        for form in forms(space, a):
            assert close(space.centre(space.sphere(*form, radius)), a)
        assert close(space.radius_squared(space.sphere(a, radius_squared=-radius)), -radius)


@all_cases("shape", [(), (N,)])
@all_cases("space", IN_SPACE)
def test_versors_of_space(space: Any, shape: tuple[int, ...]) -> None:
    p, d, t, x = places(space, 4, shape)
    origin = np.zeros(3)
    angle, along = RNG.uniform(-6, 6, shape), RNG.normal(size=shape)
    line = space.line(space.point(p), d)
    flat = line if space is PGA3 else space.point(p) ^ space.point(p + d) ^ space.einf
    axes: list[tuple[tuple[Any, ...], Any]] = [
        ((line,), p),
        ((3 * flat,), p),
        ((d,), origin),
        ((space.direction(d),), origin),
    ]
    for (axis,), point in axes:
        assert close(moved(space, space.rotor(axis, angle), x), turned(x, point, d, angle))
        assert close(moved(space, space.motor(axis, angle), x), turned(x, point, d, angle))
        for versor in (space.motor(axis, angle, along), space.motor(axis, angle, distance=along)):
            assert versor.layout == space.MOTOR and versor.shape == shape
            assert close(moved(space, versor, x), turned(x, point, d, angle, along))
        calls = [space.motor(axis, angle, *np.moveaxis(t, -1, 0)), space.motor(axis, angle, translation=t)]
        for versor in (*calls, space.motor(axis, angle, space.direction(t))):
            assert close(moved(space, versor, x), turned(x, point, d, angle) + t)
    for centre in (p, space.point(p)):
        assert close(moved(space, space.rotor(d, angle, centre), x), turned(x, p, d, angle))
    assert close(moved(space, space.rotor(1e200 * d, angle), x), turned(x, origin, d, angle)), "of any length"
    assert close(moved(space, space.rotor(1e-200 * d, angle), x), turned(x, origin, d, angle))


@all_cases("shape", [(), (N,)])
@all_cases("space", [PGA2, CGA2])
def test_versors_of_the_plane(space: Any, shape: tuple[int, ...]) -> None:
    p, t, x = places(space, 3, shape)
    angle = RNG.uniform(-6, 6, shape)

    def wanted(point: Any) -> Any:
        u, v = np.moveaxis(x - point, -1, 0)
        return point + np.stack([np.cos(angle) * u - np.sin(angle) * v, np.sin(angle) * u + np.cos(angle) * v], -1)

    for centre in (p, space.point(p)):
        assert close(moved(space, space.rotor(angle, centre), x), wanted(p))
    assert close(moved(space, space.motor(angle), x), wanted(0.0))
    for versor in (
        space.motor(angle, *np.moveaxis(t, -1, 0)),
        space.motor(angle, t),
        space.motor(angle, space.direction(t)),
    ):
        assert close(moved(space, versor, x), wanted(0.0) + t)


@all_cases("space", SPACES)
def test_translators(space: Any) -> None:
    t, x = places(space, 2, (N,))
    for call in ((t,), tuple(t.T), (space.direction(t),)):
        assert close(moved(space, space.translator(*call), x), x + t)
    assert space.translator(space.direction(t[0])).layout == space.TRANSLATOR
    if space in CONFORMAL:
        end = "inf"
        ideal = space.multivector({f"e{k + 1}{end}": t[:, k] for k in range(dimension(space))})
        assert close(moved(space, space.translator(ideal), x), x + t), "directions of flats are directions"


def wrong_calls(space: Any) -> list[tuple[str, Callable[[], Any]]]:
    """Pairs of a constructor and an invalid call of it."""
    d = dimension(space)
    o, a, b = np.zeros(d), np.eye(d)[0], np.eye(d)[1]
    p, q = space.point(a), space.point(b)
    line, motor = space.line(a, b), space.translator(a)
    calls: list[tuple[str, Callable[[], Any]]] = [
        ("line", lambda: space.line(a, a)),
        ("line", lambda: space.line(p, p)),
        ("line", lambda: space.line(0.1 * a + 0.3 * b, space.point(0.1 * a + 0.3 * b))),
        ("line", lambda: space.line(p, o)),
        ("line", lambda: space.line(p, space.direction(o))),
        ("line", lambda: space.line(a, direction=o)),
        ("line", lambda: space.line(p)),
        ("line", lambda: space.line()),
        ("line", lambda: space.line(a, 1.0)),
        ("line", lambda: space.line(line, line)),
        ("line", lambda: space.line(motor, p)),
        ("line", lambda: space.line(p, np.ones(d + 1))),
        ("line", lambda: space.line(p, VGA3.e1)),
        ("line", lambda: space.line("text", p)),
        ("line", lambda: space.line(*np.zeros(3 * d - 3))),
        ("translator", lambda: space.translator(np.ones(d + 1))),
        ("translator", lambda: space.translator(motor)),
        ("translator", lambda: space.translator(p)),
        ("rotor", lambda: space.rotor(motor, p)),
        ("motor", lambda: space.motor(motor, 1.0)),
        ("point", lambda: space.point(line)),
    ]  # fmt: skip
    if space in IN_SPACE:
        calls += [
            ("plane", lambda: space.plane(a, b, (a + b) / 2)),
            ("plane", lambda: space.plane(0.1 * (a + b), 0.3 * (a + b), space.point(0.7 * (a + b)))),
            ("plane", lambda: space.plane(p, q, q)),
            ("plane", lambda: space.plane(p, q)),
            ("plane", lambda: space.plane(o, 1.0)),
            ("plane", lambda: space.plane(line, q)),
            ("plane", lambda: space.plane(0.0, 0.0, 0.0, 1.0)),
            ("plane", lambda: space.plane(a, b, a, b, a)),
            ("plane", lambda: space.plane(p, q, p, q)),
            ("rotor", lambda: space.rotor(o, 1.0)),
            ("rotor", lambda: space.rotor(0 * line, 1.0)),
            ("rotor", lambda: space.rotor(p, 1.0)),
            ("rotor", lambda: space.rotor(line, 1.0, p)),
            ("rotor", lambda: space.rotor(a, "text")),
            ("motor", lambda: space.motor(o, 1.0)),
            ("motor", lambda: space.motor(o, 1.0, 2.0)),
            ("motor", lambda: space.motor(o, 1.0, 1, 2, 3)),
            ("motor", lambda: space.motor(0 * line, 1.0, 2.0)),
            ("motor", lambda: space.motor(a, 1.0, 2.0, distance=1.0)),
            ("motor", lambda: space.motor(a, 1.0, 2.0, 3.0)),
        ]  # fmt: skip
    if space is PGA3:
        ideal = space.e01 + 2 * space.e02
        calls += [("rotor", lambda: space.rotor(ideal, 1.0)), ("motor", lambda: space.motor(ideal, 1.0, 2.0))]
    if space in CONFORMAL:
        calls += [
            ("circle", lambda: space.circle(a, b, (a + b) / 2)),
            ("circle", lambda: space.circle(p, p, q)),
            ("circle", lambda: space.circle(p)),
            ("circle", lambda: space.circle(*([a] * (d - 1)), -1.0)),
            ("circle", lambda: space.circle(*([a] * (d - 1)), 1.0, radius_squared=1.0)),
            ("circle", lambda: space.circle(p, line, 1.0)),
            ("point_pair", lambda: space.point_pair(a, a)),
            ("point_pair", lambda: space.point_pair(p, 1.0)),
            ("dilator", lambda: space.dilator(0.0)),
            ("dilator", lambda: space.dilator("text")),
        ]  # fmt: skip
    if space is CGA3:
        calls += [
            ("circle", lambda: space.circle(a, o, 1.0)),
            ("sphere", lambda: space.sphere(a, b, o, a + b)),
            ("sphere", lambda: space.sphere(a, b, o)),
            ("sphere", lambda: space.sphere(p, q)),
            ("sphere", lambda: space.sphere(a, a, b, o)),
        ]  # fmt: skip
    return calls


WRONG = [(space, k) for space in SPACES for k in range(len(wrong_calls(space)))]


@all_cases("space, k", WRONG)
def test_wrong_calls_are_rejected_by_name(space: Any, k: int) -> None:
    name, call = wrong_calls(space)[k]
    with pytest.raises((GacError, TypeError), match=name):
        call()


@all_cases("space", SPACES)
def test_elements_of_arrays_that_do_not_exist_are_not_a_number(space: Any) -> None:
    d = dimension(space)
    p = RNG.normal(size=(4, d))
    q = p.copy()
    q[1] += 1
    q[3] -= 1
    made = [space.line(p, q)] + ([space.point_pair(p, q)] if space in CONFORMAL else [])
    if space in IN_SPACE:
        axes = np.where([[True], [False], [True], [False]], 0.0, p)
        made += [
            space.plane(p, q, q[::-1] + 3.0),
            space.rotor(axes, 1.0),
            space.motor(axes, 1.0, 2.0),
            space.plane(axes, 1.0),
        ]
    for each in made:
        assert list(np.isnan(each.values).all(-1)) == [True, False, True, False], each
        assert list(np.isnan(each.values).any(-1)) == [True, False, True, False], each


def test_other_algebras_reject_calls_without_an_axis() -> None:
    for call in (
        lambda: VGA3.rotor([0, 0, 0], 1.0), lambda: QUATERNIONS.rotation([0, 0, 0], 1.0),
        lambda: STA.rotor([0, 0, 0], 1.0), lambda: VGA3.rotor_between(VGA3.e1, -VGA3.e1),
        lambda: VGA2.rotor_between(VGA2.e1, 0 * VGA2.e1),
    ):  # fmt: skip
        with pytest.raises(GacError, match=r"rotor|rotation"):
            call()
    assert list(np.isnan(VGA3.rotor([[0, 0, 0], [0, 0, 1]], 1.0).values[:, 0])) == [True, False]


def test_nan_coordinates_propagate() -> None:
    """A NaN coordinate is not an error."""
    for space in SPACES:
        d = dimension(space)
        assert np.isnan(space.line(np.full(d, np.nan), np.ones(d)).values).any()
        assert np.isnan(space.translator(np.full(d, np.nan)).values).any()
    for space, method in product(IN_SPACE, ("rotor", "motor")):
        assert np.isnan(getattr(space, method)([0, 0, 1], np.nan).values).any()
        empty = getattr(space, method)(np.zeros((0, 3)), 1.0)
        assert isinstance(empty, MultivectorArray) and empty.shape == (0,)


@all_cases("space", SPACES)
def test_single_precision_integers_and_read_only_arrays(space: Any) -> None:
    p, q = (RNG.normal(size=(N, dimension(space))).astype(np.float32) for _ in range(2))
    p.flags.writeable = False
    line = space.line(p, q)
    assert line.values.dtype == np.float32 and np.all(
        line.isclose(space.line(p.astype(float), q.astype(float)), 1e-5, 1e-5)
    )
    if space in IN_SPACE:
        found = space.coordinates(space.motor(line, 1.0, 2.0) >> space.point(p))
        assert close(found, turned(p, p, q - p, np.full(N, 1.0), np.full(N, 2.0)), 1e-4)
    whole = RNG.integers(-9, 9, (N, dimension(space)))
    assert np.array_equal(space.line(whole, whole + 1).values, space.line(whole.astype(float), whole + 1.0).values)
