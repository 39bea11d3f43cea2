"""Run a test for many small cases as one test."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable
from functools import wraps
from typing import Any

import pytest

_MARKED = type(pytest.param())


def all_cases(names: str, cases: Iterable[Any]) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Return a decorator like ``pytest.mark.parametrize`` that runs all cases in one test.

    Two workers collect each case of `parametrize`, set it up and report it, which takes longer than a case of less than
    a few milliseconds. The error of a case has a note with its values. Fixtures are those of the whole test.
    """
    keys = [name.strip() for name in names.split(",")]
    listed = list(cases)
    rows = [tuple(case) if len(keys) > 1 else (case,) for case in listed]
    for case, row in zip(listed, rows, strict=True):
        if isinstance(case, _MARKED) or len(row) != len(keys):
            raise ValueError(f"{case!r:.200}: expected a value of each of {names}, without marks")

    def decorate(test: Callable[..., None]) -> Callable[..., None]:
        @wraps(test)
        def run(**fixtures: Any) -> None:
            for row in rows:
                values = dict(zip(keys, row, strict=True))
                try:
                    test(**fixtures, **values)
                except pytest.skip.Exception:
                    assert row is rows[0], "a case that is skipped would skip the others; leave it out"
                    raise
                except BaseException as error:
                    error.add_note(
                        "in the case " + ", ".join(f"{key} = {value!r:.200}" for key, value in values.items())
                    )
                    raise

        signature = inspect.signature(test)
        others = [each for name, each in signature.parameters.items() if name not in keys]
        run.__signature__ = signature.replace(parameters=others)  # type: ignore[attr-defined]
        return run

    return decorate
