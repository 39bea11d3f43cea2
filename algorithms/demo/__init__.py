"""The demonstration: generated kernels at work on real input. Run it with ``python -m algorithms.demo``."""
