"""Multivectors with numbers as coefficients, and names of blades, in LaTeX."""

from __future__ import annotations

import re
from collections.abc import Mapping
from fractions import Fraction
from typing import Any, Protocol


class Names(Protocol):
    """The part of the interface of `gacompiler.algebra.algebra.Algebra` that is used here."""

    def spelling(self, blade: int) -> tuple[int, str]:
        """Return the sign and the printed name of a blade."""


class Element(Protocol):
    """The part of the interface of `gacompiler.algebra.multivector.Multivector`, which uses this module."""

    @property
    def algebra(self) -> Names:
        """Its algebra."""

    @property
    def terms(self) -> Mapping[int, Any]:
        """Its coefficients by blade."""


def constant(value: Element) -> str:
    """Return a multivector with numeric coefficients in LaTeX."""
    if not value.terms:
        return "0"
    parts = []
    for blade in sorted(value.terms, key=lambda blade: (blade.bit_count(), blade)):
        number = value.terms[blade]
        sign, name = value.algebra.spelling(blade)
        signed = number if sign > 0 else -number
        text = (
            number_latex(signed)
            if blade == 0
            else ("" if signed == 1 else "-" if signed == -1 else _factor(signed)) + blade_latex(name)
        )
        parts.append(text)
    return " + ".join(parts).replace("+ -", "- ")


def blade_latex(name: str) -> str:
    """Return the name of a blade in LaTeX: ``e12`` as ``e_{12}``, ``e_r_theta`` as ``e_{r} \\wedge e_{\\theta}``."""
    if name == "1":
        return "1"
    vectors = []
    for part in name.split("^"):
        letter, *labels = (part[0], *part[2:].split("_")) if part[1:2] == "_" else (part[0], part[1:])
        vectors += [f"{letter}_{{{_label(label)}}}" if label else letter for label in labels]
    return r" \wedge ".join(vectors)


_GREEK = (
    "alpha beta gamma delta epsilon zeta eta theta iota kappa lambda mu nu xi pi rho sigma tau upsilon phi chi psi"
    " omega Gamma Delta Theta Lambda Xi Pi Sigma Upsilon Phi Psi Omega"
)


def _label(label: str) -> str:
    return rf"\{label}" if label in _GREEK.split() else label.replace("inf", r"\infty ")


def number_latex(number: Any) -> str:
    """Return a coefficient in LaTeX: fractions as such, and floats with powers of ten."""
    if isinstance(number, Fraction) and number.denominator != 1:
        sign = "-" if number < 0 else ""
        return rf"{sign}\frac{{{abs(number.numerator)}}}{{{number.denominator}}}"
    own = getattr(number, "_repr_latex_", None)
    if own is not None:
        return str(own()).strip("$").removeprefix(r"\displaystyle ")
    return re.sub(r"e([+-]?\d+)$", lambda m: rf" \cdot 10^{{{int(m[1])}}}", str(number))


def _factor(number: Any) -> str:
    """Return a coefficient as the factor of a blade."""
    text = number_latex(number)
    is_sum = " + " in text or " - " in text[1:]
    return rf"\left({text}\right)" if is_sum else text + r"\," if isinstance(number, float) else text
