"""Registration of clouds of points without a guess, and tensor voting (chapter 15)."""

from .matches import MatchRegistration, register_matches, separate_motions
from .refinement import Refinement, refine
from .rigid import Poses, Registration, register
from .rigid_status import RegistrationStatus

__all__ = [
    "MatchRegistration",
    "Poses",
    "Refinement",
    "Registration",
    "RegistrationStatus",
    "refine",
    "register",
    "register_matches",
    "separate_motions",
]
