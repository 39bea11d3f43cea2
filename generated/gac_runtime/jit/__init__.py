"""Kernels compiled by numba, for machines without a C compiler and for functions of users. Imported on first use."""

import importlib.util

if importlib.util.find_spec("numba") is None:
    raise ImportError("numba is not installed; install it, or use the C backend or array expressions")

try:
    from .compiled import Loops as Loops
    from .compiled import scalar_kernel as scalar_kernel
    from .rows import LoopRows as LoopRows
except (ImportError, AttributeError):  # this release of numba lacks internals that `llvm` uses
    from .plain import Loops as Loops  # type: ignore[assignment]
    from .plain import scalar_kernel as scalar_kernel

    LoopRows = None  # type: ignore[assignment, misc]
