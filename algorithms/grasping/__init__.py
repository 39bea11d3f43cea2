"""Grasping: fuzzy controllers, and grasping guided by two cameras."""

from .fuzzy import FuzzyOutput as FuzzyOutput
from .fuzzy import Mamdani as Mamdani
from .fuzzy import grasp_controller as grasp_controller
from .fuzzy_rules import And as And
from .fuzzy_rules import Conclusion as Conclusion
from .fuzzy_rules import Is as Is
from .fuzzy_rules import Not as Not
from .fuzzy_rules import Or as Or
from .fuzzy_rules import Rule as Rule
from .fuzzy_sets import FuzzySet as FuzzySet
from .fuzzy_sets import FuzzyVariable as FuzzyVariable
from .fuzzy_status import FuzzyStatus as FuzzyStatus
from .visual_grasping import GraspSettings as GraspSettings
from .visual_grasping import GraspState as GraspState
from .visual_grasping import GraspStep as GraspStep
from .visual_grasping import VisualErrors as VisualErrors
from .visual_grasping import grasp_step as grasp_step
from .visual_grasping import visual_error as visual_error
from .visual_scene import GraspRun as GraspRun
from .visual_scene import VisualScene as VisualScene
from .visual_scene import random_scene as random_scene
from .visual_scene import simulate_grasp as simulate_grasp
from .visual_status import GraspStage as GraspStage
from .visual_status import VisualStatus as VisualStatus
