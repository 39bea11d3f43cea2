"""Fuzzy sets, and variables with sets over a range."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import Reals, finite_number, real_array
from ..precision import ROUNDING

DEFUZZIFIERS = ("centroid", "bisector", "mom", "som", "lom")
"""Centroid and bisector of the area; mean, smallest and largest of the places with the maximum."""

_Part = TypeVar("_Part")


def instances(found: Iterable[_Part], kind: type[_Part], name: str) -> tuple[_Part, ...]:
    """Return a tuple of objects of one type.

    Raises
    ------
    TypeError
        If `found` cannot be iterated over, or contains an object of another type.
    """
    if isinstance(found, str) or not isinstance(found, Iterable):
        raise TypeError(f"{name}: {found!r}; expected a tuple of {kind.__name__}")
    parts = tuple(found)
    for part in parts:
        if not isinstance(part, kind):
            raise TypeError(f"{name}: {part!r}; expected {kind.__name__}")
    return parts


def _linear(x: Reals, places: tuple[float, ...], heights: tuple[float, ...]) -> Reals:
    """Return a function that is linear between places, which may coincide, and 0 outside."""
    found = np.zeros_like(x)
    for a, b, low, high in zip(places, places[1:], heights, heights[1:], strict=False):
        inside = (a < x) & (x < b)
        if low == high:
            found[inside] = low
        elif low < high:
            found[inside] = (x[inside] - a) / (b - a)
        else:
            found[inside] = (b - x[inside]) / (b - a)
    for place, height in zip(places, heights, strict=True):
        found[x == place] = np.maximum(found[x == place], height)
    return found


def _triangle(x: Reals, a: float, b: float, c: float) -> Reals:
    return _linear(x, (a, b, c), (0, 1, 0))


def _trapezoid(x: Reals, a: float, b: float, c: float, d: float) -> Reals:
    return _linear(x, (a, b, c, d), (0, 1, 1, 0))


def _gauss(x: Reals, mean: float, sigma: float) -> Reals:
    with np.errstate(over="ignore"):
        return np.asarray(np.exp(-(((x - mean) / sigma) ** 2) / 2))


def _bell(x: Reals, width: float, slope: float, centre: float) -> Reals:
    with np.errstate(over="ignore", divide="ignore"):
        return np.asarray(1 / (1 + np.abs((x - centre) / width) ** (2 * slope)))


def _sigmoid(x: Reals, centre: float, slope: float) -> Reals:
    with np.errstate(over="ignore"):
        return np.asarray(1 / (1 + np.exp(-slope * (x - centre))))


MEMBERSHIPS: dict[str, tuple[Callable[..., Reals], tuple[str, ...]]] = {
    "triangle": (_triangle, ("left", "peak", "right")),
    "trapezoid": (_trapezoid, ("left", "from", "to", "right")),
    "gauss": (_gauss, ("mean", "sigma")),
    "bell": (_bell, ("width", "slope", "centre")),
    "sigmoid": (_sigmoid, ("centre", "slope")),
}
"""The kinds of sets: their membership, and the names of their parameters."""


@dataclass(frozen=True)
class FuzzySet:
    """A fuzzy set of real numbers.

    Parameters
    ----------
    name : str
    kind : str
        ``"triangle"`` with the parameters left, peak, right; ``"trapezoid"`` with left, from, to, right; ``"gauss"``
        with mean, sigma; ``"bell"`` with width, slope, centre; ``"sigmoid"`` with centre, slope. These are the
        functions `trimf`, `trapmf`, `gaussmf`, `gbellmf` and `sigmf` of scikit-fuzzy, with parameters in the same
        order.
    parameters : tuple of float

    Raises
    ------
    TypeError
        If a parameter is not a number.
    ValueError
        If the kind is unknown, or parameters are missing, out of order, not positive or not finite.
    """

    name: str
    kind: str
    parameters: tuple[float, ...]

    def __post_init__(self) -> None:
        where = f"set {self.name}"
        if not isinstance(self.kind, str) or self.kind not in MEMBERSHIPS:
            raise ValueError(f"{where}: kind {self.kind!r}; expected {', '.join(MEMBERSHIPS)}")
        names = MEMBERSHIPS[self.kind][1]
        if not isinstance(self.parameters, Iterable):
            raise TypeError(f"{where}: parameters {self.parameters!r}; expected {self.kind} {' '.join(names)}")
        object.__setattr__(self, "parameters", tuple(self.parameters))
        if len(self.parameters) != len(names):
            raise ValueError(f"{where}: {len(self.parameters)} parameters; expected {self.kind} {' '.join(names)}")
        numbers = tuple(finite_number(x, f"{where}: {n}") for x, n in zip(self.parameters, names, strict=True))
        if self.kind in ("triangle", "trapezoid") and list(numbers) != sorted(numbers):
            raise ValueError(f"{where}: parameters {numbers}; expected numbers in ascending order")
        positive = {"gauss": (1,), "bell": (0, 1)}.get(self.kind, ())
        for k in positive:
            if numbers[k] <= 0:
                raise ValueError(f"{where}: {names[k]} {numbers[k]}; expected a positive number")
        object.__setattr__(self, "parameters", numbers)

    def membership(self, x: ArrayLike) -> Reals:
        """Evaluate the membership.

        Parameters
        ----------
        x : array_like, (...)

        Returns
        -------
        array, (...)
            From 0 to 1.
        """
        return MEMBERSHIPS[self.kind][0](real_array(x, "x"), *self.parameters)


@dataclass(frozen=True)
class FuzzyVariable:
    """An input or output: a range with equidistant places, or with given ones, and sets.

    Memberships are evaluated at the places and are linear between them. `at` takes the places themselves.

    Parameters
    ----------
    name : str
    low, high : float
        The range.
    samples : int
        Number of places, at least 2.
    sets : tuple of FuzzySet
        With different names. A set that is narrower than an interval of the grid may have the membership 0 at all
        places, and is empty then.
    grid : tuple of float, optional
        The places, if they are not equidistant: `samples` numbers from `low` to `high`.

    Raises
    ------
    TypeError, ValueError
        If the range or the grid is not ascending, they disagree, there are fewer than 2 places, places are closer
        together than 1e-12 times the largest number of the range, there are no sets, or two sets have the same name.
    """

    name: str
    low: float
    high: float
    samples: int
    sets: tuple[FuzzySet, ...]
    grid: tuple[float, ...] = ()

    @classmethod
    def at(cls, name: str, places: ArrayLike, sets: tuple[FuzzySet, ...]) -> FuzzyVariable:
        """Return a variable with given places.

        Parameters
        ----------
        name : str
        places : array_like, (n,)
            At least 2 finite numbers in ascending order.
        sets : tuple of FuzzySet

        Returns
        -------
        FuzzyVariable

        Raises
        ------
        TypeError, ValueError
            As for the class.
        """
        where = f"variable {name}: places"
        grid = tuple(real_array(places, where, (-1,)).astype(float).tolist())
        if np.ndim(places) != 1 or len(grid) < 2:
            raise ValueError(f"{where}: shape {np.shape(places)}; expected at least 2 numbers")
        return cls(name, grid[0], grid[-1], len(grid), sets, grid)

    def __post_init__(self) -> None:
        where = f"variable {self.name}"
        self._check_grid(where)
        low, high = finite_number(self.low, f"{where}: low"), finite_number(self.high, f"{where}: high")
        if not low < high:
            raise ValueError(f"{where}: range from {low} to {high}; expected an ascending range")
        if isinstance(self.samples, bool) or not isinstance(self.samples, (int, np.integer)) or self.samples < 2:
            raise ValueError(f"{where}: {self.samples!r} samples; expected an integer of at least 2")
        object.__setattr__(self, "samples", int(self.samples))
        # Interpolation loses all digits long before neighbouring places are equal.
        steps = [b - a for a, b in pairwise(self.grid)]
        step, largest = min(steps, default=(high - low) / (self.samples - 1)), max(abs(low), abs(high))
        if not ROUNDING * largest < step < np.inf:
            raise ValueError(
                f"{where}: places {step} apart from {low} to {high}; expected distances of more than {ROUNDING} times "
                "the largest number of the range"
            )
        object.__setattr__(self, "sets", instances(self.sets, FuzzySet, f"{where}: sets"))
        if not self.sets:
            raise ValueError(f"{where}: no sets; expected at least one")
        names = [one.name for one in self.sets]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"{where}: two sets {name}; expected different names")

    def _check_grid(self, where: str) -> None:
        if isinstance(self.grid, str) or not isinstance(self.grid, Iterable):
            raise TypeError(f"{where}: grid {self.grid!r}; expected a tuple of numbers")
        grid = tuple(finite_number(x, f"{where}: grid") for x in self.grid)
        object.__setattr__(self, "grid", grid)
        if not grid:
            return
        for a, b in pairwise(grid):
            if not a < b:
                raise ValueError(f"{where}: {b} after {a} in the grid; expected numbers in ascending order")
        own = grid[0], grid[-1], len(grid)
        if own != (self.low, self.high, self.samples):
            raise ValueError(
                f"{where}: {own[2]} numbers from {own[0]} to {own[1]} in the grid; expected {self.samples} from "
                f"{self.low} to {self.high}"
            )

    @cached_property
    def places(self) -> Reals:
        """The places (n,)."""
        if self.grid:
            return np.array(self.grid)
        return np.linspace(self.low, self.high, self.samples)

    @cached_property
    def memberships(self) -> Reals:
        """The memberships (n, sets) of the places."""
        return np.stack([_unimodal(one.membership(self.places)) for one in self.sets], 1)

    def heights(self, name: str) -> Reals:
        """Return the memberships (n,) of the places in one set; errors are those of `index`."""
        return np.asarray(self.memberships[:, self.index(name)])

    def is_empty(self, name: str) -> bool:
        """Return whether the membership of all places in a set is 0; errors are those of `index`."""
        return not bool((self.heights(name) > 0).any())

    def index(self, name: str) -> int:
        """Return the position of a set.

        Raises
        ------
        ValueError
            If there is no set of this name.
        """
        for k, one in enumerate(self.sets):
            if one.name == name:
                return k
        raise ValueError(f"{self.name} has no set {name!r}; expected {', '.join(one.name for one in self.sets)}")


def _unimodal(heights: Reals) -> Reals:
    """Remove rounding errors by which memberships do not rise and then fall."""
    peak = int(np.argmax(heights))
    rising = np.maximum.accumulate(heights[: peak + 1])
    falling = np.maximum.accumulate(heights[peak:][::-1])[::-1]
    return np.concatenate([rising, falling[1:]])
