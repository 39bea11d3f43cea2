"""Registration of clouds of points without a guess, and tensor voting (chapter 15)."""

from .deformation import Deformation, register_deformable
from .extraction import extract_curves, extract_surface
from .extremal import Extremal
from .junctions import Junctions, extract_junctions
from .matches import MatchRegistration, register_matches, separate_motions
from .normals import Normals, estimate_normals
from .ply import Ply, read_ply
from .refinement import Refinement, refine
from .rigid import Poses, Registration, register
from .rigid_status import RegistrationStatus
from .vote_status import CurveStatus, DeformStatus, VoteStatus
from .voting import Votes, published_curvature, tensor_vote

__all__ = [
    "CurveStatus",
    "DeformStatus",
    "Deformation",
    "Extremal",
    "Junctions",
    "MatchRegistration",
    "Normals",
    "Ply",
    "Poses",
    "Refinement",
    "Registration",
    "RegistrationStatus",
    "VoteStatus",
    "Votes",
    "estimate_normals",
    "extract_curves",
    "extract_junctions",
    "extract_surface",
    "published_curvature",
    "read_ply",
    "refine",
    "register",
    "register_deformable",
    "register_matches",
    "separate_motions",
    "tensor_vote",
]
