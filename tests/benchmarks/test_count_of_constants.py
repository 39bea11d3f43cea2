"""The counts of constants, for a text whose constants are known."""

from __future__ import annotations

from benchmarks.constants import Counts, counts_of

TEXT = '''
_LIMIT = 0.3
"""Half of the fraction that is expected."""
_STEPS, _LAST = 10, 2 * _LIMIT
_NAMES = ("a", "b")
_IS_FAST = True


def f(x, scale=1.5):
    """Return 0.25 of it."""
    return 0.5 * x + 0.7 * scale + 3
'''


def test_constants_and_decimals_are_counted() -> None:
    """Texts, truth values, halves and whole numbers are not."""
    assert counts_of(TEXT) == Counts(constants=2, unexplained=1, decimals=1)
