"""Constructors in kernels: the same forms of arguments give what they give for numbers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from gacompiler.algebra.layout import SCALAR
from gacompiler.errors import GacError
from gacompiler.frontend.expression import evaluate
from gacompiler.frontend.kernel import Kernel, Parameter, trace
from gacompiler.objects import CGA2, CGA3, PGA2, PGA3
from gacompiler.objects.shapes import dense

Form = Callable[[Any, Any, Any, Any, Any], Any]

BOTH: dict[str, Form] = {
    "line": lambda s, p, q, r, a: s.line(p, q),
    "translator of a direction": lambda s, p, q, r, a: s.translator(s.direction(*[a, 2 * a, 1][: s._d])) >> p,
    "translator": lambda s, p, q, r, a: s.translator(*[a, 2, 3][: s._d]) >> p,
    "point": lambda s, p, q, r, a: s.point(*[a, 2 * a, 3][: s._d]),
    "point of an array": lambda s, p, q, r, a: s.point([a, 2 * a, 3][: s._d]),
    "point of a point": lambda s, p, q, r, a: s.point(p),
}
PLANE: dict[str, Form] = {
    **BOTH,
    "rotor": lambda s, p, q, r, a: s.rotor(a) >> p,
    "rotor about a point": lambda s, p, q, r, a: s.rotor(a, q) >> p,
    "rotor about coordinates": lambda s, p, q, r, a: s.rotor(a, [1, 2]) >> p,
    "motor": lambda s, p, q, r, a: s.motor(a, 1, 2) >> p,
    "motor by numbers": lambda s, p, q, r, a: s.motor(0.5, a, 2) >> p,
    "equation": lambda s, p, q, r, a: s.line(1, a, 2),
}
SPACE: dict[str, Form] = {
    **BOTH,
    "line along coordinates": lambda s, p, q, r, a: s.line(p, [1, 2, 2]),
    "line along": lambda s, p, q, r, a: s.line(p, direction=[1, a, 2]),
    "six coefficients": lambda s, p, q, r, a: s.line(a, 0, 0, 2, 1, 0),
    "plane through points": lambda s, p, q, r, a: s.plane(p, q, r),
    "plane with a line": lambda s, p, q, r, a: s.plane(s.line(p, q), r),
    "plane at a distance": lambda s, p, q, r, a: s.plane([1, 2, 2], a),
    "plane of a normal": lambda s, p, q, r, a: s.plane([a, 2, 2], 0.5),
    "equation": lambda s, p, q, r, a: s.plane(1, a, 2, 3),
    "rotor about a line": lambda s, p, q, r, a: s.rotor(s.line(q, r), a) >> p,
    "rotor about an axis": lambda s, p, q, r, a: s.rotor([0, 0, 1], a) >> p,
    "rotor about an axis through a point": lambda s, p, q, r, a: s.rotor([0, 1, 1], a, q) >> p,
    "motor": lambda s, p, q, r, a: s.motor(s.line(q, r), a) >> p,
    "screw": lambda s, p, q, r, a: s.motor(s.line(q, r), a, 0.5) >> p,
    "screw along an axis": lambda s, p, q, r, a: s.motor([1, 0, 1], 0.3, a) >> p,
    "motor with a translation": lambda s, p, q, r, a: s.motor([0, 0, 1], a, translation=[1, a, 3]) >> p,
    "motor about a line with a translation": lambda s, p, q, r, a: s.motor(s.line(q, r), a, 1, 2, 3) >> p,
}
ROUNDS: dict[str, Form] = {
    "point pair": lambda s, p, q, r, a: s.point_pair(p, q),
    "circle through points": lambda s, p, q, r, a: s.circle(p, q, r),
    "dilator": lambda s, p, q, r, a: s.dilator(a) >> p,
}
ROUNDS2: dict[str, Form] = {
    "circle": lambda s, p, q, r, a: s.circle(p, a),
    "imaginary circle": lambda s, p, q, r, a: s.circle(p, radius_squared=-a),
}
ROUNDS3: dict[str, Form] = {
    "sphere": lambda s, p, q, r, a: s.sphere(p, a),
    "imaginary sphere": lambda s, p, q, r, a: s.sphere([1, 2, 3], radius_squared=-a),
    "sphere through points": lambda s, p, q, r, a: s.sphere(p, q, r, s.point(a, 0, 0)),
    "circle": lambda s, p, q, r, a: s.circle(p, [1, 2, 2], a),
    "circle about a direction": lambda s, p, q, r, a: s.circle(p, s.direction(a, 2, 2), 1.5),
}
SPACES: dict[str, tuple[Any, dict[str, Form]]] = {
    "PGA2": (PGA2, PLANE),
    "CGA2": (CGA2, PLANE | ROUNDS | ROUNDS2),
    "PGA3": (PGA3, SPACE),
    "CGA3": (CGA3, SPACE | ROUNDS | ROUNDS3),
}


def kernel_of(space: Any, form: Form) -> Kernel:
    points = tuple(Parameter(name, space.POINT) for name in "pqr")
    return Kernel("made", lambda *given: form(space, *given), (*points, Parameter("a", SCALAR)), None, "")


@pytest.mark.parametrize("name", SPACES)
def test_constructors_give_what_they_give_for_numbers(name: str) -> None:
    """The expression, evaluated on the numbers of objects, is the object: all coefficients are compared."""
    space, forms = SPACES[name]
    random = np.random.default_rng(5)
    for title, form in forms.items():
        d = space._d
        p, q, r = (space.point(x) for x in random.normal(size=(3, d)))
        a = float(random.uniform(0.5, 1.5))
        kernel = kernel_of(space, form)
        given = [*p.values, *q.values, *r.values, a]
        names = [component for parameter in kernel.parameters for component in parameter.components]
        (value,) = evaluate(trace(kernel).expressions, dict(zip(names, map(float, given), strict=True)), lift=float)
        expected = dense(form(space, p, q, r, a))
        found = np.zeros_like(expected)
        for blade, coefficient in value.terms.items():
            found[blade] = coefficient
        assert np.allclose(found, expected, rtol=1e-12, atol=1e-12 * np.abs(expected).max()), title


def test_wrong_arguments_in_a_kernel_name_the_constructor() -> None:
    for form, words in (
        (lambda s, p, q, r, a: s.motor(p, a), "PGA3.motor: .point, a number"),
        (lambda s, p, q, r, a: s.point(a, a), "2 coefficients; expected 3"),
        (lambda s, p, q, r, a: s.direction(p), "PGA3.DIRECTION: an element with e123"),
    ):
        with pytest.raises(GacError, match=words):
            trace(kernel_of(PGA3, form))
