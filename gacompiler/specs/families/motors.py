"""Rigid motions as versors, the same in plane-based and in conformal algebras."""

import gacompiler as ga
from gacompiler import SCALAR, Family


def motors(algebra, generator, motion):
    """Motors, with their exponentials, logarithms and powers.

    `generator` is the layout of their logarithms, and `motion` what one of them is in general.
    """
    family = Family("motors", motion=motion)
    MOTOR, POINT = algebra.MOTOR, algebra.POINT

    @family.kernel(a=MOTOR, b=MOTOR, returns=MOTOR)
    def motor_product(a, b):
        """The motor that does `b` first and then `a`."""
        return a * b

    @family.kernel(m=MOTOR, returns=MOTOR)
    def motor_inverse(m):
        """The inverse of a unit motor, which is its reverse."""
        return ~m

    @family.kernel(b=generator, returns=MOTOR)
    def motor_exponential(b):
        """``exp(b)`` of the bivector of a rigid motion. Smooth everywhere."""
        return ga.exp(b)

    @family.kernel(m=MOTOR, returns=generator)
    def motor_logarithm(m):
        """The bivector of least angle whose exponential is `m` or `-m`, the same motion.

        Pure translations are no exception. At half turns, where the scalar part is 0, the two signs are equally near
        and the result jumps.
        """
        return ga.log(m)

    @family.kernel(m=MOTOR, returns=MOTOR)
    def motor_square_root(m):
        """The motor that, done twice, is the motion of `m`, by the smaller angle; a half turn's sign decides its sense."""  # noqa: E501
        return ga.sqrt(m)

    @family.kernel(m=MOTOR, t=SCALAR, returns=MOTOR)
    def motor_power(m, t):
        """The part `t` of the motion of `m`, by the smaller angle: ``exp(t log(m))``, of ``-m`` where that is nearer to 1.

        Any real `t`: 0 gives no motion, 1 the motion itself, -1 its inverse. At half turns the sense jumps.
        """  # noqa: E501
        return ga.power(m, t)

    @family.kernel(a=MOTOR, b=MOTOR, t=SCALAR, returns=MOTOR)
    def interpolate_motors(a, b, t):
        """The {motion} that starts as `a` at ``t = 0`` and is `b` (or `-b`) at ``t = 1``, at constant twist."""
        return ga.interpolate(a, b, t)

    @family.kernel(m=MOTOR, p=POINT, returns=POINT)
    def move_point(m, p):
        """The point `p` moved by the unit motor `m`: ``m p ~m``."""
        return m * p * ~m

    return family
