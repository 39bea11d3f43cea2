"""Kernels under numba, for machines without a C compiler and for functions of users. Loaded when first needed."""

import importlib.util

if importlib.util.find_spec("numba") is None:
    raise ImportError("numba is not installed, which this needs; install it, or let C or array expressions run kernels")

try:
    from .kernels import Loops as Loops
    from .kernels import scalar_kernel as scalar_kernel
    from .rows import LoopRows as LoopRows
except (ImportError, AttributeError):  # numba changed what `llvm` uses of it
    from .plain import Loops as Loops  # type: ignore[assignment]
    from .plain import scalar_kernel as scalar_kernel

    LoopRows = None  # type: ignore[assignment, misc]
