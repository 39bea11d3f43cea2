"""Clifford support vector machines for classification."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import as_given
from .all_blades import Samples
from .clifford_machine import CliffordMachine
from .codes import code_distance, code_of_classes, losses
from .estimators import ContradictionWarning, checked_weights, contradictions, is_number, warn_column
from .svm_kernels import Floats
from .svm_probabilities import fitted_sigmoid, folds_of, probabilities


class CliffordSVC(CliffordMachine):
    """One support vector machine with multivector values for several classes.

    Classes are coded by the signs of components, so an algebra of n vectors has values for up to ``2**(2**n)`` classes.
    The interface is that of scikit-learn's classifiers.

    Parameters
    ----------
    kernel : {"scalar", "rbf", "linear", "gabor", "polynomial", "precomputed"} or callable
        ``exp(-gamma |x - y|^2)``, with two names; ``~x y``; this Gaussian times a rotor ``exp(u w (x - y))``; or
        ``(gamma ~x y + coef0)^degree``. A callable maps two arrays of samples to kernels (n, k) or (n, k, 2**k).
        With "precomputed", samples are rows of kernels with the training samples.
    C : float
        The penalty of errors.
    gamma : float, "scale" or "auto"
        With "scale", the inverse of the variance of features times their number; with "auto", that of their number.
    degree, coef0 : int, float
        Of the polynomial.
    frequency : float or array
        The wave vector w of the Gabor kernel. A number is its length; it then has equal coordinates.
    code : {"one-vs-rest", "compact"}, int or mapping
        The signs of classes; see `codes.code_of_classes`.
    class_weight : mapping or "balanced", optional
        Factors of `C` for the samples of classes, 1 for those that are not in it; with "balanced", such that all
        classes have equal sums.
    probability : bool
        Whether to fit sigmoids for `predict_proba` by cross-validation, which takes five times as long.
    algebra : (p, q), optional
        The signature. By default there are just enough vectors of square -1.
    tol : float
        Tolerance of the conditions of optimality.
    max_iter : int
        The maximum number of steps, -1 for no limit.
    shrinking : bool
        Whether to leave out samples that probably remain at their bounds.
    cache_size : float
        Megabytes for rows of the kernel.

    Attributes
    ----------
    classes_ : array, (classes,)
    code_ : array, (classes, m)
    code_distance_ : int
        The least number of components in which two classes differ.
    support_, support_vectors_ : array
        Indices of the samples with nonzero dual variables, and these samples.
    dual_coef_ : array, (m, support)
        Dual variables, with the signs of labels.
    coef_ : array, (m, d)
        The weights of features, for linear kernels of real samples.
    intercept_ : array, (m,)
    n_iter_ : int
        The number of steps, of all components.
    status_ : MachineStatus
    gap_, dual_objective_ : float
        The violation of the conditions of optimality, and the objective that is minimised.
    """

    def __init__(
        self, kernel: Any = "scalar", C: float = 1.0, gamma: Any = "scale", degree: int = 3, coef0: float = 1.0,
        frequency: Any = 1.0, code: Any = "one-vs-rest", algebra: Any = None, tol: float = 1e-6, max_iter: int = -1,
        shrinking: bool = True, cache_size: float = 200.0, class_weight: Any = None, probability: bool = False,
    ) -> None:  # fmt: skip
        self.kernel, self.C, self.gamma, self.degree, self.coef0 = kernel, C, gamma, degree, coef0
        self.frequency, self.code, self.algebra, self.tol = frequency, code, algebra, tol
        self.max_iter, self.shrinking, self.cache_size = max_iter, shrinking, cache_size
        self.class_weight, self.probability = class_weight, probability

    def fit(self, X: Samples, y: ArrayLike, sample_weight: ArrayLike | None = None) -> Self:
        """Fit the machine to samples (n, d), or multivectors (n, d, 2**k), and their classes.

        The penalties of errors are multiplied by the weights of samples and classes.

        Parameters
        ----------
        X : array or sparse matrix, (n, d) or (n, d, 2**k)
            The samples, or with the kernel "precomputed" their Gram matrix (n, n).
        y : array, (n,)
            The classes.
        sample_weight : float or array, (n,), optional
            Factors of `C`, 1 by default. Samples of weight 0 affect only `gamma="scale"` and balanced classes.

        Raises
        ------
        ValueError, TypeError
            If the samples or labels cannot be used, or the kernel is not positive definite.

        Warns
        -----
        ContradictionWarning
            If equal samples have different labels.
        ConvergenceWarning
            If the tolerance has not been reached.
        """
        samples = self._samples(X)
        labels = _checked_labels(y, len(samples))
        try:
            self.classes_, number = np.unique(labels, return_inverse=True)
        except TypeError:
            kinds = sorted({type(label).__name__ for label in labels})
            raise TypeError(f"y: labels of the types {', '.join(kinds)}; expected labels of one type") from None
        if len(self.classes_) < 2:
            raise ValueError(f"y: the number of classes has to be greater than one; got {len(self.classes_)} class")
        code = code_of_classes(self.code, self.classes_)
        if not self._is_precomputed and (samples == samples[0]).all():
            raise ValueError("X: all features are constant; expected samples that differ")
        clashes = contradictions(samples, number)
        if clashes:
            warnings.warn(
                f"y: {clashes} samples equal an earlier one with another label; no machine separates them",
                ContradictionWarning, stacklevel=2,
            )  # fmt: skip
        weights = checked_weights(sample_weight, len(samples))
        count = np.bincount(number[weights > 0], minlength=len(self.classes_))
        if np.count_nonzero(count) < 2:
            raise ValueError("sample_weight: the positive weights belong to one class; expected at least two")
        if self.probability and count.min() < 2:
            raise ValueError(
                f"probability: samples of class {self.classes_[count.argmin()]} with positive weights: {count.min()}; "
                "expected at least two of each class for cross-validation"
            )
        factors = _weights_of_classes(self.class_weight, self.classes_, number)[number]
        most = self.C * weights * factors
        targets = code[number].T.astype(float)
        self._train(samples, targets, np.where(targets > 0, 0, -most), np.where(targets > 0, most, 0), 0.0)
        self.code_, self.code_distance_ = code, code_distance(code)
        self._learn_features(X, samples)
        self._sigmoids = self._fit_sigmoids(samples, number, weights, factors) if self.probability else None
        return self

    def _fit_sigmoids(self, samples: Floats, number: NDArray[np.intp], weights: Floats, factors: Floats) -> Floats:
        """Fit the sigmoids of decision values to those of samples that are left out in training."""
        used = np.flatnonzero(weights > 0)
        samples = samples[np.ix_(used, used)] if self._is_precomputed else samples[used]
        number, weights, factors = number[used], weights[used], factors[used]
        code = {c: row for c, row in enumerate(self.code_)}
        changes = {"code": code, "probability": False, "class_weight": None, "gamma": self._settings.gamma}
        fold, scores = (
            folds_of(number),
            np.empty(len(samples) if len(self.classes_) == 2 else (len(samples), len(code))),
        )
        for k in range(fold.max() + 1):
            inner, outer = np.flatnonzero(fold != k), np.flatnonzero(fold == k)
            own = (samples[:, inner] if self._is_precomputed else samples)[[*inner, *outer]]
            parameters: dict[str, Any] = {**self.get_params(), **changes}
            machine = type(self)(**parameters)
            machine.fit(own[: len(inner)], number[inner], (weights * factors)[inner])
            scores[outer] = machine.decision_function(own[len(inner) :])
        columns = scores.reshape(len(scores), -1).T
        is_own = [number == c for c in (range(len(code)) if len(columns) > 1 else [1])]
        return np.array([fitted_sigmoid(f, own, weights) for f, own in zip(columns, is_own, strict=True)])

    @property
    def predict_proba(self) -> Callable[[Samples], Floats]:
        """The function of samples that returns the probabilities (n, classes), if the machine has `probability`.

        The probabilities are those of Platt's method, see `svm_probabilities`. The class of the greatest one can differ
        from that of `predict`.
        """
        if not self.probability:
            raise AttributeError("predict_proba is not available when probability=False")
        return self._probabilities

    def _probabilities(self, X: Samples) -> Floats:
        values = self.decision_function(X)
        if self._sigmoids is None:
            raise ValueError("probability: it was False in fit; fit the machine again")
        return probabilities(values, self._sigmoids)

    def components(self, X: Samples) -> Floats:
        """Return the components (n, m) of the multivector values, whose signs code the classes."""
        return self._values(X)

    def decision_function(self, X: Samples) -> Floats:
        """Return the value (n,) for two classes with one component, else the negative losses (n, classes)."""
        values = self._values(X)
        if values.shape[1] == 1:
            return np.asarray(values[:, 0] * self.code_[1, 0])
        found = -losses(values, self.code_)
        return np.asarray(found[:, 1] - found[:, 0] if len(self.classes_) == 2 else found)

    def predict(self, X: Samples) -> NDArray[Any]:
        """Return the class of each sample: the one whose code has the least hinge loss."""
        values = self.decision_function(X)
        return np.asarray(self.classes_[(values > 0).astype(int) if values.ndim == 1 else values.argmax(1)])

    def score(self, X: Samples, y: ArrayLike) -> float:
        """Return the share of samples whose class is predicted."""
        found = self.predict(X)
        return float((found == _checked_labels(y, len(found))).mean())

    def __sklearn_tags__(self) -> Any:
        return self._tags("classifier", self._is_precomputed)


def _weights_of_classes(given: Any, classes: NDArray[Any], number: NDArray[np.intp]) -> Floats:
    """Return the factors of classes.

    Raises
    ------
    ValueError
        If they are not a mapping, or a factor is not positive or belongs to no class.
    """
    if given is None:
        return np.ones(len(classes))
    if isinstance(given, str) and given == "balanced":
        return np.asarray(len(number) / (len(classes) * np.bincount(number)))
    if not isinstance(given, Mapping):
        raise ValueError(f"class_weight: {given!r}; expected 'balanced', a mapping, or None")
    names = classes.tolist()
    unknown = [name for name in given if name not in names]
    if unknown or not all(is_number(value) and value > 0 for value in given.values()):
        raise ValueError(f"class_weight: {given!r}; expected positive numbers for some of the classes {names}")
    return np.array([float(given.get(name, 1.0)) for name in names])


def _checked_labels(y: Any, n: int) -> NDArray[Any]:
    if y is None:
        raise ValueError("y: None; requires y to be passed, but the target y is None")
    labels = as_given(y, "y")
    if labels.ndim == 2 and labels.shape[1] == 1:
        warn_column()
        labels = labels[:, 0]
    if labels.ndim != 1 or len(labels) != n:
        raise ValueError(f"y: shape {labels.shape}; expected one label for each of {n} samples")
    if labels.dtype.kind == "f":
        if not np.isfinite(labels).all():
            raise ValueError("y: contains NaN or infinity; expected labels of classes")
        if (labels != np.round(labels)).any():
            raise ValueError("y: Unknown label type: continuous; expected classes, use CliffordSVR for numbers")
    if labels.dtype.kind == "c":
        raise ValueError("Complex data not supported: y; expected classes")
    return labels
