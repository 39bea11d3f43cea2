"""The requirements of dask, xarray and Ray on functions; tests/peers/test_large_data.py tests the libraries."""

from __future__ import annotations

import importlib
import multiprocessing
import pkgutil
import re
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from typing import Any

import numpy as np

import generated
from generated import pga3
from tests.support.all_cases import all_cases

_NAMES = [info.name for info in pkgutil.iter_modules(generated.__path__) if not info.ispkg]
MODULES = [importlib.import_module(f"generated.{name}") for name in _NAMES]
KERNELS = [getattr(module, name) for module in MODULES for name in module.kernels]
STRAIGHT = [kernel for kernel in KERNELS if isinstance(kernel, pga3.Kernel)]
"""Modules without loops, whose arguments have fixed shapes."""


def shapes(signature: str) -> tuple[list[tuple[int, ...]], list[tuple[int, ...]]]:
    """The shapes of one element's arguments and results, read from a signature."""
    parts = [re.findall(r"\(([\d,]*)\)", side) for side in signature.split("->")]
    inputs, outputs = ([tuple(map(int, filter(None, text.split(",")))) for text in side] for side in parts)
    return inputs, outputs


@all_cases("module, dtype", [*((module, np.float64) for module in MODULES), (pga3, np.float32)])
def test_no_elements(module: Any, dtype: Any) -> None:
    """Every kernel accepts empty batches, which schedulers use to infer types and shapes.

    In float32 those of one module suffice, since others would be compiled for this test only.
    """
    assert len(module.kernels) > 0
    for kernel in (kernel for kernel in STRAIGHT if kernel.__module__ == module.__name__):
        inputs, outputs = shapes(kernel.signature)
        for first, others, leading in (((0,), (0,), (0,)), ((5, 0), (), (5, 0)), ((0, 1), (1, 4), (0, 4))):
            lead = [first, *[others] * (len(inputs) - 1)]
            if len(inputs) == 1:
                leading = first
            arguments = [np.ones(extra + shape, dtype) for extra, shape in zip(lead, inputs, strict=True)]
            found = kernel(*arguments)
            found = found if isinstance(found, tuple) else (found,)
            assert [(a.shape, a.dtype) for a in found] == [(leading + shape, dtype) for shape in outputs], kernel


def test_output_sizes_are_those_of_the_signature() -> None:
    for kernel in STRAIGHT:
        named = {str(size): size for shape in shapes(kernel.signature)[1] for size in shape}
        assert kernel.output_sizes == named
    assert pga3.motor_to_rotor_translation.output_sizes == {"4": 4, "3": 3}
    assert pga3.motor_to_matrix.output_sizes == {"4": 4}
    assert pga3.distance_points.output_sizes == {}


def batch(n: int) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    """Motors, points, and the points moved by matrices."""
    rng = np.random.default_rng(n)
    m, p = pga3.motor_exponential(rng.normal(size=(n, 6))), rng.normal(size=(n, 3))
    matrix = pga3.motor_to_matrix(m)
    return m, p, (matrix[:, :3, :3] @ p[..., None])[..., 0] + matrix[:, :3, 3]


def test_signature_is_read_by_numpy() -> None:
    m, p, right = batch(7)
    function = np.vectorize(pga3.move_point, signature=pga3.move_point.signature)
    np.testing.assert_allclose(function(m, p), right, 0, 1e-13)


def test_arrays_as_schedulers_pass_them() -> None:
    """Arrays may be read-only, unaligned, or stored with coefficients first."""
    m, p, right = batch(50)
    raw = np.frombuffer(b"\0" + m.tobytes(), np.uint8)[1:].view(np.float64).reshape(m.shape)
    assert not raw.flags.aligned and not raw.flags.writeable
    fixed = p.copy()
    fixed.flags.writeable = False
    for arguments in ((raw, fixed), (np.asfortranarray(m), fixed), (m, np.asfortranarray(fixed)), (m, fixed)):
        np.testing.assert_allclose(pga3.move_point(*arguments), right, 0, 1e-13)
        np.testing.assert_allclose(pga3.move_point(*(a[3] for a in arguments)), right[3], 0, 1e-13)
        np.testing.assert_allclose(pga3.move_point(*(a[::-2] for a in arguments)), right[::-2], 0, 1e-13)


def test_another_process() -> None:
    """Kernels are pickled by name; arguments and results are arrays."""
    m, p, right = batch(50)
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        found = pool.submit(pga3.move_point, m, p).result()
    np.testing.assert_allclose(found, right, 0, 1e-13)


def test_many_threads() -> None:
    """Concurrent calls of one kernel with many shapes, so that cached plans are created and dropped meanwhile."""
    cases = [batch(n) for n in range(1, 400)]
    with ThreadPoolExecutor(8) as pool:
        results = list(pool.map(lambda case: pga3.move_point(case[0], case[1]), cases))
    for found, (_, _, right) in zip(results, cases, strict=True):
        np.testing.assert_allclose(found, right, 0, 1e-12)
