"""Networks and support vector machines with multivectors."""

from .activations import Bounded, Gate, Series, Split
from .algebra import Algebra
from .base import Layer
from .classifier import Classifier, confusion_matrix, load_classifier, train_classifier
from .clifford_svc import CliffordSVC
from .clifford_svr import CliffordSVR
from .delays import Delays, MeanOverTime
from .equivariant import GradeLinear, GradeProduct, Invariants, Norm
from .items import Attention, Dropout, Each, Messages, Residual
from .linear import Linear, Rotor, TwoSided
from .network import Network
from .optimizers import Adam, Rprop, Sgd, cosine, halving
from .particles import Interaction
from .rounds import ConformalNeuron, Hypersphere, Radial
from .status import TrainingStatus
from .svm_solver import MachineStatus
from .training import TrainingResult

__all__ = [
    "Adam",
    "Algebra",
    "Attention",
    "Bounded",
    "Classifier",
    "CliffordSVC",
    "CliffordSVR",
    "ConformalNeuron",
    "Delays",
    "Dropout",
    "Each",
    "Gate",
    "GradeLinear",
    "GradeProduct",
    "Hypersphere",
    "Interaction",
    "Invariants",
    "Layer",
    "Linear",
    "MachineStatus",
    "MeanOverTime",
    "Messages",
    "Network",
    "Norm",
    "Radial",
    "Residual",
    "Rotor",
    "Rprop",
    "Series",
    "Sgd",
    "Split",
    "TrainingResult",
    "TrainingStatus",
    "TwoSided",
    "confusion_matrix",
    "cosine",
    "halving",
    "load_classifier",
    "train_classifier",
]
