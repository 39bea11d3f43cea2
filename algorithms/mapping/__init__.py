"""Maps from laser scans: matching, line maps, relocation and localisation."""

from .building import build_map
from .built_map import BuildSettings, BuiltMap, Progress, ScanStatus
from .carmen import CarmenLog, Problem, Reading
from .g2o import PoseGraphFile, read_g2o
from .line_map import LineMap, LineMapUpdate, same_wall
from .line_views import View, seen_through
from .matching import Match, match_scans
from .pose_graph import GraphStatus, OptimisedPoses, optimise_poses
from .relocation import Hypothesis, Relocation, relocate
from .scan import Scan
from .segments import Segments, segments
from .status import MappingStatus

__all__ = [
    "BuildSettings",
    "BuiltMap",
    "CarmenLog",
    "GraphStatus",
    "Hypothesis",
    "LineMap",
    "LineMapUpdate",
    "MappingStatus",
    "Match",
    "OptimisedPoses",
    "PoseGraphFile",
    "Problem",
    "Progress",
    "Reading",
    "Relocation",
    "Scan",
    "ScanStatus",
    "Segments",
    "View",
    "build_map",
    "match_scans",
    "optimise_poses",
    "read_g2o",
    "relocate",
    "same_wall",
    "seen_through",
    "segments",
]
