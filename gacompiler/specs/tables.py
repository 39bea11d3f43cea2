"""Products of coefficients with terms listed in tables, for any dimension and grade, and minors of matrices."""

from gacompiler import SCALAR, array, each, gather, index, kernel, scatter


@kernel(
    a=array(SCALAR, "p"),
    b=array(SCALAR, "q"),
    left=index("t", into="p"),
    right=index("t", into="q"),
    sign=array(SCALAR, "t", shared=True),
    target=index("t", into="r"),
    zero=array(SCALAR, "r", shared=True),
    returns=array(SCALAR, "r"),
)
def product_by_table(a, b, left, right, sign, target, zero):
    """Sum the terms ``sign a[left] b[right]`` into the coefficients `target`; `zero` contains zeros."""
    terms = each(lambda factor, x, y: factor * x * y, sign, gather(a, left), gather(b, right))
    return scatter(terms, target, zero)
