"""Errors in the description of a robot, all subclasses of `ValueError`, and warnings."""


class DescriptionError(ValueError):
    """A description that does not define a robot."""


class MissingInertiaError(DescriptionError):
    """Dynamics is requested for a robot with moving links whose inertia is unknown."""


class CyclicTreeError(DescriptionError):
    """Links that form a loop, or a link that two joints carry."""


class UnknownJointTypeError(DescriptionError):
    """A joint of an unknown type."""


class JointCountError(DescriptionError):
    """A number of values that does not match the number of joints, or a robot without joints."""


class NotFiniteError(DescriptionError):
    """A NaN, an infinite number or a non-numeric value where a finite number was expected."""


class FloatingBaseError(DescriptionError):
    """A method that requires a fixed base, called for a robot whose base floats; or a wrong floating base."""


class InertiaWarning(UserWarning):
    """An inertia tensor that is not physically consistent."""
