"""Constants in the runtime equal those that the compiler computes."""

from __future__ import annotations

import numpy as np
import pytest

import gacompiler
from gacompiler import kernel
from gacompiler.algebra.catalog import PGA3
from gacompiler.backends import find_compiler
from gacompiler.backends.approximations import APPROXIMATIONS, FARTHEST, coefficients, numbers
from gacompiler.gac_runtime.definition import shapes_in

pytest.importorskip("numba")


def test_constants_of_transcendental_functions_under_numba() -> None:
    from gacompiler.gac_runtime.jit import terms, transcendental

    for kind, double in (("float64", True), ("float32", False)):
        assert transcendental.CONSTANTS[kind] == numbers(double=double)
        assert terms.POLYNOMIALS[kind] == {name: tuple(coefficients(name, double=double)) for name in APPROXIMATIONS}
    assert transcendental.FARTHEST == FARTHEST


def test_signatures() -> None:
    assert shapes_in("(8),(3,3),()->(3),()") == [[(8,), (3, 3), ()], [(3,), ()]]
    assert shapes_in("->(4)") == [[], [(4,)]]


@pytest.mark.parametrize("backend", ["c", "numba", "arrays"])
def test_a_kernel_without_arguments(backend: str) -> None:
    if backend == "c" and not find_compiler():
        pytest.skip("no C compiler")

    @kernel()
    def origin() -> object:
        """A plane of three constants."""
        return PGA3.multivector({"e1": 1, "e2": 2, "e3": 3})

    compiled = gacompiler.compile(origin, backend)
    assert compiled().tolist() == [1, 2, 3]
    out = np.empty(3)
    assert compiled(out=out) is out and out.tolist() == [1, 2, 3]
