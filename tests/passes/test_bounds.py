"""Lower bounds: values that are known in closed form, and no bound above the count of a program that exists."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from known import compositions_pga2, pga3

from gacompiler import SCALAR, inner_product, kernel, normalize, sandwich
from gacompiler.algebra.catalog import PGA2, PGA3, VGA3
from gacompiler.frontend.kernel import Kernel
from gacompiler.passes.bounds import Bound, lower_bound
from gacompiler.passes.pipeline import compile_kernel
from tests.support.all_cases import all_cases

V = VGA3.VECTOR


@all_cases(
    "function, layouts, products, operations",
    [
        (inner_product, (V, V), 3, 5),
        (lambda a, b: a ^ b, (V, V), 3, 3),
        (lambda a, b: 3 * a + b, (V, V), 0, 3),
        (lambda a, b: a * b, (PGA3.MOTOR, PGA3.MOTOR), 8, 8),
        (sandwich, (PGA2.MOTOR, PGA2.POINT), 2, 4),
    ],
)
def test_bounds_in_closed_form(
    function: Callable[..., Any], layouts: tuple[Any, ...], products: int, operations: int
) -> None:
    def definition(a: Any, b: Any) -> Any:
        return function(a, b)

    declared = kernel(**dict(zip("ab", layouts, strict=True)))(definition)
    record = compile_kernel(declared, forms=False, effort=0)
    assert lower_bound(declared, record.program) == Bound(products, operations)


def test_results_that_depend_on_each_other_count_once() -> None:
    @kernel(a=SCALAR, b=SCALAR, c=SCALAR)
    def definition(a, b, c):  # type: ignore[no-untyped-def]
        e1, e2, e3 = VGA3.basis()
        return a * b * e1 + b * c * e2 + (a * b + b * c + 3 * a + 1) * e3

    record = compile_kernel(definition, forms=False, effort=0)
    found = lower_bound(definition, record.program)
    assert found is not None and found.products == 2


def test_kernels_with_functions_have_no_bound() -> None:
    @kernel(x=V)
    def definition(x):  # type: ignore[no-untyped-def]
        return normalize(x)

    assert lower_bound(definition, compile_kernel(definition, forms=False, effort=0).program) is None


@pytest.mark.slow
def test_no_bound_is_above_a_count() -> None:
    kernels = [
        each for module in (compositions_pga2, pga3) for each in vars(module).values() if isinstance(each, Kernel)
    ]
    assert len(kernels) > 20
    for each in kernels:
        record = compile_kernel(each, forms=False, effort=0)
        cost, found = record.cost, lower_bound(each, record.program)
        if found is not None:
            assert found.products <= cost.mul + cost.div and found.operations <= cost.total
