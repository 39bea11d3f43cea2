"""Settings for the whole run of tests."""

from __future__ import annotations

import contextlib
import gc
import importlib
import os
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

# Before numpy is loaded, here and in the processes that tests start. Workers share the processors, and threads of BLAS
# that wait for one another spin: with two threads, tests of networks took up to five times their CPU seconds.
for _library in ("OPENBLAS", "OMP", "MKL"):
    os.environ.setdefault(f"{_library}_NUM_THREADS", "1")

# Until all tests are collected: collection creates many objects that live to the end, and scanning them takes long.
gc.disable()


def pytest_collection(session: pytest.Session) -> None:
    """Let the second worker import the files of tests from the last one on, before it collects them in order.

    Where there is no bytecode, each of two workers would otherwise compile every file at the same time as the other.
    """
    if os.environ.get("PYTEST_XDIST_WORKER") != "gw1":
        return
    for path in sorted((file for each in session.config.args for file in Path(each).rglob("test_*.py")), reverse=True):
        if str(path.parent) not in sys.path:
            sys.path.insert(0, str(path.parent))
        with contextlib.suppress(Exception, pytest.skip.Exception):  # reported when the file is collected
            importlib.import_module(path.stem)


def pytest_collection_finish() -> None:
    """Exclude objects made by test collection from garbage collections: each takes a second, and some tests run many.

    Compiled kernels and tables that are cached grow with the tests, and looking through them took a seventh of the
    time. Garbage is looked for after two million new objects, some 150 MB, as in processes that compile.
    """
    gc.freeze()
    gc.set_threshold(2_000_000)
    gc.enable()


def pytest_sessionfinish() -> None:
    """Exclude what ends with the process: plugins collect garbage once more, among the objects of all tests."""
    gc.freeze()


@pytest.fixture(scope="session", autouse=True)
def builds() -> Iterator[None]:
    """Compile operations on objects only where a test waits for them.

    Otherwise the C compiler builds each operation that any test uses once, in the background: 1,100 libraries with an
    empty cache, a third of the CPU seconds of all tests. Results do not depend on it. Programs that tests start do as
    users' programs do.
    """
    from gacompiler.objects import background, native

    native.extension()
    for job in background.QUEUE.waiting:
        background.QUEUE.finish(job)
    start, background.Queue.start = background.Queue.start, lambda queue: None  # type: ignore[method-assign]
    yield
    background.Queue.start = start  # type: ignore[method-assign]
