"""Run under the address and undefined-behaviour sanitizers: kernels on arrays of every kind, and on other objects.

``python sanitized.py FOLDER LIBRARY ROUNDS MODULE...`` imports the modules from the folder. The library of all of them
was built with the sanitizers, which end the process at the first access out of bounds. Kernels that it has for doubles
alone are not called with floats.
"""

import ctypes
import importlib.util
import sys
from pathlib import Path
from typing import Any

import numpy as np

JUNK = (None, "motor", b"", object(), [], [[1.0], [2.0, 3.0]], {}, 1j, np.array("x"), np.ones(3, bool), np.ones(3, "O"))


def an_array(random: np.random.Generator, leading: tuple[int, ...], shape: tuple[int, ...], dtype: type) -> np.ndarray:
    """Random numbers of a random kind: dense, Fortran order, gaps, backwards, one element for all, not aligned."""
    kind = random.integers(8)
    whole = (*leading, *shape)
    if kind == 0 and leading:
        kept = tuple(1 if random.integers(2) else n for n in leading)
        return np.broadcast_to(random.normal(size=(*kept, *shape)).astype(dtype), whole)
    if kind == 1:
        return np.asfortranarray(random.normal(size=whole).astype(dtype))
    if kind == 2 and whole:
        steps = tuple(int(n) for n in random.integers(1, 4, len(whole)))
        wide = random.normal(size=tuple(n * s for n, s in zip(whole, steps, strict=True))).astype(dtype)
        return wide[tuple(slice(None, None, s) for s in steps)]
    if kind == 3 and whole:
        return random.normal(size=whole).astype(dtype)[tuple(slice(None, None, -1) for _ in whole)]
    if kind == 4 and leading:
        far = np.zeros((*leading, 5000), dtype)
        size = int(np.prod(shape, dtype=int))
        far[..., :size] = random.normal(size=(*leading, size))
        return (
            far[..., :size].reshape(whole)
            if not shape
            else np.lib.stride_tricks.as_strided(
                far, whole, (*far.strides[:-1], *random.normal(size=shape).astype(dtype).strides)
            )
        )
    array = random.normal(size=whole).astype(dtype)
    if kind == 5:
        return np.frombuffer(b"\0" + array.tobytes(), np.uint8)[1:].view(dtype).reshape(whole)
    return array.astype(array.dtype.newbyteorder()) if kind == 6 else array


def leading_shape(random: np.random.Generator) -> tuple[int, ...]:
    """Leading axes of a batch: none, empty, one, around the width of a block, several axes."""
    return ((), (0,), (1,), (2,), (15,), (16,), (17,), (129,), (1100,), (3, 0, 2), (1, 5), (4, 7), (2, 3, 4))[
        random.integers(13)
    ]


def call_with_loops(random: np.random.Generator, kernel: Any, leading: tuple[int, ...], dtype: Any) -> None:
    """Call a kernel with loops on arrays of random lengths, and index tables that name rows that are there."""
    lengths = {name: int(random.integers(1, 6)) for name in kernel.lengths}
    arrays = []
    for table in kernel.definition.parameters:
        core = table.core(lengths)
        if not table.is_index:
            arrays.append(an_array(random, leading if random.integers(3) else (), core, dtype))
            continue
        least = -1 if table.rule.endswith("-1") else 0
        earlier = table.rule.startswith("an earlier")
        most = [k if earlier else lengths[table.into] for k in range(core[0])]
        rows = [random.integers(least, max(end, least + 1), core[1:]) for end in most]
        arrays.append(np.array(rows, np.int64))
    kernel(*arrays)


def main(folder: str, name: str, library: ctypes.CDLL, rounds: int) -> None:
    """Call every kernel that the library has `rounds` times."""
    spec = importlib.util.spec_from_file_location(name, Path(folder) / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    assert module.backend == "c", module.backend
    random = np.random.default_rng(1)
    count = 0
    with np.errstate(all="ignore"):
        for kernel in map(module.__dict__.__getitem__, module.kernels):
            is_straight = isinstance(kernel, module.Kernel)
            loop = f"{name}_{kernel.name}_loop" if is_straight else f"{name}_{kernel.name}"
            if not hasattr(library, f"{loop}_f64"):
                continue
            dtypes = [np.float64, *([np.float32] if hasattr(library, f"{loop}_f32") else [])]
            for _ in range(rounds):
                dtype = dtypes[random.integers(len(dtypes))]
                leading = leading_shape(random)
                if not is_straight:
                    call_with_loops(random, kernel, leading, dtype)
                    count += 1
                    continue
                arrays = [
                    an_array(random, leading if random.integers(3) else (), shape, dtype)
                    for shape in kernel.definition.shapes
                ]
                if arrays and random.integers(12) == 0:
                    arrays[random.integers(len(arrays))] = JUNK[random.integers(len(JUNK))]
                    try:
                        kernel(*arrays)
                    except (TypeError, ValueError) as error:
                        assert str(error)
                    continue
                result = kernel(*arrays)
                several = result if isinstance(result, tuple) else (result,)
                assert all(
                    np.shape(each)[np.ndim(each) - len(shape) :] == shape
                    for each, shape in zip(several, kernel.definition.out_shapes, strict=True)
                )
                if random.integers(2) and len(kernel.definition.out_shapes) == 1 and isinstance(result, np.ndarray):
                    out = np.empty((*result.shape, 2), dtype)[..., random.integers(2)]
                    kernel(*arrays, out=out)
                count += 1
    print(name, count, "calls", flush=True)


if __name__ == "__main__":
    # Modules find their runtime in this folder. The extension is compiled by the command that the environment names.
    sys.path.insert(0, sys.argv[1])
    importlib.import_module("gac_runtime.build").build_extension(Path(sys.argv[1]))
    for name in sys.argv[4:]:
        main(sys.argv[1], name, ctypes.CDLL(sys.argv[2]), int(sys.argv[3]))
