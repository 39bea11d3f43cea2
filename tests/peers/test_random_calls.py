"""Many calls with arbitrary arguments give a correct result or an error that names the argument."""

from __future__ import annotations

import importlib
from collections import Counter
from typing import Any

import numpy as np
import pytest

from gacompiler.generation.checked_in import own_specs

pytestmark = pytest.mark.peers

MODULES = [path.stem for path in own_specs()]
N_CALLS = 250_000
LEADING = ((), (), (), (1,), (3,), (17,), (0,), (2, 3), (1, 3), (3, 1), (2, 0))
JUNK = (None, "motor", b"", object(), [], [[1.0], [2.0, 3.0]], {}, 1j, np.array("x"), np.ones(3, bool), np.ones(3, "O"))


def _good(rng: np.random.Generator, shape: tuple[int, ...]) -> Any:
    """An array in one of the forms that numpy supports."""
    leading = LEADING[rng.integers(len(LEADING))]
    kind = rng.integers(12)
    if not shape and not leading:
        return (0.5, 2, np.float64(0.3), np.float32(0.7), np.array(0.2), np.array(3.0, np.float32))[kind % 6]
    array = rng.normal(size=leading + shape)
    match kind:
        case 0:
            return array.astype(np.float32)
        case 1:
            return np.asfortranarray(array)
        case 2:
            return np.repeat(array, 2, axis=-1)[..., ::2]
        case 3:
            return array[::-1] if leading or shape else array
        case 4:
            return np.broadcast_to(array, (2, *array.shape)) if len(leading) < 2 else array
        case 5:
            return array.tolist()
        case 6:
            array.flags.writeable = False
            return array
        case 7:
            return array.astype(">f8")
        case 8:
            return np.frombuffer(b"\0" + array.tobytes(), np.uint8)[1:].view(np.float64).reshape(array.shape)
        case 9:
            return np.where(rng.random(array.shape) < 0.2, (np.nan, np.inf, -np.inf, 0.0, 1e308)[kind % 5], array)
    return array


def _bad(rng: np.random.Generator, shape: tuple[int, ...]) -> Any:
    """An invalid argument, or one of another kernel."""
    kind = rng.integers(len(JUNK) + 4)
    if kind < len(JUNK):
        return JUNK[kind]
    wrong = (*shape[:-1], shape[-1] + int(rng.choice([-1, 1, 5]))) if shape else (2,)
    return rng.normal(size=wrong) if kind % 2 else np.ones(shape, np.int64 if kind % 3 else np.float16)


def _out(rng: np.random.Generator, kernel: Any, arrays: list[Any]) -> Any:
    """A valid or invalid `out`."""
    shape = kernel.definition.out_shapes[0]
    choices = (np.empty(shape), np.empty((3, *shape)), np.empty(shape, np.float32), [0.0], arrays[0], np.empty((7, 7)))
    return choices[rng.integers(len(choices))]


def _leading(kernel: Any, arrays: list[Any]) -> tuple[int, ...]:
    return np.broadcast_shapes(
        *(
            np.shape(array)[: np.ndim(array) - len(shape)]
            for array, shape in zip(arrays, kernel.definition.shapes, strict=True)
        )
    )


@pytest.mark.parametrize("name", MODULES)
def test_random_calls(name: str) -> None:
    module = importlib.import_module(f"generated.{name}")
    kernels = [getattr(module, each) for each in module.kernels]
    kernels = [kernel for kernel in kernels if isinstance(kernel, module.Kernel)]
    if not kernels:
        pytest.skip("kernels with loops have random calls of their own, in tests/gac_runtime/test_loop_kernel.py")
    rng = np.random.default_rng(MODULES.index(name))
    met: Counter[str] = Counter()
    with np.errstate(all="ignore"):
        for _ in range(N_CALLS // len(MODULES)):
            kernel = kernels[rng.integers(len(kernels))]
            arrays = [(_bad if rng.random() < 0.08 else _good)(rng, shape) for shape in kernel.definition.shapes]
            more: dict[str, Any] = {}
            if rng.random() < 0.1:
                more["out"] = _out(rng, kernel, arrays)
            if rng.random() < 0.05:
                more["num_threads"] = (1, 2, 0, "two")[rng.integers(4)]
            if rng.random() < 0.02:
                arrays = arrays[:-1]
            try:
                results = kernel(*arrays, **more)
            except (TypeError, ValueError) as error:
                assert str(error)
                met["refused"] += 1
                continue
            met["done"] += 1
            leading = _leading(kernel, arrays)
            several = results if isinstance(results, tuple) else (results,)
            for result, shape in zip(several, kernel.definition.out_shapes, strict=True):
                assert np.shape(result) == leading + shape
    assert min(met["done"], met["refused"]) > N_CALLS // len(MODULES) // 10
