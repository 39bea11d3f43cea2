"""What holds for the whole run of tests."""

from __future__ import annotations

import gc

gc.disable()  # Until all tests are collected: what that makes stays, and to look through it takes as long as the rest.


def pytest_collection_finish() -> None:
    """Leave what collection made out of later collections of garbage: a second each, and some tests ask for many."""
    gc.collect()
    gc.freeze()
    gc.enable()
