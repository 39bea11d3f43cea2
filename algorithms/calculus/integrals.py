"""Directed integrals over meshes, and applications of the fundamental theorem: flux, circulation, Cauchy's formula.

For a mesh M of dimension k and its boundary, as `SimplicialMesh.boundary` orients it, the fundamental theorem of
geometric calculus (Hestenes & Sobczyk 1984, ch. 7) is ``integral of dS F = (-1)**(k - 1) integral of dX D F``.
"""

from __future__ import annotations

from collections.abc import Callable
from math import gamma, pi
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import real_array
from .meshes import SimplicialMesh
from .products import embed, product_of
from .quadrature import simplex_rule

Floats = NDArray[np.float64]
Field = Callable[[Floats], ArrayLike]
"""Function from points ``(..., n)`` to multivectors ``(..., 2**n)`` by grades, or to other values of an integrand."""


def integral(mesh: SimplicialMesh, field: Field, degree: int) -> Floats:
    """Compute the integral of a field over a mesh by lengths, areas or volumes, independently of its orientation.

    Parameters
    ----------
    mesh : SimplicialMesh
    field : callable
        Function from points ``(C, Q, n)`` to values ``(C, Q, ...)``.
    degree : int
        Degree of polynomials that are integrated exactly.

    Returns
    -------
    array, (...)
        The axes of the values after those of the points.

    Raises
    ------
    TypeError, ValueError
        If values have a wrong shape or are not finite.
    """
    values, weights = _values(mesh, field, degree, None)
    return np.asarray(np.einsum("c,cq...,q->...", mesh.contents() * np.abs(mesh.weights), values, weights))


def directed_integral(mesh: SimplicialMesh, field: Field, degree: int, left: Field | None = None) -> Floats:
    """Compute the directed integral of ``dX F``, or of ``G dX F`` with a second field on the left.

    Parameters
    ----------
    mesh : SimplicialMesh
        A mesh in a space of up to 8 dimensions.
    field, left : callable
        Functions from points ``(C, Q, n)`` to multivectors ``(C, Q, 2**n)`` by grades.
    degree : int
        Degree of polynomials, as products of both fields, that are integrated exactly.

    Returns
    -------
    array, (2**n,)

    Raises
    ------
    TypeError, ValueError
        If values have a wrong shape or are not finite.
    """
    n, product = mesh.n, product_of(mesh.n)
    values, weights = _values(mesh, field, degree, 1 << n)
    measures = embed(mesh.measures(), n, mesh.dimension)
    if left is None:
        return np.asarray(np.sum(product(measures, np.einsum("cqm,q->cm", values, weights)), axis=0))
    others, _ = _values(mesh, left, degree, 1 << n)
    found = np.asarray(product(product(others, measures[:, None]), values))
    return np.asarray(np.einsum("cqm,q->m", found, weights))


def flux(mesh: SimplicialMesh, field: Field, degree: int) -> float:
    """Compute the flux of a vector field through a hypersurface: the integral of ``V ^ dS``, over the pseudoscalar.

    Over a boundary it is the integral of the divergence, with outward flux positive.

    Parameters
    ----------
    mesh : SimplicialMesh
        A mesh of dimension n - 1.
    field : callable
        Function from points ``(C, Q, n)`` to vectors ``(C, Q, n)``.
    degree : int
        Degree of polynomials that are integrated exactly.

    Raises
    ------
    TypeError, ValueError
        If the mesh is not a hypersurface, or if values have a wrong shape or are not finite.
    """
    n = mesh.n
    if mesh.dimension != n - 1:
        raise ValueError(f"mesh: dimension {mesh.dimension} in space of {n}; expected {n - 1}, a hypersurface")
    values, weights = _values(mesh, field, degree, n)
    # e_i ^ (blade without e_i) has the sign (-1)**i, and this blade has index n - 1 - i
    normals = mesh.measures()[:, ::-1] * (1.0 - 2.0 * (np.arange(n) & 1))
    return float(np.einsum("cqm,cm,q->", values, normals, weights))


