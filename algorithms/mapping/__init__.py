"""Maps from laser scans: matching, line maps, relocation and localisation."""

from .scan import Scan
from .status import MappingStatus

__all__ = ["MappingStatus", "Scan"]
