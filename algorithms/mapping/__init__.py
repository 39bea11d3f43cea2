"""Maps from laser scans: matching, line maps, relocation and localisation."""

from .matching import Match, match_scans
from .relocation import Hypothesis, Relocation, relocate
from .scan import Scan
from .segments import Segments, segments
from .status import MappingStatus

__all__ = [
    "Hypothesis",
    "MappingStatus",
    "Match",
    "Relocation",
    "Scan",
    "Segments",
    "match_scans",
    "relocate",
    "segments",
]
