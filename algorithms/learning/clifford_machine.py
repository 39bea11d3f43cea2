"""What Clifford support vector machines for classes and for multivectors share: parameters, training, and values."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from ..arguments import coordinates
from ..elements import Coefficients
from .all_blades import Samples, restorer, with_all_blades
from .blade_signs import Signs, blade_signs, signs_of_algebra
from .estimators import Estimator, checked_samples, convergence_warning, is_number
from .gram import GramRows, check_definite, check_finite
from .smo import Problem
from .svm_kernels import Floats, Kernel, KernelSettings, kernel_named, precomputed_kernel
from .svm_solver import MachineStatus, Solution, solve

_LARGEST_CHECK = 5000
"""A limit on work: rows up to which the Gram matrix of a kernel that may be indefinite is examined."""
_BLOCK = 1 << 20
"""Number of coefficients of kernels that are computed at a time for predictions."""


class CliffordMachine(Estimator):
    """A support vector machine whose values are multivectors; see `CliffordSVC` and `CliffordSVR`."""

    kernel: Any
    C: float
    gamma: Any
    degree: int
    coef0: float
    frequency: Any
    algebra: Any
    tol: float
    max_iter: int
    shrinking: bool
    cache_size: float

    def _samples(self, x: object) -> Floats:
        self._check_parameters()
        return checked_samples(
            self._plain(x, "X"), None if self.algebra is None else signs_of_algebra(self.algebra).size
        )

    def _plain(self, value: Any, name: str) -> Any:
        """Return elements of the algebra with all blades; without an algebra, points and vectors as coordinates."""
        if self.algebra is None:
            return coordinates(value, name, (-1,), "vectors")
        p, q, *_ = self.algebra
        return with_all_blades(value, name, (p, q, 0), np.arange(signs_of_algebra(self.algebra).size))

    def _like(self, x: Any, values: Floats) -> Any:
        """Return values with all blades as elements if `x` has elements of the algebra."""
        if self.algebra is None or values.shape[1:] != (signs_of_algebra(self.algebra).size,):
            return values
        p, q, *_ = self.algebra
        return restorer(x, (p, q, 0), np.arange(values.shape[-1]))(values)

    def _train(self, samples: Floats, targets: Floats, lower: Floats, upper: Floats, width: float) -> Solution:
        """Solve the dual problem of targets (m, n), and set the attributes of the fitted machine."""
        m = len(targets)
        signs = self._signs(m)
        self._kernel = self._kernel_for(samples, signs)
        own = samples
        if self._is_precomputed:
            if samples.ndim > 2 or len(samples) != samples.shape[1]:
                raise ValueError(f"X: shape {samples.shape}; expected a square matrix (n, n) for kernel='precomputed'")
            own = np.arange(float(len(samples)))[:, None]
        rows = GramRows(self._kernel, own, self.cache_size)
        if not self._kernel.is_definite:
            count = len(samples) * (1 if rows.size == 1 else m)
            if count > _LARGEST_CHECK:
                raise ValueError(
                    f"kernel: {self.kernel!r} may be indefinite, and {count} variables are too many to check; "
                    f"expected at most {_LARGEST_CHECK}"
                )
            check_definite(rows, m, signs)
        check_finite(rows.diagonal)
        problem = Problem(rows, signs, targets, lower, upper, width)
        found = solve(problem, float(self.tol), int(self.max_iter), bool(self.shrinking))
        used = np.flatnonzero(found.signed.any(0))
        self.support_ = used
        self.support_vectors_ = samples[used[:0] if self._is_precomputed else used]
        self.dual_coef_ = found.signed[:, used]
        self.intercept_ = found.intercept
        self.n_iter_ = found.steps
        self.status_ = found.status
        self.gap_ = found.gap
        self.dual_objective_ = found.objective
        self._blades = signs
        self._weights = _weights(self.dual_coef_, rows.size, signs)
        if found.status is not MachineStatus.OK:
            warnings.warn(
                f"{type(self).__name__} has not converged after {found.steps} steps: violation {found.gap:.2g}, "
                f"tolerance {self.tol:g}; increase max_iter, scale the features, or decrease C",
                convergence_warning(), stacklevel=3,
            )  # fmt: skip
        return found

    def _values(self, x: object) -> Floats:
        """Return the components (n, m) of the machine's values."""
        self._check_fitted()
        samples = self._samples(x)
        self._compare_features(x, samples)
        if samples.shape[1:] != self.support_vectors_.shape[1:]:
            raise ValueError(f"X: shape {samples.shape}; expected (n, {self.support_vectors_.shape[1:]}) as in fit")
        if not len(self.support_):
            return np.tile(self.intercept_, (len(samples), 1))
        if self._kernel.is_linear:
            return np.asarray(samples @ self.coef_.T + self.intercept_)
        found = np.empty((len(samples), len(self.intercept_)))
        span = max(1, _BLOCK // len(self._weights))
        for start in range(0, len(samples), span):
            some = samples[start : start + span]
            if self._is_precomputed:
                kernels = some[:, self.support_]
            else:
                kernels = self._kernel.values(some, self.support_vectors_)
            found[start : start + span] = kernels.reshape(len(some), -1) @ self._weights + self.intercept_
        return found

    @property
    def coef_(self) -> Floats:
        """The weights of features (m, d), for linear kernels of real samples."""
        self._check_fitted()
        if not self._kernel.is_linear:
            raise AttributeError("coef_ is only available when using a linear kernel of real samples")
        return np.asarray(self.dual_coef_ @ self.support_vectors_)

    @property
    def _is_precomputed(self) -> bool:
        return isinstance(self.kernel, str) and self.kernel == "precomputed"

    def multivectors(self, X: Samples) -> Coefficients:
        """Return the values of the machine as multivectors (n, 2**k), with coefficients ordered by bitmap.

        If the samples are elements of the algebra, the values are too.
        """
        values = self._values(X)
        found = np.zeros((len(values), self._blades.size))
        found[:, : values.shape[1]] = values
        return self._like(X, found)

    def __getstate__(self) -> dict[str, Any]:
        state = self.__dict__.copy()
        state.pop("_kernel", None)
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        if "_settings" in state:
            self._kernel = self._kernel_of(self.support_vectors_)

    def _signs(self, m: int) -> Signs:
        if self.algebra is None:
            return blade_signs(0, max(1, (m - 1).bit_length()))
        found = signs_of_algebra(self.algebra)
        if found.size < m:
            raise ValueError(f"algebra: {self.algebra!r} has {found.size} components; expected at least {m}")
        return found

    def _kernel_for(self, samples: Floats, signs: Signs) -> Kernel:
        flat = samples.reshape(len(samples), -1)
        gamma = self.gamma
        if isinstance(gamma, str) and gamma == "scale":
            variance = float(flat.var())
            gamma = 1 / (flat.shape[1] * variance) if variance > 0 else 1.0
        elif isinstance(gamma, str) and gamma == "auto":
            gamma = 1 / flat.shape[1]
        elif not is_number(gamma) or gamma <= 0:
            raise ValueError(f"gamma: {gamma!r}; expected 'scale', 'auto' or a positive number")
        try:
            wave = np.asarray(self.frequency, float)
        except (TypeError, ValueError):
            wave = np.full((), np.nan)
        if not np.isfinite(wave).all():
            raise ValueError(f"frequency: {self.frequency!r}; expected finite numbers")
        if wave.ndim == 0:
            wave = np.full(flat.shape[1], float(wave) / np.sqrt(flat.shape[1]))
        if wave.reshape(-1).shape != flat.shape[1:]:
            raise ValueError(f"frequency: shape {wave.shape}; expected a number, or {samples.shape[1:]}")
        self._settings = KernelSettings(float(gamma), int(self.degree), float(self.coef0), wave.reshape(-1), signs)
        return self._kernel_of(samples)

    def _kernel_of(self, samples: Floats) -> Kernel:
        if self._is_precomputed:
            return precomputed_kernel(samples)
        return kernel_named(self.kernel, self._settings, samples.ndim == 3)

    def _check_parameters(self) -> None:
        for name in ("C", "tol", "cache_size"):
            value = getattr(self, name)
            if not is_number(value) or value <= 0:
                raise ValueError(f"{name}: {value!r}; expected a positive number")
        for name, least in (("degree", 1), ("max_iter", -1)):
            value = getattr(self, name)
            if not isinstance(value, (int, np.integer)) or value < least:
                raise ValueError(f"{name}: {value!r}; expected an integer of at least {least}")


def _weights(signed: Floats, size: int, signs: Signs) -> Floats:
    """Return the matrix (size * samples, m) that maps rows of kernels ``K(x, x_k)`` to values of components."""
    m, n = signed.shape
    if size == 1:
        return np.ascontiguousarray(signed.T)
    blade, sign = signs.pairs(m)
    found = np.zeros((size, n, m))
    for j in range(m):
        for k in range(m):
            found[blade[j, k], :, j] += sign[j, k] * signed[k]
    return found.reshape(size * n, m)
