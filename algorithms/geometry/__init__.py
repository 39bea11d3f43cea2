"""Geometry between objects of all kinds: distances, angles, meets and projections, fits, surfaces."""

from .circles import NearestOnCircles, nearest_on_circles
from .pairs import KINDS, Meet, angle, distance, meet, project
from .versors import similarity_between, versor_between

__all__ = [
    "KINDS",
    "Meet",
    "NearestOnCircles",
    "angle",
    "distance",
    "meet",
    "nearest_on_circles",
    "project",
    "similarity_between",
    "versor_between",
]
