"""Benchmarks of the compiler and of its kernels, compared with other libraries: ``python -m benchmarks``."""
