"""Networks and support vector machines with multivectors."""

from .clifford_svc import CliffordSVC
from .clifford_svr import CliffordSVR
from .svm_solver import MachineStatus

__all__ = ["CliffordSVC", "CliffordSVR", "MachineStatus"]
