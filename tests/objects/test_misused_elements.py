"""Arguments of methods of elements that have no meaning, and elements where numbers are expected."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, cast

import numpy as np
import pytest

from gacompiler.errors import LayoutError, OperandError
from gacompiler.objects import CGA3, PGA3, VGA3
from tests.support.all_cases import all_cases

SPACE: Any = PGA3
POINTS: Any = SPACE.point(np.arange(15.0).reshape(5, 3))


@all_cases(
    "call, error, message",
    [
        (lambda: POINTS.reshape(2, 3), LayoutError, r"reshape to \(2, 3\): shape \(5,\)"),
        (lambda: POINTS.reshape(2.5), OperandError, r"shape \(5,\); expected integers"),
        (lambda: POINTS.sum(3), LayoutError, r"sum along axis 3: shape \(5,\)"),
        (lambda: POINTS.sum("a"), OperandError, "sum along axis 'a'"),
        (lambda: POINTS.mean((0, 0)), LayoutError, r"mean along axis \(0, 0\)"),
        (lambda: SPACE.coordinates(np.ones((4, 3))), OperandError, "coordinates: a ndarray; expected multivectors"),
        (lambda: SPACE.coordinates(VGA3.vector(1, 2, 3)), OperandError, "an element of .*; expected one of"),
        (lambda: cast(Any, CGA3).coordinates(None), OperandError, "coordinates: a NoneType"),
        (lambda: int(POINTS[0]), TypeError, r"PGA3.POINT: an element is not a number"),
        (lambda: float(POINTS), TypeError, r"PGA3.POINT: an element is not a number"),
    ],
)
def test_messages(call: Callable[[], Any], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        call()


def test_right_arguments() -> None:
    """Means and sums along axes, and coordinates of exact points, against numpy."""
    places = np.arange(18.0).reshape(2, 3, 3)
    assert np.array_equal(SPACE.coordinates(PGA3.point(places).mean(1)), places.mean(1))
    assert PGA3.point(places).reshape(-1).sum()["e123"] == 6
    assert PGA3.point(places).reshape([3, 2]).shape == PGA3.point(places).reshape((3, 2)).shape == (3, 2)
    assert list(SPACE.coordinates(POINTS[1].exactly())) == [3, 4, 5]
