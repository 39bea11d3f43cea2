"""Expressions of 3D plane-based geometric algebra whose operation counts are published or asserted elsewhere.

Blades are named by any spelling; ``unit=True`` declares ``x ~x = 1`` (every coefficient).
"""

from gacompiler import inverse, join, kernel, right_contraction, sandwich
from gacompiler.algebra.catalog import PGA3

MOTOR, POINT, DIRECTION, LINE, PLANE = PGA3.MOTOR, PGA3.POINT, PGA3.DIRECTION, PGA3.LINE, PGA3.PLANE
EVEN = PGA3.layout("EVEN", "1 e12 e13 e23 e01 e02 e03 e0123")
TRIVECTOR = PGA3.layout("TRIVECTOR", "e012 e013 e023 e123")
TRANSLATION = PGA3.layout("TRANSLATION", "e01 e02 e03", fixed={"1": 1})
ROTATION = PGA3.layout("ROTATION", "e12 e13 e23", fixed={"1": 1})
UNIT_PLANE = PGA3.layout("UNIT_PLANE", "e0 e1 e2 e3", unit=True)
UNIT_LINE = PGA3.layout("UNIT_LINE", "e12 e13 e23 e01 e02 e03", unit=True)
ORIGIN = PGA3.multivector({"e123": 1})  # constants, folded at compile time
X_DIRECTION = PGA3.multivector({"e032": 1})


@kernel(m=MOTOR, p=POINT)
def motor_point(m, p):
    return sandwich(m, p)


@kernel(m=MOTOR, p=POINT)
def motor_point_spelled_out(m, p):
    return m * p * ~m


@kernel(m=MOTOR, d=DIRECTION)
def motor_direction(m, d):
    return sandwich(m, d)


@kernel(m=MOTOR)
def motor_origin(m):
    return sandwich(m, ORIGIN)


@kernel(m=MOTOR)
def motor_x_direction_half(m):
    return sandwich(m, X_DIRECTION) / 2


@kernel(m=MOTOR, t=TRIVECTOR)
def motor_trivector(m, t):
    return sandwich(m, t)


@kernel(m=MOTOR, p=PLANE)
def motor_plane(m, p):
    return sandwich(m, p)


@kernel(m=MOTOR, line=LINE)
def motor_line(m, line):
    return sandwich(m, line)


@kernel(a=EVEN, b=EVEN)
def motor_motor(a, b):
    return a * b


@kernel(m=EVEN, t=TRANSLATION)
def motor_translation(m, t):
    return m * t


@kernel(a=TRANSLATION, b=TRANSLATION)
def translation_translation(a, b):
    return a * b


@kernel(a=ROTATION, b=ROTATION)
def rotation_rotation(a, b):
    return a * b


@kernel(a=POINT, b=POINT)
def join_2_points(a, b):
    return join(a, b)


@kernel(a=POINT, line=LINE)
def join_point_line(a, line):
    return join(a, line)


@kernel(a=POINT, b=POINT, c=POINT)
def join_3_points(a, b, c):
    return join(join(a, b), c)


@kernel(a=POINT, b=POINT, c=POINT, d=POINT)
def join_4_points(a, b, c, d):
    return join(join(join(a, b), c), d)


@kernel(p=POINT, n=PLANE)
def project_point_plane(p, n):
    return right_contraction(p, n) * inverse(n)


@kernel(p=POINT, n=UNIT_PLANE)
def project_point_unit_plane(p, n):
    return right_contraction(p, n) * n


@kernel(p=POINT, line=UNIT_LINE)
def project_point_unit_line(p, line):
    return right_contraction(p, line) * ~line


@kernel(a=POINT, b=POINT)
def distance_squared(a, b):
    return join(a, b) * ~join(a, b)


@kernel(a=TRIVECTOR, b=TRIVECTOR)
def distance_squared_unnormalised(a, b):
    return join(a, b) * ~join(a, b)


@kernel(a=POINT, b=POINT, c=POINT)
def area_squared(a, b, c):
    plane = join(join(a, b), c)
    return plane * ~plane


@kernel(m=MOTOR, n=MOTOR, p=POINT)
def composed_motors_point(m, n, p):
    return sandwich(m * n, p)


@kernel(m=MOTOR, n=MOTOR, p=POINT)
def nested_motors_point(m, n, p):
    return sandwich(m, sandwich(n, p))


@kernel(m=MOTOR, p=POINT, q=POINT)
def join_of_moved_points(m, p, q):
    return join(sandwich(m, p), sandwich(m, q))


@kernel(m=MOTOR, p=POINT, q=POINT)
def distance_squared_of_moved_points(m, p, q):
    line = join(sandwich(m, p), sandwich(m, q))
    return line * ~line
