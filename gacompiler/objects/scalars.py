"""Floats with the methods of multivectors: what `arrays.Scalar`, the number that an operation gives, has of its own.

What is written for multivectors then works where a product happens to be a number: ``(x * x).grade(0)``, ``~(x * x)``.
"""

from __future__ import annotations

from typing import Any, Self

import numpy as np

from ..algebra.algebra import Algebra
from ..algebra.layout import SCALAR, SCALARS, Layout
from ..errors import AlgebraError
from .methods import Operations


def _lifted(name: str) -> Any:
    """A method of multivectors, called on the number as the only coefficient of one."""

    def method(self: ScalarMethods, *operands: Any, **options: Any) -> Any:
        return getattr(self.as_multivector(), name)(*operands, **options)

    method.__name__, method.__qualname__ = name, f"Scalar.{name}"
    method.__doc__ = f"As `MultivectorArray.{name}`."
    return method


def _of_floats(name: str) -> Any:
    """An operator of floats, whose results are again of this class."""
    run = getattr(float, name)

    def method(self: ScalarMethods, *operands: Any) -> Any:
        found = run(self, *operands)
        return type(self)(found) if type(found) is float else found

    method.__name__, method.__qualname__, method.__doc__ = name, f"Scalar.{name}", run.__doc__
    return method


def _product(self: ScalarMethods, other: Any) -> Any:
    """The outer and inner product of numbers: their product."""
    return type(self)(float.__mul__(self, other)) if isinstance(other, (int, float)) else NotImplemented


def _without_algebra(name: str) -> Any:
    def method(self: ScalarMethods) -> Any:
        raise AlgebraError(
            name, "a number, which is of no algebra", "a multivector",
            "its dual in an algebra is the number times algebra.pseudoscalar",
        )  # fmt: skip

    method.__name__, method.__qualname__ = name, f"Scalar.{name}"
    method.__doc__ = "An error: a number is of no algebra."
    return method


class ScalarMethods(Operations, float):
    """A number with the methods of multivectors; its subclass says what a multivector is.

    It is a float in every respect. ``+ - * /`` with numbers give numbers of this class, and with multivectors what the
    operators of these give; ``^`` and ``|`` of two numbers are their product, and ``~`` is the number itself.
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

    def in_algebra(self, algebra: Algebra) -> Any:
        """The number as the only coefficient of a multivector of an algebra."""
        raise NotImplementedError

    def as_multivector(self) -> Any:
        """The number as the only coefficient of a multivector of no algebra, which takes part in operations of all."""
        return self.in_algebra(SCALARS)

    def grade(self, *grades: int) -> Self:
        """The number if 0 is one of the grades, else 0."""
        if not grades or not all(isinstance(k, int) and k >= 0 for k in grades):
            raise AlgebraError("grade", f"grades {grades}", "whole numbers from 0, as in x.grade(2)")
        return self if 0 in grades else type(self)(0.0)

    def as_layout(self, layout: Layout, *, tolerance: float = 1e-9, what: str = "") -> Any:
        """As `MultivectorArray.as_layout`, in any algebra."""
        return self.in_algebra(layout.algebra).as_layout(layout, tolerance=tolerance, what=what)

    def __invert__(self) -> Self:
        return self

    def __getitem__(self, name: str) -> float:
        if not isinstance(name, str):
            raise TypeError('one number has no axes; ask for the coefficient, x["1"]')
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
    dual, undual, polarity = (_without_algebra(name) for name in ("dual", "undual", "polarity"))
