"""Gradients of layers by complex steps and central differences, in many algebras, and facts about products."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from algorithms.learning.activations import Bounded, Gate, Series, Split
from algorithms.learning.algebra import Algebra
from algorithms.learning.base import Layer
from algorithms.learning.equivariant import GradeLinear, GradeProduct, Invariants, Norm
from algorithms.learning.items import Attention, Dropout, Each, Messages, Residual
from algorithms.learning.linear import Linear, Rotor, TwoSided, left_matrix, right_matrix, simplified_pull
from algorithms.learning.rounds import ConformalNeuron, Hypersphere, Radial
from tests.support.all_cases import all_cases
from tests.support.layer_gradients import check_gradient

ALGEBRAS = ["R", "C", "H", "G(1)", "G(2)", "G(1,1)", "G(3)", "G(0,3)", "G(3,0,1)", "G(3,1)", "G(4,1)", "G(2,0,1)"]
ANY = [
    Linear(2), Linear(2, side="right"), Linear(2, product="inner", grades=(0, 1)),
    Linear(2, product="outer", bias=False),
    TwoSided(2), Split("tanh"), Split("sigmoid"), Split("silu"), Bounded(), Gate(), Series(), GradeLinear(2),
    GradeProduct(), Invariants(), Invariants(3), Norm(), Residual((GradeProduct(), Dropout(0.5))),
    Each(3, GradeLinear(2)), Attention(3),
]  # fmt: skip


@all_cases("name", ALGEBRAS)
@all_cases("layer", ANY)
def test_gradients(layer: Layer, name: str) -> None:
    check_gradient(layer, Algebra.of(name))


@all_cases("name", ALGEBRAS)
def test_gradients_of_messages(name: str) -> None:
    """Polynomials of high degree inside of logistic functions need small steps."""
    check_gradient(Messages(3, ((0, 1), (0, 2), (2, 2))), Algebra.of(name), h=5e-4)


@pytest.mark.parametrize("name", ["C", "G(2)", "G(3)", "G(3,1)", "G(4,1)"])
@pytest.mark.parametrize("side", ["left", "right"])
def test_gradients_by_matrices_of_spinors(name: str, side: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("algorithms.learning.linear.LEAST_WIDTH", 0)
    layer = Linear(2, side=side)
    check_gradient(layer, Algebra.of(name))


@all_cases("name", ["C", "G(2)", "G(3)", "G(2,0,1)"])
def test_gradient_of_rotors(name: str) -> None:
    check_gradient(Rotor(2), Algebra.of(name), tolerance=1e-7)


@all_cases("layer, name", [(Radial(2), "G(2)"), (Radial(2), "G(3)"), (Hypersphere(2), "R"),
                                         (ConformalNeuron(2), "R")])  # fmt: skip
def test_gradients_of_rounds(layer: Layer, name: str) -> None:
    check_gradient(layer, Algebra.of(name))


@all_cases("name", [*ALGEBRAS, "G(2,2)", "G(3,3)"])
@all_cases("side", ["left", "right"])
def test_matrices_of_spinors_give_the_products_of_the_table(
    name: str, side: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("algorithms.learning.linear.LEAST_WIDTH", 0)
    algebra, random = Algebra.of(name), np.random.default_rng(2)
    x, w = random.normal(size=(5, 2, algebra.size)), random.normal(size=(3, 2, algebra.size))
    found = Linear(3, side=side, bias=False).value(algebra, x, [w])
    factors = (w[None], x[:, None]) if side == "left" else (x[:, None], w[None])
    assert np.allclose(found, algebra.product(*factors).sum(2), atol=1e-12)
    if name != "R":
        generic = (left_matrix if side == "left" else right_matrix)(algebra, w)
        assert np.allclose(found, np.einsum("oikj,bij->bok", generic, x), atol=1e-12)


@all_cases("name", ["C", "H", "G(2)", "G(3)", "G(3,0,1)", "G(1,3)"])
def test_generated_products_are_those_of_the_table(name: str) -> None:
    algebra, random = Algebra.of(name), np.random.default_rng(3)
    a, b, d = random.normal(size=(3, 6, algebra.size))
    weights = random.normal(size=(6, len(algebra.paths)))
    assert np.allclose(algebra.weighted(a, b, weights), algebra._by_table("abwd", algebra.size, a, b, weights))
    found = algebra.weighted_pull(a, b, weights, d)
    assert np.allclose(found[2], algebra._by_table("abdw", len(algebra.paths), a, b, d))


@all_cases("name", ["C", "H", "G(2)", "G(0,3)", "G(3)", "G(3,1)", "G(4,1)"])
def test_simplified_rule_equals_the_full_rule(name: str) -> None:
    algebra, random = Algebra.of(name), np.random.default_rng(4)
    x, w, d = (random.normal(size=(*s, algebra.size)) for s in ((5, 2), (3, 2), (5, 3)))
    dx, (dw,) = Linear(3, bias=False).pull(algebra, x, [w], d, d)
    for found, full in zip(simplified_pull(algebra, x, w, d), (dx, dw), strict=True):
        assert np.allclose(found, full, atol=1e-12)


def test_simplified_rule_needs_inverses() -> None:
    algebra: Any = Algebra(3, 0, 1)
    with pytest.raises(ValueError, match="null vectors"):
        simplified_pull(algebra, *np.ones((3, 1, 1, 16)))


def test_equivariant_layers_commute_with_rotors() -> None:
    algebra, random = Algebra(3), np.random.default_rng(5)
    x, rotor = random.normal(size=(4, 3, 8)), np.zeros(8)
    rotor[[0, 4, 5, 6]] = random.normal(size=4)
    rotor /= np.linalg.norm(rotor)
    turn = left_matrix(algebra, rotor) @ right_matrix(algebra, rotor * algebra.reversal)
    for layer in (GradeLinear(2), GradeProduct(), Gate()):
        parameters = layer.initial(algebra, 3, random)
        y, turned = (layer.value(algebra, one, parameters) for one in (x, x @ turn.T))
        assert np.allclose(y @ turn.T, turned, atol=1e-12)
    assert np.allclose(Invariants().value(algebra, x @ turn.T, ()), Invariants().value(algebra, x, ()), atol=1e-12)


@all_cases("name", ["G(1,3)", "G(4,1)", "G(3,0,1)", "G(0,2)"])
def test_equivariant_layers_of_any_algebra(name: str) -> None:
    """Rotations are series of exponentials of bivectors, with boosts and translations among them."""
    algebra, random = Algebra.of(name), np.random.default_rng(7)
    plane = np.where(algebra.grades == 2, 0.5 * random.normal(size=algebra.size), 0)
    rotor, term = np.zeros(algebra.size), np.eye(algebra.size)[0]
    for k in range(1, 40):
        rotor, term = rotor + term, algebra.product(term, plane) / k
    turn = left_matrix(algebra, rotor) @ right_matrix(algebra, rotor * algebra.reversal)
    x = random.normal(size=(4, 3, algebra.size))
    parameters = [p + random.normal(size=p.shape) for p in Gate().initial(algebra, 3, random)]
    y, turned = (Gate().value(algebra, one, parameters) for one in (x, x @ turn.T))
    assert np.allclose(y @ turn.T, turned, atol=1e-9)
    assert np.allclose(Invariants().value(algebra, x @ turn.T, ()), Invariants().value(algebra, x, ()), atol=1e-9)


def test_rotor_layer_keeps_norms() -> None:
    algebra, random = Algebra(3), np.random.default_rng(6)
    x = random.normal(size=(4, 1, 8))
    y = Rotor(1).value(algebra, x, Rotor(1).initial(algebra, 1, random))
    assert np.allclose(np.linalg.norm(y, axis=-1), np.linalg.norm(x, axis=-1))


def test_conformal_neuron_is_the_inner_product_of_point_and_sphere() -> None:
    random = np.random.default_rng(7)
    x, centre, radius = random.normal(size=(5, 3)), random.normal(size=3), 1.3
    found = ConformalNeuron(1).value(Algebra(0), x[..., None], [centre[None], np.array([radius])])[:, 0, 0]
    assert np.allclose(found, (radius**2 - ((x - centre) ** 2).sum(1)) / 2)
