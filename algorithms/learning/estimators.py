"""The interface of scikit-learn's estimators, without a dependency on it: parameters, and checks of samples."""

from __future__ import annotations

import importlib
import inspect
import sys
import warnings
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ..arguments import as_given

Floats = NDArray[np.float64]


class Estimator:
    """Parameters of an estimator, which are the arguments of its constructor, as in scikit-learn."""

    @classmethod
    def _names(cls) -> list[str]:
        return sorted(name for name in inspect.signature(cls.__init__).parameters if name != "self")

    def get_params(self, deep: bool = True) -> dict[str, object]:
        """Return the parameters by name; `deep` has no effect, because none of them is an estimator."""
        return {name: getattr(self, name) for name in self._names()}

    def set_params(self, **parameters: object) -> Self:
        """Set parameters by name, and return the estimator.

        Raises
        ------
        ValueError
            If there is no parameter of a name.
        """
        for name, value in parameters.items():
            if name not in self._names():
                raise ValueError(f"Invalid parameter {name!r} for estimator {self}. Valid parameters: {self._names()}")
            setattr(self, name, value)
        return self

    def __repr__(self) -> str:
        defaults = inspect.signature(type(self).__init__).parameters
        changed = [f"{k}={v!r}" for k, v in self.get_params().items() if v is not defaults[k].default]
        return f"{type(self).__name__}({', '.join(changed)})"

    def _tags(self, kind: str, pairwise: bool, **target: bool) -> Any:
        """Return the tags that scikit-learn reads, which only it calls; `pairwise` if samples are rows of kernels."""
        utils = importlib.import_module("sklearn.utils")
        special = {"classifier_tags": utils.ClassifierTags()} if kind == "classifier" else {}
        special = special or {"regressor_tags": utils.RegressorTags()}
        return utils.Tags(
            estimator_type=kind, target_tags=utils.TargetTags(required=True, **target),
            input_tags=utils.InputTags(three_d_array=False, sparse=True, pairwise=pairwise), **special,
        )  # fmt: skip

    def _check_fitted(self) -> None:
        if hasattr(self, "n_features_in_"):
            return
        text = f"This {type(self).__name__} instance is not fitted yet; call fit first"
        raise _class_of_sklearn("NotFittedError", NotFittedError)(text)

    def _learn_features(self, x: object, samples: Floats) -> None:
        self.n_features_in_ = samples.shape[1]
        names = _feature_names(x)
        if names is not None:
            self.feature_names_in_ = names
        elif hasattr(self, "feature_names_in_"):
            del self.feature_names_in_

    def _compare_features(self, x: object, samples: Floats) -> None:
        names, own, title = _feature_names(x), getattr(self, "feature_names_in_", None), type(self).__name__
        if own is None and names is not None:
            warnings.warn(f"X has feature names, but {title} was fitted without feature names", stacklevel=3)
        elif own is not None and names is None:
            warnings.warn(
                f"X does not have valid feature names, but {title} was fitted with feature names", stacklevel=3
            )
        elif own is not None and names is not None and list(names) != list(own):
            raise ValueError(_difference_of_names(list(names), list(own)))
        if samples.shape[1] != self.n_features_in_:
            raise ValueError(
                f"X has {samples.shape[1]} features, but {title} is expecting {self.n_features_in_} features as input"
            )


class NotFittedError(ValueError, AttributeError):
    """Raised by methods of an estimator before `fit`; scikit-learn's class where that is loaded."""


class ConvergenceWarning(UserWarning):
    """Issued if a machine has not converged; scikit-learn's class where that is loaded."""


class ContradictionWarning(UserWarning):
    """Issued if equal samples have different labels."""


def convergence_warning() -> type[Warning]:
    """Return the class of the warning."""
    return _class_of_sklearn("ConvergenceWarning", ConvergenceWarning)


def warn_column() -> None:
    """Warn that targets are a matrix of one column."""
    warnings.warn(
        "A column-vector y was passed when a 1d array was expected; use y.ravel()",
        _class_of_sklearn("DataConversionWarning", UserWarning), stacklevel=4,
    )  # fmt: skip


def _class_of_sklearn(name: str, own: type[Any]) -> type[Any]:
    module = sys.modules.get("sklearn.exceptions")
    found: type[Any] = getattr(module, name, own)
    return found


