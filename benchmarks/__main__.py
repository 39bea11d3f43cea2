"""The command ``python -m benchmarks``."""

from __future__ import annotations

import os
import sys


def main() -> int:
    """Run the command on one thread: the libraries read these variables when they are loaded, so not before."""
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
        os.environ[name] = "1"
    from .command import main

    return main()


if __name__ == "__main__":
    sys.exit(main())
