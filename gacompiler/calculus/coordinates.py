"""Coordinates of a flat space, and the vector derivative of multivector fields in these coordinates.

With a position ``x(u)``, its frame ``e_i = dx/du_i`` and the reciprocal frame ``e^i``, the vector derivative is
``d = sum e^i d/du_i`` (Hestenes & Sobczyk 1984, §6-2; Doran & Lasenby 2003, §6.2). Fields are multivectors over the
fixed basis of the algebra, and their coefficients depend on the parameters. A frame that varies with position therefore
needs no Christoffel symbols.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from itertools import combinations_with_replacement
from typing import Any

import sympy

from ..algebra.algebra import Algebra
from ..algebra.blades import outer
from ..algebra.multivector import Multivector
from ..errors import AlgebraError
from ..rings.symbolic import Expanded
from ..symbolic import inverse as inverse_blade
from ..symbolic import left_contraction, reduce
from ..symbolic.multivector import SymbolicMultivector, symbolic
from ..symbolic.printing import latex
from .curvature import Curved, inverse_of, positive_length, short
from .operators import FieldOperator

Product = Callable[[SymbolicMultivector, SymbolicMultivector], SymbolicMultivector]


class Chart(Curved):
    """Coordinates: a position vector as a function of parameters.

    Parameters
    ----------
    position : SymbolicMultivector
        A vector that depends on the parameters. With fewer parameters than the dimension of the space, it describes a
        surface, and the derivatives are those within the surface.
    *parameters : Symbol

    Raises
    ------
    AlgebraError
        When `position` is not a vector, or its frame is degenerate, because of dependent parameters or null directions.

    Examples
    --------
    >>> u, v, w = symbols("u v w")
    >>> parabolic = Chart(multivector(VGA3, {"e1": u * v, "e2": (u**2 - v**2) / 2, "e3": w}), u, v, w)
    >>> parabolic.metric
    Matrix([
    [u**2 + v**2,           0, 0],
    [          0, u**2 + v**2, 0],
    [          0,           0, 1]])
    """

    position: SymbolicMultivector | None
    """The position as a function of the parameters; None if only a metric is given."""
    algebra: Algebra

    def __init__(self, position: SymbolicMultivector, *parameters: Any) -> None:
        if not isinstance(position, SymbolicMultivector) or set(position.grades) != {1}:
            raise AlgebraError("Chart", f"the position {position}", "a vector with symbolic coefficients")
        self.parameters = _symbols("Chart", parameters)
        self.position = position
        self.algebra = position.algebra

    @classmethod
    def of_metric(cls, metric: Any, *parameters: Any, vectors: str | Sequence[str] = "", name: str = "") -> Chart:
        """Return coordinates of a space with a given metric, which may be curved.

        Fields are multivectors of `algebra`, whose basis vectors are the frame of the coordinates. Their derivatives
        include those of the basis vectors (`christoffel`).

        Parameters
        ----------
        metric : sequence or Matrix
            The inner products ``e_i . e_j`` as expressions in the parameters and other symbols: a symmetric matrix, or
            the squares of orthogonal vectors.
        *parameters : Symbol
        vectors : str or sequence of str, optional
            Names of the basis vectors. By default ``e_`` and the name of the parameter.
        name : str, optional
            The name of the algebra.

        Raises
        ------
        AlgebraError
            When the metric is not symmetric, has another size, or has the determinant zero.

        Examples
        --------
        >>> theta, phi = symbols("theta phi")
        >>> sphere = Chart.of_metric([1, sympy.sin(theta) ** 2], theta, phi)
        >>> sphere.scalar_curvature, sphere.christoffel[0, 1, 1]
        (2, -sin(theta)*cos(theta))
        """
        found = cls.__new__(cls)
        found.parameters = _symbols("Chart.of_metric()", parameters)
        names = vectors.split() if isinstance(vectors, str) else list(vectors)
        names = names or [f"e_{parameter.name}" for parameter in parameters]
        found.algebra = Algebra(name or "M" + "".join(each.name for each in parameters), names, metric)
        found.position = None
        if inverse_of(found.metric) is None:
            raise AlgebraError(
                "Chart.of_metric()", f"the metric {metric} with determinant zero", "an invertible metric"
            )
        return found

    def __eq__(self, other: object) -> bool:
        """Return whether both charts have the same parameters and position, or the same metric."""
        same = isinstance(other, Chart) and self.parameters == other.parameters and self.algebra == other.algebra
        return same and self.position == other.position  # type: ignore[attr-defined]

    def __hash__(self) -> int:
        return hash((self.position, self.parameters, self.algebra))

    def __repr__(self) -> str:
        given = repr(self.position) if self.position is not None else f"{self.algebra.name}: {self.metric.tolist()}"
        return f"Chart({given}, {', '.join(map(str, self.parameters))})"

    def _latex(self, printer: object = None) -> str:
        """Return the line element in LaTeX, for `sympy.latex`."""
        names = [rf"\mathrm{{d}}{latex(each)}" for each in self.parameters]
        n, parts = len(names), []
        for i, j in combinations_with_replacement(range(n), 2):
            value = self.metric[i, j] * (1 if i == j else 2)
            if value != 0:
                square = rf"{names[i]}^{{2}}" if i == j else rf"{names[i]}\,{names[j]}"
                factor = "" if value == 1 else "-" if value == -1 else latex(value) + r"\,"
                parts.append((rf"\left({latex(value)}\right)" if value.is_Add else factor) + square)
        return r"\mathrm{d}s^{2} = " + " + ".join(parts).replace("+ -", "- ")

    def _repr_latex_(self) -> str:
        return f"${self._latex()}$"

    @cached_property
    def frame(self) -> tuple[SymbolicMultivector, ...]:
        """The frame vectors ``e_i = dx/du_i``."""
        if self.position is None:
            return tuple(map(symbolic, self.algebra.basis()))
        return tuple(self.position.diff(parameter) for parameter in self.parameters)

    @cached_property
    def metric(self) -> Any:
        """The sympy matrix of ``e_i . e_j``."""
        if self.position is None:
            return sympy.Matrix([[Expanded.of(value).expression for value in row] for row in self.algebra.gram])
        n = len(self.frame)
        return sympy.Matrix(n, n, lambda i, j: short(left_contraction(self.frame[i], self.frame[j])["1"]))

    @cached_property
    def inverse_metric(self) -> Any:
        """The sympy matrix of ``e^i . e^j``."""
        inverse = inverse_of(self.metric)
        if inverse is None:
            raise AlgebraError(
                "reciprocal frame",
                f"the frame {', '.join(map(str, self.frame))}, which is degenerate",
                "independent parameters, and no direction that is orthogonal to all directions",
            )
        return inverse

    @cached_property
    def reciprocal_frame(self) -> tuple[SymbolicMultivector, ...]:
        """The vectors ``e^i`` with ``e^i . e_j = 1`` if ``i = j``, else 0."""
        n, inverse = len(self.frame), self.inverse_metric
        return tuple(reduce(self._total(self.frame[j] * inverse[i, j] for j in range(n))) for i in range(n))

    def _total(self, parts: Iterable[SymbolicMultivector]) -> SymbolicMultivector:
        return sum(parts, SymbolicMultivector(self.algebra, {}))

    @cached_property
    def lengths(self) -> tuple[Any, ...]:
        """The scale factors, the roots of ``|e_i . e_i|``; factors such as ``sin(theta)`` have either sign."""
        positive = {p: sympy.Symbol(f"{p.name}_", positive=True) for p in self.parameters}
        back = {new: old for old, new in positive.items()}
        roots = []
        for k in range(len(self.parameters)):
            root = sympy.simplify(sympy.sqrt(sympy.factor(self.metric[k, k].subs(positive))))
            if root.has(sympy.I):
                root = sympy.simplify(sympy.sqrt(sympy.factor(-self.metric[k, k].subs(positive))))
            roots.append(positive_length(root).subs(back))
        return tuple(roots)

    @cached_property
    def unit_frame(self) -> tuple[SymbolicMultivector, ...]:
        """The frame vectors divided by their lengths. Physical components refer to this frame."""
        return tuple(reduce(vector / length) for vector, length in zip(self.frame, self.lengths, strict=True))

    def vector(self, *components: Any) -> SymbolicMultivector:
        """Return a vector field from its physical components, which are those along `unit_frame`."""
        if len(components) != len(self.parameters):
            raise AlgebraError("Chart.vector()", f"{len(components)} components", f"{len(self.parameters)}")
        return self._total(vector * component for component, vector in zip(components, self.unit_frame, strict=True))

    def components(self, field: SymbolicMultivector) -> tuple[Any, ...]:
        """Return the physical components ``F . e_i / |e_i|`` of a vector field, for orthogonal coordinates.

        Raises
        ------
        AlgebraError
            If the field has parts of other grades: a curl is a bivector, and `dual` gives its vector in space.
        """
        grades = [k for k in field.grades if k != 1]
        if grades:
            raise AlgebraError(
                "Chart.components()", f"a field of grade {', '.join(map(str, grades))}", "a vector field",
                "take the vector part with grade(1), or the dual of a bivector in space",
            )  # fmt: skip
        return tuple(
            sympy.simplify(left_contraction(vector, field)["1"] * length)
            for vector, length in zip(self.reciprocal_frame, self.lengths, strict=True)
        )

    def derivative(self, field: Any, *, right: bool = False) -> SymbolicMultivector:
        """Return the vector derivative ``sum e^i dF/du_i``; for a scalar field, this is the gradient.

        Parameters
        ----------
        field : SymbolicMultivector, Multivector or sympy expression
        right : bool
            Whether the reciprocal frame multiplies from the right: ``sum dF/du_i e^i``.
        """
        return self._sum(field, (lambda e, f: f * e) if right else (lambda e, f: e * f))

    def divergence(self, field: Any) -> SymbolicMultivector:
        """Return ``sum e^i . dF/du_i`` (left contraction): it lowers the grade by one, and is zero for a scalar."""
        return self._sum(field, left_contraction)

    def curl(self, field: Any) -> SymbolicMultivector:
        """Return ``sum e^i ^ dF/du_i``, which raises the grade by one; in 3D it is dual to the curl of a vector."""
        return self._sum(field, lambda e, f: e ^ f)

    def laplacian(self, field: Any) -> SymbolicMultivector:
        """Apply the vector derivative twice, which preserves grades; in spacetime this is the d'Alembertian."""
        return self.derivative(self.derivative(field))

    def directional_derivative(self, direction: SymbolicMultivector, field: Any) -> SymbolicMultivector:
        """Return ``a . d F``, the derivative of the field along a vector or vector field `direction`."""
        lifted = self.lift(field)
        parts = zip(self._along(direction), range(len(self.parameters)), strict=True)
        return reduce(self._total(scale * self.partial(lifted, k) for scale, k in parts if scale != 0))

    def covariant_derivative(self, direction: SymbolicMultivector, field: Any) -> SymbolicMultivector:
        """Return the covariant derivative along a vector field: the part of ``a . d F`` within the surface or space.

        It is `directional_derivative` if the parameters describe the whole space, or if a metric is given.
        """
        return self._tangential(self.directional_derivative(direction, field))

    def bracket(self, a: SymbolicMultivector, b: SymbolicMultivector) -> SymbolicMultivector:
        """Return the Lie bracket ``[a, b] = a . d b - b . d a`` of two vector fields along the coordinates."""
        return reduce(self.directional_derivative(a, b) - self.directional_derivative(b, a))

    def lie_derivative(self, direction: SymbolicMultivector, field: Any) -> SymbolicMultivector:
        """Return the Lie derivative of a multivector field along a vector field `a`.

        For a scalar field, it is the directional derivative; for a vector field, the bracket ``[a, v]``. It satisfies
        the product rule of the outer product. The field must be tangential, made of the frame vectors.
        """
        lifted = self.lift(field)
        moved = self.covariant_derivative(direction, lifted)
        turned = self._total(
            self.covariant_derivative(vector, direction) ^ left_contraction(reciprocal, lifted)
            for vector, reciprocal in zip(self.frame, self.reciprocal_frame, strict=True)
        )
        return reduce(moved - turned)

    def curvature(self, a: SymbolicMultivector, b: SymbolicMultivector) -> SymbolicMultivector:
        """Return the curvature bivector ``R(a ^ b)`` of two vector fields.

        Its commutator product with a field is ``D_a D_b F - D_b D_a F - D_[a,b] F``, with covariant derivatives.
        """
        n, x, y = len(self.parameters), self._along(a), self._along(b)
        found = SymbolicMultivector(self.algebra, {})
        for h in range(n):
            for k in range(h + 1, n):
                terms = (
                    self._mixed[h, k, i, j] * (x[i] * y[j] - x[j] * y[i]) for i in range(n) for j in range(i + 1, n)
                )
                value = sum(terms, Expanded({}))
                found = found + (self.frame[h] ^ self.frame[k]) * value.expression
        return reduce(found)

    @cached_property
    def second_fundamental_form(self) -> tuple[tuple[SymbolicMultivector, ...], ...]:
        """The parts of ``d e_j / du_i`` that are orthogonal to the surface; zero in a space given by its metric."""
        indices = range(len(self.parameters))
        seconds = [[self.partial(self.frame[j], i) for j in indices] for i in indices]
        return tuple(tuple(reduce(each - self._tangential(each)) for each in row) for row in seconds)

    def submanifold(self, values: Mapping[Any, Any] | Sequence[Any], *parameters: Any) -> Chart:
        """Return coordinates of a submanifold, given by the coordinates of this chart as functions of new parameters.

        If this chart has a position, so has the submanifold; otherwise it has the induced metric.

        Parameters
        ----------
        values : mapping or sequence
            The value of every parameter of this chart, as a function of the new parameters.
        *parameters : Symbol
        """
        row = [values.get(p, p) for p in self.parameters] if isinstance(values, Mapping) else list(values)
        if len(row) != len(self.parameters):
            raise AlgebraError(
                "Chart.submanifold()", f"{len(row)} values", f"{len(self.parameters)}, one per parameter"
            )
        given = dict(zip(self.parameters, map(sympy.sympify, row), strict=True))
        if self.position is not None:
            return Chart(self.position.subs(given), *parameters)
        slopes = sympy.Matrix([[sympy.diff(value, p) for p in parameters] for value in given.values()])
        induced = slopes.T * self.metric.subs(given, simultaneous=True) * slopes
        return Chart.of_metric(induced.applyfunc(short), *parameters)

    def intrinsic(self) -> Chart:
        """Return the chart with the same metric and without a position: its fields are those within the surface."""
        return Chart.of_metric(self.metric, *self.parameters)

    def partial(self, field: Any, k: int) -> SymbolicMultivector:
        """Return the derivative of a field by parameter `k`, with the derivatives of the basis vectors."""
        lifted = self.lift(field)
        found = lifted.diff(self.parameters[k])
        if self.position is not None or not self._turns[k]:
            return found
        terms = dict(found.terms)
        for blade, value in lifted.terms.items():
            for i, j, turn in self._turns[k]:
                rest = blade ^ 1 << j
                if blade >> j & 1 and not rest >> i & 1:
                    target = rest | 1 << i
                    product = value * turn * (outer(1 << i, rest) * outer(1 << j, rest))
                    terms[target] = terms[target] + product if target in terms else product
        return found.of_ring(self.algebra, terms)

    @cached_property
    def _turns(self) -> list[list[tuple[int, int, Expanded]]]:
        """For each parameter `k`, the derivatives of the basis vectors that are not zero: ``D_k e_j`` along ``e_i``."""
        n = range(self.algebra.dimension)
        return [[(i, j, turn) for j in n for i in n if (turn := self._second[i, k, j])] for k in n]

    @cached_property
    def is_flat(self) -> bool:
        """Whether fields are those of a flat space, in which the derivatives along coordinates commute."""
        return self.position is not None or not any(self._riemann.values())

    @cached_property
    def grad(self) -> FieldOperator:
        """The vector derivative as an operator, ``grad * F``, which composes; see `FieldOperator`."""
        return FieldOperator(self, [(e, (k,)) for k, e in enumerate(self.reciprocal_frame)])

    @cached_property
    def rgrad(self) -> FieldOperator:
        """The vector derivative as an operator on the fields at its left, ``F * rgrad``."""
        return FieldOperator(self, [(e, (k,)) for k, e in enumerate(self.reciprocal_frame)], right=True)

    def _along(self, direction: Any) -> list[Any]:
        """Return the components of a vector field along the frame."""
        lifted = self.lift(direction)
        if self.position is None:
            return [lifted[1 << k] for k in range(self.algebra.dimension)]
        return [left_contraction(vector, lifted)["1"] for vector in self.reciprocal_frame]

    @cached_property
    def _tangent(self) -> SymbolicMultivector:
        found = SymbolicMultivector(self.algebra, {0: 1})
        for vector in self.frame:
            found = reduce(found ^ vector)
        return found

    def _tangential(self, field: SymbolicMultivector) -> SymbolicMultivector:
        if len(self.parameters) == self.algebra.dimension:
            return field
        tangent = self._tangent
        return reduce(left_contraction(field, tangent) * inverse_blade(tangent))

    def _sum(self, field: Any, product: Product) -> SymbolicMultivector:
        lifted = self.lift(field)
        parts = enumerate(self.reciprocal_frame)
        return reduce(self._total(product(vector, self.partial(lifted, k)) for k, vector in parts))

    def lift(self, field: Any) -> SymbolicMultivector:
        """Return a field as a symbolic multivector of the chart's algebra; an expression becomes a scalar field."""
        if type(field) is SymbolicMultivector and field.algebra is self.algebra:
            return field
        if isinstance(field, Multivector) and field.algebra != self.algebra:
            raise AlgebraError(
                "field", f"of {field.algebra.name}", f"a field of the chart's algebra {self.algebra.name}"
            )
        return SymbolicMultivector(self.algebra, {}).lift(field)


def _symbols(where: str, parameters: tuple[Any, ...]) -> tuple[Any, ...]:
    if not parameters or not all(isinstance(each, sympy.Symbol) for each in parameters):
        raise AlgebraError(where, f"parameters {parameters}", "the symbols of the coordinates, such as r, theta, phi")
    return parameters
