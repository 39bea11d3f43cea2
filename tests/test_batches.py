"""An element has the same result in a batch as alone, to the last bit, wherever the batch lies."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np
import pytest

from gacompiler.generate import own_specs

N_ELEMENTS = 83
"""Some blocks of a loop, and what is left of one."""


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("name", [path.stem for path in own_specs()])
def test_an_element_alone_and_in_a_batch(name: str, dtype: Any) -> None:
    module = importlib.import_module(f"generated.{name}")
    rng = np.random.default_rng(3)
    for each in module.kernels:
        kernel = getattr(module, each)
        arrays = [rng.normal(size=(N_ELEMENTS, *shape)).astype(dtype) for shape in kernel._shapes]
        # An element twice makes every product of it with itself that should vanish a difference of equal products.
        arrays = [arrays[0] if a.shape == arrays[0].shape and rng.random() < 0.5 else a for a in arrays]
        with np.errstate(all="ignore"):
            alone = [_results(kernel(*(array[i] for array in arrays))) for i in range(N_ELEMENTS)]
            for order in "CF":
                batch = _results(kernel(*(np.asarray(array, order=order) for array in arrays)))
                for k, result in enumerate(batch):
                    one = np.array([results[k] for results in alone])
                    assert one.dtype == result.dtype == dtype
                    np.testing.assert_array_equal(result, one, f"{name}.{each}, {order} order")


def _results(found: Any) -> tuple[Any, ...]:
    return found if isinstance(found, tuple) else (found,)


def test_a_bivector_of_a_vector_with_itself_is_zero_in_a_batch() -> None:
    from generated import vga2

    a = np.random.default_rng(0).normal(size=(1000, 2))
    assert not vga2.vector_product(a, a)[:, 1:].any()
