"""Distortion of lenses: the models of Brown, with rational terms, and of fisheye lenses."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generated import lenses, matrices

from ..arguments import Reals, finite_number, real_array
from ..precision import NEGLIGIBLE

Model = Literal["brown", "fisheye"]
NAMES: dict[Model, tuple[str, ...]] = {
    "brown": ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"),
    "fisheye": ("k1", "k2", "k3", "k4"),
}
"""Coefficients of the models, in OpenCV's order."""


@dataclass(frozen=True, slots=True)
class Distortion:
    """The distortion of a lens, which maps normalised coordinates of a pinhole camera to those that the lens shows.

    The model "brown" is that of Brown (1971), with the rational terms of OpenCV: with ``s = x**2 + y**2``, coordinates
    are multiplied by ``(1 + k1 s + k2 s**2 + k3 s**3) / (1 + k4 s + k5 s**2 + k6 s**3)``, and ``2 p1 x y + p2 (s + 2
    x**2)`` and ``p1 (s + 2 y**2) + 2 p2 x y`` are added. The model "fisheye" is that of Kannala and Brandt (2006): the
    distance from the centre is ``a (1 + k1 a**2 + k2 a**4 + k3 a**6 + k4 a**8)`` for a direction at the angle a from
    the axis, which may exceed a right angle.

    Attributes
    ----------
    model : {"brown", "fisheye"}
    coefficients : tuple of float
        ``k1 k2 p1 p2 k3 k4 k5 k6``, or ``k1 k2 k3 k4`` of a fisheye lens. Those left out at the end are added as 0.
    limit : float
        The end of the range in which the model is monotonic: a distance ``hypot(x, y)`` of normalised coordinates,
        which may be infinite, or an angle of a fisheye lens in radians, at most pi. Farther points have no image:
        the formula would give the pixel of another point, too.

    Raises
    ------
    TypeError, ValueError
        If the model is unknown, or if there are too many coefficients or one is not finite.
    """

    model: Model
    coefficients: tuple[float, ...] = ()
    limit: float = field(init=False, compare=False, repr=False)

    def __post_init__(self) -> None:
        if self.model not in get_args(Model):
            raise ValueError(f"model: {self.model!r}; expected 'brown' or 'fisheye'")
        most = len(NAMES[self.model])
        if len(self.coefficients) > most:
            raise ValueError(f"coefficients: {len(self.coefficients)} numbers; expected at most {most}")
        numbers = tuple(finite_number(c, f"coefficients[{k}]") for k, c in enumerate(self.coefficients))
        object.__setattr__(self, "coefficients", numbers + (0.0,) * (most - len(numbers)))
        object.__setattr__(self, "limit", _limit(self.model, self.array))

    @property
    def array(self) -> NDArray[np.float64]:
        """The coefficients as an array, (8,) or (4,)."""
        return np.array(self.coefficients)

    def distort(self, directions: ArrayLike) -> Reals:
        """Return where the lens shows directions.

        Parameters
        ----------
        directions : array_like, (..., 3)
            In the camera frame, of any length.

        Returns
        -------
        array, (..., 2)
            Coordinates after distortion; NaN for directions beyond `limit`, and for those that are not in front of a
            lens of the model "brown".

        Raises
        ------
        TypeError, ValueError
            If `directions` is not an array of directions.
        """
        array = real_array(directions, "directions", (3,), "directions")
        exact = np.asarray(array, np.float64)
        with np.errstate(all="ignore"):
            if self.model == "brown":
                places = np.where(exact[..., 2:] > 0, exact[..., :2] / exact[..., 2:], np.nan)
                found, is_valid = lenses.distort_brown(places, self.array, self.limit)
            else:
                found, is_valid = lenses.distort_fisheye(exact, self.array, self.limit)
        return np.where(np.asarray(is_valid)[..., None] > 0, found, np.nan).astype(array.dtype)

    def undistort(self, places: ArrayLike) -> Reals:
        """Return the directions that the lens shows at places.

        Parameters
        ----------
        places : array_like, (..., 2)
            Coordinates after distortion: pixels without intrinsic parameters.

        Returns
        -------
        array, (..., 3)
            Directions ``(x, y, 1)`` of the model "brown", and unit vectors of fisheye lenses; NaN where the lens shows
            none up to `limit`.

        Raises
        ------
        TypeError, ValueError
            If `places` is not an array of coordinates.

        Notes
        -----
        Newton's method, to 1e-12 of the distance from the centre.
        """
        array = real_array(places, "places", (2,), "x y")
        exact = np.asarray(array, np.float64)
        if self.model == "brown":
            plain, is_found = lenses.undistort_brown(exact, self.array, self.limit)
            found = np.concatenate([plain, np.ones((*plain.shape[:-1], 1))], -1)
        else:
            found, is_found = lenses.undistort_fisheye(exact, self.array, self.limit)
        return np.where(np.asarray(is_found)[..., None] > 0, found, np.nan).astype(array.dtype)


def _limit(model: Model, k: Reals) -> float:
    """Return the end of the range in which no two directions have the same image.

    The matrix of derivatives of the model "brown" is symmetric. Where it is positive definite, the model is the
    gradient of a convex function, which has every value once. Its eigenvalues without tangential terms are N / D, with
    the polynomials N and D of the square of the distance r, and the derivative of r N / D; tangential terms change them
    by at most ``6 r hypot(p1, p2)``.
    """
    if model == "fisheye":
        return min(float(np.sqrt(_first_root(k * [3, 5, 7, 9]))), np.pi)
    above, below = np.zeros(7), np.zeros(7)
    above[::2], below[::2] = [1, k[0], k[1], k[4]], [1, k[5], k[6], k[7]]
    orders, tangential = np.arange(7), np.array([0, 6 * np.hypot(k[2], k[3])])
    slope = np.convolve((1 + orders) * above, below) - np.convolve(above, orders * below)
    conditions = (
        below,
        np.append(above, 0) - np.convolve(tangential, below),
        np.append(slope, 0) - np.convolve(tangential, np.convolve(below, below)),
    )
    return min(_first_root(condition[1:]) for condition in conditions)


def _first_root(coefficients: Reals) -> float:
    """Return the least positive root of ``1 + c1 s + c2 s^2 + ...``, or infinity."""
    used = np.trim_zeros(coefficients, "b")
    if not len(used):
        return float(np.inf)
    # In terms of 1 / s, the leading coefficient is 1.
    real, imaginary, _, _ = matrices.polynomial_roots(used)
    is_real = (real > 0) & (np.abs(imaginary) <= NEGLIGIBLE * np.abs(real))
    return float(1 / real[is_real].max()) if is_real.any() else float(np.inf)
