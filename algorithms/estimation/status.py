"""Statuses of estimates from recordings and measurements."""

from __future__ import annotations

from ..evidence import Status


class EstimationStatus(Status):
    """Whether measurements determine an estimate, and whether they agree with it."""

    OK = 0
    UNOBSERVED = 1
    """The measurements so far leave some direction of the state undetermined; the prior alone fixes it."""
    SKIPPED = 2
    """No number of the last measurement is finite, or nothing was measured; the estimate is that before it."""
    REJECTED = 3
    """The last measurement was left out because its innovation exceeds the gate."""
    INCONSISTENT = 4
    """The last measurement was used, but its innovation is far larger than the covariance permits, or most of what was
    measured lately was left out."""
    NOT_CONVERGED = 5
    """The linearisations of the last update did not converge, or are not finite; the estimate is that before it."""
    NOT_DEFINITE = 6
    """A covariance was not positive definite; the nearest one that is was used instead."""
    BAD_TIME = 7
    """A time step is negative or not finite; nothing was predicted."""
    AMBIGUOUS = 8
    """Several estimates agree with the measurements so far, which cannot separate them."""
