"""Registration of point clouds, and tensor voting."""

from .deformation import Deformation, register_deformable
from .extraction import Extremal, extract_curves, extract_surface
from .normals import Normals, estimate_normals
from .ply import Ply, read_ply
from .vote_status import DeformStatus, VoteStatus
from .voting import Votes, published_curvature, tensor_vote

__all__ = [
    "DeformStatus",
    "Deformation",
    "Extremal",
    "Normals",
    "Ply",
    "VoteStatus",
    "Votes",
    "estimate_normals",
    "extract_curves",
    "extract_surface",
    "published_curvature",
    "read_ply",
    "register_deformable",
    "tensor_vote",
]
