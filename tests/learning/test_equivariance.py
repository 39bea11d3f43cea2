"""Layers commute with products of reflections, with permutations of items, and say so; others refuse to."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from algorithms.learning import (
    Adam,
    Algebra,
    Attention,
    Bounded,
    Dropout,
    Each,
    Gate,
    GradeLinear,
    Invariants,
    Layer,
    Linear,
    Messages,
    Network,
    Norm,
    Residual,
    Split,
)
from algorithms.learning.recorded import drawn
from tests.support.all_cases import all_cases
from tests.support.equivariant_layers import LAYERS, RING, given, reflections


@all_cases("name", ["G(3)", "G(1,3)", "G(4,1)", "G(3,0,1)"])
@all_cases("count", [1, 2, 3])
@all_cases("layer", LAYERS)
def test_layers_commute_with_versors(layer: Layer, count: int, name: str) -> None:
    algebra = Algebra.of(name)
    x, parameters = given(layer, algebra)
    turn = reflections(algebra, count, seed=count)
    turned = layer.value(algebra, x @ turn.T, parameters)
    expected = layer.value(algebra, x, parameters) @ turn.T
    scale = np.linalg.norm(turn) * np.abs(turned).max()  # of what is rounded in boosted coordinates
    assert np.abs(turned - expected).max() < 1e-12 * scale
    assert layer.symmetry(name) == layer.symmetry(algebra) == "O({},{},{})".format(*algebra.signature)


@all_cases("name", ["G(3)", "G(1,3)", "G(4,1)", "G(3,0,1)"])
def test_invariants_do_not_change(name: str) -> None:
    algebra = Algebra.of(name)
    x, _ = given(Invariants(), algebra)
    turned = Invariants().value(algebra, x @ reflections(algebra, 3, 0).T, ())
    assert np.allclose(turned, Invariants().value(algebra, x, ()), rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("layer", [Split("tanh"), Linear(2)], ids=str)
def test_other_layers_do_not_and_say_so(layer: Layer) -> None:
    algebra = Algebra(3)
    x, parameters = given(layer, algebra)
    turn = reflections(algebra, 2, 0)
    turned, expected = layer.value(algebra, x @ turn.T, parameters), layer.value(algebra, x, parameters) @ turn.T
    assert np.abs(turned - expected).max() > 1e-3
    with pytest.raises(ValueError, match=r"does not commute with the rotations of G\(3,0,0\)"):
        layer.symmetry(algebra)


def test_bounded_values_commute_in_definite_algebras_only() -> None:
    layer = Bounded()
    assert layer.symmetry(Algebra(3)) == "O(3)"
    with pytest.raises(ValueError, match=r"G\(1,3,0\)"):
        layer.symmetry(Algebra(1, 3))


@all_cases("layer", [Attention(3), Messages(3, RING)])
def test_items_can_be_renumbered(layer: Layer) -> None:
    """All neighbours send messages along this ring, in both directions."""
    algebra, order = Algebra(3), [2, 0, 1]
    x, parameters = given(layer, algebra)

    def renumbered(y: np.ndarray) -> np.ndarray:
        return y.reshape(4, 3, 2, 8)[:, order].reshape(4, 6, 8)

    found = layer.value(algebra, renumbered(x), parameters)
    assert np.allclose(found, renumbered(layer.value(algebra, x, parameters)), atol=1e-13)


def test_messages_come_from_neighbours_only() -> None:
    algebra, layer = Algebra(3), Messages(3, ((0, 1), (2, 1)))
    x, parameters = given(layer, algebra)
    changed = x.copy()
    changed[:, 4:] += 1  # the third item
    difference = layer.value(algebra, changed, parameters) - layer.value(algebra, x, parameters)
    assert not difference[:, :4].any() and difference[:, 4:].all()


def test_attention_is_that_of_its_formula() -> None:
    """Sums over items, written as a loop with products of the table."""
    algebra, layer = Algebra(1, 3), Attention(3)
    x, parameters = given(layer, algebra)
    items = x.reshape(4, 3, 2, 16)
    q, k, v = (
        np.einsum("oik,nmik->nmok", parameters[j][..., algebra.grades], items)
        + parameters[j + 1][:, None] * np.eye(1, 16)
        for j in (0, 2, 4)
    )
    for sample in range(4):
        found = np.zeros((3, 2, 16))
        for i in range(3):
            inner = [algebra.product(q[sample, i], k[sample, j] * algebra.reversal)[:, 0].sum() for j in range(3)]
            shares = np.exp(np.array(inner) / np.sqrt(32))
            found[i] = np.einsum("j,jck->ck", shares / shares.sum(), v[sample])
        out = np.einsum("oik,mik->mok", parameters[6][..., algebra.grades], found)
        out[..., 0] += parameters[7]
        assert np.allclose(out.reshape(6, 16), layer.value(algebra, x, parameters)[sample], atol=1e-12)


def by_grade(algebra: Algebra, parameters: list[np.ndarray], x: np.ndarray) -> np.ndarray:
    """Sums over channels with weights by grade."""
    w, bias = parameters
    found: np.ndarray = np.einsum("oik,...ik->...ok", w[..., algebra.grades], x)
    return found + bias[:, None] * np.eye(1, algebra.size)


def gates(algebra: Algebra, parameters: list[np.ndarray], x: np.ndarray) -> np.ndarray:
    slope, offset = parameters
    squares = np.add.reduceat(x * x * algebra.metric, np.searchsorted(algebra.grades, np.arange(algebra.n + 1)), -1)
    return np.asarray(x / (1 + np.exp(-(slope * squares + offset)))[..., algebra.grades])


def test_layers_of_parts_are_those_of_their_formulas() -> None:
    algebra = Algebra(1, 3)
    x, parameters = given(Gate(), algebra)
    assert np.allclose(gates(algebra, parameters, x), Gate().value(algebra, x, parameters), atol=1e-12)
    x, (weights,) = given(Norm(), algebra)
    squares = np.stack([(x * x * algebra.metric * (algebra.grades == k)).sum(-1) for k in range(5)], -1)
    sizes = (1 + (squares**2).mean(1, keepdims=True)) ** 0.25
    expected = x * (weights / sizes)[..., algebra.grades]
    assert np.allclose(expected, Norm().value(algebra, x, [weights]), atol=1e-12)
    assert np.allclose(x + expected, Residual((Norm(),)).value(algebra, x, [weights]), atol=1e-12)


def test_messages_are_those_of_their_formula() -> None:
    """Products of parts, one after the other, for each pair of neighbours."""
    algebra, neighbours = Algebra(1, 3), ((0, 1), (2, 1), (2, 0))
    layer = Messages(3, neighbours)
    x, parameters = given(layer, algebra)
    items = x.reshape(4, 3, 2, 16)
    own = [by_grade(algebra, parameters[2 * k : 2 * k + 2], items) for k in range(5)]
    parts = np.eye(5)[algebra.grades].T
    total = np.zeros_like(items)
    for i, j in neighbours:
        a, b = own[0][:, i] + own[1][:, j], own[2][:, i] + own[3][:, j]
        product = np.zeros_like(a)
        for w, (p, q, r) in zip(parameters[12].T, algebra.paths, strict=True):
            product += w[:, None] * algebra.product(a * parts[p], b * parts[q]) * parts[r]
        total[:, i] += gates(algebra, parameters[13:], product)
    expected = own[4] + by_grade(algebra, parameters[10:12], total)
    assert np.allclose(expected.reshape(x.shape), layer.value(algebra, x, parameters), atol=1e-11)


def test_norm_limits_sizes() -> None:
    algebra, random = Algebra(3), np.random.default_rng(0)
    x = random.normal(size=(50, 1, 8))
    small, large = (Norm().value(algebra, s * x, [np.ones((1, 4))]) for s in (1e-6, 1e6))
    assert np.allclose(small, 1e-6 * x, rtol=1e-6)
    sizes = np.sqrt(np.add.reduceat(large**2, [0, 1, 4, 7], axis=-1))
    assert np.allclose(sizes, 1, rtol=1e-6)


def test_dropout_leaves_out_elements_in_training() -> None:
    algebra, layer = Algebra(3), Dropout(0.25)
    x = np.random.default_rng(0).normal(size=(2000, 3, 8))
    assert layer.value(algebra, x, ()) is x
    with drawn(1):
        y = layer.value(algebra, x, ())
        dx, _ = layer.pull(algebra, x, (), y, np.ones_like(x))
    dropped = (y == 0).all(-1)
    assert abs(dropped.mean() - 0.25) < 5 * np.sqrt(0.25 * 0.75 / dropped.size)
    assert np.allclose(y[~dropped], x[~dropped] / 0.75) and np.array_equal(dx == 0, np.repeat(dropped[..., None], 8, 2))


def test_seeds_of_dropout_and_training() -> None:
    algebra, x = Algebra(3), np.random.default_rng(0).normal(size=(50, 3, 8))
    with drawn(1):
        one, same, other = (Dropout(0.5, seed).value(algebra, x, ()) for seed in (0, 0, 1))
    assert np.array_equal(one, same) and not np.array_equal(one, other)
    nets = [Network([Dropout(rate), GradeLinear(1)], "G(3)", 3) for rate in (0.0, 0.5)]
    for net in nets:
        net.fit(x, x[:, :1], Adam(0.01), epochs=1)
    assert not np.allclose(nets[0].parameters, nets[1].parameters)


def network(**options: Any) -> Network:
    layers = [
        Each(3, GradeLinear(4)),
        Residual((Each(3, Norm()), Attention(3, heads=2), Dropout(0.1))),
        Residual((Messages(3, RING), Each(3, Gate()))),
        Each(3, GradeLinear(1)),
    ]
    return Network(layers, "G(3)", 6, **options)


def test_networks_of_sets_learn_and_are_stored(tmp_path: Path) -> None:
    """Centres of mass relative to the items: with masses as scalars, they are products."""
    random, x = np.random.default_rng(0), np.zeros((300, 6, 8))
    x[:, ::2, 1:4], masses = random.normal(size=(300, 3, 3)), random.uniform(1, 2, size=(300, 3))
    x[:, 1::2, 0], places = masses, x[:, ::2, 1:4]
    y = np.zeros((300, 3, 8))
    y[..., 1:4] = np.einsum("nk,nkd->nd", masses, places)[:, None] / masses.sum(1)[:, None, None] - places
    one = network()
    before = one.loss(x, y)
    one.fit(x, y, Adam(0.01), epochs=25)
    assert one.loss(x, y) < 0.1 * before
    again = [network(), network()]
    for each in again:
        each.fit(x[:50], y[:50], Adam(0.01), epochs=2, seed=3)
    assert np.array_equal(again[0].parameters, again[1].parameters)
    one.save(tmp_path / "n.npz")
    assert np.array_equal(Network.load(tmp_path / "n.npz").predict(x), one.predict(x))


def test_lists_and_arrays_are_layers_of_the_same_fields() -> None:
    """Layers are keys of caches, which lists and arrays cannot be."""
    messages = Messages(3, np.array(RING))  # type: ignore[arg-type]
    assert messages == Messages(3, RING)
    layer = Residual([messages, Norm()])  # type: ignore[arg-type]
    assert layer == Residual((Messages(3, RING), Norm())) and hash(layer)
    x = np.random.default_rng(0).normal(size=(2, 6, 8))
    assert Network([layer], "G(3)", 6).predict(x).shape == x.shape


def test_batches_without_samples() -> None:
    layers = [Attention(3), Messages(3, RING), Norm(), Each(3, Gate()), Invariants(2)]
    assert Network(layers, "G(3)", 6).predict(np.zeros((0, 6, 8))).shape == (0, 12, 1)


def test_messages_of_errors() -> None:
    random = np.random.default_rng(0)
    with pytest.raises(TypeError, match=r"Residual: Linear.*expected GradeLinear, "):
        Residual((Linear(2),))  # type: ignore[arg-type]
    with pytest.raises(TypeError, match=r"Each: Linear.*expected GradeLinear, "):
        Each(2, Linear(2))  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="Residual: Norm; expected a sequence of layers"):
        Residual(Norm())  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"3 channels of G\(3,0,0\); expected 2"):
        Residual((GradeLinear(3),)).output(Algebra(3), 2)
    with pytest.raises(ValueError, match="7 channels; expected a multiple of items = 3"):
        Attention(3).output(Algebra(3), 7)
    with pytest.raises(ValueError, match="2 channels of each item; expected a multiple of heads = 4"):
        Attention(3, heads=4).output(Algebra(3), 6)
    wrong: list[Any] = [((0, 3),), (), ((0, 1, 2),), ((0, 1), (2,))]
    for pairs in wrong:
        with pytest.raises(ValueError, match="at least one pair of numbers below 3"):
            Messages(3, pairs)
    with pytest.raises(TypeError, match=r"neighbour: 1\.0; expected a whole number"):
        Messages(3, ((0, 1.0),))  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="Messages: int; expected a sequence of pairs"):
        Messages(3, (0, 1))  # type: ignore[arg-type]
    for rate in (1, -0.1, np.nan):
        with pytest.raises(ValueError, match=f"rate {rate}; expected a probability"):
            Dropout(rate)
    with pytest.raises(ValueError, match="seed: -1"):
        Dropout(0.5, -1)
    assert not Dropout(0.5).initial(Algebra(3), 2, random)
