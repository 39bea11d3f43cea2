"""Operations on elements of every type of coefficients and every origin give what doubles give.

The expected result is that of the same operation on an array of doubles, which other tests compare with truth.
"""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from gacompiler.errors import ZeroDivisorError
from gacompiler.objects import CGA2, PGA3, STA, VGA3, Space
from generated import pga3

RANDOM = np.random.default_rng(3)
ORIGINS: dict[str, Callable[[Any, Any], Any]] = {
    "float32": lambda s, x: s.of(x.layout, np.asarray(x.values, np.float32)),
    "integers": lambda s, x: s.of(x.layout, np.asarray(x.values, int)),
    "complex": lambda s, x: s.of(x.layout, np.asarray(x.values, complex)),
    "columns": lambda s, x: s.of(x.layout, np.asfortranarray(x.values)),
    "backwards": lambda s, x: x[::-1][::-1],
    "pickle": lambda s, x: pickle.loads(pickle.dumps(x)),
    "copy": lambda s, x: copy.deepcopy(copy.copy(x)),
    "concatenate": lambda s, x: np.concatenate([x[:1], x[1:]]),
    "stack": lambda s, x: np.stack(list(x)),
    "where": lambda s, x: np.where([True, False, True], x, x),
    "take": lambda s, x: np.take(x, [0, 1, 2], axis=0),
    "broadcast": lambda s, x: np.broadcast_to(x, (2, 3))[1],
}
OPERATIONS: dict[str, Callable[[Any, Any], Any]] = {
    "a * b": lambda a, b: a * b, "a ^ b": lambda a, b: a ^ b, "a & b": lambda a, b: a & b, "a | b": lambda a, b: a | b,
    "a - b": lambda a, b: a - b, "a >> b": lambda a, b: a >> b, "~a": lambda a, b: ~a, "dual": lambda a, b: a.dual(),
    "grade": lambda a, b: a.grade(0, 2), "square": lambda a, b: a.norm_squared(), "sum": lambda a, b: a.sum(),
    "left": lambda a, b: a.left_contraction(b), "inverse": lambda a, b: (a + 20).inverse(), "exp": lambda a, b: a.exp(),
}  # fmt: skip


@pytest.fixture(autouse=True)
def without_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GAC_BACKEND", "arrays")


@pytest.mark.parametrize("space", [VGA3, PGA3, CGA2, STA], ids=lambda space: space.algebra.name)
def test_results_do_not_depend_on_the_origin(space: Any) -> None:
    names = space.algebra.vectors
    vectors = [
        space.multivector(dict(zip(names, rows, strict=True))) for rows in RANDOM.integers(-3, 4, (2, len(names), 3))
    ]
    vectors = [x * 1.0 for x in vectors]
    elements = [*vectors, vectors[0] ^ vectors[1]]
    for origin, made in ORIGINS.items():
        others = [made(space, x) for x in elements]
        tolerance = 1e-5 if origin == "float32" else 1e-12
        for name, run in OPERATIONS.items():
            if name == "exp" and origin == "complex":
                continue
            for k, j in ((0, 1), (2, 0), (1, 2)):
                want, found = run(elements[k], elements[j]), run(others[k], others[j])
                assert getattr(found, "layout", None) == getattr(want, "layout", None), (origin, name)
                a, b = (np.asarray(getattr(x, "values", x)) for x in (want, found))
                size = max(1.0, np.abs(a).max())
                np.testing.assert_allclose(b, a, rtol=0, atol=tolerance * size, err_msg=f"{origin}: {name}")
        for x in others:
            empty = OPERATIONS["a * b"](x[:0], others[0][:0])
            assert empty.shape == (0,) and empty.layout == OPERATIONS["a * b"](x, others[0]).layout


@pytest.mark.parametrize("space", [VGA3, PGA3, Space(6)], ids=lambda space: space.algebra.name)
def test_complex_elements_have_quotients(space: Any) -> None:
    names = space.algebra.vectors
    rows = RANDOM.normal(size=(2, len(names), 3)) + 1j * RANDOM.normal(size=(2, len(names), 3))
    a, b = (space.multivector(dict(zip(names, each, strict=True))) for each in rows)
    general = a * b + 2
    for x in (a, general, general[0]):
        np.testing.assert_allclose(np.asarray((x * x.inverse() - 1).values), 0, atol=1e-12)
        np.testing.assert_allclose((x / (1 + 2j)).values, x.values / (1 + 2j), rtol=1e-14)
    null = 1j * a.algebra.multivector({names[0]: 1}) + space.multivector({names[1]: 1.0})
    with pytest.raises(ZeroDivisorError, match="determinant is 0"):
        null.inverse()


def test_motors_of_single_precision_are_of_unit_norm() -> None:
    single = PGA3.of(PGA3.MOTOR, np.asarray(PGA3.motor([1, 2, 2], 0.7, 2.0).values, np.float32))
    even = PGA3.of(PGA3.EVEN, single.values)
    moved = pga3.move_point(even, PGA3.point(1, 2, 3))
    np.testing.assert_allclose(moved.values, (single >> PGA3.point(1, 2, 3)).values, rtol=1e-5)
    with pytest.raises(TypeError, match="x ~x = 1 up to"):
        pga3.move_point(1.001 * even, PGA3.point(1, 2, 3))
