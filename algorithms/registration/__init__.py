"""Registration of point clouds, and tensor voting."""

from .vote_status import VoteStatus
from .voting import Votes, published_curvature, tensor_vote

__all__ = ["VoteStatus", "Votes", "published_curvature", "tensor_vote"]
