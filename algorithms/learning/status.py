"""Statuses of training."""

from __future__ import annotations

from ..evidence import Status


class TrainingStatus(Status):
    """How a training ended."""

    OK = 0
    """All epochs were run, or L-BFGS converged."""
    STOPPED_EARLY = 1
    """The validation loss did not decrease any more; the parameters are those of the smallest one."""
    INTERRUPTED = 2
    """The training was interrupted; the parameters are those of the last complete step."""
    DIVERGED = 3
    """The loss was not finite; the parameters are those of the smallest loss."""
    NOT_CONVERGED = 4
    """L-BFGS reached its limit of iterations, or found no descent."""
