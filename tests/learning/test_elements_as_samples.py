"""Networks and machines take elements, whose blades they convert to their own orders, and return elements."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from algorithms.learning import Algebra, CliffordSVC, CliffordSVR, Linear, Network
from algorithms.learning.all_blades import restorer, with_all_blades
from gacompiler.objects import CGA3, PGA2, PGA3, QUATERNIONS, STA, VGA2, VGA3, Space
from tests.support.all_cases import all_cases

RANDOM = np.random.default_rng(41)
NAMES = {"G(2)": VGA2, "G(3)": VGA3, "G(2,0,1)": PGA2, "G(3,0,1)": PGA3, "G(1,3)": STA, "H": QUATERNIONS}
SPACES: list[tuple[str, Any]] = [*NAMES.items(), ("G(4,1)", Space(4, 1)), ("G(1,1,1)", Space(1, 1, 1))]


def full(space: Any, *shape: int) -> Any:
    return space.of(space.full, RANDOM.normal(size=(*shape, space.full.size)))


@pytest.mark.parametrize(("name", "space"), SPACES, ids=[name for name, _ in SPACES])
def test_products_of_networks_are_those_of_elements(name: str, space: Any) -> None:
    algebra, a, b = Algebra.of(name), full(space, 5), full(space, 5)
    x, y, z = (with_all_blades(each, "x", algebra.signature, algebra.bitmaps) for each in (a, b, a * b))
    np.testing.assert_allclose(algebra.product(x, y), z, atol=1e-13)
    back = restorer(a, algebra.signature, algebra.bitmaps)(x)
    assert back.isclose(a).all() and back.algebra == space.algebra


def test_networks_map_elements_to_elements() -> None:
    network = Network([Linear(2)], algebra="G(3,0,1)", channels=3)
    motors = PGA3.random_motor((4, 3), generator=1)
    found = network.predict(motors)
    assert found.algebra == PGA3.algebra and found.shape == (4, 2)
    np.testing.assert_allclose(found["e31"], network.predict(network.inputs(motors))[..., 6] * -1)
    listed = network.predict([[each for each in row] for row in motors])
    assert listed.isclose(found).all()
    assert network.loss(motors, found) == pytest.approx(0, abs=1e-30)


def test_machines_fit_elements() -> None:
    x = VGA3.vector(RANDOM.normal(size=(30, 2, 3)))
    y = x[:, 0] * x[:, 1] + 2
    machine = CliffordSVR(algebra=(3, 0), gamma=0.5).fit(x, y)
    found = machine.predict(x)
    plain_x, plain_y, values = (with_all_blades(each, "x", (3, 0, 0), np.arange(8)) for each in (x, y, found))
    other = CliffordSVR(algebra=(3, 0), gamma=0.5).fit(plain_x, plain_y)
    np.testing.assert_array_equal(other.predict(plain_x), values)
    assert machine.multivectors(x).isclose(found).all()
    assert found.algebra == VGA3.algebra and machine.score(x, y) == other.score(plain_x, plain_y)
    assert CliffordSVC(kernel="linear").fit(VGA3.vector([[1, 0, 0], [0, 1, 0]]), [0, 1]).predict([[1, 0, 0]]) == [0]


OTHERS = [
    CGA3.point(1, 2, 3),
    PGA2.point(1, 2),
    VGA2.vector(1, 2),
    Space(3, 1).vector(1, 2, 3, 4),
    VGA3.vector(1j, 0, 0),
]


@all_cases("x", OTHERS)
def test_elements_of_other_algebras_are_refused_by_name(x: Any) -> None:
    network, many = Network([Linear(1)], algebra="G(3)", channels=1), x * np.ones((4, 1))
    machine, real = CliffordSVR(algebra=(3, 0)), np.zeros((4, 1, 8))
    calls = {
        "X": [
            lambda: network.predict(many), lambda: machine.fit(many, np.zeros(4)), lambda: network.predict([[x]]),
        ],
        "y": [
            lambda: network.loss(real, many), lambda: machine.fit(real, many[:, 0]),
            lambda: machine.fit(real, np.zeros((4, 8))).score(real, many[:, 0]),
        ],
    }  # fmt: skip
    for name, runs in calls.items():
        for run in runs:
            with pytest.raises(TypeError, match=rf"^{name}(\[0\])* (is|has complex)"):
                run()


def test_machines_without_an_algebra_take_coordinates_only() -> None:
    machine = CliffordSVC(kernel="linear")
    with pytest.raises(TypeError, match=r"^X is VGA3\.BIVECTOR"):
        machine.fit(VGA3.bivector([[1, 0, 0], [0, 1, 0]]), [0, 1])
    labels = Network([Linear(2)], algebra="G(3)", channels=1, loss="entropy")
    with pytest.raises(TypeError, match=r"^y is VGA3\.BIVECTOR"):
        labels.loss(np.zeros((2, 1, 8)), VGA3.bivector([[1, 0, 0], [0, 1, 0]]))
