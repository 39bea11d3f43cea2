"""Tables of numbers as text with named columns (CSV)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import Reals, finite, real_array, unmasked
from .text_files import Line, lines_of, text_of


def read_columns(path: str | Path, names: Sequence[str] | None = None) -> dict[str, Reals]:
    """Read columns of numbers by their names from a CSV file, which gzip may have compressed.

    Parameters
    ----------
    path : path
        A text file whose first line has the names, separated by commas. It may begin with ``#``, and units in brackets
        after a name do not belong to it.
    names : sequence of str, optional
        The columns that are read, by default all. Others need not be numbers.

    Returns
    -------
    dict of str to array, (n,)
        Columns of whole numbers without a point or an exponent are arrays of int64, which keep time stamps in
        nanoseconds.

    Raises
    ------
    OSError, ValueError
        If the file cannot be read, lacks a column, is cut off, or has a line with other numbers of columns or with what
        is no finite number.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     write_columns(Path(folder) / "log.csv", {"time": [1, 2], "x": [0.5, 0.25]})
    ...     read_columns(Path(folder) / "log.csv", ["x"])
    {'x': array([0.5 , 0.25])}
    """
    every = lines_of(path, "a table with named columns")
    heads = _names(every[0])
    wanted = heads if names is None else list(names)
    for name in wanted:
        if heads.count(name) != 1:
            known = f"columns {', '.join(heads)}"
            raise every[0].wrong(known, f"{name!r}, once")
    rows = []
    for line in every[1:]:
        if line.text.strip():
            words = [word.strip() for word in line.text.split(",")]
            if len(words) != len(heads):
                raise line.wrong(f"{len(words)} columns", f"{len(heads)}, as in the first line")
            rows.append((line, words))
    return {name: _column(rows, heads.index(name), name) for name in wanted}


def _names(line: Line) -> list[str]:
    heads = [word.split("[")[0].strip() for word in line.text.lstrip("#").split(",")]
    for head in heads:
        try:
            float(head or "0")
        except ValueError:
            continue
        raise line.wrong(repr(line.text[:60]), "the names of columns")
    return heads


def _column(rows: list[tuple[Line, list[str]]], place: int, name: str) -> Reals:
    words = [words[place] for _, words in rows]
    if words and all(word.lstrip("+-").isdecimal() for word in words):
        return np.array([line.whole(word, f"{name} as a number") for (line, _), word in zip(rows, words, strict=True)])
    return np.array([
        line.numbers([word], f"{name} as a number")[0] for (line, _), word in zip(rows, words, strict=True)
    ])  # fmt: skip


def write_columns(path: str | Path, columns: Mapping[str, ArrayLike]) -> None:
    """Write columns of numbers (n,) as a CSV file from which `read_columns` reads the same numbers.

    Parameters
    ----------
    path : path
    columns : mapping of str to array_like, (n,)
        Whole numbers and floats, by the names of the columns.

    Raises
    ------
    TypeError, ValueError
        If columns are not finite real numbers of one length, whole numbers have more than 64 bits with a sign, or names
        are empty, numbers, or have commas, brackets, ``#`` or characters that cannot be printed, such as line breaks.
    """
    texts = []
    for name, values in columns.items():
        if not name.strip() or name != name.strip() or set(name) & set(",[#") or not name.isprintable():
            raise ValueError(f"columns: the name {name!r}; expected one without commas, brackets and line breaks")
        given = np.asarray(unmasked(values, name))
        if given.ndim != 1:
            raise ValueError(f"{name}: shape {given.shape}; expected (n,)")
        if given.dtype.kind in "iu":
            if given.max(initial=0) >= 2**63:
                raise ValueError(f"{name}: {given.max()}; expected numbers of 64 bits with a sign")
            texts.append([str(x) for x in given.tolist()])
        else:
            texts.append(text_of(finite(real_array(given, name).astype(float), name)[:, None], ","))
    if len({len(text) for text in texts}) != 1:
        raise ValueError(f"columns: {[len(text) for text in texts]} numbers; expected one length, of at least a column")
    head = Line(Path(path), 1, ",".join(columns))
    _names(head)
    rows = [head.text, *(",".join(row) for row in zip(*texts, strict=True))]
    Path(path).write_text("\n".join(rows) + "\n", encoding="utf-8")
