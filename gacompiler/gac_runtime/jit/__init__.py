"""Kernels under numba, for machines without a C compiler and for functions of users. Loaded when first needed."""
