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
