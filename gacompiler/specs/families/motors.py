"""Rigid motions as versors, the same in plane-based and in conformal algebras."""

import gacompiler as ga
from gacompiler import SCALAR, Family


def motors(algebra, generator, motion):
    """Declare motors with their exponentials, logarithms and powers.

    `generator` is the layout of their logarithms, and `motion` names the general motion of a motor.
    """
    family = Family("motors", motion=motion)
    MOTOR, POINT = algebra.MOTOR, algebra.POINT

    @family.kernel(a=MOTOR, b=MOTOR, returns=MOTOR)
    def motor_product(a, b):
        """Compose two motors; the product applies `b` first and then `a`."""
        return a * b

    @family.kernel(m=MOTOR, returns=MOTOR)
    def motor_inverse(m):
        """Compute the inverse of a unit motor, which is its reverse."""
        return ~m

    @family.kernel(b=generator, returns=MOTOR)
    def motor_exponential(b):
        """Compute ``exp(b)`` of the bivector of a rigid motion. Smooth everywhere."""
        return ga.exp(b)

    @family.kernel(m=MOTOR, returns=generator)
    def motor_logarithm(m):
        """Compute the bivector of least angle with exponential `m` or `-m`, the same motion.

        Pure translations are supported. At half turns, where the scalar part is 0, the two signs are equally near and
        the result is discontinuous.
        """
        return ga.log(m)

    @family.kernel(m=MOTOR, returns=MOTOR)
    def motor_square_root(m):
        """Compute the motor of half the motion of `m`, by the smaller angle; a half turn's sign decides."""
        return ga.sqrt(m)

    @family.kernel(m=MOTOR, t=SCALAR, returns=MOTOR)
    def motor_power(m, t):
        """Compute the power ``exp(t log(m))`` of a motor, or of ``-m`` if nearer to 1: the smaller motion times `t`.

        `t` is any real number: 0 gives no motion, 1 the motion itself, -1 its inverse. The orientation is discontinuous
        at half turns.
        """
        return ga.power(m, t)

    @family.kernel(a=MOTOR, b=MOTOR, t=SCALAR, returns=MOTOR)
    def interpolate_motors(a, b, t):
        """Interpolate by the {motion} from `a` at ``t = 0`` to `b` (or `-b`) at ``t = 1``, at constant twist."""
        return ga.interpolate(a, b, t)

    @family.kernel(m=MOTOR, p=POINT, returns=POINT)
    def move_point(m, p):
        """Move the point `p` by the unit motor `m`: ``m p ~m``."""
        return m * p * ~m

    return family
