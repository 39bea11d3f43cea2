"""Products of the layers of networks, and their transposed derivatives, in any algebra."""

from dataclasses import replace

from gacompiler import SCALAR, Family, array, vjp


def paths(algebra):
    """Return the grades (i, j, k) for which products of grades i and j have parts of grade k, in ascending order."""
    grades = range(algebra.dimension + 1)

    def product(i, j):
        pairs = ((a, b) for a in algebra.blades(i) for b in algebra.blades(j))
        return {c.bit_count() for a, b in pairs for c in algebra.blade_product(a, b)}

    return [(i, j, k) for i in grades for j in grades for k in sorted(product(i, j))]


def layers(algebra, suffix=""):
    """Declare the products of layers in an algebra; the names of the kernels end with `suffix`.

    A spec for another algebra is ``globals().update(layers(orthogonal(2, 2)))``; pass the module that is generated from
    it to `algorithms.learning.Algebra`.
    """
    family = Family("layers", algebra=algebra.name)
    full, ways = algebra.full, paths(algebra)
    gradient = array(SCALAR, len(full.blades))

    @family.kernel(a=full, b=full, returns=full)
    def product(a, b):
        """Compute the geometric product ``a b`` in {algebra}."""
        return a * b

    @family.kernel(a=full, b=full, cotangent=full, returns=(gradient, gradient))
    def product_pull(a, b, cotangent):
        """Compute the gradients of ``cotangent . (a b)`` with respect to a and b in {algebra}."""
        return vjp(product, "a").function(a, b, cotangent)[1], vjp(product, "b").function(a, b, cotangent)[1]

    @family.kernel(a=full, b=full, weights=array(SCALAR, len(ways)), returns=full)
    def weighted(a, b, weights):
        """Compute the sum of the parts of ``a b`` in {algebra}, each multiplied by the weight of its grades.

        The weights are those of the grades (i, j, k) of a, of b and of the part, in ascending order.
        """
        parts = [weight * (a.grade(i) * b.grade(j)).grade(k) for weight, (i, j, k) in zip(weights, ways, strict=True)]
        return sum(parts[1:], parts[0])

    @family.kernel(a=full, b=full, weights=array(SCALAR, len(ways)), cotangent=full,
                   returns=(gradient, gradient, array(SCALAR, len(ways))))  # fmt: skip
    def weighted_pull(a, b, weights, cotangent):
        """Compute the gradients of ``cotangent . weighted(a, b, weights)`` by a, b and the weights in {algebra}."""
        by_weights = [
            sum(cotangent[name] * part[name] for name in full.blades)
            for part in ((a.grade(i) * b.grade(j)).grade(k) for i, j, k in ways)
        ]
        by_factors = [vjp(weighted, name).function(a, b, weights, cotangent)[1] for name in ("a", "b")]
        return *by_factors, tuple(by_weights)

    kernels = product, product_pull, weighted, weighted_pull
    return {kernel.name + suffix: replace(kernel, name=kernel.name + suffix) for kernel in kernels}
