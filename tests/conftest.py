"""Settings for the whole run of tests."""

from __future__ import annotations

import gc
import os

# Before numpy is loaded, here and in the processes that tests start. Workers share the processors, and threads of BLAS
# that wait for one another spin: with two threads, tests of networks took up to five times their CPU seconds.
for _library in ("OPENBLAS", "OMP", "MKL"):
    os.environ.setdefault(f"{_library}_NUM_THREADS", "1")

# Until all tests are collected: collection creates many objects that live to the end, and scanning them takes long.
gc.disable()


def pytest_collection_finish() -> None:
    """Exclude objects made by test collection from garbage collections: each takes a second, and some tests run many.

    Compiled kernels and tables that are cached grow with the tests, and looking through them took a seventh of the
    time, so that garbage is looked for more rarely than Python does.
    """
    gc.collect()
    gc.freeze()
    gc.set_threshold(20_000, 20, 100)
    gc.enable()
