r"""The table of operations: the properties of every operation of the compiler.

`Operation` is the closed set of operations in a multivector expression; every member has a `Row`. The rows determine
the grade rules of products, operators, functions for kernels, symbolic functions, methods of numeric objects, their
docstrings, LaTeX and the derivatives of linear and bilinear operations.

To add a product that selects grades of the geometric product, add one member here. Type checkers and editors read names
from the source, so the name also needs one line in each of `gacompiler.frontend.operations`,
`gacompiler.symbolic.functions` and `gacompiler.algebra.methods`; ``tests/algebra/test_operation_table.py`` reports
missing lines. An operation of another kind also needs a definition in `gacompiler.algebra.meanings`.

LaTeX is a template of `str.format`: ``{0}`` is the first operand, in parentheses where needed, and ``{plain[0]}`` the
same without parentheses.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum, StrEnum


class Kind(Enum):
    """The kind of operands of an operation, which determines where it is available."""

    DATA = "data"
    """Has data in addition to its operands; created by methods of expressions."""
    ARITHMETIC = "arithmetic"
    """Written with an operator."""
    MULTIVECTOR = "multivector"
    """A function of multivectors in kernels and of symbolic multivectors, and a method of numeric objects."""
    SCALAR = "scalar"
    """A function of scalars in kernels, or an operator if it has one."""


class Derivative(Enum):
    """How an operation is differentiated."""

    BILINEAR = "bilinear"
    """By the product rule."""
    LINEAR = "linear"
    """The operation itself, applied to the derivative of its operand."""
    ZERO = "zero"
    """Piecewise constant."""
    OWN = "own"
    """By a rule in `gacompiler.derivatives`."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """The properties of an operation.

    Attributes
    ----------
    name : str
    kind : Kind
    operands : int
        Number of operands; -1 for any number.
    latex : str
        Template, see above; if empty, the operation is printed as a function of its name.
    summary : str
        First line of the docstring, with operands `a` and `b`.
    details : str
        Further paragraphs of the docstring.
    grades : callable, optional
        For a product: whether the part of grade `r` of the geometric product of grades `p` and `q` is kept
        (Dorst, Fontijne & Mann 2007, §19.4; Hestenes & Sobczyk 1984, §1-1).
    bracket : int
        For a product that is half of ``a b - b a`` or ``a b + b a``: the sign in it. Otherwise 0.
    signs : callable, optional
        For an involution: the sign of grade `k` (Dorst, Fontijne & Mann 2007, §2.9).
    operator : str
        The operator in kernels; empty if there is none.
    object_operators : tuple of str
        Further operators of numeric objects; ``()`` is the call ``a(b)``.
    is_closed : bool
        Whether its LaTeX never needs enclosing parentheses.
    derivative : Derivative
    """

    name: str
    kind: Kind
    operands: int
    latex: str = ""
    summary: str
    details: str = ""
    grades: Callable[[int, int, int], bool] | None = None
    bracket: int = 0
    signs: Callable[[int], int] | None = None
    operator: str = ""
    object_operators: tuple[str, ...] = ()
    is_closed: bool = False
    derivative: Derivative = Derivative.OWN


def _data(name: str, operands: int, summary: str, is_closed: bool = True) -> Row:
    return Row(name=name, kind=Kind.DATA, operands=operands, summary=summary, is_closed=is_closed)


def _arithmetic(name: str, operator: str, latex: str, summary: str, is_closed: bool = False) -> Row:
    return Row(
        name=name, kind=Kind.ARITHMETIC, operands=2, operator=operator, latex=latex, summary=summary,
        is_closed=is_closed,
    )  # fmt: skip


def _product(
    name: str,
    latex: str,
    summary: str,
    grades: Callable[[int, int, int], bool] | None = None,
    *,
    bracket: int = 0,
    operator: str = "",
    object_operators: tuple[str, ...] = (),
) -> Row:
    return Row(
        name=name, kind=Kind.MULTIVECTOR, operands=2, latex=latex, summary=summary, grades=grades, bracket=bracket,
        operator=operator, object_operators=object_operators, derivative=Derivative.BILINEAR,
    )  # fmt: skip


def _linear(
    name: str,
    latex: str,
    summary: str,
    signs: Callable[[int], int] | None = None,
    *,
    kind: Kind = Kind.MULTIVECTOR,
    operator: str = "",
    is_closed: bool = False,
) -> Row:
    return Row(
        name=name, kind=kind, operands=1, latex=latex, summary=summary, signs=signs, operator=operator,
        is_closed=is_closed, derivative=Derivative.LINEAR,
    )  # fmt: skip


def _function(name: str, latex: str, summary: str, details: str = "", *, is_closed: bool = False) -> Row:
    return Row(
        name=name, kind=Kind.MULTIVECTOR, operands=1, latex=latex, summary=summary, details=details,
        is_closed=is_closed,
    )  # fmt: skip


def _scalar(
    name: str,
    operands: int,
    summary: str,
    latex: str = "",
    *,
    is_closed: bool = False,
    derivative: Derivative = Derivative.OWN,
) -> Row:
    return Row(
        name=name, kind=Kind.SCALAR, operands=operands, summary=summary, latex=latex, is_closed=is_closed,
        derivative=derivative,
    )  # fmt: skip


def _comparison(name: str, operator: str, latex: str, summary: str) -> Row:
    return Row(
        name=name, kind=Kind.SCALAR, operands=2, operator=operator, latex=latex, summary=summary,
        derivative=Derivative.ZERO,
    )  # fmt: skip


class Operation(StrEnum):
    """The operations of multivector expressions. Each member is equal to its name as a string."""

    row: Row

    def __new__(cls, row: Row) -> Operation:
        """Create the member with the name of a row."""
        member = str.__new__(cls, row.name)
        member._value_ = row.name
        member.row = row
        return member

    INPUT = _data("input", 0, "An input of the kernel.")
    CONSTANT = _data("constant", 0, "A constant multivector.")
    GRADE = _data("grade", 1, "The part of the given grades.")
    COEFFICIENT = _data("coefficient", 1, "The coefficient of a blade.")
    ASSEMBLE = _data("assemble", -1, "A multivector from its coefficients.", is_closed=False)

    ADD = _arithmetic("add", "+", "{plain[0]} + {plain[1]}", "The sum ``a + b``.")
    SUBTRACT = _arithmetic("subtract", "-", "{plain[0]} - {1}", "The difference ``a - b``.")
    DIVIDE = _arithmetic(
        "divide", "/", r"\frac{{{plain[0]}}}{{{plain[1]}}}", "The quotient ``a / b`` by a scalar.", is_closed=True
    )
    NEGATE = _linear("negate", "-{0}", "The negative ``-a``.", kind=Kind.ARITHMETIC, operator="-")

    GEOMETRIC_PRODUCT = _product(
        "geometric_product", r"{0}\,{1}", "The geometric product ``a * b``.", lambda p, q, r: True, operator="*"
    )
    OUTER_PRODUCT = _product(
        "outer_product",
        r"{0} \wedge {1}",
        "The outer product ``a ^ b``: for grades p and q, the part of grade p + q of the geometric product.",
        lambda p, q, r: r == p + q,
        operator="^",
    )
    REGRESSIVE_PRODUCT = _product(
        "regressive_product",
        r"{0} \vee {1}",
        "The regressive product ``a & b``: ``undual(dual(a) ^ dual(b))``, in every metric.",
        operator="&",
    )
    LEFT_CONTRACTION = _product(
        "left_contraction",
        r"{0} \rfloor {1}",
        "The left contraction: for grades p and q, the part of grade q - p of the geometric product.",
        lambda p, q, r: r == q - p,
    )
    RIGHT_CONTRACTION = _product(
        "right_contraction",
        r"{0} \lfloor {1}",
        "The right contraction: for grades p and q, the part of grade p - q of the geometric product.",
        lambda p, q, r: r == p - q,
    )
    INNER_PRODUCT = _product(
        "inner_product",
        r"{0} \cdot {1}",
        "The inner product: for grades p and q, the part of grade ``|p - q|`` of the geometric product.",
        lambda p, q, r: r == abs(p - q),
        object_operators=("|",),
    )
    HESTENES_PRODUCT = _product(
        "hestenes_product",
        r"{0} \cdot {1}",
        "The `inner_product`, except that the product with a scalar is zero.",
        lambda p, q, r: r == abs(p - q) and p != 0 and q != 0,
    )
    SCALAR_PRODUCT = _product(
        "scalar_product", "{0} * {1}", "The scalar part of the geometric product.", lambda p, q, r: r == 0
    )
    COMMUTATOR = _product("commutator", r"{0} \times {1}", "The commutator ``(a b - b a) / 2``.", bracket=-1)
    ANTICOMMUTATOR = _product(
        "anticommutator", r"{0} \bullet {1}", "The anticommutator ``(a b + b a) / 2``.", bracket=1
    )

    REVERSE = _linear(
        "reverse",
        r"\widetilde{{{plain[0]}}}",
        "The reverse ``~a``, with the vectors of every product in reverse order: sign ``(-1)**(k (k - 1) / 2)``.",
        lambda k: -1 if k & 2 else 1,
        operator="~",
        is_closed=True,
    )
    GRADE_INVOLUTION = _linear(
        "grade_involution",
        r"\widehat{{{0}}}",
        "The grade involution, with every vector negated: sign ``(-1)**k``.",
        lambda k: -1 if k & 1 else 1,
    )
    CLIFFORD_CONJUGATE = _linear(
        "clifford_conjugate",
        r"\overline{{{0}}}",
        "The Clifford conjugate: reverse and grade involution together, sign ``(-1)**(k (k + 1) / 2)``.",
        lambda k: -1 if (k + 1) & 2 else 1,
    )
    DUAL = _linear(
        "dual",
        r"{{{0}}}^{{\star}}",
        "The right complement: ``b ^ dual(b) = I`` for every basis blade, in any metric.",
    )
    UNDUAL = _linear("undual", r"{{{0}}}_{{\star}}", "The left complement, the inverse of `dual`.")
    POLARITY = _linear(
        "polarity", r"{{{0}}}\,I^{{-1}}", "The metric dual ``a I**-1``; an error if the metric is degenerate."
    )

    SANDWICH = Row(
        name="sandwich",
        kind=Kind.MULTIVECTOR,
        operands=2,
        latex=r"{0}\,{1}\,\widetilde{{{plain[0]}}}",
        summary="The sandwich product ``a b ~a``; for an odd versor `a`, ``a grade_involution(b) ~a``.",
        object_operators=(">>", "()"),
    )
    INVERSE = _function("inverse", r"{{{0}}}^{{-1}}", "The inverse: ``b`` with ``a b = 1``.")
    DETERMINANT = _function(
        "determinant",
        r"\det({0})",
        "The determinant of the matrix of `a`, a scalar that is zero exactly if `a` has no inverse (Shirokov 2021).",
        "It has the degree ``2**ceil(n/2)`` in the coefficients, where `n` is the dimension of the algebra.",
    )
    NORM_SQUARED = _function(
        "norm_squared", r"\lVert {plain[0]} \rVert^2", "The squared norm, the scalar part of ``a ~a``.", is_closed=True
    )
    NORM = _function(
        "norm",
        r"\lVert {plain[0]} \rVert",
        "The norm ``sqrt(|a ~a|)``, the square root of the absolute value of `norm_squared`.",
        "The absolute value takes an operation only if squares of both signs can occur: in conformal and\n"
        "Minkowski metrics, but not in Euclidean metrics, with or without null vectors.",
        is_closed=True,
    )
    NORMALIZE = _function(
        "normalize",
        r"\frac{{{plain[0]}}}{{\lVert {plain[0]} \rVert}}",
        "The element ``a / norm(a)``, whose squared norm is 1, or -1 if that of `a` is negative.",
        "The squared norm is negative for real conformal spheres, circles, lines and planes that are outer\n"
        "products of points, and for spacelike vectors in a metric with one positive square. A null element has\n"
        "the norm 0: the coefficients of its quotient are infinite, or NaN where they are 0.",
        is_closed=True,
    )

    SQRT = _scalar("sqrt", 1, "Square root of a scalar.", r"\sqrt{{{plain[0]}}}", is_closed=True)
    SIN = _scalar("sin", 1, "Sine of a scalar, in radians.")
    COS = _scalar("cos", 1, "Cosine of a scalar, in radians.")
    ATAN2 = _scalar("atan2", 2, "Angle of the point (b, a), in (-pi, pi].")
    ACOS = _scalar("acos", 1, "Arc cosine of a scalar, in [0, pi].")
    EXP = _scalar("exp", 1, "Exponential of a scalar.")
    LOG = _scalar("log", 1, "Natural logarithm of a scalar.")
    ABS = _scalar("abs", 1, "Absolute value of a scalar.", r"\lvert {plain[0]} \rvert", is_closed=True)
    FLOOR = _scalar(
        "floor",
        1,
        "The largest integer that is not larger than a scalar; its derivative is 0.",
        r"\lfloor {plain[0]} \rfloor",
        derivative=Derivative.ZERO,
    )
    MINIMUM = _scalar("minimum", 2, "The smaller of two scalars.")
    MAXIMUM = _scalar("maximum", 2, "The larger of two scalars.")
    LESS = _comparison("less", "<", "{0} < {1}", "1 if ``a < b``, else 0.")
    LESS_EQUAL = _comparison("less_equal", "<=", r"{0} \le {1}", "1 if ``a <= b``, else 0.")
    EQUAL = _comparison("equal", "", "{0} = {1}", "1 if two scalars are equal, else 0.")
    SELECT = _scalar(
        "select",
        3,
        "The second operand if the first is not zero, else the third.",
        r"\begin{{cases}} {plain[1]} & {plain[0]} \\ {plain[2]} & \text{{otherwise}} \end{{cases}}",
    )


BY_NAME: Mapping[str, Operation] = {operation.value: operation for operation in Operation}
"""Every operation by its name."""

PRODUCTS: tuple[Operation, ...] = tuple(each for each in Operation if each.row.derivative is Derivative.BILINEAR)
"""The bilinear products of two multivectors."""

SCALAR_FUNCTIONS: tuple[Operation, ...] = tuple(each for each in Operation if each.row.kind is Kind.SCALAR)
"""The operations that take only scalars."""
