"""The command ``python -m benchmarks``, and the pages that may be named after it."""

from __future__ import annotations

import importlib
import os
import sys

COMMANDS = ("chain", "counts", "growth", "overview", "robots", "signals", "subspaces", "toolkit", "vision")
"""What may stand after ``benchmarks``, the modules that do it; without one of them, times are measured."""


def main() -> int:
    """Run the command on one thread: the libraries read these variables when they are loaded, so not before."""
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
        os.environ[name] = "1"
    words = sys.argv[1:]
    chosen = words[0] if words and words[0] in COMMANDS else None
    module = importlib.import_module(f".{chosen or 'command'}", __package__)
    status: int = module.main(words[1:] if chosen else words)
    return status


if __name__ == "__main__":
    sys.exit(main())
