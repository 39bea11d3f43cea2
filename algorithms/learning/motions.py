"""Recordings of accelerometers and gyroscopes as multivectors, and a classifier invariant under rotations."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np

from .activations import Split
from .algebra import Array
from .equivariant import Invariants
from .linear import Linear
from .network import Network


def read_series(path: str | Path) -> tuple[Array, list[str]]:
    """Read a file in the format .ts, also compressed: (recordings, dimensions, times), and the classes."""
    opened = gzip.open if str(path).endswith(".gz") else open
    with opened(path, "rt") as file:
        lines = [line.strip() for line in file if line.strip() and line[0] not in "#@"]
    parts = [line.split(":") for line in lines]
    values = [[[float(number) for number in row.split(",")] for row in part[:-1]] for part in parts]
    return np.array(values), [part[-1] for part in parts]


def spectra(recordings: Array, scale: float = 30.0) -> Array:
    """Return Fourier coefficients over time as elements of G(3), (recordings, 2 frequencies, 8).

    Accelerations are vectors, and angular velocities are bivectors. The real and imaginary part of a frequency are
    neighbouring channels. Rotations of the sensors act on all channels alike. The mean is left out.
    """
    coefficients = np.fft.rfft(recordings, axis=-1)[..., 1:] / scale
    parts = np.stack([coefficients.real, coefficients.imag], -1).reshape(*recordings.shape[:2], -1).transpose(0, 2, 1)
    found = np.zeros((*parts.shape[:2], 8))
    found[..., 1:4] = parts[..., :3]
    # The bivectors e12, e13 and e23 of rotations about z, -y and x.
    found[..., 4], found[..., 5], found[..., 6] = parts[..., 5], -parts[..., 4], parts[..., 3]
    return found


def classifier(frequencies: int, classes: int, *, bands: int = 5, hidden: int = 16, seed: int = 0) -> Network:
    """Return a network of `spectra` whose logits are invariant under rotations of the sensors."""
    layers = [Invariants(2 * frequencies // bands), Linear(hidden), Split("tanh"), Linear(classes)]
    return Network(layers, "G(3)", 2 * frequencies, seed=seed, loss="entropy")
