"""Subspaces as blades: factorization, join and meet in any dimension; versors as reflections; splitting bivectors."""

from .bivectors import BivectorParts, split_bivectors
from .blade import Blade, FactoredBlade, factorize_blade, outer_product, reduced_factors
from .duals import delta_product, dual, metric_factors, polarity
from .elements import Classes, classify, factorize_versor, versor_coefficients
from .incidence import JoinAndMeet, join, join_and_meet, meet
from .reflections import reflections_of
from .versors import FactoredVersor

__all__ = [
    "BivectorParts",
    "Blade",
    "Classes",
    "FactoredBlade",
    "FactoredVersor",
    "JoinAndMeet",
    "classify",
    "delta_product",
    "dual",
    "factorize_blade",
    "factorize_versor",
    "join",
    "join_and_meet",
    "meet",
    "metric_factors",
    "outer_product",
    "polarity",
    "reduced_factors",
    "reflections_of",
    "split_bivectors",
    "versor_coefficients",
]
