"""Products, involutions and duals of general elements."""

import gacompiler as ga
from gacompiler import Family


def products(algebra, even=None, **notes):
    """Declare the products of an algebra and other operations on all its elements.

    `even` is the layout of even elements, if it differs from the default of the algebra. The notes are appended to the
    docstrings of `outer_product`, `regressive_product`, `even_product`, `dual` and `norm`; `versor` is the name of even
    versors in the algebra.
    """
    words = {"outer_product": "", "regressive_product": "", "even_product": "", "dual": "", "norm": "", "versor": ""}
    family = Family("products", **words | notes, pseudoscalar=algebra.spelling(algebra.everything)[1])
    FULL, EVEN = algebra.full, even or algebra.even

    @family.kernel(a=FULL, b=FULL)
    def geometric_product(a, b):
        """Compute the geometric product ``a b`` of two elements."""
        return a * b

    @family.kernel(a=FULL, b=FULL)
    def outer_product(a, b):
        """Compute the outer product ``a ^ b`` of two elements{outer_product}."""
        return a ^ b

    @family.kernel(a=FULL, b=FULL)
    def regressive_product(a, b):
        """Compute the regressive product ``a & b`` of two elements{regressive_product}."""
        return a & b

    @family.kernel(a=FULL, b=FULL)
    def inner_product(a, b):
        """Compute the inner product of two elements: for grades p and q, the part of grade \\|p - q\\| of ``a b``."""
        return ga.inner_product(a, b)

    @family.kernel(a=EVEN, b=EVEN)
    def even_product(a, b):
        """Compute the geometric product of two even elements{even_product}."""
        return a * b

    @family.kernel(a=FULL)
    def reverse(a):
        """Compute the reverse ``~a`` of an element: the order of the vectors in every product is reversed."""
        return ~a

    @family.kernel(a=EVEN)
    def even_reverse(a):
        """Compute the reverse of an even element: the inverse of a unit {versor}."""
        return ~a

    @family.kernel(a=FULL)
    def grade_involution(a):
        """Negate the odd part of an element."""
        return ga.grade_involution(a)

    @family.kernel(a=FULL)
    def clifford_conjugate(a):
        """Compute the reverse of the grade involution of an element."""
        return ga.clifford_conjugate(a)

    @family.kernel(a=FULL)
    def dual(a):
        """Compute the right complement{dual}: ``b ^ dual(b) = {pseudoscalar}`` for basis blades."""
        return ga.dual(a)

    @family.kernel(a=FULL)
    def undual(a):
        """Compute the inverse of `dual`."""
        return ga.undual(a)

    @family.kernel(a=FULL)
    def polarity(a):
        """Compute the metric dual ``a {pseudoscalar}**-1``."""
        return ga.polarity(a)

    @family.kernel(a=FULL)
    def norm(a):
        """Compute the norm ``sqrt(<a ~a>)`` of an element{norm}."""
        return ga.norm(a)

    @family.kernel(a=FULL)
    def inverse(a):
        """Compute the inverse of an element, if it has one."""
        return ga.inverse(a)

    return family
