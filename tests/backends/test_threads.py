"""Batches on several threads: the same numbers for any number of threads and any memory layout."""

from __future__ import annotations

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from backend_programs import DISTANCE, MOVE_POINT, NORMALIZE, expected, inputs

from gacompiler.gac_runtime.threads import in_threads
from tests.support.all_cases import all_cases

PROGRAMS = (MOVE_POINT, NORMALIZE, DISTANCE)
LARGE = 120_001
"""Enough elements to start threads; not a multiple of block sizes."""


def results(found: Any) -> list[np.ndarray[Any, Any]]:
    return list(found) if isinstance(found, tuple) else [found]


@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("program", PROGRAMS, ids=lambda program: program.name)
def test_results_do_not_depend_on_threads(program: Any, dtype: Any, order: Any, module: ModuleType) -> None:
    kernel = getattr(module, program.name)
    arrays = inputs(program, (LARGE,), dtype, order)
    alone = results(kernel(*arrays, num_threads=1))
    for n_threads in (2, 3, np.int64(7)):
        for one, other in zip(alone, results(kernel(*arrays, num_threads=n_threads)), strict=True):
            np.testing.assert_array_equal(one, other)
    for one, known in zip(alone, expected(program, arrays), strict=True):
        np.testing.assert_allclose(one, known, rtol=20 * np.finfo(dtype).eps, atol=20 * np.finfo(dtype).eps)


def test_threads_with_strides_axes_and_uniform_arguments(module: ModuleType) -> None:
    m, p = inputs(MOVE_POINT, (200, 300))
    cases = [
        (m[::-1, ::2], p[:, :150]),
        (m[0, 0], p),
        (m[:, :1], p),
        (m, p[:1]),
        (np.moveaxis(m, 0, 1), np.moveaxis(p, 0, 1)),
    ]
    for case in cases:
        np.testing.assert_array_equal(module.move_point(*case, num_threads=2), module.move_point(*case))


def test_threads_write_to_out_and_over_an_argument(module: ModuleType) -> None:
    m, p = inputs(MOVE_POINT, (LARGE,))
    known = module.move_point(m, p)
    for order in "CF":
        out = np.empty_like(p, order=order)
        assert module.move_point(m, p, out=out, num_threads=2) is out
        np.testing.assert_array_equal(out, known)
        over = p.copy(order)
        module.move_point(m, over, out=over, num_threads=2)
        np.testing.assert_array_equal(over, known)
    shifted = np.concatenate([p, p[:1]])
    module.move_point(m, shifted[:-1], out=shifted[1:], num_threads=2)
    np.testing.assert_array_equal(shifted[1:], known)


def test_the_module_gives_the_default_number_of_threads(module: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    m, p = inputs(MOVE_POINT, (LARGE,))
    known = module.move_point(m, p)
    assert module.num_threads == 1
    monkeypatch.setattr(module, "num_threads", 2)
    np.testing.assert_array_equal(module.move_point(m, p), known)
    monkeypatch.setattr(module, "num_threads", 0)
    with pytest.raises(ValueError, match="num_threads is 0; expected a positive integer"):
        module.move_point(m, p)


@all_cases("wrong", [0, -1, 1.5, "2", True])
def test_a_wrong_number_of_threads_is_rejected(wrong: Any, module: ModuleType) -> None:
    for n in (1, LARGE):
        with pytest.raises(ValueError, match=r"move_point: num_threads is .*; expected a positive integer"):
            module.move_point(*inputs(MOVE_POINT, (n,)), num_threads=wrong)


def test_calls_from_several_threads(module: ModuleType) -> None:
    m, p = inputs(MOVE_POINT, (LARGE,))
    known = module.move_point(m, p)
    with ThreadPoolExecutor(4) as threads:
        for found in threads.map(lambda _: module.move_point(m, p, num_threads=2), range(12)):
            np.testing.assert_array_equal(found, known)


PROGRAM = """
import os, sys
import numpy as np
from generated import vga3
r, v = np.random.default_rng(0).normal(size=(2, 50000, 4))
known = vga3.rotor_product(r, v)
assert vga3.num_threads == int(os.environ["GAC_NUM_THREADS"])
child = os.fork() if hasattr(os, "fork") else 0
same = (vga3.rotor_product(r, v) == known).all()
if not child:
    os._exit(0 if same else 1)
assert same and os.waitpid(child, 0)[1] == 0
"""


@all_cases("work, count", [(1 << 23, 8), (1 << 27, 8), ((1 << 27) + 1, 2)])
def test_pieces_are_whole_cache_lines_and_those_of_large_results_few(work: int, count: int) -> None:
    pieces: list[tuple[int, int]] = []
    in_threads(lambda first, size: pieces.append((first, size)), 6405, 2, work)
    pieces.sort()
    assert len(pieces) == count and all(first % 64 == 0 for first, _ in pieces)
    assert [0, *(first + size for first, size in pieces)] == [*(first for first, _ in pieces), 6405]


def test_a_pool_of_threads_does_not_outlive_a_fork() -> None:
    root = Path(__file__).parents[2]
    environment = {**os.environ, "GAC_NUM_THREADS": "2", "PYTHONPATH": str(root)}
    subprocess.run([sys.executable, "-c", PROGRAM], env=environment, check=True, timeout=60)
    wrong = subprocess.run(
        [sys.executable, "-c", "from generated import vga3"],
        env={**environment, "GAC_NUM_THREADS": "many"},
        capture_output=True,
        text=True,
        cwd=root,
    )
    assert wrong.returncode == 1 and "GAC_NUM_THREADS: 'many'; expected a positive integer" in wrong.stderr
