"""Maps from laser scans: matching, line maps, relocation and localisation."""

from .matching import Match, match_scans
from .scan import Scan
from .segments import Segments, segments
from .status import MappingStatus

__all__ = ["MappingStatus", "Match", "Scan", "Segments", "match_scans", "segments"]
