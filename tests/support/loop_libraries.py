"""Libraries of kernels with loops, called through ctypes as C programs call them."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from math import prod
from pathlib import Path
from typing import Any

import numpy as np
from loop_examples import shape_of

from gacompiler.backends import build_library, c_header, c_source, runtime_files
from gacompiler.backends.module import ModuleSource
from gacompiler.generation.files import write as write_files
from gacompiler.ir.procedure import Procedure, Storage

Array = np.ndarray[Any, Any]
SUFFIX = {np.dtype(np.float64): "f64", np.dtype(np.float32): "f32"}


def build_loops(module: ModuleSource, folder: Path) -> ctypes.CDLL:
    """Build the library of a module."""
    write_files(runtime_files(), folder)
    (folder / f"{module.name}.c").write_text(c_source(module))
    (folder / f"{module.name}.h").write_text(c_header(module))
    library = build_library(folder / f"{module.name}.c")
    assert library is not None
    return ctypes.CDLL(str(library))


def call_one(
    library: ctypes.CDLL, module: str, procedure: Procedure, lengths: Mapping[str, int], arguments: Mapping[str, Array]
) -> list[Array]:
    """Call the plain function of one element; check that nothing is written past results and work space."""
    dtype = _dtype(procedure, arguments)
    real = ctypes.c_double if dtype == np.float64 else ctypes.c_float
    sizes = [ctypes.c_ssize_t(lengths[name]) for name in procedure.lengths]
    work_size = library[f"{module}_{procedure.name}_work"]
    work_size.restype = ctypes.c_ssize_t
    results = [np.full(prod(shape_of(table, lengths)) + 1, 7, dtype) for table in procedure.results]
    work = np.full(work_size(*sizes) + 1, 7, dtype)
    passed: list[Any] = list(sizes)
    kept = []
    for table in procedure.parameters:
        array = np.asarray(arguments[table.name], order="C")
        kept.append(array)
        is_number = table.storage is Storage.ARGUMENT and not table.lengths and not table.shape
        passed.append(real(array.item()) if is_number else ctypes.c_void_p(array.ctypes.data))
    passed += [ctypes.c_void_p(array.ctypes.data) for array in (*results, work)]
    library[f"{module}_{procedure.name}_{SUFFIX[dtype]}"](*passed)
    assert all(array[-1] == 7 for array in (*results, work))
    shapes = [shape_of(table, lengths) for table in procedure.results]
    return [array[:-1].reshape(shape) for array, shape in zip(results, shapes, strict=True)]


def call_rows(
    library: ctypes.CDLL,
    module: str,
    procedure: Procedure,
    lengths: Mapping[str, int],
    arguments: Mapping[str, Array],
    count: int,
) -> list[Array]:
    """Call the function of a batch: arguments have one additional leading axis or are the same for all elements."""
    dtype = _dtype(procedure, arguments)
    arrays, steps = [], []
    for table in procedure.parameters:
        array = np.asarray(arguments[table.name], order="C")
        varies = array.ndim > len(shape_of(table, lengths))
        arrays.append(array)
        steps.append(array.strides[0] if varies else 0)
    for table in procedure.results:
        shape = shape_of(table, lengths)
        # The stride between elements is larger than an element.
        arrays.append(np.full((count, prod(shape) + 1), 7, dtype))
        steps.append(arrays[-1].strides[0])
    sizes = (ctypes.c_ssize_t * len(procedure.lengths))(*(lengths[name] for name in procedure.lengths))
    pointers = (ctypes.c_void_p * len(arrays))(*(array.ctypes.data for array in arrays))
    strides = (ctypes.c_ssize_t * len(steps))(*steps)
    function = library[f"{module}_{procedure.name}_rows_{SUFFIX[dtype]}"]
    assert function(sizes, pointers, strides, ctypes.c_ssize_t(count)) == 0
    results = arrays[len(procedure.parameters) :]
    assert all((array[:, -1] == 7).all() for array in results)
    shapes = [shape_of(table, lengths) for table in procedure.results]
    return [array[:, :-1].reshape(count, *shape) for array, shape in zip(results, shapes, strict=True)]


def _dtype(procedure: Procedure, arguments: Mapping[str, Array]) -> Any:
    return next(arguments[t.name].dtype for t in procedure.parameters if t.storage is Storage.ARGUMENT)
