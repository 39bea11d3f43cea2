"""Filters of wavelets, computed from their defining equations in fixed-point arithmetic.

Numbers are integers in units of ``2**-320``. Taps are rounded once, to the nearest double.

- db, sym: spectral factors of ``|m(w)|**2 = cos(w/2)**(2 N) P(sin(w/2)**2)`` with ``P(y) = sum_k comb(N - 1 + k, k)
  y**k`` for k < N (Daubechies, *Ten Lectures on Wavelets*, SIAM 1992, sections 6.1 and 8.1.1).
- coif: both functions have vanishing moments (ibid., section 8.2); solved by Newton's method.
- bior, rbio: factors of the same ``cos(w/2)**(2 N) P`` with symmetric taps (Cohen, Daubechies and Feauveau, *Comm. Pure
  Appl. Math.* 45:485, 1992).
- dmey: the Fourier coefficients of Meyer's filter (Daubechies, ibid., section 4.2.1), truncated.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import comb, isqrt

import numpy as np
from numpy.typing import NDArray

_BITS = 320
"""Bits after the point. Products of 38 factors lose fewer than 200 of them, which leaves more than a double has."""
_ONE = 1 << _BITS
"""The number 1, as an integer with digits behind the point."""
_CONVERGED = _ONE >> 100
"""A step of Newton's method below which the next one reaches the last bit, since steps are squared."""
_STEPS = 40
"""Bound of the steps of Newton's method, which takes at most 9."""

_SYMLETS = ["0", "0", "01", "10", "101", "100", "0101", "0110", "10101", "01100", "101010", "001110", "0011010"]
_SYMLETS += ["0011100", "10011010", "01110001", "101100101", "001011100", "1010011010"]
"""For sym2 to sym20, the zeros outside the unit circle (1), ordered by the real part of y.

Several choices have nearly the same symmetry. These are the ones in use, at most 15 % from the most linear phase.
"""

