"""Geometric algebras, given by the names of the basis vectors and their Gram matrix."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from importlib import import_module
from itertools import combinations
from typing import TYPE_CHECKING, Any, overload
from weakref import WeakValueDictionary

from ..errors import AlgebraError
from .blades import BladeProducts, Gram, Rational, Terms, exact, reverse_sign
from .coefficients import Coefficient, is_exact, is_zero
from .immutable import Immutable
from .methods import AttributeAlgebraError
from .multivector import Multivector
from .naming import BladeNames
from .products import Row

if TYPE_CHECKING:
    from .layout import Layout, Relations

_ALIVE: WeakValueDictionary[tuple[Any, ...], Algebra] = WeakValueDictionary()
"""Algebras by their arguments, so that unpickling returns the object that this process already has."""


_EVERYWHERE = ("full", "even", "UNIT_EVEN")
"""Layouts that every algebra has."""


class Algebra(Immutable):
    """The geometric algebra of a symmetric bilinear form.

    ``Algebra(p, q, r)`` is the algebra with `p` basis vectors of square 1, `q` of square -1 and `r` of square 0: VGA2,
    VGA3, PGA2 or PGA3 of the catalog with their layouts, or else one with the basis vectors ``e1 e2 ...``.

    Parameters
    ----------
    name : str
        The name of the algebra in messages and generated files.
    vectors : str or sequence of str
        Names of the basis vectors, ``"e1 e2 e3 e0"``. Their order is the order of the bits in a bitmap.
    gram : sequence
        Either the squares of the vectors (an orthogonal basis) or the full symmetric matrix of their inner products,
        as exact rationals or sympy expressions. Zero squares, null pairs and oblique bases are supported without a
        change of basis. Symbolic entries may be constants or functions of coordinates. They are for derivations with
        `gacompiler.symbolic`: kernels and numeric objects need numbers.
    spellings : str, optional
        Names of blades whose vectors are not in ascending order, ``"e01 e02 e03 e0123"``. The name of the pseudoscalar
        determines its sign.
    layouts : callable, optional
        Function of the algebra that returns its named layouts, which are attributes of the algebra: ``PGA3.MOTOR``. It
        is called on the first access to a layout.
    conjugates : bool, optional
        Whether the vectors are imaginary units, as of complex numbers and quaternions: ``~x`` is the Clifford
        conjugate, which negates them, norms are those of numbers, and sandwich products are ``x y ~x``.

    Notes
    -----
    Algebras and layouts can be pickled. If the process that reads the pickle already has an algebra with the same
    arguments, unpickling returns that object; this is always the case for the algebras of the catalog.

    Examples
    --------
    >>> G3 = Algebra("G3", "e1 e2 e3", [1, 1, 1])
    >>> e1, e2, e3 = G3.basis()
    >>> print(e1 * e2 * e1)
    -1*e2
    >>> Algebra(3, 0, 1)
    Algebra(PGA3: e1 e2 e3 e0)
    """

    name: str
    vectors: tuple[str, ...]

    @overload
    def __init__(self, name: int, vectors: int = 0, gram: int = 0, /) -> None: ...

    @overload
    def __init__(
        self,
        name: str,
        vectors: str | Sequence[str],
        gram: Sequence[Rational] | Sequence[Sequence[Rational]],
        spellings: str = "",
        layouts: Callable[[Algebra], Iterable[Layout]] | None = None,
        conjugates: bool = False,
    ) -> None: ...

    def __init__(
        self,
        name: str | int,
        vectors: str | Sequence[str] | int = 0,
        gram: Sequence[Rational] | Sequence[Sequence[Rational]] | int = 0,
        spellings: str = "",
        layouts: Callable[[Algebra], Iterable[Layout]] | None = None,
        conjugates: bool = False,
    ) -> None:
        row: Any = (name, vectors, gram, spellings, layouts)
        self.conjugates = conjugates
        if not isinstance(name, str) or isinstance(vectors, int) or isinstance(gram, int):
            row = _of_signature(name, vectors, gram)
        self.name, given, squares, spellings, self._make_layouts = row
        self.vectors = tuple(given.split() if isinstance(given, str) else given)
        self.gram = _gram(self.name, squares, len(self.vectors))
        self._spellings = tuple(spellings.split())
        self._names = BladeNames(self.name, self.vectors, self._spellings)
        self._products = BladeProducts(self.gram)
        self._rows: dict[tuple[str, int], Row] = {}
        _ALIVE.setdefault(self.arguments, self)

    def __eq__(self, other: object) -> bool:
        """Return whether two algebras have the same basis vectors, products and duals; the names are not compared."""
        return isinstance(other, Algebra) and self._identity == other._identity

    def __hash__(self) -> int:
        return self._hash

    @cached_property
    def _hash(self) -> int:
        return hash(self._identity)

    @cached_property
    def _identity(self) -> tuple[object, ...]:
        return self.vectors, self.gram, self.spelling(self.everything)[0], self.conjugates

    @property
    def arguments(self) -> tuple[Any, ...]:
        """The arguments that this algebra was created from; equal algebras may differ in names and layouts."""
        return self.name, self.vectors, self.gram, self._spellings, self.conjugates, self._make_layouts

    def __reduce__(self) -> tuple[Any, ...]:
        *plain, layouts = self.arguments
        return _restored, (*plain, layouts if layouts is None or _is_importable(layouts) else LayoutTable.of(self))

    def __repr__(self) -> str:
        return f"Algebra({self.name}: {' '.join(self.vectors)})"

    def _latex(self, printer: object = None) -> str:
        """Return the name in LaTeX, for `sympy.latex`."""
        return rf"\mathrm{{{self.name}}}".replace("_", r"\_")

    def _repr_latex_(self) -> str:
        return f"${self._latex()}$"

    @property
    def spellings(self) -> tuple[str, ...]:
        """The names of blades that are not in ascending order of the vectors."""
        return self._spellings

    @property
    def dimension(self) -> int:
        """Number of basis vectors."""
        return len(self.vectors)

    @property
    def everything(self) -> int:
        """Bitmap of the pseudoscalar."""
        return (1 << self.dimension) - 1

    def blades(self, *grades: int) -> tuple[int, ...]:
        """Return the bitmaps of the basis blades of the given grades (by default all), by grade and then by bitmap."""
        wanted = grades or tuple(range(self.dimension + 1))
        return tuple(
            blade
            for k in wanted
            for blade in sorted(sum(1 << i for i in chosen) for chosen in combinations(range(self.dimension), k))
        )

    def blade(self, spelling: str) -> tuple[int, int]:
        """Return the sign and bitmap of a blade given in any spelling: ``e31``, ``e3e1``, ``e3^e1``, ``1``.

        Raises
        ------
        AlgebraError
            If the spelling is not a blade of this algebra, or is ambiguous.
        """
        return self._names.parse(spelling)

    def spelling(self, blade: int) -> tuple[int, str]:
        """Return the sign and printed name of a basis blade; the sign relates the named blade to the bitmap."""
        return self._names.spell(blade)

    def reverse_sign(self, k: int) -> int:
        """Return the sign of blades of grade `k` in ``~x``: of the reverse, or of the conjugate of numbers."""
        return reverse_sign(k + 1 if self.conjugates else k)

    def blade_product(self, a: int, b: int) -> Terms:
        """Return the geometric product of two basis blades."""
        return self._products(a, b)

    def partners(self, blade: int) -> int:
        """Return the bitmap of the basis vectors that are not orthogonal to every vector of a basis blade."""
        return self._products.partners(blade)

    def product_row(self, name: str, left: int) -> Row:
        """Return the cached products `name` of one basis blade with others; `product` adds to the cache."""
        return self._rows.setdefault((name, left), {})

    def multivector(self, coefficients: Mapping[str, Coefficient]) -> Multivector:
        """Create a multivector from coefficients by blade name, over any ring: ``PGA3.multivector({"e032": 1})``."""
        terms: dict[int, Coefficient] = {}
        for spelling, value in coefficients.items():
            sign, blade = self.blade(spelling)
            signed = value if sign > 0 else -value
            terms[blade] = terms[blade] + signed if blade in terms else signed
        return Multivector(self, terms)

    def scalar(self, value: Coefficient) -> Multivector:
        """Return `value` as a multivector of grade 0."""
        return Multivector(self, {0: value})

    def basis(self) -> tuple[Multivector, ...]:
        """Return the basis vectors."""
        return tuple(Multivector(self, {1 << k: 1}) for k in range(self.dimension))

    @cached_property
    def pseudoscalar(self) -> Multivector:
        """The unit pseudoscalar, with the orientation of its name."""
        sign, _ = self.spelling(self.everything)
        return Multivector(self, {self.everything: sign})

    @cached_property
    def is_degenerate(self) -> bool:
        """Whether the metric is degenerate: some vector is orthogonal to all, and the pseudoscalar has no inverse."""
        return is_zero((self.pseudoscalar * self.pseudoscalar).scalar)

    @cached_property
    def has_symbolic_metric(self) -> bool:
        """Whether some inner product of basis vectors is a formula, and not a number."""
        return not all(is_exact(value) for row in self.gram for value in row)

    @cached_property
    def null_pairs(self) -> tuple[tuple[int, int], ...]:
        """Index pairs of null basis vectors that are orthogonal to all basis vectors except each other: e0 and einf."""
        partners = [[j for j, value in enumerate(row) if value] for row in self.gram]
        pairs = combinations(range(self.dimension), 2)
        return tuple((i, j) for i, j in pairs if partners[i] == [j] and partners[j] == [i])

    def layout(
        self,
        name: str,
        blades: str,
        *,
        fixed: Mapping[str, Rational] | None = None,
        implied: Mapping[str, Callable[[Mapping[str, Coefficient]], Coefficient]] | None = None,
        unit: bool = False,
        relations: Relations | None = None,
    ) -> Layout:
        """Create a layout of this algebra; see `gacompiler.algebra.layout.Layout` for the parameters."""
        from .layout import Layout

        return Layout.of(self, name, blades, fixed=fixed, implied=implied, unit=unit, relations=relations)

    @cached_property
    def layouts(self) -> Mapping[str, Layout]:
        """The named layouts of this algebra."""
        return {layout.name: layout for layout in (self._make_layouts(self) if self._make_layouts else ())}

    def named_layout(self, name: str) -> Layout | None:
        """Return the layout that is the attribute `name`, or None."""
        if name in self.layouts:
            return self.layouts[name]
        known: Layout | None = getattr(self, name) if name in _EVERYWHERE else None
        return known

    @cached_property
    def full(self) -> Layout:
        """The layout of all ``2**n`` coefficients, without relations."""
        return self.layout("full", self._spell(self.blades()))

    @cached_property
    def even(self) -> Layout:
        """The layout of the even subalgebra, without relations."""
        return self.layout("even", self._spell(self.blades(*range(0, self.dimension + 1, 2))))

    @cached_property
    def UNIT_EVEN(self) -> Layout:
        """The layout of the elements of the even subalgebra with ``x ~x = 1``."""
        return self.layout("UNIT_EVEN", " ".join(self.even.blades), unit=True)

    def _spell(self, blades: Iterable[int]) -> str:
        return " ".join(self.spelling(blade)[1] for blade in blades)

    def __getattr__(self, name: str) -> Layout:
        if name.startswith("_"):
            raise AttributeError(name)
        known = self.layouts
        if name in known:
            return known[name]
        raise AttributeAlgebraError(
            self.name,
            f"no layout {name}",
            "one of " + " ".join([*known, *_EVERYWHERE]),
            "or define it with layout()",
        )


@dataclass(frozen=True, slots=True)
class LayoutTable:
    """The layouts of an algebra as rows, in place of a `layouts` function that cannot be imported when unpickling."""

    rows: tuple[tuple[Any, ...], ...]

    @classmethod
    def of(cls, algebra: Algebra) -> LayoutTable:
        """Return the table of the layouts of an algebra."""
        return cls(tuple(layout.row for layout in algebra.layouts.values()))

    def __call__(self, algebra: Algebra) -> Iterable[Layout]:
        from .layout import Layout

        return [Layout(algebra, *row) for row in self.rows]


def _restored(
    name: str, vectors: tuple[str, ...], gram: Gram, spellings: tuple[str, ...], conjugates: bool, layouts: Any
) -> Algebra:
    # The package loads the catalog before anything can be unpickled, so its algebras are found and not created again.
    known = _ALIVE.get((name, vectors, gram, spellings, conjugates, layouts))
    return known if known is not None else Algebra(name, vectors, gram, " ".join(spellings), layouts, conjugates)


def _is_importable(function: object) -> bool:
    """Return whether another process can import `function` by its name, or it is an object pickled by its state."""
    name = getattr(function, "__qualname__", None)
    if name is None:
        return True
    module = sys.modules.get(getattr(function, "__module__", None) or "")
    return module is not None and getattr(module, name, None) is function


def _of_signature(*given: Any) -> tuple[Any, ...]:
    """Return the arguments of the algebra with the given numbers of squares 1, -1 and 0."""
    if not all(isinstance(each, int) for each in given):
        raise AlgebraError(
            "Algebra()",
            str(given),
            "the numbers of squares 1, -1 and 0, or a name, basis vectors and their squares",
            'as in Algebra(3, 0, 1) or Algebra("G", "e1 e2", [1, -1])',
        )
    catalog = import_module(".catalog", __package__)  # which uses this module
    *plain, spellings, _, layouts = catalog.of_signature(*given).arguments
    return *plain, " ".join(spellings), layouts


def _gram(name: str, gram: Sequence[Rational] | Sequence[Sequence[Rational]], n: int) -> Gram:
    rows: Sequence[Any] = gram.tolist() if hasattr(gram, "tolist") else gram
    matrix = tuple(
        tuple(_entry(value) for value in row)
        if isinstance(row, Sequence)
        else (0,) * i + (_entry(row),) + (0,) * (len(rows) - 1 - i)
        for i, row in enumerate(rows)
    )
    if len(matrix) != n or any(len(row) != n for row in matrix):
        raise AlgebraError(
            name, f"a Gram matrix of {len(matrix)} rows for {n} basis vectors", f"{n} x {n} or {n} squares"
        )
    if any(matrix[i][j] != matrix[j][i] for i in range(n) for j in range(i)):
        raise AlgebraError(name, "a Gram matrix that is not symmetric")
    return matrix


def _entry(value: Any) -> Any:
    """Return an entry of a Gram matrix: an exact number, or an element of the ring of sympy's expressions."""
    if not hasattr(value, "free_symbols") and not hasattr(value, "scalar_function"):
        return exact(Fraction(value))
    ring: Any = import_module(f"{__name__.partition('.')[0]}.rings.symbolic")  # Only formulas need sympy.
    found = ring.Expanded.of(value)
    number = found.terms.get((), 0) if found.terms.keys() <= {()} else found
    return exact(Fraction(number)) if isinstance(number, float) else number
