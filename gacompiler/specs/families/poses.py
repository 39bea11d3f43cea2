"""Poses of cameras while they descend: a unit quaternion and a shift, which changes in units of its length."""

from gacompiler import sqrt
from gacompiler.specs.families.covariances import dot
from gacompiler.specs.families.two_views import applied, rotation_matrix, turned_by


def moved_pose(state, step):
    """Return the seven numbers of a pose after a step: a rotation vector and a change of the shift."""
    shift = state[4:]
    size = sqrt(dot(shift, shift))
    turned = turned_by((1, 0, 0, 0), step[:3])
    after = applied(rotation_matrix(turned), shift)
    return (*turned_by(state[:4], step[:3]), *(a + size * s for a, s in zip(after, step[3:], strict=True)))


def matrix_of_pose(state):
    """Return the rows of [R | t]."""
    return tuple((*row, s) for row, s in zip(rotation_matrix(state[:4]), state[4:], strict=True))