def circulation(mesh: SimplicialMesh, field: Field, degree: int) -> float:
    """Compute the circulation of a vector field along a curve: the integral of ``V . dX``.

    Along the boundary of a surface it is the integral of the curl, ``-(D ^ V) . dX`` in the surface (Stokes).

    Parameters
    ----------
    mesh : SimplicialMesh
        A mesh of dimension 1.
    field : callable
        Function from points ``(C, Q, n)`` to vectors ``(C, Q, n)``.
    degree : int
        Degree of polynomials that are integrated exactly.

    Raises
    ------
    TypeError, ValueError
        If the mesh is not a curve, or if values have a wrong shape or are not finite.
    """
    if mesh.dimension != 1:
        raise ValueError(f"mesh: dimension {mesh.dimension}; expected 1, a curve")
    values, weights = _values(mesh, field, degree, mesh.n)
    return float(np.einsum("cqm,cm,q->", values, mesh.measures(), weights))


def cauchy_integral(surface: SimplicialMesh, field: Field, at: ArrayLike, degree: int) -> Floats:
    """Compute a field with ``D F = 0`` inside a closed surface from its values on the surface, in any dimension.

    ``F(a) = I^-1 integral of E(x - a) dS F(x)``, ``E(x) = x / (|x|**n`` area of the unit sphere``)``. Outside the
    surface the result is 0.

    Parameters
    ----------
    surface : SimplicialMesh
        A closed hypersurface, oriented with an outward vector first, such as `SimplicialMesh.boundary`.
    field : callable
        Function from points ``(C, Q, n)`` to multivectors ``(C, Q, 2**n)`` by grades.
    at : array_like, (..., n)
        Points not on the surface; errors grow if the distance from it is less than that of quadrature points.
    degree : int
        Degree of the quadrature on each cell.

    Returns
    -------
    array, (..., 2**n)

    Raises
    ------
    TypeError, ValueError
        If the mesh is not a closed hypersurface, or if values have a wrong shape or are not finite.
    """
    n, product = surface.n, product_of(surface.n)
    if n < 2 or surface.dimension != n - 1:
        raise ValueError(f"surface: dimension {surface.dimension} in space of {n}; expected {n - 1}, a hypersurface")
    if len(surface.boundary().cells):
        raise ValueError("surface: it has a boundary; expected a closed one")
    places = real_array(at, "at", (n,), "points")
    values, weights = _values(surface, field, degree, 1 << n)
    measures = embed(surface.measures(), n, n - 1)
    weighted = np.asarray(product(measures[:, None], values)) * weights[:, None]
    x = _points(surface, degree)
    area = 2 * pi ** (n / 2) / gamma(n / 2)
    # I I^~ = 1, and the pseudoscalar is the last coefficient
    inverse = np.zeros(1 << n)
    inverse[-1] = 1.0 - 2.0 * (n * (n - 1) // 2 & 1)
    found = np.empty((*places.shape[:-1], 1 << n))
    for index in np.ndindex(places.shape[:-1]):
        away = x - places[index]
        kernel = embed(away / (area * np.linalg.norm(away, axis=-1, keepdims=True) ** n), n, 1)
        found[index] = product(inverse, np.asarray(product(kernel, weighted)).sum((0, 1)))
    return found


def _points(mesh: SimplicialMesh, degree: int) -> Floats:
    points, _ = simplex_rule(mesh.dimension, degree)
    return np.asarray(np.einsum("qi,cin->cqn", points, mesh.points[mesh.cells]))


def _values(mesh: SimplicialMesh, field: Field, degree: int, size: int | None) -> tuple[Floats, Any]:
    """Return the values of a field at the quadrature points, ``(C, Q, ...)``, and the weights of these."""
    x = _points(mesh, degree)
    values = real_array(field(x), "field")
    if values.shape[:2] != x.shape[:2] or (size is not None and values.shape != (*x.shape[:2], size)):
        expected = (*x.shape[:2], "..." if size is None else size)
        raise ValueError(f"field: values of shape {values.shape}; expected ({', '.join(map(str, expected))})")
    if not np.isfinite(values).all():
        raise ValueError("field: infinite values or not numbers; expected finite ones at all points of quadrature")
    return values.astype(np.float64, copy=False), simplex_rule(mesh.dimension, degree)[1]
