"""Results that are declared as numbers are not decided, and all others are."""

from typing import Any

import pytest

from gacompiler import SCALAR, kernel
from gacompiler.algebra.catalog import VGA3
from gacompiler.errors import GacError
from gacompiler.passes import decide
from gacompiler.passes.pipeline import compile_kernel


def test_numbers_need_no_points(monkeypatch: pytest.MonkeyPatch) -> None:
    def no_points(*_: Any) -> Any:
        raise AssertionError("points for a decision")

    monkeypatch.setattr(decide, "samples", no_points)

    @kernel(a=SCALAR, b=SCALAR, returns=(SCALAR, SCALAR))
    def numbers(a: Any, b: Any) -> Any:
        return a * b, a - a

    program = compile_kernel(numbers).program
    assert [result.shape for result in program.results] == [(), ()]

    @kernel(a=SCALAR, b=SCALAR)
    def undeclared(a: Any, b: Any) -> Any:
        return a * b

    with pytest.raises(AssertionError, match="points"):
        compile_kernel(undeclared)


def test_other_coefficients_are_refused() -> None:
    @kernel(a=VGA3.VECTOR, b=VGA3.VECTOR, returns=SCALAR)
    def product(a: Any, b: Any) -> Any:
        return a * b

    with pytest.raises(GacError, match="the result has blade"):
        compile_kernel(product)
