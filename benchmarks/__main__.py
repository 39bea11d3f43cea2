"""The command ``python -m benchmarks``, and its subcommands."""

from __future__ import annotations

import importlib
import os
import sys

COMMANDS = (
    *("chain", "clifford_svm", "cost_models", "counts", "estimation", "grasping"),
    *("grasping_loop", "growth", "learning", "mapping", "minimal", "overview"),
    *("random_kernels", "registration", "robots", "shapes", "signals", "speech"),
    *("subspaces", "toolkit", "tracking", "vision", "visual_grasping"),
)
"""The subcommands, which are also the names of their modules. Without a subcommand, `command` runs."""


def main() -> int:
    """Run the command on one thread."""
    # The libraries read these variables when they are loaded, so the modules are imported afterwards.
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
        os.environ[name] = "1"
    words = sys.argv[1:]
    chosen = words[0] if words and words[0] in COMMANDS else None
    module = importlib.import_module(f".{chosen or 'command'}", __package__)
    status: int = module.main(words[1:] if chosen else words)
    return status


if __name__ == "__main__":
    sys.exit(main())
