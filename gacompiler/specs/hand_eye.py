"""How a camera sits on a hand, by unit motors of G(3,0,1): ``a x = x b`` and ``a x = z b``.

A pose ``a`` takes the frame of the hand to that of its base, ``b`` the frame of the camera to that of what it looks
at, and ``x`` the frame of the camera to that of the hand; ``z`` takes the frame of what is looked at to the base.
Motors have the signs that make the scalar part of a misfit positive. Coefficients with e0 are half of lengths.
"""

from fractions import Fraction

import gacompiler as ga
from gacompiler import SCALAR, array, jacobian, kernel
from gacompiler.algebra.catalog import PGA3

MOTOR, EVEN, BIVECTOR = PGA3.MOTOR, PGA3.EVEN, PGA3.LINE
ROTOR_BLADES = PGA3.ROTOR.blades
PSEUDOSCALAR = PGA3.multivector({"e0123": 1})
TINY = Fraction(1, 10**60)


@kernel(u=EVEN, v=EVEN, returns=MOTOR)
def null_motor(u, v):
    """The unit motor, of the plane of two even elements, of the direction whose rotational part is largest.

    Where the elements are orthonormal and span X and its product with the pseudoscalar, that is X. Its scalar part is
    not negative.
    """

    def inner(a, b):
        return sum(a[name] * b[name] for name in ROTOR_BLADES)

    uu, uv, vv = inner(u, u), inner(u, v), inner(v, v)
    gap = uu - vv
    long = ga.sqrt(gap * gap + 4 * uv * uv) + ga.select(gap < 0, -gap, gap)
    none = long < TINY
    first = ga.select(none, 1, ga.select(gap < 0, 2 * uv, long))
    second = ga.select(none, 0, ga.select(gap < 0, long, 2 * uv))
    even = first * u + second * v
    study = even * ~even
    size = study["1"]
    motor = even * (1 - study["e0123"] / (2 * size) * PSEUDOSCALAR) / ga.sqrt(size)
    return ga.select(motor["1"] < 0, -1, 1) * motor


@kernel(a=MOTOR, b=MOTOR, returns=(SCALAR, SCALAR))
def screw_misfit(a, b):
    """By how much two motions differ that should be conjugate: the same screw about different lines.

    Returns ``sin((alpha - beta) / 2)`` of their angles, and half the difference of their translations along the axis,
    each multiplied by the sine of half the angle. Both vanish where ``a x = x b`` for some motor x (the screw
    congruence theorem; Chen, CVPR 1991). Signs of the motors do not matter, nor the sense of the pitch, which that of
    a motor decides where it turns by half a turn.
    """
    sines = [ga.sqrt(sum(m[name] * m[name] for name in ROTOR_BLADES[1:])) for m in (a, b)]
    cosines, pitches = ([ga.select(m[name] < 0, -m[name], m[name]) for m in (a, b)] for name in ("1", "e0123"))
    return cosines[1] * sines[0] - cosines[0] * sines[1], pitches[0] - pitches[1]


@kernel(a=MOTOR, b=MOTOR, x=MOTOR, returns=BIVECTOR)
def misfit(a, b, x):
    """The bivector part of ``~(x b) a x``: half of the rotation, and of the translation, that are left, negative."""
    return (~b * (~x * a * x)).grade(2)


@kernel(a=MOTOR, b=MOTOR, x=MOTOR, z=MOTOR, frame=MOTOR, returns=BIVECTOR)
def misfit_of_poses(a, b, x, z, frame):
    """The bivector part of ``~(z b) a x``, seen from a frame: half of the motion that is left, negative.

    `frame` takes that frame to the camera's; a translation is that of the frame's origin.
    """
    return (~frame * (~b * (~z * (a * x))) * frame).grade(2)


_OF_MOTIONS = [jacobian(misfit, "x", "right")]
_OF_POSES = [jacobian(misfit_of_poses, name, "right") for name in ("x", "z")]


def _rows(value, matrices):
    """Rows of derivatives with the value behind them: of the rotation, and of the translation."""
    # Tangents are along e12 e13 e23 e10 e20 e30, the coefficients of a bivector those of e01 e02 e03.
    signs = (1, 1, 1, -1, -1, -1)
    rows = [
        (*(sign * entry for matrix in matrices for sign, entry in zip(signs, matrix[k], strict=True)), value[name])
        for k, name in enumerate(BIVECTOR.blades)
    ]
    return tuple(rows[:3]), tuple(rows[3:])


@kernel(a=MOTOR, b=MOTOR, x=MOTOR, returns=(array(SCALAR, 3, 7), array(SCALAR, 3, 7)))
def misfit_equations(a, b, x):
    """Derivatives of `misfit` by the coefficients of B in ``x exp(B)``, and the misfit in the last column.

    Of the rotation, e12 e13 e23, and of the translation, e01 e02 e03.
    """
    ((value, by_x),) = (each.function(a, b, x) for each in _OF_MOTIONS)
    return _rows(value, [by_x])


@kernel(a=MOTOR, b=MOTOR, x=MOTOR, z=MOTOR, frame=MOTOR, returns=(array(SCALAR, 3, 13), array(SCALAR, 3, 13)))
def misfit_of_poses_equations(a, b, x, z, frame):
    """Derivatives of `misfit_of_poses` by B and C in ``x exp(B)`` and ``z exp(C)``, and the misfit in the last column.

    Of the rotation, e12 e13 e23, and of the translation, e01 e02 e03.
    """
    (value, by_x), (_, by_z) = (each.function(a, b, x, z, frame) for each in _OF_POSES)
    return _rows(value, [by_x, by_z])
