"""A demonstration of generated kernels on real input. Run it with ``python -m algorithms.demo``."""
