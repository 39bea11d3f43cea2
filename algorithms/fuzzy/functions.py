"""The conclusions of Sugeno inference: constants and affine functions of the inputs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from ..arguments import finite_number
from .sets import instances


@dataclass(frozen=True)
class AffineFunction:
    """A constant, or an affine function of inputs.

    Parameters
    ----------
    name : str
    constant : float
        The value where the inputs are 0.
    slopes : tuple of (str, float), optional
        Names of inputs, and the derivatives with respect to them. Other inputs do not matter.

    Raises
    ------
    TypeError
        If a number is not one, or a slope is not a pair.
    ValueError
        If a number is not finite, or an input has two slopes.
    """

    name: str
    constant: float
    slopes: tuple[tuple[str, float], ...] = ()

    def __post_init__(self) -> None:
        where = f"function {self.name}"
        object.__setattr__(self, "constant", finite_number(self.constant, f"{where}: constant"))
        if isinstance(self.slopes, str) or not isinstance(self.slopes, Iterable):
            raise TypeError(f"{where}: slopes {self.slopes!r}; expected pairs of an input and a number")
        slopes: list[tuple[str, float]] = []
        for pair in self.slopes:
            if not isinstance(pair, (tuple, list)) or len(pair) != 2 or not isinstance(pair[0], str):
                raise TypeError(f"{where}: slope {pair!r}; expected an input and a number")
            if pair[0] in dict(slopes):
                raise ValueError(f"{where}: two slopes of {pair[0]}; expected one")
            slopes.append((pair[0], finite_number(pair[1], f"{where}: slope of {pair[0]}")))
        object.__setattr__(self, "slopes", tuple(slopes))


@dataclass(frozen=True)
class FunctionOutput:
    """An output of Sugeno inference: the functions that rules may conclude.

    Parameters
    ----------
    name : str
    functions : tuple of AffineFunction
        With different names.

    Raises
    ------
    TypeError
        If a function has another type.
    ValueError
        If there is none, or two have the same name.
    """

    name: str
    functions: tuple[AffineFunction, ...]

    def __post_init__(self) -> None:
        where = f"output {self.name}"
        object.__setattr__(self, "functions", instances(self.functions, AffineFunction, f"{where}: functions"))
        if not self.functions:
            raise ValueError(f"{where}: no functions; expected at least one")
        names = [one.name for one in self.functions]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"{where}: two functions {name}; expected different names")

    def index(self, name: str) -> int:
        """Return the position of a function.

        Raises
        ------
        ValueError
            If there is no function of this name.
        """
        names = [one.name for one in self.functions]
        if name not in names:
            raise ValueError(f"{self.name} has no function {name!r}; expected {', '.join(names)}")
        return names.index(name)

    def is_empty(self, name: str) -> bool:
        """Return False: unlike a set, a function always has a value; errors are those of `index`."""
        return self.index(name) < 0
