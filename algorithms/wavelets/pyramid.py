"""Quaternionic wavelet pyramids: the exactly invertible dual tree, and short complex filters close to Gabor's."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from generated import quaternion

from ..arguments import Reals
from .checks import image_stack
from .discrete import checked_levels
from .phase import amplitudes, quaternion_phase
from .sharing import Progress, n_threads, steps
from .tree_levels import joined, split, trees

_FIRST, _LATER = "near_sym_b", "qshift_b"
_KINDS = ("dual-tree", "gabor")
_PARTS = (0, 2, 1, 3)
"""Component of the quaternion for each of `trees`."""
_NAMES = {"H": ("high", "low"), "V": ("low", "high"), "D": ("high", "high")}
_TAPS = {
    "low": np.array([1 - 1j, 4 - 1j, 4 + 1j, 1 + 1j]) / 10,
    "high": np.array([-1 - 2j, 5 + 2j, -5 + 2j, 1 - 2j]) / 14,
}
"""Magarey and Kingsbury, *IEEE Trans. Signal Processing* 46:1069, 1998: Gaussians times waves of 0.51 and 2.4 radians
per pixel, to 1 %."""


class QuaternionPyramid:
    """The quaternionic wavelet transform of images.

    Parameters
    ----------
    image : array_like, (..., M, N)
        Real images of any size, padded as in `dual_tree`; for "gabor", the last row or column is repeated up to
        multiples of ``2**levels``. float32 is kept; integers are converted to float64.
    levels : int
        Number of levels; ``2**levels`` must not exceed the smaller size.
    kind : str
        "dual-tree": the four trees of the dual-tree transform are the components of a quaternion (Chan, Choi and
        Baraniuk, *IEEE Trans. Image Processing* 17:1069, 2008). "gabor": complex filters of four taps, close to Gabor
        filters, act along x with i from the left and along y with j from the right (Bayro-Corrochano, *J. Math. Imaging
        and Vision* 24:79, 2006); the image is extended periodically.
    workers : int, optional
        Number of threads, as in `scipy.fft`; the result does not depend on it. The kind "gabor" uses one thread.
    progress : function of (done, total), optional
        Called after each level.

    Attributes
    ----------
    approx : array, (..., m, n, 4)
        The approximation after all levels, as quaternions (w, x, y, z).
    detail : tuple of dict
        ``detail[l]["H"]``, ``["V"]`` and ``["D"]``, (..., m, n, 4), for horizontal, vertical and diagonal structures,
        finest first: each level has half the size of the previous one.
    kind : str
    size : (int, int)
        M and N.

    Raises
    ------
    TypeError, ValueError
        If `image` is not an array of finite real numbers with two axes, if `kind` is unknown, or if there are too many
        levels.
    """

    def __init__(
        self,
        image: ArrayLike,
        levels: int = 4,
        kind: str = "dual-tree",
        workers: int | None = None,
        progress: Progress | None = None,
    ) -> None:
        if kind not in _KINDS:
            raise ValueError(f"kind: {kind!r}; expected 'dual-tree' or 'gabor'")
        array = image_stack(image)
        rows, columns = array.shape[-2:]
        most = int(np.log2(min(rows, columns)))
        count = checked_levels(levels, most, f"as images of {rows} x {columns} pixels have")
        self.kind, self.size = kind, (rows, columns)
        if kind == "dual-tree":
            approx, bands = split(array, (-2, -1), count, _FIRST, _LATER, workers, progress)
            self.approx = _quaternions(approx) if count else _embedded(approx)
            # A large single allocation is served by the system in large pages.
            sizes = [level[name].size for level in bands for name in _NAMES]
            pieces = iter(np.split(np.empty(sum(sizes), array.dtype), np.cumsum(sizes, dtype=int)[:-1]))
            self.detail = tuple({name: _quaternions(level[name], next(pieces)) for name in _NAMES} for level in bands)
        else:
            padding = [(0, 0)] * (array.ndim - 2) + [(0, -n % 2**count) for n in array.shape[-2:]]
            n_threads(workers)
            planes, details = _gabor(np.pad(array, padding, "edge"), count, steps(progress, count))
            self.approx = _unpacked(planes).astype(array.dtype, copy=False)
            self.detail = tuple(
                {name: _unpacked(level[name]).astype(array.dtype, copy=False) for name in _NAMES} for level in details
            )

    def amplitude(self) -> tuple[dict[str, Reals], ...]:
        """Return the norms of the details: for each level and band, (..., m, n)."""
        return tuple({name: amplitudes(band) for name, band in level.items()} for level in self.detail)

    def phases(self) -> tuple[dict[str, Reals], ...]:
        """Return the phases phi, theta and psi of the details, (..., m, n, 3) for each band; see `quaternion_phase`."""
        return tuple(
            {name: np.stack(quaternion_phase(band)[1:4], -1) for name, band in level.items()} for level in self.detail
        )

    def inverse(self, workers: int | None = None, progress: Progress | None = None) -> Reals:
        """Return the reconstructed images, (..., M, N).

        For the dual tree, the reconstruction is exact up to rounding. For "gabor", it is the least-squares solution,
        computed by conjugate gradients to 1e-10; it is the image if no coefficient was changed.

        Parameters
        ----------
        workers : int, optional
            Number of threads, as in `scipy.fft`; the result does not depend on it. The kind "gabor" uses one thread.
        progress : function of (done, total), optional
            Called after each level; for "gabor", once at the end.

        Returns
        -------
        array, (..., M, N)

        Raises
        ------
        ArithmeticError
            If conjugate gradients do not converge in 1000 steps.
        """
        if self.kind == "dual-tree":
            if not self.detail:
                return np.ascontiguousarray(self.approx[..., 0])
            bands = [{name: _interleaved(band) for name, band in level.items()} for level in self.detail]
            return joined(_interleaved(self.approx), (-2, -1), bands, _FIRST, _LATER, self.size, workers, progress)
        n_threads(workers)
        planes = _packed(self.approx)
        details = [{name: _packed(band) for name, band in level.items()} for level in self.detail]
        shape = (*planes[0].shape[:-2], *(n * 2 ** len(details) for n in planes[0].shape[-2:]))
        levels = len(details)

        def normal(flat: NDArray[Any]) -> NDArray[Any]:
            return _adjoint(*_gabor(flat.reshape(shape), levels, steps(None, 0))).ravel()

        size = int(np.prod(shape))
        operator = scipy.sparse.linalg.LinearOperator((size, size), normal, dtype=np.float64)
        target = _adjoint(planes, details).ravel()
        solution, left = scipy.sparse.linalg.cg(operator, target, rtol=1e-12, maxiter=1000)
        if left:
            raise ArithmeticError("the least-squares solution was not found in 1000 steps of conjugate gradients")
        steps(progress, 1)()
        image = solution.reshape(shape)[..., : self.size[0], : self.size[1]]
        return np.ascontiguousarray(image, self.approx.dtype)


def _quaternions(samples: Reals, memory: Reals | None = None) -> Reals:
    """Return the four trees as components of a quaternion: i belongs to x, the first axis, and j to y."""
    shape = samples.shape
    memory = np.empty(samples.size, samples.dtype) if memory is None else memory
    q = memory.reshape(*shape[:-2], shape[-2] // 2, shape[-1] // 2, 4)
    for part, values in enumerate(trees(samples, (-2, -1))):
        q[..., _PARTS[part]] = values
    return q


def _interleaved(q: Reals) -> Reals:
    samples = np.empty((*q.shape[:-3], 2 * q.shape[-3], 2 * q.shape[-2]), q.dtype)
    for part, values in enumerate(trees(samples, (-2, -1))):
        values[...] = q[..., _PARTS[part]]
    return samples


def _embedded(image: Reals) -> Reals:
    return np.stack([image, *np.zeros((3, *image.shape), image.dtype)], -1)


Planes = tuple[NDArray[Any], NDArray[Any]]
"""The two complex images of a quaternion image, as in `quaternion.pack_two_sided`: j acts as -i and as i on them."""


def _gabor(image: Reals, levels: int, step_done: Callable[[], None]) -> tuple[Planes, list[dict[str, Planes]]]:
    planes: Planes = (image, image)
    details = []
    for _ in range(levels):
        details.append({name: _filtered(planes, words) for name, words in _NAMES.items()})
        planes = _filtered(planes, ("low", "low"))
        step_done()
    return planes, details


def _adjoint(approx: Planes, details: list[dict[str, Planes]]) -> Reals:
    """Return the adjoint of `_gabor` for half the inner product of quaternion coefficients."""
    planes = approx
    for level in details[::-1]:
        parts = [_spread(planes, ("low", "low")), *(_spread(level[name], words) for name, words in _NAMES.items())]
        planes = np.sum([part[0] for part in parts], 0), np.sum([part[1] for part in parts], 0)
    return np.asarray(planes[0].real + planes[1].real)


def _filtered(planes: Planes, words: tuple[str, str]) -> Planes:
    rows, columns = (_matrix(words[k], planes[0].shape[k - 2]) for k in range(2))
    plus, minus = planes
    return _applied(_applied(plus, rows, -2), columns.conj(), -1), _applied(_applied(minus, rows, -2), columns, -1)


def _spread(planes: Planes, words: tuple[str, str]) -> Planes:
    rows, columns = (_matrix(words[k], 2 * planes[0].shape[k - 2]).conj().T for k in range(2))
    plus, minus = planes
    return _applied(_applied(plus, rows, -2), columns.conj(), -1), _applied(_applied(minus, rows, -2), columns, -1)


def _applied(array: NDArray[Any], matrix: Any, axis: int) -> NDArray[Any]:
    moved = np.moveaxis(array, axis, 0)
    return np.moveaxis((matrix @ moved.reshape(moved.shape[0], -1)).reshape(-1, *moved.shape[1:]), 0, axis)


@lru_cache(64)
def _matrix(word: str, size: int) -> Any:
    """Return the matrix of periodic filtering followed by downsampling by 2."""
    taps = _TAPS[word]
    places = (2 * np.arange(size // 2)[:, None] + np.arange(4) - 1) % size
    rows = np.broadcast_to(np.arange(size // 2)[:, None], places.shape)
    values = np.broadcast_to(taps[::-1], places.shape)
    return scipy.sparse.csr_array((values.ravel(), (rows.ravel(), places.ravel())), (size // 2, size))


def _unpacked(planes: Planes) -> Reals:
    plus, minus = (np.asarray(np.ascontiguousarray(plane), complex)[..., None].view(float) for plane in planes)
    result: Reals = quaternion.unpack_two_sided(plus, minus)
    return result


def _packed(q: Reals) -> Planes:
    plus, minus = quaternion.pack_two_sided(q.astype(float, copy=False))
    return plus.view(complex)[..., 0], minus.view(complex)[..., 0]
