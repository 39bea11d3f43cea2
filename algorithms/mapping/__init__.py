"""Maps from laser scans: matching, line maps, relocation and localisation; formats of maps and trajectories."""

from .building import build_map
from .built_map import BuildSettings, BuiltMap, MapStep, Progress, ScanStatus
from .carmen import CarmenLog, Problem, Reading
from .export_3d import write_ply, write_svg
from .floor_plans import FloorPlan, RecallPrecision, load_floor_plan, wall_recall_precision
from .following import Command, FollowSettings, follow
from .g2o import PoseGraphFile, read_g2o
from .g2o_space import SpaceGraphFile, read_g2o_space, write_g2o
from .lidar_odometry import LidarOdometry
from .line_map import LineMap, LineMapUpdate, same_wall
from .line_views import View, seen_through
from .localization import LineLocalizer, LocalizationSettings
from .map_3d import (
    Map3D,
    Solid,
    SolidKind,
    pose_in_space,
    stereo_lines,
    stereo_points,
    vertical_planes,
)
from .mapper import Mapper
from .matching import Match, match_scans
from .named_columns import read_columns, write_columns
from .navigation_run import NavigationRun, simulate_following
from .navigation_status import FitStatus, FollowStatus, LocalizationStatus, PathStatus, PlanStatus
from .objects import MapObject, ObjectDistance, ObjectFit, ObjectKind, ObjectMap, fit_box, fit_circle
from .occupancy_grids import OccupancyGrid, read_occupancy_grid, write_occupancy_grid
from .paths import Located, PlanarPath
from .pose_graph import GraphStatus, OptimisedPoses, optimise_poses
from .relocation import Hypothesis, Relocation, relocate
from .relocator import Relocator
from .scan import Scan
from .scan_factors import add_scans
from .scan_simulation import Odometry, Scanner, SimulatedLog, SimulatedScan, simulate_log, simulate_scan
from .segments import Segments, segments
from .solids import SolidFit, fit_solid
from .status import MappingStatus
from .trajectories import (
    InertialRecording,
    Trajectory,
    read_euroc,
    read_euroc_inertial,
    read_tum,
    write_euroc,
    write_tum,
)

__all__ = [
    "BuildSettings",
    "BuiltMap",
    "CarmenLog",
    "Command",
    "FitStatus",
    "FloorPlan",
    "FollowSettings",
    "FollowStatus",
    "GraphStatus",
    "Hypothesis",
    "InertialRecording",
    "LidarOdometry",
    "LineLocalizer",
    "LineMap",
    "LineMapUpdate",
    "LocalizationSettings",
    "LocalizationStatus",
    "Located",
    "Map3D",
    "MapObject",
    "MapStep",
    "Mapper",
    "MappingStatus",
    "Match",
    "NavigationRun",
    "ObjectDistance",
    "ObjectFit",
    "ObjectKind",
    "ObjectMap",
    "OccupancyGrid",
    "Odometry",
    "OptimisedPoses",
    "PathStatus",
    "PlanStatus",
    "PlanarPath",
    "PoseGraphFile",
    "Problem",
    "Progress",
    "Reading",
    "RecallPrecision",
    "Relocation",
    "Relocator",
    "Scan",
    "ScanStatus",
    "Scanner",
    "Segments",
    "SimulatedLog",
    "SimulatedScan",
    "Solid",
    "SolidFit",
    "SolidKind",
    "SpaceGraphFile",
    "Trajectory",
    "View",
    "add_scans",
    "build_map",
    "fit_box",
    "fit_circle",
    "fit_solid",
    "follow",
    "load_floor_plan",
    "match_scans",
    "optimise_poses",
    "pose_in_space",
    "read_columns",
    "read_euroc",
    "read_euroc_inertial",
    "read_g2o",
    "read_g2o_space",
    "read_occupancy_grid",
    "read_tum",
    "relocate",
    "same_wall",
    "seen_through",
    "segments",
    "simulate_following",
    "simulate_log",
    "simulate_scan",
    "stereo_lines",
    "stereo_points",
    "vertical_planes",
    "wall_recall_precision",
    "write_columns",
    "write_euroc",
    "write_g2o",
    "write_occupancy_grid",
    "write_ply",
    "write_svg",
    "write_tum",
]
