"""Lines and numbers of text files, with errors that name the place, what was found and what was expected."""

from __future__ import annotations

import gzip
import math
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..arguments import Reals

UNIT = 1e-2
"""From floating point: quaternions with three decimals have norms within this of 1."""


class Line(NamedTuple):
    """A line of a file."""

    path: Path
    number: int
    text: str

    def wrong(self, found: str, expected: str) -> ValueError:
        """Return an error at this line."""
        return ValueError(f"{self.path}, line {self.number}: {found}; expected {expected}")

    def numbers(self, words: Sequence[str], expected: str) -> list[float]:
        """Return words as finite numbers.

        Raises
        ------
        ValueError
            If one is no number, or not finite.
        """
        try:
            found = [float(_plain(word)) for word in words]
        except ValueError:
            raise self.wrong(repr(self.text[:60]), expected) from None
        for word, number in zip(words, found, strict=True):
            if not math.isfinite(number):
                raise self.wrong(word, f"finite numbers: {expected}")
        return found

    def whole(self, word: str, expected: str) -> int:
        """Return a word as a whole number of 64 bits.

        Raises
        ------
        ValueError
            If it is none.
        """
        try:
            number = int(_plain(word))
        except ValueError:
            raise self.wrong(repr(word), expected) from None
        if not -(2**63) <= number < 2**63:
            raise self.wrong(word, f"a number of 64 bits: {expected}")
        return number

    def unit(self, quaternion: Sequence[float]) -> None:
        """Check the norm of a quaternion.

        Raises
        ------
        ValueError
            If it is not 1 to two decimals.
        """
        size = math.sqrt(sum(x * x for x in quaternion))
        if not abs(size - 1) <= UNIT:
            raise self.wrong(f"a quaternion of norm {size:.4g}", "norm 1")


def _plain(word: str) -> str:
    """Return a word without underscores, which Python skips in numbers.

    Raises
    ------
    ValueError
        If it has one.
    """
    if "_" in word:
        raise ValueError(word)
    return word


def lines_of(path: str | Path, kind: str) -> list[Line]:
    """Return the lines of a text file, which gzip may have compressed.

    Raises
    ------
    OSError
        If it cannot be read.
    ValueError
        If it is not text, or cut off: compressed data or the last line without an end.
    """
    path = Path(path)
    data = path.read_bytes()
    if data[:2] == b"\x1f\x8b":
        try:
            data = gzip.decompress(data)
        except (EOFError, OSError, zlib.error) as error:
            raise ValueError(f"{path}: {error}; expected {kind}, whole") from None
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise ValueError(f"{path}: not text; expected {kind}") from None
    every = [Line(path, number, line) for number, line in enumerate(text.splitlines(), 1)]
    if not text.strip():
        raise ValueError(f"{path}: an empty file; expected {kind}")
    if not text.endswith(("\n", "\r")):
        raise every[-1].wrong("a line without an end, so that the file may be cut off", "a newline at the end")
    return every


def text_of(rows: Reals, separator: str) -> list[str]:
    """Return rows of numbers as text from which the same numbers are read again."""
    return [separator.join(map(repr, row)) for row in np.asarray(rows, float).tolist()]
