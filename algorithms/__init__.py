"""Algorithms of geometric computing on generated kernels."""
