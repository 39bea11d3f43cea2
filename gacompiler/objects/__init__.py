"""Numeric multivectors for interactive use; every operation is compiled when it is first used.

>>> from gacompiler.objects import PGA3
>>> m = PGA3.motor([0, 0, 1], 0.5, 2)
>>> m >> PGA3.point(0, 0, 1)
PGA3.POINT(3 e021 + e123)
"""

from .arrays import MultivectorArray
from .builds import Builds, builds
from .conformal import CGA2, CGA3
from .draw import draw
from .euclidean import QUATERNIONS, STA, VGA2, VGA3
from .exchange import from_clifford, from_kingdon, load, save, to_clifford, to_kingdon
from .ganja import from_ganja, save_ganja, to_ganja
from .operators import build
from .projective import PGA2, PGA3
from .signature import Cl
from .spaces import Space
from .view import view

__all__ = [
    "CGA2", "CGA3", "PGA2", "PGA3", "QUATERNIONS", "STA", "VGA2", "VGA3", "Builds", "Cl", "MultivectorArray",
    "Space", "build", "builds", "draw", "from_clifford", "from_ganja", "from_kingdon", "load", "save", "save_ganja",
    "to_clifford", "to_ganja", "to_kingdon", "view",
]  # fmt: skip


def __dir__() -> list[str]:
    return sorted({*__all__, *(name for name in globals() if name.startswith("__"))})
