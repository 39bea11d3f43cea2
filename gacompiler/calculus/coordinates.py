"""Coordinates of a flat space, and the vector derivative of multivector fields in these coordinates.

With a position ``x(u)``, its frame ``e_i = dx/du_i`` and the reciprocal frame ``e^i``, the vector derivative is
``d = sum e^i d/du_i`` (Hestenes & Sobczyk 1984, §6-2; Doran & Lasenby 2003, §6.2). Fields are multivectors over the
fixed basis of the algebra, and their coefficients depend on the parameters. A frame that varies with position therefore
needs no Christoffel symbols.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import sympy

from ..algebra.algebra import Algebra
from ..algebra.catalog import VGA3
from ..algebra.multivector import Multivector
from ..errors import AlgebraError
from ..symbolic import left_contraction, multivector, reduce, symbols
from ..symbolic.functions import signless
from ..symbolic.multivector import SymbolicMultivector

Product = Callable[[SymbolicMultivector, SymbolicMultivector], SymbolicMultivector]


class Chart:
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

    def __init__(self, position: SymbolicMultivector, *parameters: Any) -> None:
        if not isinstance(position, SymbolicMultivector) or set(position.grades) != {1}:
            raise AlgebraError("Chart", f"the position {position}", "a vector with symbolic coefficients")
        if not parameters or not all(isinstance(each, sympy.Symbol) for each in parameters):
            raise AlgebraError("Chart", f"parameters {parameters}", "the symbols that the position depends on")
        self.position = position
        self.parameters = parameters
        self.algebra = position.algebra

    def __eq__(self, other: object) -> bool:
        """Return whether both charts map the same parameters to the same position."""
        same = isinstance(other, Chart) and self.parameters == other.parameters
        return same and self.position == other.position  # type: ignore[attr-defined]

    def __hash__(self) -> int:
        return hash((self.position, self.parameters))

    def __repr__(self) -> str:
        return f"Chart({self.position!r}, {', '.join(map(str, self.parameters))})"

    @cached_property
    def frame(self) -> tuple[SymbolicMultivector, ...]:
        """The frame vectors ``e_i = dx/du_i``."""
        return tuple(self.position.diff(parameter) for parameter in self.parameters)

    @cached_property
    def metric(self) -> Any:
        """The sympy matrix of ``e_i . e_j``, simplified."""
        n = len(self.frame)
        return sympy.Matrix(n, n, lambda i, j: sympy.simplify(left_contraction(self.frame[i], self.frame[j])["1"]))

    @cached_property
    def reciprocal_frame(self) -> tuple[SymbolicMultivector, ...]:
        """The vectors ``e^i`` with ``e^i . e_j = 1`` if ``i = j``, else 0."""
        if sympy.simplify(self.metric.det()) == 0:
            raise AlgebraError(
                "reciprocal frame",
                f"the frame {', '.join(map(str, self.frame))}, which is degenerate",
                "independent parameters, and no direction that is orthogonal to all directions",
            )
        inverse = self.metric.inv()
        zero = SymbolicMultivector(self.algebra, {})
        return tuple(
            reduce(sum((self.frame[j] * inverse[i, j] for j in range(len(self.frame))), zero))
            for i in range(len(self.frame))
        )

    @cached_property
    def lengths(self) -> tuple[Any, ...]:
        """The scale factors, the roots of ``|e_i . e_i|``; the sign is chosen for positive parameters."""
        positive = {p: sympy.Symbol(f"{p.name}_", positive=True) for p in self.parameters}
        back = {new: old for old, new in positive.items()}
        roots = []
        for k in range(len(self.parameters)):
            root = sympy.simplify(sympy.sqrt(sympy.factor(self.metric[k, k].subs(positive))))
            if root.has(sympy.I):
                root = sympy.simplify(sympy.sqrt(sympy.factor(-self.metric[k, k].subs(positive))))
            roots.append(signless(root).subs(back))
        return tuple(roots)

    @cached_property
    def unit_frame(self) -> tuple[SymbolicMultivector, ...]:
        """The frame vectors divided by their lengths. Physical components refer to this frame."""
        return tuple(reduce(vector / length) for vector, length in zip(self.frame, self.lengths, strict=True))

    def vector(self, *components: Any) -> SymbolicMultivector:
        """Return a vector field from its physical components, which are those along `unit_frame`."""
        if len(components) != len(self.parameters):
            raise AlgebraError("Chart.vector()", f"{len(components)} components", f"{len(self.parameters)}")
        parts = zip(components, self.unit_frame, strict=True)
        return sum((vector * component for component, vector in parts), SymbolicMultivector(self.algebra, {}))

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
        along = [left_contraction(vector, direction) for vector in self.reciprocal_frame]
        parts = zip(along, self.parameters, strict=True)
        lifted = self._lift(field)
        return reduce(
            sum((scale * lifted.diff(parameter) for scale, parameter in parts), SymbolicMultivector(self.algebra, {}))
        )

    def _sum(self, field: Any, product: Product) -> SymbolicMultivector:
        lifted = self._lift(field)
        total = SymbolicMultivector(self.algebra, {})
        for vector, parameter in zip(self.reciprocal_frame, self.parameters, strict=True):
            total = total + product(vector, lifted.diff(parameter))
        return reduce(total)

    def _lift(self, field: Any) -> SymbolicMultivector:
        if isinstance(field, Multivector) and field.algebra != self.algebra:
            raise AlgebraError(
                "field", f"of {field.algebra.name}", f"a field of the chart's algebra {self.algebra.name}"
            )
        return SymbolicMultivector(self.algebra, {}).lift(field)


def cartesian(algebra: Algebra, names: str, vectors: str | Sequence[str] | None = None) -> Chart:
    """Return coordinates along basis vectors, in any metric: ``cartesian(STA, "t x y z")``.

    Parameters
    ----------
    algebra : Algebra
    names : str
        Names of the coordinates, one for each vector.
    vectors : str or sequence of str, optional
        Basis vectors; all by default. In projective and conformal algebras, pass those of space: ``"e1 e2 e3"``.
    """
    chosen = algebra.vectors if vectors is None else vectors.split() if isinstance(vectors, str) else tuple(vectors)
    parameters = tuple(symbols(name) for name in names.replace(",", " ").split())
    if len(parameters) != len(chosen):
        raise AlgebraError(
            f"cartesian({algebra.name})", f"{len(parameters)} names", f"{len(chosen)}, for {' '.join(chosen)}"
        )
    return Chart(multivector(algebra, dict(zip(chosen, parameters, strict=True))), *parameters)


def spherical(names: str = "r theta phi", algebra: Algebra = VGA3) -> Chart:
    """Return spherical coordinates: radius, polar angle from the e3 axis, and azimuth about it."""
    r, theta, phi = symbols(names)
    across = r * sympy.sin(theta)
    x = {"e1": across * sympy.cos(phi), "e2": across * sympy.sin(phi), "e3": r * sympy.cos(theta)}
    return Chart(multivector(algebra, x), r, theta, phi)


def cylindrical(names: str = "rho phi z", algebra: Algebra = VGA3) -> Chart:
    """Return cylindrical coordinates: distance from the e3 axis, azimuth about it, and height."""
    rho, phi, z = symbols(names)
    x = {"e1": rho * sympy.cos(phi), "e2": rho * sympy.sin(phi), "e3": z}
    return Chart(multivector(algebra, x), rho, phi, z)
