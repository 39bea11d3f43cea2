"""Algebras available to scripts: by Gaalop's names, by names of the catalog, or from a user's definition."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..algebra import catalog
from ..algebra.algebra import Algebra
from ..algebra.catalog import CATALOG
from ..algebra.multivector import Multivector
from ..errors import SpecError, text_of
from .definitions import read_definition
from .macros.common import Table
from .macros.conformal import conformal
from .macros.cubics import cubics
from .macros.cyclides import cyclides
from .macros.euclidean import euclidean, space_time
from .macros.projective import plane, space
from .macros.quadrics import conics, quadrics


@dataclass(frozen=True)
class Dialect:
    """An algebra with the names that scripts may use in it.

    Attributes
    ----------
    algebra : Algebra
    constants : mapping of str to Multivector
        Basis vectors, and vectors of the orthogonal basis that a base change names.
    macros : mapping
        Macros by name and number of arguments.
    source : str
        Text of the macros of a user's definition; empty otherwise.
    where : str
        Name of that text in error messages.
    """

    algebra: Algebra
    constants: Mapping[str, Multivector]
    macros: Table
    source: str = ""
    where: str = ""


_GAALOP: dict[str, tuple[Algebra, Callable[[Algebra], Table], Mapping[str, str]]] = {
    "2d": (catalog.VGA2, euclidean, {}),
    "3d": (catalog.VGA3, euclidean, {}),
    "2dpga": (catalog.PGA2, plane, {}),
    "3dpga": (catalog.PGA3, space, {}),
    "cra": (catalog.CGA2, conformal, {"ep": "1/2 einf - e0", "em": "1/2 einf + e0"}),
    "cga": (catalog.CGA3, conformal, {"ep": "1/2 einf - e0", "em": "1/2 einf + e0"}),
    "sta": (catalog.STA, space_time, {f"e{k + 1}": f"g{k}" for k in range(4)}),
    "sta0": (catalog.STA, space_time, {f"e{k}": f"g{k}" for k in range(4)}),
    "gac": (catalog.GAC, conics, {
        f"e{sign}{k + 1}": f"1/2 einf{name} {'-' if sign == 'p' else '+'} e0{name}"
        for k, name in enumerate("pmc") for sign in "pm"
    }),
    "qga": (catalog.QGA, quadrics, {
        f"e{k + first}": f"1/2 einf{name} {sign} e0{name}"
        for first, sign in ((4, "-"), (7, "+")) for k, name in enumerate("xyz")
    }),
    "dcga": (catalog.DCGA, cyclides, {
        "e4": "1/2 ei1 - eo1", "e5": "1/2 ei1 + eo1", "e9": "1/2 ei2 - eo2", "e10": "1/2 ei2 + eo2",
    }),
    "ccga": (catalog.CCGA, cubics, {}),
}  # fmt: skip
"""By Gaalop's name: the algebra, its macros, and names of further vectors."""

OTHER_NAMES = {
    "vga2": "2d", "vga3": "3d", "pga2": "2dpga", "pga3": "3dpga", "cga2": "cra", "cga3": "cga",
    "5d": "cga", "cr4d": "cra", "9d": "qga",
}  # fmt: skip
"""Names of the catalog and of older versions of Gaalop."""

DECLARED = {"DefVarsE2": "2d", "DefVarsE3": "3d", "DefVarsC2": "cra", "DefVarsN3": "cga"}
"""Declarations of the algebra in the first line of older scripts."""

NAMES = tuple(name for name in _GAALOP if name != "sta0")


def fitting(chosen: Dialect, names: set[str]) -> Dialect:
    """Return the dialect that fits the names in a script: in spacetime, time is ``e1``, or ``e0`` if it is used."""
    return _named("sta0") if chosen is _known.get("sta") and "e0" in names else chosen


def dialect(algebra: str | Path | Algebra) -> Dialect:
    """Return the dialect of an algebra.

    Parameters
    ----------
    algebra : str, Path or Algebra
        A name (``cga``, ``cga3``, ``3dpga``), a folder or file with a definition by base change, or an algebra: one of
        the named ones with its macros, any other with its basis vectors alone.

    Raises
    ------
    SpecError
        If the algebra or the definition does not exist.
    """
    if isinstance(algebra, Algebra):
        known = next((name for name, row in _GAALOP.items() if row[0] == algebra), None)
        return _named(known) if known else Dialect(algebra, _vectors(algebra), {})
    name = str(algebra).lower()
    name = OTHER_NAMES.get(name, name)
    if name in _GAALOP:
        return _named(name)
    by_name = {each.lower(): found for each, found in CATALOG.items()}
    if name in by_name:
        return Dialect(by_name[name], _vectors(by_name[name]), {})
    path = Path(algebra)
    if path.is_dir() or path.is_file():
        return _defined(path)
    raise SpecError(
        f"algebra {algebra}", "no such algebra", "one of " + " ".join(NAMES), "or a folder with definition.csv"
    )


_known: dict[str, Dialect] = {}


def _named(name: str) -> Dialect:
    if name not in _known:
        algebra, table, further = _GAALOP[name]
        constants = _vectors(algebra)
        constants |= {each: _combination(constants, text) for each, text in further.items()}
        _known[name] = Dialect(algebra, constants, table(algebra))
    return _known[name]


def _vectors(algebra: Algebra) -> dict[str, Multivector]:
    return dict(zip(algebra.vectors, algebra.basis(), strict=True))


def _combination(vectors: Mapping[str, Multivector], text: str) -> Any:
    """Return a linear combination such as ``1/2 einf - e0``."""
    words = text.split()
    if len(words) == 1:
        return vectors[words[0]]
    sign = -1 if words[2] == "-" else 1
    return vectors[words[1]] / 2 + sign * vectors[words[3]]


def _defined(path: Path) -> Dialect:
    """Return a user's algebra: ``definition.csv``, and ``macros.clu`` in the same folder if it exists."""
    file = path / "definition.csv" if path.is_dir() else path
    if not file.is_file():
        raise SpecError(str(file), "no such file", "a definition of an algebra in five lines")
    name = file.parent.name if file.name == "definition.csv" else file.stem
    algebra, further = read_definition(text_of(file), name or "USER", str(file))
    macros = file.parent / "macros.clu"
    source = text_of(macros) if macros.is_file() else ""
    return Dialect(algebra, _vectors(algebra) | further, {}, source, str(macros))
