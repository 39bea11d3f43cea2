"""Random inputs of a kernel that satisfy the relations of its layouts, and the values of its definition there."""

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
"""Sizes of free coefficients and distances of versors from 1, for ordinary points and for points close to branches.
Small values also satisfy definitions with a bounded domain (such as a velocity below 1)."""


def sample(
    kernel: Kernel, random: Random, *, spread: Fraction = Fraction(1), near_one: bool = False, whole: bool = False
) -> dict[str, Any]:
    """Return random values of all input components that satisfy the relations of the layouts."""
    values: dict[str, Any] = {}
    taken: set[int] = set()  # Versors are distinct, so that dependence on their difference is visible.
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
    """Yield up to `n` points at which the definition is defined, with its values.

    The spreads are those of `SPREADS` in turn. If `whole` is true, coefficients are integers.
    """
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
    """Evaluate the author's definition at a point, exactly if possible, else to `DIGITS` digits."""
    if all(isinstance(value, (int, Fraction)) for value in inputs.values()):
        try:
            return evaluate(expressions, inputs)
        except InexactError:
            pass
    with mpmath.workdps(DIGITS):
        return evaluate(expressions, {name: to_mpmath(value) for name, value in inputs.items()}, lift=to_mpmath)


def to_mpmath(value: Any) -> Any:
    """Convert a number to an mpmath number at the current precision."""
    return mpmath.mpf(value.numerator) / value.denominator if isinstance(value, (int, Fraction)) else mpmath.mpf(value)
