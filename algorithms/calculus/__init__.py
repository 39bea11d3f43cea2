"""Geometric calculus in numbers: linear functions, integrals over meshes, electromagnetic fields, spinors."""