_COIFLETS = (
    "0.82 0.18",
    "3 0.49 -0.33 -0.13",
    "11 1.5 -2 -0.75 0.21 0.1",
    "41 4.5 -9.6 -3.5 1.7 0.79 -0.15 -0.083",
    "1.6e2 14 -43 -15 9.8 4.4 -1.5 -0.82 0.12 0.071",
    "6e2 45 -1.8e2 -61 49 22 -10 -5.4 1.5 0.85 -0.1 -0.063",
    "2.3e3 1.4e2 -7.6e2 -2.5e2 2.3e2 99 -59 -30 11 6.4 -1.4 -0.88 0.087 0.057",
    "9e3 4.6e2 -3.1e3 -1e3 1e3 4.4e2 -3e2 -1.5e2 72 40 -12 -7.5 1.4 0.9 -0.077 -0.052",
    "3.5e4 1.5e3 -1.3e4 -4e3 4.6e3 1.9e3 -1.5e3 -7.2e2 4e2 2.2e2 -86 -51 14 8.6 -1.4 -0.93 0.069 0.048",
    "1.4e5 4.6e3 -5.2e4 -1.6e4 2e4 8e3 -6.9e3 -3.3e3 2.1e3 1.1e3 -5.2e2 -3e2 1e2 64 -15 -9.8 1.4 0.95 -0.062 -0.045",
    "5.3e5 1.4e4 -2.1e5 -6.4e4 8.3e4 3.3e4 -3.1e4 -1.5e4 1e4 5.4e3 -2.9e3 -1.7e3 6.8e2 4.2e2 -1.2e2 -80 16 11 "
    "-1.4 -0.98 0.057 0.042",
    "2.1e6 4e4 -8.4e5 -2.5e5 3.5e5 1.4e5 -1.4e5 -6.4e4 4.9e4 2.5e4 -1.5e4 -8.6e3 4e3 2.4e3 -8.6e2 -5.5e2 1.4e2 "
    "97 -18 -12 1.4 1 -0.053 -0.039",
    "8.1e6 1.1e5 -3.4e6 -1e6 1.5e6 5.7e5 -6e5 -2.7e5 2.3e5 1.2e5 -7.6e4 -4.2e4 2.2e4 1.3e4 -5.4e3 -3.4e3 1.1e3 "
    "7.2e2 -1.7e2 -1.2e2 19 14 -1.4 -1 0.05 0.037",
    "3.2e7 2.3e5 -1.4e7 -4e6 6e6 2.3e6 -2.6e6 -1.2e6 1e6 5.2e5 -3.7e5 -2e5 1.2e5 6.9e4 -3.1e4 -2e4 7.2e3 4.7e3 "
    "-1.3e3 -9.1e2 1.9e2 1.4e2 -20 -15 1.4 1 -0.046 -0.035",
    "1.2e8 2.6e5 -5.4e7 -1.6e7 2.5e7 9.5e6 -1.1e7 -4.9e6 4.6e6 2.3e6 -1.7e6 -9.4e5 5.8e5 3.4e5 -1.7e5 -1.1e5 "
    "4.4e4 2.9e4 -9.4e3 -6.4e3 1.6e3 1.2e3 -2.2e2 -1.6e2 22 16 -1.4 -1.1 0.044 0.034",
    "4.9e8 -1.4e6 -2.2e8 -6.2e7 1e8 3.8e7 -4.6e7 -2.1e7 2e7 9.9e6 -8e6 -4.3e6 2.8e6 1.7e6 -9.1e5 -5.6e5 2.5e5 "
    "1.6e5 -6e4 -4.1e4 1.2e4 8.4e3 -2e3 -1.4e3 2.5e2 1.8e2 -23 -18 1.4 1.1 -0.041 -0.033",
    "1.9e9 -1.4e7 -8.7e8 -2.5e8 4.2e8 1.6e8 -2e8 -8.6e7 8.7e7 4.3e7 -3.6e7 -1.9e7 1.4e7 7.8e6 -4.6e6 -2.8e6 "
    "1.4e6 8.9e5 -3.6e5 -2.4e5 8.2e4 5.7e4 -1.5e4 -1.1e4 2.4e3 1.7e3 -2.8e2 -2.1e2 25 19 -1.4 -1.1 0.039 0.031",
)
"""First approximations, to two digits, of the coefficients f of coif1 to coif17: the solution in use of several."""

_SPLINES = ["1.1", "1.3", "1.5", "2.2", "2.4", "2.6", "2.8", "3.1", "3.3", "3.5", "3.7", "3.9"]
_SYMMETRIC = {"4.4": (4, 4, 0), "5.5": (6, 4, 0), "6.8": (6, 8, 1)}
"""The zeros at -1 of the synthesis and of the analysis, and the place of the zero y of the synthesis in `_zeros`."""

_MEYER = 31
"""Fourier coefficients of Meyer's filter from the middle on, which gives 62 taps with a zero, as in PyWavelets."""

Fixed = int
"""A real number in units of ``2**-_BITS``."""
Complex = tuple[Fixed, Fixed]
Polynomial = list[int]


@dataclass(frozen=True)
class Filters:
    """Low- and high-pass filters for analysis and synthesis, of the same even length.

    They are `dec_lo`, `dec_hi`, `rec_lo` and `rec_hi` of PyWavelets.
    """

    low: NDArray[np.float64]
    high: NDArray[np.float64]
    low_back: NDArray[np.float64]
    high_back: NDArray[np.float64]


def wavelet_names() -> list[str]:
    """Return the names that `wavelet_filters` knows; `wavelist` of PyWavelets."""
    biorthogonal = [*_SPLINES, *_SYMMETRIC]
    return [
        "haar",
        *(f"db{n}" for n in range(1, 39)),
        *(f"sym{n}" for n in range(2, len(_SYMLETS) + 2)),
        *(f"coif{n}" for n in range(1, len(_COIFLETS) + 1)),
        *(f"bior{orders}" for orders in biorthogonal),
        *(f"rbio{orders}" for orders in biorthogonal),
        "dmey",
    ]


