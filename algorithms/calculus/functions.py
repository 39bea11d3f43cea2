"""Functions of multivectors: closed forms for complex, double and dual numbers, functions of matrices for all others.

A power series of an element `x` is the same power series of the matrix that multiplies by `x`, applied to 1. For a
single basis vector there are closed forms: with a null vector ``f(a + b e) = f(a) + f'(a) b e``; with a vector of
square 1 the values at ``a + b`` and ``a - b`` are those of two real numbers; with a vector of square -1 they are
complex numbers.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from generated.gac_runtime.layout import Layout, layout

from ..arguments import real_array
from ..elements import plain, restorer
from ..precision import NEGLIGIBLE, TINY
from .products import bitmaps_of

Floats = NDArray[np.float64]
Matrix = NDArray[Any]
LARGEST = 6
"""Maximum number of basis vectors: matrices have 64 rows."""
_RESIDUAL = 1e-8
"""Relative residual above which a root or a logarithm is invalid."""

_Derivative = Callable[[Any], Any]
_NUMBERS: dict[str, tuple[Callable[[Any], Any], _Derivative]] = {
    "exp": (np.exp, np.exp),
    "expm1": (np.expm1, np.exp),
    "log": (np.log, lambda a: 1 / a),
    "log1p": (np.log1p, lambda a: 1 / (1 + a)),
    "sqrt": (np.sqrt, lambda a: 1 / (2 * np.sqrt(a))),
    "reciprocal": (lambda a: 1 / a, lambda a: -1 / (a * a)),
    "square": (lambda a: a * a, lambda a: 2 * a),
    "cube": (lambda a: a * a * a, lambda a: 3 * a * a),
    "sin": (np.sin, np.cos),
    "cos": (np.cos, lambda a: -np.sin(a)),
    "tan": (np.tan, lambda a: 1 / np.cos(a) ** 2),
    "asin": (np.arcsin, lambda a: 1 / (np.sqrt(1 - a) * np.sqrt(1 + a))),
    "acos": (np.arccos, lambda a: -1 / (np.sqrt(1 - a) * np.sqrt(1 + a))),
    "atan": (np.arctan, lambda a: 1 / (1 + a * a)),
    "sinh": (np.sinh, np.cosh),
    "cosh": (np.cosh, np.sinh),
    "tanh": (np.tanh, lambda a: 1 / np.cosh(a) ** 2),
    "asinh": (np.arcsinh, lambda a: 1 / np.sqrt(1 + a * a)),
    "acosh": (np.arccosh, lambda a: 1 / (np.sqrt(a - 1) * np.sqrt(a + 1))),
    "atanh": (np.arctanh, lambda a: 1 / ((1 - a) * (1 + a))),
}
"""Functions of real or complex numbers, and their derivatives."""
_SQUARES = {
    "VGA2": (1, 1), "VGA3": (1, 1, 1), "QUATERNIONS": (-1, -1), "COMPLEX": (-1,), "DOUBLE_NUMBERS": (1,),
    "DUAL_NUMBERS": (0,),
}  # fmt: skip
"""The squares of the vectors of algebras whose elements are accepted; their blades are spelled in ascending order."""
FUNCTIONS = tuple(_NUMBERS)
"""The names that `multivector_function` accepts."""


def multivector_function(name: str, x: ArrayLike, squares: ArrayLike | None = None) -> Floats:
    """Compute a function of multivectors by its power series, or by the principal branch for inverse functions.

    Parameters
    ----------
    name : str
        exp, expm1, log, log1p, sqrt, reciprocal, square, cube, sin, cos, tan, asin, acos, atan, sinh, cosh, tanh,
        asinh, acosh or atanh. For other powers use ``exp`` of a multiple of ``log``.
    x : array_like, (..., 2**n), or multivector of VGA2, VGA3 or an algebra of numbers
        Coefficients by grade, each grade ordered by bitmap: the order of full layouts. Dual numbers are (a, b).
    squares : array_like, (n,), optional
        Squares of the orthogonal basis vectors, each 1, 0 or -1; the default is 1 for all. ``[0]`` gives dual numbers,
        ``[1]`` double (split-complex) numbers and ``[-1]`` complex numbers; n is at most 6.

    Returns
    -------
    array, (..., 2**n), or multivector
        NaN where the function has no value in the real algebra (``log`` of a double number with ``abs(b) > a``), at its
        poles, and where a matrix has no root or logarithm. Infinite where it overflows.

    Raises
    ------
    TypeError, ValueError
        If the name or the squares are invalid, or if `x` is not an array of real numbers of this shape.

    Notes
    -----
    For one basis vector, results are accurate to a few units in the last place of the larger of the combined values:
    errors are at most 2e-15 of ``abs(f) + abs(f') (abs(a) + abs(b))`` in
    `tests/calculus/test_multivector_functions.py`. For several vectors, each element requires functions of a matrix of
    2**n rows, by Padé approximants and Schur forms (scipy's expm, logm and sqrtm): functions composed with their
    inverses reproduce elements of size 0.4 to 2e-12, and less accurately near poles and branch points.

    Examples
    --------
    A dual number carries a derivative:

    >>> from algorithms.calculus import multivector_function
    >>> multivector_function("square", [3.0, 1.0], [0])
    array([9., 6.])
    """
    if name not in _NUMBERS:
        raise ValueError(f"name: {name!r}; expected one of {' '.join(FUNCTIONS)}")
    own = getattr(x, "stored", (None, None))[1]
    if own is not None and own.algebra in _SQUARES:
        if squares is not None:
            raise ValueError(f"squares: {squares}; expected none beside an element of {own.algebra}, which has its own")
        full = _full(own.algebra)
        result = multivector_function(name, plain(x, "x", (full,)), _SQUARES[own.algebra])
        return restorer(x, (full,))(result)  # type: ignore[no-any-return]
    if own is not None:
        raise TypeError(
            f"x is {own.name}; expected an element of {', '.join(_SQUARES)}, or an array of coefficients by grade, "
            "(..., 2**n), with the squares of the n basis vectors"
        )
    array = real_array(x, "x").astype(np.float64, copy=False)
    signs = _squares(squares, array.shape)
    if array.shape[-1:] != (1 << len(signs),):
        raise ValueError(
            f"x: shape {array.shape}; expected (..., {1 << len(signs)}), multivectors of {len(signs)} vectors"
        )
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # scipy's, of several classes; roots and logarithms are tested
        if len(signs) == 1:
            return _of_number(name, array, signs[0])
        return _of_matrices(name, array, signs)


def _full(algebra: str) -> Layout:
    """Return the layout of all blades of an algebra, by grade and bitmap."""
    n, first = len(_SQUARES[algebra]), int(algebra != "DUAL_NUMBERS")
    blades = sorted(range(1 << n), key=lambda blade: (blade.bit_count(), blade))
    names = ("".join(str(k + first) for k in range(n) if blade >> k & 1) for blade in blades)
    return layout(f"{algebra}.full", " ".join(f"e{name}" if name else "1" for name in names))


def _squares(squares: ArrayLike | None, shape: tuple[int, ...]) -> tuple[int, ...]:
    if squares is None:
        n = max(shape[-1].bit_length() - 1, 1) if shape else 1
        signs: tuple[int, ...] = (1,) * n
    else:
        given = real_array(squares, "squares", (-1,), "squares of basis vectors")
        if given.ndim != 1 or not np.isin(given, (-1, 0, 1)).all():
            raise ValueError(f"squares: {given.tolist()}; expected 1, 0 or -1 for each basis vector")
        signs = tuple(int(value) for value in given)
    if not 1 <= len(signs) <= LARGEST:
        raise ValueError(f"squares: {len(signs)} basis vectors; expected 1 to {LARGEST}")
    return signs


def _of_number(name: str, x: Floats, square: int) -> Floats:
    function, derivative = _NUMBERS[name]
    a, b = x[..., 0], x[..., 1]
    if square == 0:
        return np.stack([function(a), derivative(a) * b], -1)
    if square > 0:
        one, other = function(a + b), function(a - b)
        return np.stack([(one + other) / 2, (one - other) / 2], -1)
    value = function(a + 1j * b)
    return np.stack([value.real, value.imag], -1)


def _of_matrices(name: str, x: Floats, squares: tuple[int, ...]) -> Floats:
    """Compute the function for each element in turn: scipy's functions of matrices have their own loops."""
    rows, factors = _multiplication(squares)
    flat = x.reshape(-1, x.shape[-1])
    out = np.full(flat.shape, np.nan)
    for k, element in enumerate(flat):
        if np.isfinite(element).all():
            matrix = element[rows] * factors
            column = _matrix_function(name, matrix)[:, 0]
            size = np.abs(column).max()
            if not np.iscomplexobj(column) or np.abs(column.imag).max() <= NEGLIGIBLE * size:
                out[k] = column.real
    return out.reshape(x.shape)


@cache
def _multiplication(squares: tuple[int, ...]) -> tuple[NDArray[np.int64], Floats]:
    """Return (rows, factors): the matrix of ``y -> x y`` is ``x[rows] * factors``."""
    n = len(squares)
    bitmaps = bitmaps_of(n)
    place = np.empty(1 << n, np.int64)
    place[bitmaps] = np.arange(1 << n)
    left = bitmaps[:, None] ^ bitmaps  # the blade that maps each column to each row
    swaps = np.zeros(left.shape, np.int64)
    for shift in range(1, n):
        swaps += np.bitwise_count((left >> shift) & bitmaps)
    factors = 1.0 - 2.0 * (swaps & 1)
    for k, square in enumerate(squares):
        factors = np.where((left & bitmaps) >> k & 1, square * factors, factors)
    return np.asarray(place[left], np.int64), np.asarray(factors, np.float64)


def _matrix_function(name: str, m: Matrix) -> Matrix:
    try:
        return _MATRICES[name](m, np.eye(len(m)))
    except (np.linalg.LinAlgError, ValueError):  # a singular matrix, or an overflow in the computation
        return np.full(m.shape, np.nan)


def _checked(found: Matrix, back: Matrix, wanted: Matrix) -> Matrix:
    """Return `found` if `back`, computed from it, agrees with `wanted`; otherwise NaN."""
    good = np.abs(back - wanted).max() <= _RESIDUAL * max(float(np.abs(wanted).max()), TINY)
    return found if good else np.full(found.shape, np.nan)


def _root(m: Matrix) -> Matrix:
    found = np.asarray(scipy.linalg.sqrtm(m))
    return _checked(found, found @ found, m)


def _log(m: Matrix) -> Matrix:
    if np.linalg.matrix_rank(m) < len(m):  # logm then returns the logarithm of a rounding error
        return np.full(m.shape, np.nan)
    found = np.asarray(scipy.linalg.logm(m))
    return _checked(found, scipy.linalg.expm(found), m)


def _quotient(a: Matrix, b: Matrix) -> Matrix:
    return np.asarray(scipy.linalg.solve(b, a))


def _cosine_and_sine(m: Matrix) -> tuple[Matrix, Matrix]:
    exponential = scipy.linalg.expm(1j * m)
    return exponential.real, exponential.imag


def _hyperbolic(m: Matrix) -> tuple[Matrix, Matrix]:
    up, down = scipy.linalg.expm(m), scipy.linalg.expm(-m)
    return (up + down) / 2, (up - down) / 2


def _asin(m: Matrix, one: Matrix) -> Matrix:
    return -1j * _log(1j * m + _root(one - m @ m))


def _atanh(m: Matrix, one: Matrix) -> Matrix:
    return (_log(one + m) - _log(one - m)) / 2


_MATRICES: dict[str, Callable[[Matrix, Matrix], Matrix]] = {
    "exp": lambda m, one: scipy.linalg.expm(m),
    "expm1": lambda m, one: scipy.linalg.expm(m) - one,
    "log": lambda m, one: _log(m),
    "log1p": lambda m, one: _log(one + m),
    "sqrt": lambda m, one: _root(m),
    "reciprocal": lambda m, one: _quotient(one, m),
    "square": lambda m, one: m @ m,
    "cube": lambda m, one: m @ m @ m,
    "sin": lambda m, one: _cosine_and_sine(m)[1],
    "cos": lambda m, one: _cosine_and_sine(m)[0],
    "tan": lambda m, one: _quotient(*_cosine_and_sine(m)[::-1]),
    "asin": _asin,
    "acos": lambda m, one: np.pi / 2 * one - _asin(m, one),
    "atan": lambda m, one: -1j * _atanh(1j * m, one),
    "sinh": lambda m, one: _hyperbolic(m)[1],
    "cosh": lambda m, one: _hyperbolic(m)[0],
    "tanh": lambda m, one: _quotient(*_hyperbolic(m)[::-1]),
    "asinh": lambda m, one: 1j * _asin(-1j * m, one),
    "acosh": lambda m, one: _log(m + _root(m - one) @ _root(m + one)),
    "atanh": _atanh,
}
