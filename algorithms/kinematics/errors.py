"""What can be wrong with the description of a robot, errors that are all `ValueError`, and what is doubtful."""


class DescriptionError(ValueError):
    """A description that no robot has."""


class MissingInertiaError(DescriptionError):
    """Something that moves has no inertia, and dynamics is asked for."""


class CyclicTreeError(DescriptionError):
    """Links that carry each other in a ring, or a link that two joints carry."""


class UnknownJointTypeError(DescriptionError):
    """A joint of a type that is not known."""


class JointCountError(DescriptionError):
    """As many numbers as another robot would need, or no joint at all."""


class NotFiniteError(DescriptionError):
    """NaN, an infinite number, or what is no number, where one was expected."""


class FloatingBaseError(DescriptionError):
    """Something that is for robots with a fixed base, asked of one whose base floats."""


class InertiaWarning(UserWarning):
    """Moments of inertia that no rigid body has."""
