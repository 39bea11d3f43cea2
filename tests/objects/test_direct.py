"""Constructors of single elements by one compiled call, beside those that look at their arguments."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from gacompiler.errors import GacError, LayoutError
from gacompiler.objects import CGA2, CGA3, PGA2, PGA3, QUATERNIONS, VGA3, direct, operators
from tests.support.all_cases import all_cases

RANDOM = np.random.default_rng(5)


def three() -> list[float]:
    return list(RANDOM.normal(size=3).tolist())


CASES: dict[str, Callable[[], tuple[Callable[..., Any], tuple[Any, ...]]]] = {
    "motor about a line": lambda: (PGA3.motor, (3 * PGA3.line(three(), three()), *three()[:2])),
    "motor about an axis": lambda: (PGA3.motor, (three(), 0.7, 2)),
    "motor with a translation": lambda: (PGA3.motor, (tuple(three()), *three(), 0.25)),
    "rotor about a line": lambda: (PGA3.rotor, (PGA3.line(three(), three()), 2.5)),
    "translator": lambda: (PGA3.translator, tuple(three())),
    "rotor about an axis": lambda: (PGA3.rotor, (three(), 2.5)),
    "plane": lambda: (PGA3.plane, (*three(), 2)),
    "plane by a normal": lambda: (PGA3.plane, (three(), -1.5)),
    "plane through points": lambda: (PGA3.plane, (three(), three(), three())),
    "line along a direction": lambda: (PGA3.line, (PGA3.point(*three()), three())),
    "line of the plane": lambda: (PGA2.line, (three()[:2], three()[:2])),
    "line of the plane along a direction": lambda: (PGA2.line, (PGA2.point(*three()[:2]), three()[:2])),
    "line of an equation": lambda: (PGA2.line, tuple(three())),
    "translator of the plane": lambda: (PGA2.translator, tuple(three()[:2])),
    "rotor of the plane": lambda: (PGA2.rotor, (0.7, three()[:2])),
    "motor of the plane": lambda: (PGA2.motor, (0.7, *three()[:2])),
    "conformal motor of the plane": lambda: (CGA2.motor, (0.7, *three()[:2])),
    "conformal line of the plane": lambda: (CGA2.line, (three()[:2], three()[:2])),
    "conformal translator of the plane": lambda: (CGA2.translator, tuple(three()[:2])),
    "circle of the plane": lambda: (CGA2.circle, (three()[:2], 0.5)),
    "circle through points of the plane": lambda: (CGA2.circle, (three()[:2], three()[:2], three()[:2])),
    "point pair of the plane": lambda: (CGA2.point_pair, (three()[:2], three()[:2])),
    "conformal translator": lambda: (CGA3.translator, tuple(three())),
    "conformal line": lambda: (CGA3.line, (three(), three())),
    "conformal line along a direction": lambda: (CGA3.line, (CGA3.point(*three()), three())),
    "conformal plane": lambda: (CGA3.plane, (three(), -0.5)),
    "conformal plane through points": lambda: (CGA3.plane, (three(), three(), three())),
    "point pair": lambda: (CGA3.point_pair, (three(), three())),
    "circle": lambda: (CGA3.circle, (three(), three(), 2)),
    "circle through points": lambda: (CGA3.circle, (three(), three(), three())),
    "conformal rotor": lambda: (CGA3.rotor, (three(), 0.5)),
    "conformal motor": lambda: (CGA3.motor, (three(), 0.5, 2.5)),
    "conformal motor with a translation": lambda: (CGA3.motor, (three(), 0.5, *three())),
    "line through coordinates": lambda: (PGA3.line, (three(), three())),
    "line through points": lambda: (PGA3.line, (PGA3.point(*three()), PGA3.point(*three()))),
    "sphere": lambda: (CGA3.sphere, (three(), abs(three()[0]))),
    "sphere through points": lambda: (CGA3.sphere, (three(), three(), three(), three())),
    "conformal rotor about a line": lambda: (CGA3.rotor, (CGA3.line(three(), three()), 0.5)),
    "conformal motor about a line": lambda: (CGA3.motor, (3 * CGA3.line(three(), three()), *three()[:2])),
    "rotor of the plane about the origin": lambda: (PGA2.rotor, (0.7,)),
    "rotor of vectors": lambda: (VGA3.rotor, (three(), 2.5)),
    "quaternion": lambda: (QUATERNIONS.rotation, (three(), 2.5)),
    "sphere about a point": lambda: (CGA3.sphere, (CGA3.point(*three()), 2)),
}


@pytest.fixture(autouse=True)
def at_once(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Compile at the second call, and forget it afterwards."""
    monkeypatch.setattr(direct, "OFTEN", 2)
    monkeypatch.setattr(operators, "_OPERATORS", {})  # so that `ready` does not wait for what other tests have used
    known = dict(direct._DIRECT)
    direct._DIRECT.clear()
    yield
    direct._DIRECT.clear()
    direct._DIRECT.update(known)


def ready() -> None:
    """Wait for the C functions of all operations, which need no generated modules."""
    for operator in operators.operators():
        operator.wait()


@all_cases("name", CASES)
def test_compiled_constructors(name: str) -> None:
    for _ in range(3):
        construct, arguments = CASES[name]()
        construct(*arguments)
    ready()
    compiled = [each for each in direct._DIRECT.values() if isinstance(each, tuple)]
    for _ in range(20):
        construct, arguments = CASES[name]()
        made = construct(*arguments)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(direct, "_DIRECT", {})
            expected = construct(*arguments)
        assert made.layout == expected.layout
        np.testing.assert_allclose(made.values, expected.values, rtol=1e-13, atol=1e-14)
    assert compiled or [each for each in direct._DIRECT.values() if isinstance(each, tuple)]


def test_invalid_arguments_raise_the_errors_of_constructors() -> None:
    for _ in range(4):
        PGA3.motor([0, 0, 1], 0.5), PGA3.motor(PGA3.line([0, 0, 0], [0, 0, 1]), 0.5)
        PGA3.line([0, 0, 0], [0, 0, 1]), CGA3.sphere([0, 0, 0], 1.0)
        ready()
    screw = PGA3.line([0, 0, 0], [0, 0, 1]) + 2 * PGA3.e03
    for wrong in (
        lambda: PGA3.motor([0, 0, 0], 0.5), lambda: PGA3.motor(screw, 0.5), lambda: PGA3.motor(["a", 0, 1], 0.5),
        lambda: PGA3.line([1, 2, 3], [1, 2, 3]), lambda: CGA3.sphere([0, 0, 0], -1.0),
        lambda: CGA3.sphere([[0, 0], 0, 0], 1.0), lambda: PGA3.motor([0, 0, 1, 2], 0.5),
        lambda: PGA3.motor([np.arange(1.0, 4), 0.0, 1.0], 0.5),
    ):  # fmt: skip
        with pytest.raises(GacError):
            wrong()
    with pytest.raises(LayoutError, match="radius of -1"):
        CGA3.sphere([0, 0, 0], -1.0)
    assert np.isnan(PGA3.motor([0, 0, 1], float("nan")).values).any()
    many = PGA3.motor([[0, 0, 1], [0, 0, 2], [0, 1, 0]], 0.5)
    assert many.shape == (3,)
    assert direct.form_of(PGA3.algebra, "motor", ([0, 0, 1], np.float64(1))) is None