@lru_cache
def wavelet_filters(name: str) -> Filters:
    """Return the filters of a wavelet; `Wavelet` of PyWavelets.

    The names are "haar", "db1" to "db38", "sym2" to "sym20", "coif1" to "coif17", "bior1.1" to "bior6.8", "rbio1.1" to
    "rbio6.8" and "dmey".

    Raises
    ------
    ValueError
        If the name is unknown.

    Notes
    -----
    The arrays are not writeable, since they are kept for the next call. Filters of "haar", "db", "sym", "coif", "bior"
    and "rbio" solve their equations to the rounding of each tap. Order and signs are those of PyWavelets 1.8, whose
    coefficients differ by up to 2e-11 for "sym" and 7e-13 for "bior" and "rbio". Meyer's filter has infinitely many
    taps: "dmey" reconstructs signals to 1e-4 of their largest number. That of PyWavelets differs from it by 8e-4, and
    reconstructs to 2e-2.
    """
    if name not in wavelet_names():
        raise ValueError(
            f"wavelet: {name!r}; expected 'haar', 'db1' to 'db38', 'sym2' to 'sym20', 'coif1' to 'coif17', 'dmey', or "
            f"'bior' or 'rbio' with one of {', '.join([*_SPLINES, *_SYMMETRIC])}"
        )
    if name == "dmey":
        return orthogonal_filters(np.append(0, _meyer()))
    if name[:4] in ("bior", "rbio"):
        low, back = _biorthogonal(name[4:])
        signs = (-1.0) ** np.arange(len(low))
        if name[:4] == "bior":
            return _kept(Filters(low, -signs * back, back, signs * low))
        return _kept(Filters(back[::-1], (signs * low)[::-1], low[::-1], (-signs * back)[::-1]))
    order = 1 if name == "haar" else int(name.lstrip("dbsymcoif"))
    if name[:4] == "coif":
        taps = _normalized(_coiflet(order))
    else:
        choice = _SYMLETS[order - 2] if name[:3] == "sym" else order * "0"
        taps = _normalized(_daubechies(order, choice))
    return orthogonal_filters(taps[::-1])


def orthogonal_filters(low: NDArray[np.float64]) -> Filters:
    """Return the four filters determined by an orthogonal low-pass analysis filter."""
    back = low[::-1]
    high_back = (-1.0) ** np.arange(len(low)) * low
    return _kept(Filters(low, high_back[::-1], back, high_back))


def _kept(filters: Filters) -> Filters:
    """Return contiguous filters that cannot be changed."""
    taps = [np.ascontiguousarray(each) for each in (filters.low, filters.high, filters.low_back, filters.high_back)]
    for each in taps:
        each.flags.writeable = False
    return Filters(*taps)


def _daubechies(order: int, choice: str) -> Polynomial:
    """Return the polynomial with `order` zeros at -1 and, of each pair z and 1/z, the zero that is chosen."""
    taps = _power([1, 1], order)
    taps = [tap << _BITS for tap in taps]
    for y, outside in zip(_zeros(order), choice, strict=False):
        p, q = 2 * _ONE - 4 * y[0], -4 * y[1]
        root = np.sqrt(complex(p / _ONE, q / _ONE) ** 2 / 4 - 1)
        first = min((complex(p / _ONE, q / _ONE) / 2 + sign * root for sign in (1, -1)), key=abs)
        # z + 1/z = 2 - 4 y.
        x, v = _newton([(_ONE, 0), (-p, -q), (_ONE, 0)], _fixed(first.real), _fixed(first.imag) if q else 0)
        size = _times((x, v), (x, -v))[0]
        factor = ([-x, _ONE] if outside == "1" else [_ONE, -x]) if q == 0 else [_ONE, -2 * x, size]
        taps = _shifted(_product(taps, factor[::-1] if q and outside == "1" else factor))
    return taps


