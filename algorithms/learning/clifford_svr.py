"""Clifford support vector machines for regression with multivector values."""

from __future__ import annotations

from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import as_given
from ..elements import Coefficients
from .all_blades import Samples, Targets
from .clifford_machine import CliffordMachine
from .estimators import checked_weights, is_number, warn_column
from .svm_kernels import Floats


class CliffordSVR(CliffordMachine):
    """Support vector regression with values in a geometric algebra, and a tube around each component.

    The interface is that of scikit-learn's regressors, with several outputs.

    Parameters
    ----------
    kernel, C, gamma, degree, coef0, frequency, algebra, tol, max_iter, shrinking, cache_size
        As in `CliffordSVC`.
    epsilon : float
        The half width of the tube, in which errors have no penalty.

    Attributes
    ----------
    support_, support_vectors_, dual_coef_, coef_, intercept_, n_iter_, status_, gap_, dual_objective_
        As in `CliffordSVC`.
    """

    def __init__(
        self, kernel: Any = "scalar", C: float = 1.0, epsilon: float = 0.1, gamma: Any = "scale", degree: int = 3,
        coef0: float = 1.0, frequency: Any = 1.0, algebra: Any = None, tol: float = 1e-6, max_iter: int = -1,
        shrinking: bool = True, cache_size: float = 200.0,
    ) -> None:  # fmt: skip
        self.kernel, self.C, self.epsilon, self.gamma, self.degree = kernel, C, epsilon, gamma, degree
        self.coef0, self.frequency, self.algebra, self.tol = coef0, frequency, algebra, tol
        self.max_iter, self.shrinking, self.cache_size = max_iter, shrinking, cache_size

    def fit(self, X: Samples, y: Targets, sample_weight: ArrayLike | None = None) -> Self:
        """Fit the machine to samples and targets (n,), or components of multivectors (n, m) ordered by bitmap.

        The penalties of errors are multiplied by the weights of samples.

        Parameters
        ----------
        X : array or sparse matrix, (n, d) or (n, d, 2**k), or elements, (n, d)
            The samples, or with the kernel "precomputed" their Gram matrix (n, n).
        y : array, (n,) or (n, m), or elements, (n,)
            The targets. Elements of `algebra` have all of its blades.
        sample_weight : float or array, (n,), optional
            Factors of `C`, 1 by default.

        Raises
        ------
        ValueError, TypeError
            If the samples or targets cannot be used, or the kernel is not positive definite.

        Warns
        -----
        ConvergenceWarning
            If the tolerance has not been reached.
        """
        if not is_number(self.epsilon) or self.epsilon < 0:
            raise ValueError(f"epsilon: {self.epsilon!r}; expected a number of at least 0")
        samples = self._samples(X)
        targets = _checked_targets(self._plain(y, "y"), len(samples))
        self._is_flat = targets.ndim == 1
        rows = np.ascontiguousarray(np.atleast_2d(targets.T))
        bound = np.broadcast_to(self.C * checked_weights(sample_weight, len(samples)), rows.shape)
        self._train(samples, rows, -bound, bound, float(self.epsilon))
        self._learn_features(X, samples)
        return self

    def predict(self, X: Samples) -> Coefficients:
        """Return the values (n,) or (n, m) for samples; elements if the samples are, and m is the number of blades."""
        return self._like(X, self._predicted(X))

    def _predicted(self, x: Any) -> Floats:
        values = self._values(x)
        return np.asarray(values[:, 0] if self._is_flat else values)

    def score(self, X: Samples, y: Targets) -> float:
        """Return the coefficient of determination, the mean of all components."""
        found = self._predicted(X)
        truth = _checked_targets(self._plain(y, "y"), len(found))
        spread = ((truth - truth.mean(0)) ** 2).sum(0)
        return float(np.mean(1 - ((truth - found) ** 2).sum(0) / np.where(spread > 0, spread, 1)))

    def __sklearn_tags__(self) -> Any:
        return self._tags("regressor", self._is_precomputed, multi_output=True, single_output=True)


def _checked_targets(y: Any, n: int) -> Floats:
    if y is None:
        raise ValueError("y: None; requires y to be passed, but the target y is None")
    raw = as_given(y, "y")
    if raw.dtype.kind == "c":
        raise ValueError("Complex data not supported: y; expected components of multivectors")
    if raw.dtype.kind not in "fiubO":
        raise ValueError(f"y: type {raw.dtype}; expected numbers")
    targets = raw.astype(float)
    if targets.ndim not in (1, 2) or len(targets) != n or not targets.size:
        raise ValueError(f"y: shape {targets.shape}; expected ({n},) or ({n}, components)")
    if not np.isfinite(targets).all():
        raise ValueError("y: contains NaN or infinity; expected finite numbers")
    if targets.ndim == 2 and targets.shape[1] == 1:
        warn_column()
        return np.ascontiguousarray(targets[:, 0])
    return targets
