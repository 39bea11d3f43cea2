"""Format tables and numbers as text."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Sequence

MISSING = "–"


def paragraph(*sentences: str) -> str:
    """Join sentences, and wrap them to lines of at most 120 characters."""
    return _wrapped(" ".join(sentences))


def item(*sentences: str) -> str:
    """Return a list item of wrapped sentences."""
    return _wrapped(" ".join(sentences), "- ", "  ")


def _wrapped(text: str, first: str = "", further: str = "") -> str:
    return textwrap.fill(
        text, 120, initial_indent=first, subsequent_indent=further, break_long_words=False, break_on_hyphens=False
    )


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table, followed by a line break."""
    lines = ["| " + " | ".join(header) + " |", "|" + "|".join("---" for _ in header) + "|"]
    lines += ["| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in rows]
    return "\n".join([*lines, ""])


def seconds(value: float) -> str:
    """Format a time in seconds or milliseconds, with the unit."""
    return f"{value:.1f} s" if value >= 10 else f"{value:.2f} s" if value >= 1 else f"{1e3 * value:.0f} ms"


def ns(value: float) -> str:
    """Format a time given in seconds as nanoseconds, without the unit."""
    value *= 1e9
    return f"{value:,.0f}" if value >= 100 else f"{value:.1f}" if value >= 10 else f"{value:.2f}"


def ratio(value: float) -> str:
    """Format a quotient with two digits."""
    return f"{value:,.0f}" if value >= 10 else f"{value:.1f}" if value >= 1 else f"{value:.2f}"
