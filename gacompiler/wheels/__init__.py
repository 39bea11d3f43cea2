"""Wheels: kernels of users as an installable package, and compiled libraries for wheels that have generated modules."""
