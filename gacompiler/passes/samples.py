"""Random inputs of a kernel that satisfy the relations of its layouts, and the values of its definition there."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from fractions import Fraction
from itertools import cycle
from random import Random
from typing import Any

import mpmath

from ..algebra.layout import Layout
from ..algebra.multivector import Multivector
from ..errors import InexactError, TooLargeError
from ..frontend.evaluation import Evaluation, Value, convert
from ..frontend.expression import Expression
from ..frontend.kernel import Kernel
from ..rings.decimals import digits, from_decimal, to_decimal
from ..rings.points import point, wide_point
from ..rings.residues import residue

SPREADS = (Fraction(1), Fraction(1, 256), Fraction(1), Fraction(1, 2**30))
"""Sizes of free coefficients and distances of versors from 1, for ordinary points and for points close to branches.
Small values also satisfy definitions with a bounded domain (such as a velocity below 1)."""

WORKING_DIGITS = 120
"""Number of decimal digits of values that are not rational. Cancellation in a deep definition may lose two thirds."""
FAR = (10**WORKING_DIGITS).bit_length()
"""Values with more bits before the point than `WORKING_DIGITS` has are far from 1."""
LONGEST = 2_000
"""Maximum number of bits of numerators and denominators; residues modulo a prime replace longer numbers."""
SHORT = 400
"""The same for definitions without residues: calculating with longer rationals takes more time than with digits."""


def sample(
    kernel: Kernel, random: Random, *, spread: Fraction = Fraction(1), near_one: bool = False, whole: bool = False
) -> dict[str, Any]:
    """Return random values of all input components that satisfy the relations of the layouts."""
    taken: set[int] = set()  # Versors are distinct, so that dependence on their difference is visible.
    found = _elements(
        kernel, lambda layout: point(layout, random, spread=spread, near_one=near_one, whole=whole, taken=taken)
    )
    assert found is not None
    return found


def wide_sample(kernel: Kernel, random: Random) -> dict[str, Any] | None:
    """Return values of all input components modulo a large prime, or None if a layout has no such points."""
    return _elements(kernel, lambda layout: wide_point(layout, random))


def _elements(kernel: Kernel, make: Callable[[Layout], list[Any] | None]) -> dict[str, Any] | None:
    """Return the coefficients of an element for each element of the inputs, or None if one cannot be made."""
    values: dict[str, Any] = {}
    for parameter in kernel.parameters:
        layout = parameter.layout
        for names in parameter.elements:
            found = make(layout)
            if found is None:
                return None
            values.update(zip(names, found, strict=True))
    return values


def samples(
    kernel: Kernel, expressions: Sequence[Expression], random: Random, n: int, whole: bool = False
) -> Iterator[tuple[dict[str, Any], list[Multivector]]]:
    """Yield up to `n` points at which the definition is defined, with its values.

    The spreads are those of `SPREADS` in turn. If `whole` is true, coefficients are integers. Points at which inexact
    values are far from 1 are only used if there are no others, since cancellation leaves none of their digits.
    """
    found = 0
    far: list[tuple[dict[str, Any], list[Multivector]]] = []
    meaning = Meaning(expressions)
    for spread, _ in zip(cycle(SPREADS), range(8 * n), strict=False):
        inputs = sample(kernel, random, spread=spread, whole=whole)
        try:
            values = meaning.at(inputs)
        except (ZeroDivisionError, ValueError, mpmath.libmp.ComplexResult):
            continue
        coefficients = [value for multivector in values for value in multivector.terms.values()]
        if not all(map(is_real, coefficients)):
            continue
        if any(isinstance(value, mpmath.mpf) and mpmath.mag(value) > FAR for value in coefficients):
            far.append((inputs, values))
            continue
        yield inputs, values
        found += 1
        if found == n:
            return
    if not found:
        yield from far[:n]


def is_real(value: Any) -> bool:
    """Return whether a number is real and finite."""
    return not isinstance(value, mpmath.mpc) and (not isinstance(value, mpmath.mpf) or bool(mpmath.isfinite(value)))


def meaning(expressions: Sequence[Expression], inputs: Mapping[str, Any]) -> list[Multivector]:
    """Evaluate the author's definition at a point; see `Meaning`."""
    return Meaning(expressions).at(inputs)


class Meaning:
    """The author's definition, evaluated exactly if possible, else to a number of digits.

    Exact values are rational numbers, or their residues modulo a prime if the rational numbers are too long.

    Parameters
    ----------
    expressions : sequence of Expression
    n_digits : int
    """

    def __init__(self, expressions: Sequence[Expression], n_digits: int = WORKING_DIGITS) -> None:
        self._evaluation = Evaluation(expressions)
        self._n_digits = n_digits
        self._longest = LONGEST
        self._has_residues = True

    def at(self, inputs: Mapping[str, Any]) -> list[Multivector]:
        """Return the values of the expressions at a point.

        If rational numbers are too long at one point, other kinds of numbers are used at all further points.

        Raises
        ------
        ValueError
            If a value is not real, or a function is not defined at the point.
        """
        known: list[Value] = []
        if all(isinstance(value, (int, Fraction)) for value in inputs.values()):
            try:
                if self._longest:
                    return self._evaluation.run(inputs, values=known, check=self._limit)
                return self.residues(inputs)
            except TooLargeError:
                if self._has_residues:
                    try:
                        values = self.residues(inputs)
                        self._longest = 0
                        return values
                    except InexactError:
                        self._has_residues, self._longest = False, SHORT
            except InexactError:
                pass
        with digits(self._n_digits):
            lifted = {name: to_decimal(value) for name, value in inputs.items()}
            try:
                values = self._evaluation.run(lifted, to_decimal, convert(known, to_decimal))
            except InexactError as error:  # Zeros remain exact, and no number is the logarithm of zero.
                raise ValueError("a function is not defined at zero") from error
            return [each.map(from_decimal) for each in values]

    def residues(self, inputs: Mapping[str, Any]) -> list[Multivector]:
        """Evaluate modulo a prime.

        Raises
        ------
        InexactError
            If there is a function that residues do not have, such as a comparison.
        """
        return self._evaluation.run({name: residue(value) for name, value in inputs.items()}, residue)

    def _limit(self, number: Any) -> None:
        """Raise an error if a rational number is too long."""
        if max(number.numerator.bit_length(), number.denominator.bit_length()) > self._longest:
            raise TooLargeError("exact evaluation", f"a number of more than {self._longest} bits")


def to_mpmath(value: Any) -> Any:
    """Convert a number to an mpmath number at the current precision."""
    return mpmath.mpf(value.numerator) / value.denominator if isinstance(value, (int, Fraction)) else mpmath.mpf(value)
