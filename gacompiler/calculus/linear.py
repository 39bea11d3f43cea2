"""Linear functions of vectors in any metric: outermorphism, adjoint, determinant, inverse, eigenblades, derivatives.

Doran & Lasenby 2003, ch. 4 and §11.1.1; Hestenes & Sobczyk 1984, ch. 3.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

import sympy

from ..algebra.algebra import Algebra
from ..algebra.multivector import Multivector
from ..errors import AlgebraError, ZeroDivisorError
from ..symbolic import reduce, symbols
from ..symbolic.multivector import SymbolicMultivector


class LinearFunction:
    """A linear function of vectors. Calling it on a multivector applies its outermorphism.

    Parameters
    ----------
    algebra : Algebra
    matrix : sympy matrix
        Column `j` holds the coefficients of the image of basis vector `j`.

    Examples
    --------
    >>> from gacompiler.algebra.catalog import VGA2
    >>> t = symbols("t")
    >>> e1, e2 = VGA2.basis()
    >>> f = LinearFunction.of(VGA2, lambda a: a + t * (a["e2"] * e1))
    >>> f(e1 ^ e2)
    VGA2: e12
    """

    def __init__(self, algebra: Algebra, matrix: Any) -> None:
        n = algebra.dimension
        if callable(matrix):
            raise AlgebraError(f"LinearFunction({algebra.name})", "a function", "a matrix", "use LinearFunction.of()")
        given = sympy.Matrix(matrix)
        if given.shape != (n, n):
            raise AlgebraError(f"LinearFunction({algebra.name})", f"a matrix of shape {given.shape}", f"{n} x {n}")
        self.algebra = algebra
        self.matrix = given.as_immutable()

    @classmethod
    def of(cls, algebra: Algebra, function: Callable[[SymbolicMultivector], Any]) -> LinearFunction:
        """Create a linear function from a Python function of vectors.

        Raises
        ------
        AlgebraError
            When an image is not a vector, or `function` is not linear.
        """
        columns = [cls._image(algebra, function, vector) for vector in algebra.basis()]
        made = cls(algebra, sympy.Matrix.hstack(*columns))
        probe = symbols("linear_probe", layout=algebra.layout("probe", " ".join(algebra.vectors)))
        if reduce(made(probe) - function(probe)).simplify().terms:
            raise AlgebraError("LinearFunction.of()", "a function that is not linear", "f(s a + b) = s f(a) + f(b)")
        return made

    @classmethod
    def _image(cls, algebra: Algebra, function: Callable[[SymbolicMultivector], Any], vector: Multivector) -> Any:
        zero = SymbolicMultivector(algebra, {})
        image = zero.lift(function(zero.lift(vector)))
        if image.terms and set(image.grades) != {1}:
            raise AlgebraError("LinearFunction.of()", f"the image {image} of {vector}", "a vector")
        return sympy.Matrix([image[1 << k] for k in range(algebra.dimension)])

    def __repr__(self) -> str:
        return f"LinearFunction({self.algebra.name}, {self.matrix.tolist()})"

    def _latex(self, printer: object = None) -> str:
        """Return the matrix in LaTeX, for `sympy.latex`."""
        return str(sympy.latex(self.matrix))

    def _repr_latex_(self) -> str:
        return f"${self._latex()}$"

    def __call__(self, element: Any) -> SymbolicMultivector:
        """Return the image of a multivector, with ``f(a ^ b) = f(a) ^ f(b)``; scalars are unchanged."""
        lifted = SymbolicMultivector(self.algebra, {}).lift(element)
        total = SymbolicMultivector(self.algebra, {})
        for blade, value in lifted.expressions.items():
            total = total + value * self._image_of_blade(blade)
        return total

    @cached_property
    def images(self) -> tuple[SymbolicMultivector, ...]:
        """The images of the basis vectors."""
        n = self.algebra.dimension
        return tuple(SymbolicMultivector(self.algebra, {1 << i: self.matrix[i, j] for i in range(n)}) for j in range(n))

    @cached_property
    def _blades(self) -> dict[int, SymbolicMultivector]:
        return {0: SymbolicMultivector(self.algebra, {0: 1})}

    def _image_of_blade(self, blade: int) -> SymbolicMultivector:
        if blade not in self._blades:
            low = blade & -blade
            self._blades[blade] = self.images[low.bit_length() - 1] ^ self._image_of_blade(blade ^ low)
        return self._blades[blade]

    def __matmul__(self, other: LinearFunction) -> LinearFunction:
        """Return the composition ``(f @ g)(a) = f(g(a))``."""
        if not isinstance(other, LinearFunction) or other.algebra != self.algebra:
            raise AlgebraError("composition", f"{other!r}", f"a linear function of {self.algebra.name}")
        return LinearFunction(self.algebra, self.matrix * other.matrix)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, LinearFunction) or other.algebra != self.algebra:
            return False
        return bool(sympy.simplify(self.matrix - other.matrix).is_zero_matrix)

    def __hash__(self) -> int:
        return hash((LinearFunction, self.algebra))  # Equal matrices may have different expressions as entries.

    @cached_property
    def determinant(self) -> Any:
        """The determinant, with ``f(I) = det(f) I``."""
        return (self(self.algebra.pseudoscalar))[self.algebra.everything] * self.algebra.spelling(
            self.algebra.everything
        )[0]

    @property
    def trace(self) -> Any:
        """The trace ``sum e^i . f(e_i)``."""
        return self.matrix.trace()

    @cached_property
    def adjoint(self) -> LinearFunction:
        """The function with ``a . f(b) = adjoint(a) . b``; for a definite metric, its matrix is the transpose.

        Raises
        ------
        AlgebraError
            In a degenerate metric.
        """
        gram = self._gram
        return LinearFunction(self.algebra, (gram.inv() * self.matrix.T * gram).applyfunc(sympy.expand))

    @cached_property
    def _gram(self) -> Any:
        gram = sympy.Matrix([[sympy.sympify(value) for value in row] for row in self.algebra.gram])
        if gram.det() == 0:
            raise AlgebraError(
                f"adjoint in {self.algebra.name}", "the metric is degenerate", "a metric with reciprocal vectors"
            )
        return gram

    @cached_property
    def inverse(self) -> LinearFunction:
        """The function with ``inverse(f(a)) = a``, by cofactors.

        Raises
        ------
        ZeroDivisorError
            When the determinant is identically zero.
        """
        determinant = sympy.simplify(self.determinant)
        if determinant == 0:
            raise ZeroDivisorError("inverse of a linear function", "its determinant is zero", "an invertible function")
        return LinearFunction(self.algebra, self.matrix.adjugate() / determinant)

    def eigenblades(self, grade: int = 1) -> list[tuple[Any, SymbolicMultivector]]:
        """Return the blades of a grade with ``f(B) = value B``, as pairs of value and blade.

        The blades are outer products of eigenvectors. For an eigenvalue with several eigenvectors, a basis is returned.
        Eigenvectors of complex conjugate eigenvalues are complex, but the plane of such a pair is real.
        """
        vectors = [
            (value, SymbolicMultivector(self.algebra, {1 << k: vector[k] for k in range(len(vector))}))
            for value, _, space in self.matrix.eigenvects()
            for vector in space
        ]
        if not 1 <= grade <= self.algebra.dimension:
            raise AlgebraError("eigenblades()", f"grade {grade}", f"1 to {self.algebra.dimension}")
        found = [(value, blade, k) for k, (value, blade) in enumerate(vectors)]
        for _ in range(grade - 1):
            found = [
                (sympy.simplify(value * vectors[j][0]), blade ^ vectors[j][1], j)
                for value, blade, k in found
                for j in range(k + 1, len(vectors))
            ]
        return [(value, _without_unit(blade.simplify())) for value, blade, _ in found]

    def derivative(self, function: Any, direction: Any) -> SymbolicMultivector:
        """Return ``d_f(a) F``, the derivative of `function` with respect to this linear function along `direction`.

        It is defined by ``d_f(a) (f(b) . c) = (a . b) c``. The entries of this function must be independent symbols, as
        created by `linear_function`.

        Parameters
        ----------
        function : SymbolicMultivector or sympy expression
            A function of the entries.
        direction : SymbolicMultivector or Multivector
        """
        entries = list(self.matrix)
        if len(set(entries)) < len(entries) or not all(isinstance(entry, sympy.Symbol) for entry in entries):
            raise AlgebraError("derivative by a linear function", f"{self!r}", "independent symbols as entries")
        zero = SymbolicMultivector(self.algebra, {})
        lifted, vector = zero.lift(function), zero.lift(direction)
        n, gram = self.algebra.dimension, self._gram
        inverse = gram.inv()
        covariant = gram * sympy.Matrix([vector[1 << k] for k in range(n)])
        reciprocal = [SymbolicMultivector(self.algebra, {1 << k: inverse[i, k] for k in range(n)}) for i in range(n)]
        total = zero
        for i in range(n):
            for j in range(n):
                total = total + covariant[j] * (reciprocal[i] * lifted.diff(self.matrix[i, j]))
        return total


def _without_unit(blade: SymbolicMultivector) -> SymbolicMultivector:
    """Divide a blade by the imaginary unit if all its coefficients are imaginary."""
    imaginary = all(sympy.simplify(sympy.re(value)) == 0 for value in blade.expressions.values())
    return (blade * -sympy.I).simplify() if imaginary else blade


def linear_function(name: str, algebra: Algebra, **assumptions: Any) -> LinearFunction:
    """Return a linear function with symbols as the entries of its matrix: ``f_11``, ``f_12``, ..."""
    n = algebra.dimension
    entries = [[symbols(f"{name}_{i + 1}{j + 1}", **assumptions) for j in range(n)] for i in range(n)]
    return LinearFunction(algebra, entries)
