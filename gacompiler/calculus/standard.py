"""Standard coordinates of flat spaces."""

from __future__ import annotations

from collections.abc import Sequence

import sympy

from ..algebra.algebra import Algebra
from ..algebra.catalog import VGA3
from ..errors import AlgebraError
from ..symbolic import multivector, symbols
from .coordinates import Chart


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
