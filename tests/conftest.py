"""What holds for the whole run of tests."""

from __future__ import annotations

import gc

gc.disable()  # Until all tests are collected: what that makes stays, and to look through it takes as long as the rest.


def pytest_collection_finish() -> None:
    """Leave what collection made out of later collections of garbage: a second each, and some tests ask for many.

    Compiled kernels and tables that are cached grow with the tests, and looking through them took a seventh of the
    time, so that garbage is looked for more rarely than Python does.
    """
    gc.collect()
    gc.freeze()
    gc.set_threshold(20_000, 20, 100)
    gc.enable()
