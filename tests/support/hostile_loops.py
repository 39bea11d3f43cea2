"""A spec of kernels with loops that are hard to print: tables that share places, names that languages reserve."""

from typing import NamedTuple

from gacompiler import (
    SCALAR,
    absolute,
    accumulate,
    array,
    each,
    fold,
    gather,
    index,
    iterate,
    kernel,
    least,
    scan,
    scatter,
    sin,
    total,
)
from gacompiler.algebra.catalog import CGA3, PGA3

N = array(SCALAR, "n")
M = array(SCALAR, "m")


class State(NamedTuple):
    position: object
    speed: object


@kernel(m=array(PGA3.MOTOR, "n"), p=PGA3.POINT)
def motors(m, p):
    """Checked by its proof."""
    c = scan(lambda c, a: c * a, 1, m)
    return each(lambda c: c * p * ~c, c), c


@kernel(x=array(PGA3.POINT, "n"), i=index("n", into="m"), y=M)
def points_sum(x, i, y):
    """Checked by its proof."""
    return scatter(x, i, y), total(lambda a: a, x)


@kernel(x=array(PGA3.MOTOR, "n"), i=index("n", into="m"), j=index("n", into="k"), y=M, z=array(SCALAR, "k"))
def matrices(x, i, j, y, z):
    """Checked by its proof."""
    return scatter((x, each(lambda a: a * 2, x)), (i, j), (y, z))


@kernel(p=array(CGA3.POINT, "n"), m=array(CGA3.MOTOR, "n"))
def conformal(p, m):
    """Checked by its proof."""
    return (
        each(lambda p, m: m * p * ~m, p, m),
        fold(lambda s, p, m: m * p * ~m, CGA3.multivector({"e0": 1}), p, m),
        scan(lambda c, m: c * m, 1, m),
    )


@kernel(x=N)
def nested_iteration(x):
    """Checked by its proof."""

    def row(a):
        r, _, n = iterate(lambda r: (r + (a * a + 1) / r) / 2, 1, lambda o, n: absolute(o - n) < 1e-9, 20)
        return r, n

    return each(row, x)


@kernel(x=N)
def loop_in_iteration(x):
    """Checked by its proof."""
    s = total(lambda a: a * a, x)

    def step(r):
        d = total(lambda a: a * r, x)
        return (r[0] if isinstance(r, tuple) else r) - d / (1 + s) * 0.5

    return iterate(step, 1, lambda a, b: absolute(a - b) < 1e-3, 30)[0]


@kernel(x=N, w=index("n"))
def both_ways(x, w):
    """Checked by its proof."""
    up = scan(lambda s, a: s * 2 + a, 1, x, parents=w)
    v, k = accumulate(lambda c, a: (c + a, (a * c)), 0, up, parents=w, keep=True)
    return v, k, up


@kernel(x=N, w=index("n"))
def gathered(x, w):
    """Checked by its proof."""
    return gather(x, w), gather(each(lambda a: a * a, gather(x, w)), w), scatter(gather(x, w), w, x)


@kernel(x=N)
def reversed_(x):
    """Checked by its proof."""
    return (
        accumulate(lambda s, a: s * 2 + a, 0, x),
        scan(lambda s, a: s * 2 + a, 0, x, reverse=True),
        fold(lambda s, a: s * 2 + a, 0, x, reverse=True),
    )


@kernel(x=N, a=SCALAR)
def copies(x, a):
    """Checked by its proof."""
    s = fold(lambda s, b: s + b, a, x)
    r = each(lambda b: b + 1, x)
    return s, s, a, x, r, r


@kernel(x=array(PGA3.MOTOR, "n"), a=PGA3.MOTOR)
def copies_of_motors(x, a):
    """Checked by its proof."""
    s = fold(lambda s, b: s * b, a, x)
    t = fold(lambda s, b: b, a, x)
    u = fold(lambda s, b: (s[1], b), (a, a), x)
    return s, s, a, x, t, u[0], u[1]


@kernel(x=array(PGA3.POINT, "n", 3), returns=array(PGA3.POINT, "n", 2))
def pairs(x):
    """Checked by its proof."""
    return (each(lambda p: p[0], x), each(lambda p: p[1], x))


@kernel(i=N, out=N, work=SCALAR, q=SCALAR)
def names(i, out, work, q):
    """Checked by its proof."""
    return (
        each(lambda n, j: n * j + work, i, out),
        total(lambda out_0: out_0 * q, i),
        fold(lambda double, int: double + int, 0, i),
        fold(lambda range, t: range * t, 1, i),
    )


@kernel(x=N)
def smallest(x):
    """Checked by its proof."""
    return least(lambda a: a * a, x)


@kernel(x=N, y=M)
def nested(x, y):
    """Checked by its proof."""

    def body(a):
        z = each(lambda b: a * b + 1, y)
        return total(lambda b: b * b, z) * a, fold(lambda s, b: s * sin(a) + b, 1, z)

    return each(body, x)


@kernel(x=N, y=M)
def captured(x, y):
    """Checked by its proof."""
    return each(lambda v: total(lambda w: w * sin(v) + v, y), x), fold(
        lambda s, a: State(s.position + s.speed, s.speed + a), State(0, 1), x
    )[1]


@kernel(x=N)
def unchanged(x):
    """Checked by its proof."""
    return fold(lambda s, a: (s[0], s[1] + a), (5, 1), x)


@kernel(x=N)
def no_effect(x):
    """Checked by its proof."""
    return fold(lambda s, a: s, 5, x)


@kernel(x=array(SCALAR, "n", shared=True), y=N)
def shared(x, y):
    """Checked by its proof."""
    return each(lambda a, b: a * b, x, y), total(lambda a: a * a, x)


@kernel(x=array(SCALAR, "n", shared=True))
def only_shared(x):
    """Checked by its proof."""
    return each(lambda a: a * a, x)


@kernel(x=N, y=M)
def aliasing(x, y):
    """A row that is carried on while its table changes."""
    line = PGA3.multivector({"e1": 1})
    return fold(lambda s, a: fold(lambda t, b: b, s, each(lambda b: (b * a) * line + s, y)), line, x)


@kernel(m=array(SCALAR, "n", 2, 2), start=array(SCALAR, 2, 2), parents=index("n"), returns=array(SCALAR, "n", 2, 2))
def matrix_products(m, start, parents):
    """Products of matrices along a tree."""

    def product(a, b):
        return tuple(tuple(sum(a[i][k] * b[k][j] for k in range(2)) for j in range(2)) for i in range(2))

    return scan(product, start, m, parents=parents)


@kernel(
    m=array(SCALAR, "n", 2, 2),
    parents=index("n"),
    a=SCALAR,
    returns=(array(SCALAR, "n", 2, 2), array(SCALAR, 2, 2), SCALAR),
)
def matrix_sums(m, parents, a):
    """Sums of matrices."""
    zero = ((0, 0), (0, 0))
    s = accumulate(
        lambda c, b: tuple(tuple(c[i][j] + a * b[i][j] for j in range(2)) for i in range(2)), zero, m, parents=parents
    )
    t, _, k = iterate(
        lambda r: tuple(tuple(r[i][j] / 2 + a for j in range(2)) for i in range(2)),
        ((1, 0), (0, 1)),
        lambda o, n: absolute(o[0][0] - n[0][0]) < 1e-3,
        9,
    )
    return s, t, k
