"""Floats with the methods of multivectors, the numbers returned by operations.

With these methods, code for multivectors also works if a product happens to be a number: ``(x * x).grade(0)``,
``~(x * x)``.
"""

from __future__ import annotations

from typing import Any, Self

import numpy as np

from ..algebra.algebra import Algebra
from ..algebra.layout import SCALAR, SCALARS, Layout
from ..errors import AlgebraError, ZeroDivisorError
from .methods import Operations, scalar_of


def _lifted(name: str) -> Any:
    """Return a method that converts the number to a multivector and calls the method of that name."""

    def method(self: Scalar, *operands: Any, **options: Any) -> Any:
        return getattr(self.as_multivector(), name)(*operands, **options)

    method.__name__, method.__qualname__ = name, f"Scalar.{name}"
    method.__doc__ = f"As `MultivectorArray.{name}`."
    return method


def _of_floats(name: str) -> Any:
    """Return an operator of floats whose results are again of this class."""
    run = getattr(float, name)

    def method(self: Scalar, *operands: Any) -> Any:
        found = run(self, *operands)
        return type(self)(found) if type(found) is float else found

    method.__name__, method.__qualname__, method.__doc__ = name, f"Scalar.{name}", run.__doc__
    return method


def _product(self: Scalar, other: Any) -> Any:
    """Return the outer or inner product of numbers, which is their product."""
    return type(self)(float.__mul__(self, other)) if isinstance(other, (int, float)) else NotImplemented


def _without_algebra(name: str) -> Any:
    def method(self: Scalar) -> Any:
        raise AlgebraError(
            name, "a number, which belongs to no algebra", "a multivector",
            "its dual in an algebra is the number times algebra.pseudoscalar",
        )  # fmt: skip

    method.__name__, method.__qualname__ = name, f"Scalar.{name}"
    method.__doc__ = "Raise `AlgebraError`: a number belongs to no algebra."
    return method


class Scalar(Operations, float):
    """A number returned by an operation: a float with the methods of multivectors.

    It is a float in every respect. ``+ - * /`` with numbers return numbers of this class; with multivectors they are
    the operators of multivectors. ``^`` and ``|`` of two numbers are their product, and ``~`` is the number itself.
    """

    __slots__ = ()

    layout = SCALAR
    algebra = SCALARS
    shape: tuple[int, ...] = ()
    ndim = 0
    size = 1

    @property
    def values(self) -> np.ndarray[Any, Any]:
        """The number as the only stored coefficient."""
        return np.array([float(self)])

    def as_multivector(self, algebra: Algebra = SCALARS) -> Any:
        """Return a multivector of an algebra; by default of none, which can be combined with those of any algebra."""
        return scalar_of(float(self), algebra)

    def grade(self, *grades: int) -> Self:
        """Return the number if 0 is one of the grades, else 0."""
        if not grades or not all(isinstance(k, int) and k >= 0 for k in grades):
            raise AlgebraError("grade", f"grades {grades}", "nonnegative integers, as in x.grade(2)")
        return self if 0 in grades else type(self)(0.0)

    def inverse(self) -> Self:
        """Return the reciprocal.

        Raises
        ------
        ZeroDivisorError
            If this is 0.
        """
        if not float(self):
            raise ZeroDivisorError("inverse", "the number 0", "an invertible element")
        return type(self)(1 / float(self))

    def as_layout(self, layout: Layout, *, tolerance: float = 1e-9, what: str = "") -> Any:
        """Convert to a layout of any algebra, as `MultivectorArray.as_layout` does."""
        return self.as_multivector(layout.algebra).as_layout(layout, tolerance=tolerance, what=what)

    def __invert__(self) -> Self:
        return self

    def __getitem__(self, name: str) -> float:
        if not isinstance(name, str):
            raise TypeError('a number has no axes; index it by a blade, x["1"]')
        return float(self) if name == "1" else 0.0

    @property
    def scalar(self) -> float:
        """The number."""
        return float(self)

    __xor__ = __rxor__ = __or__ = __ror__ = _product
    __add__, __radd__ = _of_floats("__add__"), _of_floats("__radd__")
    __sub__, __rsub__ = _of_floats("__sub__"), _of_floats("__rsub__")
    __mul__, __rmul__ = _of_floats("__mul__"), _of_floats("__rmul__")
    __truediv__, __rtruediv__ = _of_floats("__truediv__"), _of_floats("__rtruediv__")
    __neg__, __pos__, __abs__ = _of_floats("__neg__"), _of_floats("__pos__"), _of_floats("__abs__")
    __rshift__, __call__ = _lifted("__rshift__"), _lifted("__call__")

    normalize, exp, log = _lifted("normalize"), _lifted("exp"), _lifted("log")
    sqrt, power = _lifted("sqrt"), _lifted("power")
    isclose, exactly, project = _lifted("isclose"), _lifted("exactly"), _lifted("project")
    grades, explain = _lifted("grades"), _lifted("explain")
    is_blade, is_versor, is_null = _lifted("is_blade"), _lifted("is_versor"), _lifted("is_null")
    factorize = _lifted("factorize")
    dual, undual, polarity = (_without_algebra(name) for name in ("dual", "undual", "polarity"))
