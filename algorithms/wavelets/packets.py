"""Wavelet packets: transforms that also divide the details, and the basis of packets with the least cost."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import Reals
from .discrete import analysis, checked_signal, divided, joined, synthesis
from .sharing import Progress, n_threads, steps

Cost = Callable[[Reals], float]


def _entropy(shares: Reals) -> float:
    """The entropy of the coefficients, as shares of the energy."""
    energy = shares[shares > 0]
    return -float((energy * np.log(energy)).sum())


def _sum_of_sizes(shares: Reals) -> float:
    return float(np.sqrt(shares).sum())


COSTS: dict[str, Cost] = {"entropy": _entropy, "l1": _sum_of_sizes}


@dataclass(frozen=True)
class WaveletPackets:
    """Result of `wavelet_packets`.

    Attributes
    ----------
    nodes : dict of str to array
        The coefficients of all packets. The key is the path from the signal, "": signals are divided into "a" (smooth)
        and "d" (detail), and images into "a", "h", "v" and "d"; packets of more axes have one letter per axis and
        level, as in "aad".
    wavelet, mode : str
    axes : tuple of int
    levels : int
    """

    nodes: dict[str, Reals]
    wavelet: str
    mode: str
    axes: tuple[int, ...]
    levels: int

    def paths(self, level: int | None = None) -> tuple[str, ...]:
        """Return the packets of a level, by default the last, ordered by the frequencies along the axes.

        A filter reverses the order of the frequencies of the details, so this order differs from that of the paths.
        """
        chosen = self.levels if level is None else level
        found = [path for path in self.nodes if len(path) == chosen * self._letters]
        return tuple(sorted(found, key=self.band))

    def band(self, path: str) -> tuple[int, ...]:
        """Return the number of the band of frequencies along each axis, from 0 to ``2**level - 1``."""
        bands = [0] * len(self.axes)
        for word in self._words(path):
            # Each detail reverses the halves of the next level: a Gray code.
            bands = [2 * band + ((letter == "d") != (band % 2 == 1)) for band, letter in zip(bands, word, strict=True)]
        return tuple(bands)

    def best_basis(self, cost: str | Cost = "entropy") -> tuple[str, ...]:
        """Return the paths of the basis of packets whose total cost is least.

        Parameters
        ----------
        cost : str or function
            "entropy": that of the squared coefficients as shares of the energy; "l1": the sum of absolute coefficients;
            or a function of an array of the squared coefficients, as shares of the energy. Costs of packets are added.

        Returns
        -------
        tuple of str
            A basis for `inverse`, ordered as the nodes of a tree. If costs are equal, packets are not divided.

        Raises
        ------
        ValueError
            If the name of the cost is unknown.

        Notes
        -----
        Coifman and Wickerhauser, *IEEE Trans. Information Theory* 38:713, 1992. The least cost is exact for additive
        costs; the search computes each cost once.
        """
        if isinstance(cost, str) and cost not in COSTS:
            raise ValueError(f"cost: {cost!r}; expected a function, {' or '.join(map(repr, COSTS))}")
        function = COSTS[cost] if isinstance(cost, str) else cost
        energy = float((self.nodes[""].astype(float) ** 2).sum()) or 1.0

        def best(path: str, level: int) -> tuple[float, tuple[str, ...]]:
            own = function(np.ravel(self.nodes[path].astype(float) ** 2 / energy))
            if level == self.levels:
                return own, (path,)
            parts = [best(path + name, level + 1) for name in self._names()]
            total = sum(part[0] for part in parts)
            return (total, sum((part[1] for part in parts), ())) if total < own else (own, (path,))

        return best("", 0)[1]

    def inverse(self, paths: Iterable[str] | None = None, workers: int | None = None) -> Reals:
        """Return the signals from the packets of a basis, exact up to rounding if no coefficient was changed.

        Parameters
        ----------
        paths : sequence of str, optional
            A basis: every part of the signal is in one of these packets. The default are those of the last level.
        workers : int, optional
            Number of threads, as in `scipy.fft`; the result does not depend on it.

        Returns
        -------
        array, of the shape of the signals

        Raises
        ------
        ValueError
            If packets are missing, or overlap.
        """
        chosen = set(self.paths() if paths is None else paths)
        n_threads(workers)
        used = set()

        def reconstructed(path: str, level: int) -> Reals:
            if path in chosen:
                used.add(path)
                return self.nodes[path]
            if level == self.levels:
                raise ValueError(f"paths: no packet contains {path!r}; expected a basis, as `best_basis` returns")
            parts = {name: reconstructed(path + name, level + 1) for name in self._names()}
            sizes = self.nodes[path].shape

            def join(low: Reals, high: Reals, axis: int) -> Reals:
                return synthesis(low, high, self.wavelet, self.mode, axis, sizes[axis], workers)

            approx = parts.pop(_short("a" * len(self.axes)))
            return joined(approx, {_long(name): part for name, part in parts.items()}, self.axes, join)

        result = reconstructed("", 0)
        if used != chosen:
            raise ValueError(f"paths: {min(chosen - used)!r}; expected packets that do not overlap, of this transform")
        return result.copy() if used == {""} else result

    @property
    def _letters(self) -> int:
        return 1 if len(self.axes) < 3 else len(self.axes)

    def _names(self) -> list[str]:
        return [_short("".join(word)) for word in product("ad", repeat=len(self.axes))]

    def _words(self, path: str) -> list[str]:
        """Return one letter per axis for each level."""
        step = self._letters
        names = [path[k : k + step] for k in range(0, len(path), step)]
        return [_IMAGES[name] for name in names] if len(self.axes) == 2 else names


_IMAGES = {"a": "aa", "h": "da", "v": "ad", "d": "dd"}
"""Words of the names of the packets of images."""


def _short(word: str) -> str:
    return next((name for name, other in _IMAGES.items() if other == word), word)


def _long(name: str) -> str:
    """Return the name of details in `divided`."""
    return name.upper() if len(name) == 1 else name


def wavelet_packets(
    signal: ArrayLike,
    wavelet: str = "db4",
    levels: int | None = None,
    mode: str = "symmetric",
    axes: tuple[int, ...] | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
) -> WaveletPackets:
    """Compute all wavelet packets of signals; `WaveletPacket` of PyWavelets.

    Parameters
    ----------
    signal, wavelet, levels, mode, axes, workers
        As in `discrete_wavelet`.
    progress : function of (done, total), optional
        Called after each level.

    Returns
    -------
    WaveletPackets
        The packets of all levels, which have ``levels + 1`` times as many numbers as the signal, and more at the
        boundaries unless the mode is "periodization".

    Raises
    ------
    TypeError, ValueError
        As in `discrete_wavelet`.

    Notes
    -----
    Coefficients agree with PyWavelets to 1e-10 of the largest number. Orthogonal wavelets with the mode "periodization"
    give orthonormal bases, for sizes that are multiples of ``2**levels``.
    """
    array, chosen, count = checked_signal(signal, wavelet, levels, mode, axes)
    n_threads(workers)
    step_done = steps(progress, count)
    nodes, parents = {"": array}, [""]
    for _ in range(count):
        children = []
        for path in parents:
            low, bands = divided(nodes[path], chosen, lambda band, axis: analysis(band, wavelet, mode, axis, workers))
            for name, band in {"a" * len(chosen): low, **bands}.items():
                children.append(path + _short(name if len(name) > 1 else name.lower()))
                nodes[children[-1]] = band
        parents = children
        step_done()
    return WaveletPackets(nodes, wavelet, mode, chosen, count)
