"""Equivalent forms of a system of polynomials, before common parts are extracted (`gacompiler.passes.factor`)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction

from .common_factors import without_common_factors
from .products import as_products
from .resubstitute import resubstitute
from .shift import shift, shift_each
from .system import System

Steps = tuple[str, ...]
SMALLEST = Fraction(1, 2**1000)
"""Numbers between this one and its reciprocal are in the range of double precision."""


@dataclass(frozen=True, slots=True, eq=False)
class Form:
    """A form of a system.

    Attributes
    ----------
    steps : tuple of str
        The transformations that were applied.
    system : System
    plain : System
        The system before inputs were replaced by their differences.
    """

    steps: Steps
    system: System
    plain: System


def forms_of(steps: Steps, system: System) -> Iterator[Form]:
    """Yield a system, with results divided by others and without, and in terms of differences of inputs."""
    for how, each in (((), system), (("results by results",), resubstitute(system))):
        if each is not None:
            yield Form((*steps, *how), each, each)
            shifted = shift(each)
            if shifted is not None:
                yield Form((*steps, *how, "in differences"), shifted, each)


def further_forms(form: Form) -> Iterator[Form]:
    """Yield forms that are tried for the best systems only."""
    yield from _simplified(form)
    if form.system is not form.plain:
        apart = shift_each(form.plain)
        if apart is not None:
            each = Form((*form.steps[:-1], "each in differences"), apart, form.plain)
            yield each
            yield from _simplified(each)


def forms_as_products(form: Form) -> Iterator[Form]:
    """Yield the form with polynomials as products, if there are any, also with factors in differences of inputs."""
    products = as_products(form.system)
    if products is not None and _is_representable(products):
        steps = (*form.steps, "as products")
        yield Form(steps, products, form.plain)
        shifted = shift(products)
        if shifted is not None:
            yield Form((*steps, "in differences"), shifted, products)


def _simplified(form: Form) -> Iterator[Form]:
    changed = without_common_factors(form.system)
    if changed is not None and _is_representable(changed):
        yield Form((*form.steps, "without common numbers"), changed, form.plain)
    yield from forms_as_products(form)


def _is_representable(system: System) -> bool:
    """Return whether the numbers of a system are in the range of double precision: factors of many terms may not be."""
    sizes = (max(value, -value) for polynomial in system.polynomials for value in polynomial.terms.values())
    return all(SMALLEST < size < 1 / SMALLEST for size in sizes)
