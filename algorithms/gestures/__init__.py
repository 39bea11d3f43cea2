"""Recognition of hands: descriptors of images and of key points on which rotations act simply."""

from .classifier import HandClassifier, train_hands
from .hands import hand_descriptor, turned_descriptor
from .points import mean_of_sequence, point_features

__all__ = [
    "HandClassifier",
    "hand_descriptor",
    "mean_of_sequence",
    "point_features",
    "train_hands",
    "turned_descriptor",
]
