"""The operations as methods of every multivector: exact, symbolic, numeric, or an expression in a kernel.

A method ``x.name(y)`` is the public function ``gacompiler.name(x, y)``, so that one text runs on all types of values.
"""

from __future__ import annotations

from collections.abc import Callable
from difflib import get_close_matches
from functools import cache
from importlib import import_module
from typing import Any, TypeVar

from ..errors import AlgebraError, OperandError
from .operations import BY_NAME, Operation

Method = TypeVar("Method", bound=Callable[..., Any])


@cache
def _function(name: str) -> Callable[..., Any]:
    """Return a public function of this package, which loads the layers above this one when it is first used."""
    found: Callable[..., Any] = getattr(import_module(__name__.partition(".")[0]), name)
    return found


def unary(operation: str) -> Callable[[Any], Any]:
    """Create the method of a function of one multivector."""

    def method(self: Any) -> Any:
        return _function(operation)(self)

    return named(method, operation)


def binary(operation: str) -> Callable[[Any, Any], Any]:
    """Create the method of a function of two multivectors."""

    def method(self: Any, other: Any) -> Any:
        return _function(operation)(self, other)

    return named(method, operation)


def named(method: Method, operation: str) -> Method:
    """Give a method the name of its operation, and a docstring with the summary in the table of operations."""
    row = BY_NAME[operation].row if operation in BY_NAME else None
    found = f"{row.summary}\n\n{row.details}".rstrip() if row else f"Apply `gacompiler.{operation}`."
    method.__name__, method.__qualname__ = str(operation), f"Methods.{operation}"
    method.__doc__ = f"{found}\n\nHere `a` is this multivector, and `b` the other one, if there is one.\n"
    return method


def _refused(symbol: str) -> Callable[[Any, Any], Any]:
    """Create an operator that raises an error, because multivectors have no order."""

    def method(self: Any, other: Any) -> Any:
        raise OperandError(f"x {symbol} y", "multivectors, which have no order", "numbers", _COMPARE)

    return method


_COMPARE = "compare numbers such as x.norm() or a coefficient, x.e12"


class Methods:
    """The operations of the algebra as methods."""

    __slots__ = ()

    geometric_product = binary(Operation.GEOMETRIC_PRODUCT)
    outer_product = binary(Operation.OUTER_PRODUCT)
    regressive_product = binary(Operation.REGRESSIVE_PRODUCT)
    left_contraction = binary(Operation.LEFT_CONTRACTION)
    right_contraction = binary(Operation.RIGHT_CONTRACTION)
    inner_product = binary(Operation.INNER_PRODUCT)
    hestenes_product = binary(Operation.HESTENES_PRODUCT)
    scalar_product = binary(Operation.SCALAR_PRODUCT)
    commutator = binary(Operation.COMMUTATOR)
    anticommutator = binary(Operation.ANTICOMMUTATOR)
    sandwich = binary(Operation.SANDWICH)
    join = binary("join")
    meet = binary("meet")
    power = binary("power")

    reverse = unary(Operation.REVERSE)
    grade_involution = unary(Operation.GRADE_INVOLUTION)
    clifford_conjugate = unary(Operation.CLIFFORD_CONJUGATE)
    dual = unary(Operation.DUAL)
    undual = unary(Operation.UNDUAL)
    polarity = unary(Operation.POLARITY)
    inverse = unary(Operation.INVERSE)
    determinant = unary(Operation.DETERMINANT)
    norm_squared = unary(Operation.NORM_SQUARED)
    norm = unary(Operation.NORM)
    normalize = unary(Operation.NORMALIZE)
    exp = unary(Operation.EXP)
    log = unary(Operation.LOG)
    sqrt = unary(Operation.SQRT)
    sin = unary("sin")
    cos = unary("cos")
    tan = unary("tan")
    sinh = unary("sinh")
    cosh = unary("cosh")
    tanh = unary("tanh")
    even_part = unary("even_part")
    odd_part = unary("odd_part")
    outer_exp = unary("outer_exp")
    outer_sin = unary("outer_sin")
    outer_cos = unary("outer_cos")
    outer_tan = unary("outer_tan")


class Unordered:
    """Comparisons that raise an error, because multivectors have no order."""

    __slots__ = ()

    __lt__, __le__ = _refused("<"), _refused("<=")
    __gt__, __ge__ = _refused(">"), _refused(">=")


class AttributeAlgebraError(AlgebraError, AttributeError):
    """Raised for access to an unknown layout, blade or method as an attribute."""


class WithCoefficients(Methods, Unordered):
    """The methods, and coefficients as attributes: ``x.e12`` is ``x["e12"]``, and ``x.scalar`` is ``x["1"]``."""

    __slots__ = ()

    def __or__(self, other: Any) -> Any:
        return self.inner_product(other)

    def __ror__(self, other: Any) -> Any:
        return _function(Operation.INNER_PRODUCT)(other, self)

    def __rshift__(self, other: Any) -> Any:
        return self.sandwich(other)

    def __rrshift__(self, other: Any) -> Any:
        return _function(Operation.SANDWICH)(other, self)

    def __call__(self, other: Any) -> Any:
        """Return the sandwich product of a versor with another multivector."""
        return self.sandwich(other)

    def __rpow__(self, base: Any) -> Any:
        return _function("power")(base, self)

    def __abs__(self) -> Any:
        return self.norm()

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        algebra: Any = object.__getattribute__(self, "algebra")
        try:
            return self["1" if name == "scalar" else name]  # type: ignore[index]
        except AlgebraError:
            pass
        near = get_close_matches(name, dir(self), 1)
        raise AttributeAlgebraError(
            f"{type(self).__name__} of {algebra.name}",
            f"no method and no blade {name!r}",
            "a method, or the name of a blade",
            f"did you mean {near[0]}?" if near else "",
        )

    def _latex(self, printer: object = None) -> str:
        """Return LaTeX without dollar signs, for `sympy.latex`."""
        found: str = self._repr_latex_()
        return found.strip("$")

    def __dir__(self) -> list[str]:
        algebra: Any = object.__getattribute__(self, "algebra")
        return sorted({*object.__dir__(self), *(algebra.spelling(blade)[1] for blade in self.blades if blade)})
