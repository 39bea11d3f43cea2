"""Products of elements with very many blades by a table, and inverses in more than five dimensions by linear equations.

A kernel of such a product has one operation for each pair of blades, and tracing it takes much longer than it saves.
"""

from __future__ import annotations

from itertools import chain
from typing import Any, NamedTuple

import numpy as np

from ..algebra.layout import Layout
from ..algebra.operations import Operation
from ..algebra.versors import SMALL_DIMENSION, n_vectors
from ..errors import ZeroDivisorError
from .caches import cached_by_name
from .definitions import BINARY, Definition
from .layouts import chosen_layout, layout_of

MOST_PAIRS = 1 << 13
"""Number of pairs of blades from which a product is computed by a table: compiling one takes a millisecond for each."""
_AT_ONCE = 1 << 22
"""Number of terms that are computed at once, which bounds the memory."""
_GRADES = {BINARY[each.row.name]: each.row.grades for each in Operation if each.row.grades is not None}
_PRODUCT = BINARY["geometric_product"]


class Table(NamedTuple):
    """The terms of a bilinear product, sorted by the blade of the result."""

    result: Layout
    left: Any
    right: Any
    """Indices of the stored coefficients whose product is a term."""
    factors: Any
    starts: Any
    """The index of the first term of each coefficient of the result."""

    def product(self, a: Any, b: Any) -> Any:
        """Return the product of coefficients along the last axes; leading axes broadcast."""
        a, b = np.broadcast_arrays(a, b) if a.shape == b.shape else _of_one_shape(a, b)
        flat, other = a.reshape(-1, a.shape[-1]), b.reshape(-1, b.shape[-1])
        found = np.empty((len(flat), len(self.starts)), np.result_type(a, b))
        step = max(1, _AT_ONCE // len(self.left))
        for k in range(0, len(flat), step):
            terms = flat[k : k + step, self.left] * other[k : k + step, self.right] * self.factors
            np.add.reduceat(terms, self.starts, axis=-1, out=found[k : k + step])
        return found.reshape(*a.shape[:-1], len(self.starts))

    def matrix(self, a: Any) -> Any:
        """Return the matrix of multiplication by elements from the left, (..., blades of the result, of the other)."""
        rows = np.searchsorted(self.starts, np.arange(len(self.left)), side="right") - 1
        size = len(self.starts), int(self.right.max()) + 1
        found = np.zeros((*a.shape[:-1], *size), a.dtype)
        np.add.at(found, (..., rows, self.right), a[..., self.left] * self.factors)  # type: ignore[arg-type]
        return found


def _of_one_shape(a: Any, b: Any) -> tuple[Any, Any]:
    leading = np.broadcast_shapes(a.shape[:-1], b.shape[:-1])
    return np.broadcast_to(a, (*leading, a.shape[-1])), np.broadcast_to(b, (*leading, b.shape[-1]))


def product_table(a: Layout, b: Layout) -> Table:
    """Return the table of the geometric product, for computations with few elements that are not worth a kernel."""
    found = _table(_PRODUCT, a, b)
    assert found is not None
    return found


def table_of(definition: Definition, layouts: tuple[Layout, ...]) -> Table | None:
    """Return the table of a product; None if it is compiled: it has few terms, or is not a part of the product."""
    if definition not in _GRADES:
        return None
    a, b = layouts
    if a.size * b.size < MOST_PAIRS or any(each.fixed or each.implied or each.is_scalar for each in layouts):
        return None
    return _table(definition, a, b)


@cached_by_name
def _table(definition: Definition, a: Layout, b: Layout) -> Table | None:
    algebra, kept = a.algebra, _GRADES[definition]
    terms: dict[int, list[tuple[int, int, float]]] = {}
    for i, one in enumerate(a.stored):
        p = one.blade.bit_count()
        for j, two in enumerate(b.stored):
            sign = one.sign * two.sign
            for blade, value in algebra.blade_product(one.blade, two.blade).items():
                if kept(p, two.blade.bit_count(), blade.bit_count()):
                    terms.setdefault(blade, []).append((i, j, float(value) * sign))
    if not terms:
        return None
    whole = layout_of(algebra, terms)
    result = chosen_layout(whole, definition is _PRODUCT and a.unit and b.unit)
    if {slot.blade for slot in result.stored} != set(terms):
        result = whole
    ordered = [[(i, j, x * slot.sign) for i, j, x in terms[slot.blade]] for slot in result.stored]
    left, right, factors = (np.array(column) for column in zip(*chain(*ordered), strict=True))
    starts = np.cumsum([0, *map(len, ordered[:-1])])
    return Table(result, left, right, factors.astype(float), starts)


def inverse_by_equations(x: Any, wrap: Any) -> Any:
    """Return inverses in more than five dimensions; None if the kernel of the operation is used.

    A versor has the inverse ``~x / <x ~x>``; it is accepted if the residual of ``x x^-1 = 1`` is of the size of
    rounding errors. Other elements are inverted as matrices.

    Raises
    ------
    ZeroDivisorError
        If a single element has no inverse that is determined to half of the digits; in an array it gives NaN.
    """
    layout, values = x.layout, x.values
    if n_vectors(layout.support) <= SMALL_DIMENSION or layout.unit or values.dtype.kind not in "fc":
        return None
    even = all(not blade.bit_count() & 1 for blade in layout.support)
    whole = layout.algebra.even if even else layout.algebra.full
    full = np.stack(np.broadcast_arrays(*(np.asarray(x[name]) for name in whole.blades)), -1).astype(values.dtype)
    found = _inverses(whole, full)
    if not x.shape and np.isnan(found).any() and np.isfinite(values).all():
        raise ZeroDivisorError("inverse", f"{x}, whose determinant is 0 up to rounding", "an invertible element")
    return wrap(whole, found)


def _inverses(whole: Layout, full: Any) -> Any:
    """Return the inverses of elements of a layout that is closed under products; NaN where there are none."""
    table = _table(_PRODUCT, whole, whole)
    assert table is not None
    order = [table.result.blades.index(name) for name in whole.blades]
    scalar = whole.blades.index("1")
    one, eps = np.eye(whole.size)[scalar], float(np.finfo(full.dtype).eps)
    reverses = full * np.array([whole.algebra.reverse_sign(slot.blade.bit_count()) for slot in whole.stored])
    with np.errstate(all="ignore"):
        found = reverses / table.product(full, reverses)[..., order][..., scalar, None]
        size = np.linalg.norm(full, axis=-1) * np.linalg.norm(found, axis=-1)
        # Rounding errors of a sum of as many products as there are blades, each at most the product of the norms.
        others = ~(np.abs(table.product(full, found)[..., order] - one).max(-1) <= 8 * eps * size)
    if np.any(others):
        solved = _solved(table.matrix(full[others])[..., order, :], one)
        left = np.abs(table.product(full[others], solved)[..., order] - one).max(-1)
        found[others] = np.where((left <= np.sqrt(eps))[..., None], solved, np.nan)
    return found


def _solved(matrices: Any, right: Any) -> Any:
    """Return solutions of linear equations; NaN for singular matrices."""
    found = np.full(matrices.shape[:-1], np.nan, matrices.dtype)
    for k in np.ndindex(matrices.shape[:-2]):
        try:
            found[k] = np.linalg.solve(matrices[k], right)
        except np.linalg.LinAlgError:
            continue
    return found
