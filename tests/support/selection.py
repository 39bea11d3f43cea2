"""Mark those cases of a test that only ``make slow`` runs."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest


def some_slow(cases: Iterable[Any], *slow: Any) -> list[Any]:
    """The cases of a test for ``pytest.mark.parametrize``, those in `slow` marked as slow."""
    listed = list(cases)
    unknown = [case for case in slow if case not in listed]
    if unknown:
        raise ValueError(f"{unknown}: marked as slow; expected some of {listed}")
    return [case if case not in slow else _slow(case) for case in listed]


def _slow(case: Any) -> Any:
    values = case if isinstance(case, tuple) else (case,)
    return pytest.param(*values, marks=pytest.mark.slow)
