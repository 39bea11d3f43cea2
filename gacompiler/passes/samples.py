"""Random inputs of a kernel that satisfy what its layouts say, and what its author's definition gives there."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from itertools import cycle
from random import Random
from typing import Any

import mpmath

from ..algebra.multivector import Multivector
from ..errors import InexactError
from ..frontend.expression import Expression, evaluate
from ..frontend.kernel import Kernel
from ..rings.points import DIGITS, point

SPREADS = (Fraction(1), Fraction(1, 256), Fraction(1), Fraction(1, 2**30))
"""Sizes of free coefficients, and distances of versors from 1: ordinary points, and points close to where formulas
change. Definitions with a bounded domain (a velocity below 1) are met by the small ones."""


def sample(
    kernel: Kernel, random: Random, *, spread: Fraction = Fraction(1), near_one: bool = False, whole: bool = False
) -> dict[str, Any]:
    """A random value of every input component that satisfies the relations of the layouts."""
    values: dict[str, Any] = {}
    taken: set[int] = set()  # equal versors would hide what depends on how they differ
    for parameter in kernel.parameters:
        step = parameter.layout.size
        for start in range(0, len(parameter.components), step):
            names = parameter.components[start : start + step]
            found = point(parameter.layout, random, spread=spread, near_one=near_one, whole=whole, taken=taken)
            values.update(zip(names, found, strict=True))
    return values


def samples(
    kernel: Kernel, expressions: Sequence[Expression], random: Random, n: int, whole: bool = False
) -> Iterator[tuple[dict[str, Any], list[Multivector]]]:
    """Up to `n` points where the definition has a value, with that value; `SPREADS` in turn, or whole numbers."""
    found = 0
    for spread, _ in zip(cycle(SPREADS), range(8 * n), strict=False):
        inputs = sample(kernel, random, spread=spread, whole=whole)
        try:
            values = meaning(expressions, inputs)
        except (ZeroDivisionError, ValueError, mpmath.libmp.ComplexResult):
            continue
        if all(_is_real(value) for multivector in values for value in multivector.terms.values()):
            yield inputs, values
            found += 1
            if found == n:
                return


def _is_real(value: Any) -> bool:
    return not isinstance(value, mpmath.mpc) and (not isinstance(value, mpmath.mpf) or bool(mpmath.isfinite(value)))


def meaning(expressions: Sequence[Expression], inputs: Mapping[str, Any]) -> list[Multivector]:
    """The author's definition at a point: exact where the functions in it allow, else to `DIGITS` digits."""
    if all(isinstance(value, (int, Fraction)) for value in inputs.values()):
        try:
            return evaluate(expressions, inputs)
        except InexactError:
            pass
    with mpmath.workdps(DIGITS):
        return evaluate(expressions, {name: to_mpmath(value) for name, value in inputs.items()}, lift=to_mpmath)


def to_mpmath(value: Any) -> Any:
    """A number of any kind as an mpmath number at the current precision."""
    return mpmath.mpf(value.numerator) / value.denominator if isinstance(value, (int, Fraction)) else mpmath.mpf(value)
