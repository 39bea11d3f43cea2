"""Networks and support vector machines with multivectors."""

from .activations import Bounded as Bounded
from .activations import Gate as Gate
from .activations import Series as Series
from .activations import Split as Split
from .algebra import Algebra as Algebra
from .base import Layer as Layer
from .equivariant import GradeLinear as GradeLinear
from .equivariant import GradeProduct as GradeProduct
from .equivariant import Invariants as Invariants
from .linear import Linear as Linear
from .linear import Rotor as Rotor
from .linear import TwoSided as TwoSided
from .network import Network as Network
from .optimizers import Adam as Adam
from .optimizers import Rprop as Rprop
from .optimizers import Sgd as Sgd
from .optimizers import cosine as cosine
from .optimizers import halving as halving
from .rounds import ConformalNeuron as ConformalNeuron
from .rounds import Hypersphere as Hypersphere
from .rounds import Radial as Radial
from .status import TrainingStatus as TrainingStatus
from .training import TrainingResult as TrainingResult
