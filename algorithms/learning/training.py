"""Training of networks, which ends with usable parameters whether it converges, is interrupted, or diverges."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy

from ..precision import TINY
from .algebra import Array
from .losses import LOSSES
from .optimizers import Adam, Optimizer, Rprop, Schedule, Sgd
from .recorded import drawn
from .status import TrainingStatus


class Trainable(Protocol):
    """What training needs of a network."""

    parameters: Array
    loss_name: str

    def forward(self, x: Array) -> list[Array]:
        """Return the input and the results of all layers."""
        ...

    def checked_gradient(self, x: Array, y: Array) -> tuple[float, Array]:
        """Return the mean loss and its gradient."""
        ...


Progress = Callable[[int, float], None]
Samples = tuple[Array, Array]


@dataclass(frozen=True, slots=True, eq=False)
class TrainingResult:
    """The outcome of a training."""

    status: TrainingStatus
    losses: Array
    """The mean loss of each epoch or iteration, during the epoch."""
    validation: Array
    """The validation loss after each epoch, if there are validation data."""


class _Kept:
    """The parameters of the smallest loss."""

    def __init__(self, parameters: Array) -> None:
        self.loss, self.parameters, self.age = np.inf, parameters.copy(), 0

    def update(self, loss: float, parameters: Array) -> None:
        self.age += 1
        if loss < self.loss:
            self.loss, self.age = loss, 0
            self.parameters[:] = parameters


_GROWTH = 1e6
"""The quotient of a loss and the smallest one, above which a training has diverged."""


def is_count(value: object) -> bool:
    """Return whether a value is a positive integer."""
    return isinstance(value, (int, np.integer)) and not isinstance(value, bool) and bool(value > 0)


def train(
    network: Trainable, x: Array, y: Array, optimizer: Optimizer | str, epochs: int, batch: int | None,
    schedule: Schedule | None, held: Samples | None, patience: int | None, decay: float, seed: int,
    progress: Progress | None, clip: float | None = None,
) -> TrainingResult:  # fmt: skip
    """Train a network on checked arrays; see `Network.fit`."""
    if not is_count(epochs) or not (batch is None or is_count(batch)):
        raise ValueError(f"epochs {epochs!r}, batch {batch!r}; expected positive integers")
    if clip is not None and not clip > 0:
        raise ValueError(f"clip: {clip}; expected a positive norm of gradients, or None")
    if optimizer == "lbfgs":
        if held is not None:
            raise ValueError("validation: given with L-BFGS, which does not select epochs; expected another optimizer")
        return _by_lbfgs(network, x, y, epochs, decay, progress)
    kinds: dict[str, type[Optimizer]] = {"sgd": Sgd, "rprop": Rprop, "adam": Adam}
    if isinstance(optimizer, str):
        if optimizer not in kinds:
            raise ValueError(f"optimizer: {optimizer!r}; expected one of {sorted([*kinds, 'lbfgs'])}")
        optimizer = kinds[optimizer]()
    size = len(x) if batch is None or isinstance(optimizer, Rprop) else batch
    random, kept = np.random.default_rng(seed), _Kept(network.parameters)
    losses: list[float] = []
    checks: list[float] = []
    status = TrainingStatus.OK
    try:
        for epoch in range(epochs):
            factor = schedule(epoch) if schedule else 1.0
            before = network.parameters
            losses.append(_epoch(network, x, y, optimizer, size, factor, decay, random, clip))
            checks.extend([LOSSES[network.loss_name](network.forward(held[0])[-1], held[1])[0]] if held else [])
            judged = checks[-1] if held else losses[-1]
            is_lost = not np.isfinite(judged) or not np.isfinite(network.parameters).all()
            if is_lost or judged > _GROWTH * kept.loss > 0:
                status = TrainingStatus.DIVERGED
                which = f"parameters of the smallest loss {kept.loss:.3g}" if np.isfinite(kept.loss) else "initial ones"
                warnings.warn(
                    f"training diverged in epoch {epoch}: loss {judged:.3g}; the {which} are kept; "
                    "use a smaller rate, or scale the samples", RuntimeWarning, stacklevel=3,
                )  # fmt: skip
                break
            # The loss during an epoch is that of earlier parameters than those after it.
            kept.update(judged, network.parameters if held else before)
            if progress:
                progress(epoch, losses[-1])
            if patience is not None and kept.age >= patience:
                status = TrainingStatus.STOPPED_EARLY
                break
    except KeyboardInterrupt:
        status = TrainingStatus.INTERRUPTED
    if status == TrainingStatus.DIVERGED or (held is not None and status != TrainingStatus.INTERRUPTED):
        network.parameters[:] = kept.parameters
    return TrainingResult(status, np.array(losses), np.array(checks))


def _epoch(
    network: Trainable, x: Array, y: Array, optimizer: Optimizer, size: int, factor: float, decay: float,
    random: np.random.Generator, clip: float | None,
) -> float:  # fmt: skip
    """Run one epoch, and return the mean loss. An interruption between steps leaves the last complete step."""
    order, total = random.permutation(len(x)), 0.0
    # Channels are left out by another stream, which does not change the order of the rows.
    (choices,) = random.spawn(1)
    with np.errstate(over="ignore", invalid="ignore"):
        for start in range(0, len(x), size):
            rows = order[start : start + size] if size < len(x) else slice(None)
            with drawn(int(choices.integers(1 << 62))):
                loss, gradient = network.checked_gradient(x[rows], y[rows])
            total += loss * len(x[rows])
            if not np.isfinite(loss):
                return np.inf
            if clip is not None:
                gradient = gradient * min(1, clip / max(float(np.linalg.norm(gradient)), TINY))
            after = network.parameters.copy()
            optimizer.step(after, gradient + decay * network.parameters, factor)
            network.parameters = after
    return total / len(x)


def _by_lbfgs(
    network: Trainable, x: Array, y: Array, iterations: int, decay: float, progress: Progress | None
) -> TrainingResult:
    """Minimise the loss of all samples by scipy's L-BFGS-B."""
    dtype, losses = network.parameters.dtype, [0.0]
    losses.clear()
    last = network.parameters.copy()

    def function(flat: Array) -> tuple[float, Array]:
        network.parameters = flat.astype(dtype)
        loss, gradient = network.checked_gradient(x, y)
        return loss + decay / 2 * float(flat @ flat), (gradient + decay * flat).astype(float)

    def report(intermediate_result: scipy.optimize.OptimizeResult) -> None:
        last[:] = intermediate_result.x
        losses.append(float(intermediate_result.fun))
        if progress:
            progress(len(losses) - 1, losses[-1])

    options = {"maxiter": iterations, "maxfun": 10 * iterations, "ftol": 1e-14, "gtol": 1e-9}
    try:
        found = scipy.optimize.minimize(
            function, last.astype(float), jac=True, method="L-BFGS-B", callback=report, options=options
        )
    except KeyboardInterrupt:
        network.parameters = last
        return TrainingResult(TrainingStatus.INTERRUPTED, np.array(losses), np.zeros(0))
    network.parameters = found.x.astype(dtype)
    if not np.isfinite(found.fun):
        network.parameters = last
        warnings.warn(
            "training diverged; the last parameters with a finite loss are kept", RuntimeWarning, stacklevel=4
        )
        return TrainingResult(TrainingStatus.DIVERGED, np.array(losses), np.zeros(0))
    status = TrainingStatus.OK if found.success else TrainingStatus.NOT_CONVERGED
    return TrainingResult(status, np.array(losses), np.zeros(0))