def _zeros(order: int) -> list[Complex]:
    """Return the zeros y of P, of nonnegative imaginary part, ordered by the real part.

    ``1 - (1 - y)**N P(y)`` is N comb(2 N - 1, N) times the integral of ``t**(N - 1) (1 - t)**(N - 1)`` up to y. For
    large N, it is about ``(1 - s**2)**N / (2 sqrt(pi N) s)`` with s = 1 - 2 y, and 1 at the zeros.
    """
    places = np.arange(order // 2, 0, -1)
    s = np.full(len(places), 2, complex)
    for _ in range(_STEPS):
        s = np.sqrt(1 - np.exp(2j * np.pi * places / order) * (2 * np.sqrt(np.pi * order) * s) ** (1 / order))
    coefficients = [(comb(order - 1 + k, k) << _BITS, 0) for k in range(order)][::-1]
    # The zero in the middle is real.
    parts = zip((1 - s).real / 2, np.where(2 * places == order, 0, -s.imag / 2), strict=True)
    return [_newton(coefficients, *map(_fixed, map(float, each))) for each in parts]


def _biorthogonal(orders: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the low-pass filters of analysis and of synthesis, with zeros up to the same even length."""
    if orders in _SYMMETRIC:
        back_zeros, zeros, chosen = _SYMMETRIC[orders]
        roots = _zeros(sum(map(int, orders.split("."))) // 2)
        parts = [_in_z(roots[:chosen] + roots[chosen + 1 :], zeros), _in_z(roots[chosen : chosen + 1], back_zeros)]
    else:
        back_zeros, zeros = map(int, orders.split("."))
        order = (back_zeros + zeros) // 2
        sums = _sum_of_powers([comb(order - 1 + k, k) * _ONE for k in range(order)])
        parts = [_product(sums, _power([1, 1], zeros)), _power([1, 1], back_zeros)]
    low, back = map(_normalized, parts)
    length = max(len(low), len(back)) + len(low) % 2
    # Odd lengths: the middles are adjacent, that of the analysis after that of the synthesis.
    before = (length - len(low) + 1) // 2, (length - len(back)) // 2
    low, back = (
        np.concatenate([np.zeros(n), taps, np.zeros(length - n - len(taps))])
        for n, taps in zip(before, (low, back), strict=True)
    )
    return low, back


def _in_z(roots: Iterable[Complex], zeros: int) -> Polynomial:
    """Return the polynomial in z with these zeros y = (2 - z - 1/z) / 4 and `zeros` zeros at -1."""
    taps = [tap << _BITS for tap in _power([1, 1], zeros)]
    for re, im in roots:
        factors = [-re, _ONE] if im == 0 else [_times((re, im), (re, -im))[0], -2 * re, _ONE]
        taps = _shifted(_product(taps, _sum_of_powers(factors)))
    return taps


def _sum_of_powers(coefficients: Sequence[Fixed]) -> Polynomial:
    """Return ``sum_k c_k y**k`` as a polynomial in z, times a power of z."""
    degree = len(coefficients) - 1
    total = [0] * (2 * degree + 1)
    for k, coefficient in enumerate(coefficients):
        for place, value in enumerate(_power([-1, 2, -1], k)):
            total[degree - k + place] += coefficient * value >> 2 * k
    return total


def _coiflet(order: int) -> Polynomial:
    """Return ``c**K (sum_(k < K) comb(K - 1 + k, k) s**k + s**K f(z))`` with squared sines s and cosines c of w/2.

    The 2 K coefficients f make the filter orthogonal to its even shifts. The last 2 K of these equations imply the
    others, since the defect has 2 K zeros at 1 and at -1.
    """
    length, unknowns = 6 * order, 2 * order
    low = [comb(order - 1 + k, k) * _ONE >> 2 * order for k in range(order)]
    middle = _product(_sum_of_powers(low), _power([1, 2, 1], order))
    base = [0, *middle, *[0] * (length - 1 - len(middle))]
    bump = _product(_power([1, 2, 1], order), _power([-1, 2, -1], order))
    f = [_fixed(float(each)) for each in _COIFLETS[order - 1].split()]
    shifts = range(2 * order, length, 2)
    for _ in range(_STEPS):
        taps = [tap + (more >> 4 * order) for tap, more in zip(base, _product(f, bump), strict=True)]
        defects = [sum(map(int.__mul__, taps, taps[shift:])) >> _BITS for shift in shifts]
        padded = [0] * length + taps + [0] * (2 * length)
        slopes = [
            sum(map(int.__mul__, bump, padded[k : k + len(bump)])) >> 4 * order for k in range(2 * length + unknowns)
        ]
        rows = [
            [slopes[length + k + shift] + slopes[length + k - shift] for k in range(unknowns)] + [-defect]
            for shift, defect in zip(shifts, defects, strict=True)
        ]
        step = _solution(rows)
        f = [each + more for each, more in zip(f, step, strict=True)]
        if max(map(abs, step)) < _CONVERGED:
            return taps
    raise AssertionError("unreachable: every approximation converges")


def _solution(rows: list[list[Fixed]]) -> list[Fixed]:
    """Return the solution of linear equations, each with its right side last, by elimination."""
    count = len(rows)
    for c in range(count):
        best = max(range(c, count), key=lambda i: abs(rows[i][c]))
        rows[c], rows[best] = rows[best], rows[c]
        for i in range(c + 1, count):
            ratio = (rows[i][c] << _BITS) // rows[c][c]
            rows[i] = [x - (ratio * y >> _BITS) for x, y in zip(rows[i], rows[c], strict=True)]
    found = [0] * count
    for c in range(count - 1, -1, -1):
        rest = sum(map(int.__mul__, rows[c][c + 1 : count], found[c + 1 :]))
        found[c] = (rows[c][count] * _ONE - rest) // rows[c][c]
    return found


def _meyer() -> NDArray[np.float64]:
    """Return the 61 middle Fourier coefficients of Meyer's filter, which decay as the fifth power."""
    # The trapezoidal rule is exact up to coefficients beyond 2**14, below 1e-20.
    w = 3 * np.abs(np.fft.fftfreq(2**14, 0.5)) - 1
    x = np.clip(w, 0, 1)
    response = np.sqrt(2) * np.cos(np.pi / 2 * x**4 * (35 - 84 * x + 70 * x**2 - 20 * x**3))
    taps = np.fft.ifft(response).real[:_MEYER]
    both = np.concatenate([taps[:0:-1], taps])
    return np.asarray(both * (np.sqrt(2) / both.sum()))


def _newton(coefficients: list[Complex], *first: Fixed) -> Complex:
    """Return a zero of a polynomial, whose highest coefficient is first, near an approximation."""
    x = first[0], first[1]
    for _ in range(_STEPS):
        value, slope = (0, 0), (0, 0)
        for coefficient in coefficients:
            slope = _plus(_times(slope, x), value)
            value = _plus(_times(value, x), coefficient)
        p, q = _times(value, (slope[0], -slope[1]))
        size = _times(slope, (slope[0], -slope[1]))[0]
        step = (p << _BITS) // size, (q << _BITS) // size
        x = x[0] - step[0], x[1] - step[1]
        if max(map(abs, step)) < _CONVERGED:
            return x
    raise AssertionError("unreachable: every approximation converges")


def _normalized(taps: Polynomial) -> NDArray[np.float64]:
    """Return taps whose sum is the square root of 2."""
    root, total = isqrt(2 << 2 * _BITS), sum(taps)
    return np.array([tap * root / (total << _BITS) for tap in taps])


def _product(a: Sequence[int], b: Sequence[int]) -> Polynomial:
    result = [0] * (len(a) + len(b) - 1)
    for i, x in enumerate(a):
        for j, y in enumerate(b):
            result[i + j] += x * y
    return result


def _power(a: Sequence[int], count: int) -> Polynomial:
    result = [1]
    for _ in range(count):
        result = _product(result, a)
    return result


def _shifted(a: Polynomial) -> Polynomial:
    """Return a product of two polynomials in units of `_ONE`."""
    return [x >> _BITS for x in a]


def _fixed(number: float) -> Fixed:
    top, bottom = number.as_integer_ratio()
    return (top << _BITS) // bottom


def _plus(a: Complex, b: Complex) -> Complex:
    return a[0] + b[0], a[1] + b[1]


def _times(a: Complex, b: Complex) -> Complex:
    return a[0] * b[0] - a[1] * b[1] >> _BITS, a[0] * b[1] + a[1] * b[0] >> _BITS
