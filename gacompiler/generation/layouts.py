"""Layouts of algebras in the form that generated modules store, which is text only and needs no compiler."""

from __future__ import annotations

from ..algebra import catalog
from ..algebra.algebra import Algebra
from ..algebra.layout import Layout
from ..gac_runtime.layout import Layout as PlainLayout
from ..rings.polynomial import PolynomialRing


def plain_layout(layout: Layout, proved: bool = True) -> PlainLayout:
    """Convert a layout to the form stored in generated modules.

    With `proved` false, the layout is not marked as unit or related: the result has these properties only for arguments
    that satisfy more relations than their layouts state.
    """
    fixed = tuple((slot.name, str(value)) for slot, value in layout.fixed)
    implied = tuple((slot.name, "implied") for slot, _ in layout.implied)
    return PlainLayout(
        layout.name if layout.is_scalar else f"{algebra_name(layout.algebra)}.{layout.name}",
        () if layout.is_scalar else layout.blades,
        (*fixed, *implied),
        layout.unit and proved,
        _formulas(layout),
        layout.user_relations is not None and proved,
    )


def algebra_name(algebra: Algebra) -> str:
    """Return the name of an algebra, with the products of its vectors if the catalog has another one of that name."""
    known = vars(catalog).get(algebra.name)
    is_other = isinstance(known, Algebra) and known != algebra
    return f"{algebra.name}{algebra.gram}".replace(" ", "") if is_other else algebra.name


def _formulas(layout: Layout) -> tuple[tuple[str, str], ...]:
    """Return the coefficients implied by the stored ones, each with its formula as a sum of products."""
    ring = PolynomialRing()
    stored = {name: ring.variable(name) for name in layout.blades}
    found = []
    for slot, function in layout.implied:
        polynomial = ring.lift(function(stored))
        terms = ["*".join([str(factor), *(ring.names[k] for k in m)]) for m, factor in polynomial.terms.items()]
        found.append((slot.name, " + ".join(terms) or "0"))
    return tuple(found)
