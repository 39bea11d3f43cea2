"""Kernels under numba, for machines without a C compiler and for functions of users. Loaded when first needed."""

try:
    from .kernels import Loops as Loops
    from .kernels import scalar_kernel as scalar_kernel
    from .rows import LoopRows as LoopRows
except (ImportError, AttributeError):  # numba changed what `llvm` uses of it
    from .plain import Loops as Loops  # type: ignore[assignment]
    from .plain import scalar_kernel as scalar_kernel

    LoopRows = None  # type: ignore[assignment, misc]
