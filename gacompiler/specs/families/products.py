"""Products, involutions and duals of any two elements."""

import gacompiler as ga
from gacompiler import Family


def products(algebra, even=None, **notes):
    """The products of an algebra, and what else is defined for all its elements.

    `even` is the layout of even elements, where it is not that of every algebra. Docstrings of `outer_product`,
    `regressive_product`, `even_product`, `dual` and `norm` go on with the note of that name; `versor` says what the
    algebra calls its even versors.
    """
    words = {"outer_product": "", "regressive_product": "", "even_product": "", "dual": "", "norm": "", "versor": ""}
    family = Family("products", **words | notes, pseudoscalar=algebra.spelling(algebra.everything)[1])
    FULL, EVEN = algebra.full, even or algebra.even

    @family.kernel(a=FULL, b=FULL)
    def geometric_product(a, b):
        """The geometric product ``a b`` of any two elements."""
        return a * b

    @family.kernel(a=FULL, b=FULL)
    def outer_product(a, b):
        """The outer product ``a ^ b`` of any two elements{outer_product}."""
        return a ^ b

    @family.kernel(a=FULL, b=FULL)
    def regressive_product(a, b):
        """The regressive product ``a & b`` of any two elements{regressive_product}."""
        return a & b

    @family.kernel(a=FULL, b=FULL)
    def inner_product(a, b):
        """The inner product of any two elements: of grades p and q, the part of grade \\|p - q\\| of ``a b``."""
        return ga.inner_product(a, b)

    @family.kernel(a=EVEN, b=EVEN)
    def even_product(a, b):
        """The geometric product of two even elements{even_product}."""
        return a * b

    @family.kernel(a=FULL)
    def reverse(a):
        """The reverse ``~a`` of any element: the order of vectors in every product turned round."""
        return ~a

    @family.kernel(a=EVEN)
    def even_reverse(a):
        """The reverse of an even element: the inverse of a unit {versor}."""
        return ~a

    @family.kernel(a=FULL)
    def grade_involution(a):
        """Any element with its odd part negated."""
        return ga.grade_involution(a)

    @family.kernel(a=FULL)
    def clifford_conjugate(a):
        """The reverse of the grade involution of any element."""
        return ga.clifford_conjugate(a)

    @family.kernel(a=FULL)
    def dual(a):
        """The right complement of any element{dual}: ``b ^ dual(b) = {pseudoscalar}`` for basis blades."""
        return ga.dual(a)

    @family.kernel(a=FULL)
    def undual(a):
        """The inverse of `dual`."""
        return ga.undual(a)

    @family.kernel(a=FULL)
    def polarity(a):
        """The metric dual ``a {pseudoscalar}**-1``."""
        return ga.polarity(a)

    @family.kernel(a=FULL)
    def norm(a):
        """The norm ``sqrt(<a ~a>)`` of any element{norm}."""
        return ga.norm(a)

    @family.kernel(a=FULL)
    def inverse(a):
        """The inverse of any element that has one."""
        return ga.inverse(a)

    return family
