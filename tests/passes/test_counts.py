"""Operation counts of known expressions. A higher count fails; record a lower one in `known_counts.py`.

`test_operation_counts.py` compares all of them, and those of further expressions.
"""

from __future__ import annotations

import pytest
from known import cga3, pga3
from known_counts import COUNTS

from gacompiler import Kernel
from gacompiler.passes.pipeline import compile_kernel


def kernels() -> dict[str, Kernel]:
    """Every kernel of the two files."""
    return {v.name: v for module in (pga3, cga3) for v in vars(module).values() if isinstance(v, Kernel)}


SLOW = (
    *("composed_motors_point", "nested_motors_point", "join_of_moved_points", "versor_vector", "sphere_4_points"),
    *("distance_squared_of_moved_points", "circle_3_points", "full_product", "even_product", "motor_line"),
)
"""Kernels that take more than half a second to compile."""


@pytest.mark.parametrize("name", [name for name in COUNTS if name not in SLOW])
def test_counts_equal_the_recorded_ones(name: str) -> None:
    cost = compile_kernel(kernels()[name], forms=False).cost
    assert (cost.mul, cost.add) == COUNTS[name][1], (
        f"{name}: {cost}; record it in known_counts.py if it is an improvement"
    )


def test_every_known_kernel_is_counted() -> None:
    assert set(kernels()) == set(COUNTS)
    assert all(sum(reached) <= sum(published) for published, reached in COUNTS.values())