def checked_samples(x: Any, size: int | None) -> Floats:
    """Return samples as a contiguous array of float64: (n, d), or with an algebra of `size` blades (n, d, size).

    Sparse matrices are converted to dense ones.

    Raises
    ------
    ValueError
        If X is complex, empty, not finite, or has another shape.
    """
    array = as_given(x.toarray() if hasattr(x, "tocsr") else x, "X")
    if array.dtype.kind == "c":
        raise ValueError(
            "Complex data not supported: X has complex numbers; expected real coefficients of multivectors"
        )
    if array.dtype.kind not in "fiubO":
        raise ValueError(f"X: type {array.dtype}; expected real numbers")
    samples = np.ascontiguousarray(array, np.float64)
    if samples.ndim < 2:
        raise ValueError(
            f"X: shape {samples.shape}; Expected 2D array, got {samples.ndim}D array instead. Reshape your data either "
            "using array.reshape(-1, 1) for one feature, or array.reshape(1, -1) for one sample"
        )
    if samples.ndim > 3 or (samples.ndim == 3 and samples.shape[2] != size):
        hint = "pass algebra=(p, q) for multivectors" if size is None else f"its algebra has {size} basis blades"
        raise ValueError(f"X: shape {samples.shape}; expected (n, d), or (n, d, 2**k) with algebra=; {hint}")
    if samples.shape[1] == 0:
        raise ValueError(f"0 feature(s) (shape={samples.shape}) while a minimum of 1 is required.")
    if samples.shape[0] == 0:
        raise ValueError(f"X: 0 sample(s), shape {samples.shape}; expected at least one")
    if not np.isfinite(samples).all():
        at = tuple(int(i) for i in np.argwhere(~np.isfinite(samples))[0])
        raise ValueError(f"X: {samples[at]} at {at}; expected finite numbers, without NaN and infinity")
    return samples


def checked_weights(sample_weight: Any, n: int) -> Floats:
    """Return weights of samples as an array (n,), which are 1 by default.

    Raises
    ------
    ValueError
        If weights are not real, negative or not finite, if all of them are 0, or if their number is wrong.
    """
    if sample_weight is None:
        return np.ones(n)
    raw = as_given(sample_weight, "sample_weight")
    if raw.dtype.kind not in "biuf":
        raise ValueError(f"sample_weight: type {raw.dtype}; expected real numbers")
    weights = raw.astype(float)
    if weights.ndim == 0:
        weights = np.full(n, float(weights))
    if weights.shape != (n,):
        raise ValueError(f"sample_weight: shape {weights.shape}; Sample weights must be 1D array or scalar, ({n},)")
    if not np.isfinite(weights).all() or weights.min() < 0:
        raise ValueError("sample_weight: expected finite numbers of at least 0")
    if not weights.max() > 0:
        raise ValueError("sample_weight: all weights are zero; expected some positive ones")
    return weights


def is_number(value: object) -> bool:
    """Return whether a value is a finite real number, as parameters of machines have to be."""
    return (
        isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool) and np.isfinite(value)
    )


def contradictions(samples: Floats, labels: NDArray[Any]) -> int:
    """Return the number of samples that equal an earlier sample with another label."""
    # Equal rows have equal sums of products with any weights, which few other rows have.
    flat = samples.reshape(len(samples), -1)
    weights = np.random.default_rng(0).normal(size=flat.shape[1])
    _, place, count = np.unique((flat * weights).sum(1), return_inverse=True, return_counts=True)
    first: dict[bytes, Any] = {}
    doubtful = np.flatnonzero(count[place] > 1)
    return sum(first.setdefault(samples[i].tobytes(), labels[i]) != labels[i] for i in doubtful)


def _feature_names(x: Any) -> NDArray[Any] | None:
    columns = getattr(x, "columns", None)
    if columns is None or not len(columns):
        return None
    names = np.asarray(columns, object)
    return names if all(isinstance(name, str) for name in names) else None


def _difference_of_names(names: list[str], own: list[str]) -> str:
    unexpected, missing = sorted(set(names) - set(own)), sorted(set(own) - set(names))
    text = "The feature names should match those that were passed during fit.\n"
    if unexpected:
        text += "Feature names unseen at fit time:\n" + "".join(f"- {name}\n" for name in unexpected)
    if missing:
        text += "Feature names seen at fit time, yet now missing:\n" + "".join(f"- {name}\n" for name in missing)
    if not unexpected and not missing:
        text += "Feature names must be in the same order as they were in fit.\n"
    return text
