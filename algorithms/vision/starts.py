"""Limits on work, and a tolerance from the noise, that all searches for poses of cameras share."""

from __future__ import annotations

STEPS = 200
"""A limit on work: the number of iterations from each start."""
SETS = 60
"""A limit on work: the number of smallest sets of items whose poses are starts, if no threshold is given."""
BEST = 12
"""A limit on work: the number of starts that are refined: the poses of a smallest set, and some more."""
ROUNDS = 10
"""A limit on work: the number of selections of inliers."""
REAL = 1e-3
"""From the noise: roots with a smaller relative imaginary part are taken to be double roots that noise has moved."""
