"""Thresholds of garbage collection during compilation and after it."""

from __future__ import annotations

import gc
from contextlib import ExitStack

import pytest

from gacompiler.passes.collection import OBJECTS, rare_collection


@pytest.mark.parametrize("before", [(700, 10, 10), (0, 10, 10), (2 * OBJECTS, 5, 5)], ids=str)
def test_thresholds_are_restored_by_the_last_compilation(before: tuple[int, int, int]) -> None:
    """Compilations of two threads overlap: the one that begins first also ends first."""
    known = gc.get_threshold()
    gc.disable()  # the objects of all tests take a second
    gc.set_threshold(*before)
    during = max(before[0], OBJECTS) if before[0] else 0
    try:
        first, second = ExitStack(), ExitStack()
        first.enter_context(rare_collection())
        second.enter_context(rare_collection())
        first.close()
        assert gc.get_threshold() == (during, *before[1:])
        second.close()
        assert gc.get_threshold() == before
        with pytest.raises(ZeroDivisionError), rare_collection():
            raise ZeroDivisionError
        assert gc.get_threshold() == before
    finally:
        gc.set_threshold(*known)
        gc.enable()
