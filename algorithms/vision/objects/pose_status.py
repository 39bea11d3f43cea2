"""Statuses of the poses of objects."""

from __future__ import annotations

from ...evidence import Status


class PoseStatus(Status):
    """Whether images determine the pose of an object, or why not."""

    OK = 0
    """Errors are below the tolerance, with cameras and a model that are known as well as `SharedErrors` states. One
    image rarely shows a wrong focal length or distortion: by default both are taken as exact."""
    SYMMETRIC = 1
    """The pose is determined up to motions that change no image, such as turns of a cylinder: see `freedoms`."""
    AMBIGUOUS = 2
    """Another pose explains the images as well, within the noise: see `alternatives`."""
    TOO_FEW = 3
    """There are fewer measurements than the six unknowns require."""
    OCCLUDED = 4
    """Elements of the object are not seen, and the others are too few."""
    BEHIND_CAMERA = 5
    """The object is behind a camera."""
    UNDETERMINED = 6
    """There are enough measurements, but a motion changes none of them to first order."""
    INCONSISTENT = 7
    """Residuals are larger than the noise explains, or too many measurements are rejected."""
    UNCERTAIN = 8
    """The pose is the best one, but the bounds of its errors are larger than the tolerance."""
    NOT_CONVERGED = 9
    """The iterations ended before they reached a minimum."""
    NOT_FINITE = 10
    """A measurement is infinite."""
    UNEXPLAINED = 11
    """The distances follow another focal length, a distortion, another size of the object or another place of one of
    several cameras more than noise: a camera or the model is not what it is taken for."""
