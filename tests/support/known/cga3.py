"""Expressions of 3D conformal geometric algebra, null basis ``e0, einf`` with ``e0 . einf = -1``."""

from gacompiler import kernel, outer_product, sandwich
from gacompiler.algebra.catalog import CGA3, VGA3

POINT = CGA3.POINT  # x y z given; e0 = 1 and the einf coefficient x.x/2 are implied
VECTOR = CGA3.layout("VECTOR", "e1 e2 e3 e0 einf")
FULL = CGA3.full
EVEN = CGA3.even
ROTOR, DIRECTION3 = VGA3.ROTOR, VGA3.VECTOR


@kernel(r=ROTOR, v=DIRECTION3)
def rotor_vector(r, v):
    return sandwich(r, v)


@kernel(a=POINT, b=POINT, c=POINT, d=POINT)
def sphere_4_points(a, b, c, d):
    return a ^ b ^ c ^ d


@kernel(a=POINT, b=POINT, c=POINT)
def circle_3_points(a, b, c):
    return a ^ b ^ c


@kernel(a=POINT, b=POINT)
def point_pair(a, b):
    return outer_product(a, b)


@kernel(m=CGA3.UNIT_EVEN, x=VECTOR)
def versor_vector(m, x):
    return sandwich(m, x)


@kernel(a=EVEN, b=EVEN)
def even_product(a, b):
    return a * b


@kernel(a=FULL, b=FULL)
def full_product(a, b):
    return a * b
