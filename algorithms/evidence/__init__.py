"""One theory of evidence for all estimators: noise, chance, consensus, ambiguity, observability, gates and statuses."""

from .ambiguity import differ, largest_likely, likely, likely_bounds
from .chance import (
    Freedom,
    by_chance,
    least_by_chance,
    log_choices,
    log_false_alarms,
    share_of,
    surely_not_by_chance,
)
from .consensus import (
    Consensus,
    Hypothesis,
    Problem,
    check_sampling,
    consensus,
    explained_by_chance,
    near_by_chance,
    polished,
    unrelated,
)
from .gates import certain_deviations, gate_of, is_lost
from .least_squares import Minima, minima
from .noise import Noise, deviation_of_most, explains, growth_by_threshold, largest_ratio
from .observability import rank, spectrum, undetermined
from .sampling import Seed, all_or_some_sets, checked_scores, random_sets, random_subsets
from .status import WRONG, Status

__all__ = [
    "WRONG",
    "Consensus",
    "Freedom",
    "Hypothesis",
    "Minima",
    "Noise",
    "Problem",
    "Seed",
    "Status",
    "all_or_some_sets",
    "by_chance",
    "certain_deviations",
    "check_sampling",
    "checked_scores",
    "consensus",
    "deviation_of_most",
    "differ",
    "explained_by_chance",
    "explains",
    "gate_of",
    "growth_by_threshold",
    "is_lost",
    "largest_likely",
    "largest_ratio",
    "least_by_chance",
    "likely",
    "likely_bounds",
    "log_choices",
    "log_false_alarms",
    "minima",
    "near_by_chance",
    "polished",
    "random_sets",
    "random_subsets",
    "rank",
    "share_of",
    "spectrum",
    "surely_not_by_chance",
    "undetermined",
    "unrelated",
]
