"""Networks: sequences of layers with one vector of parameters, losses and gradients."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import as_given, finite, real_array
from . import activations, delays, equivariant, items, linear, particles, rounds
from .algebra import Algebra, Array
from .all_blades import restorer, with_all_blades
from .base import Defined, Layer
from .chains import joined
from .losses import LOSSES
from .optimizers import Optimizer, Schedule
from .training import TrainingResult, is_count, train
from .workspace import Workspace

_LAYERS: dict[str, type[Layer]] = {
    kind.__name__: kind
    for module in (activations, delays, equivariant, items, linear, particles, rounds)
    for kind in vars(module).values()
    if isinstance(kind, type) and issubclass(kind, Layer) and kind not in (Layer, Defined)
}


class Network:
    """A network of layers over an algebra.

    Parameters
    ----------
    layers : sequence of Layer
    algebra : str or Algebra
        The algebra of the input: "R", "C", "H", or a name like "G(3)", "G(4,1)" or "G(3,0,1)".
    channels : int
        The number of multivectors of one input.
    seed : int
        Of the initial parameters.
    dtype : {numpy.float64, numpy.float32}
    loss : {"squares", "entropy"}
        The mean over the samples of half the squared error, or of the cross entropy of the scalar parts of the
        channels, for labels 0, 1, ...

    Examples
    --------
    >>> network = Network([Linear(64), Split("tanh"), Linear(4)], algebra="G(3)", channels=16)
    >>> network.predict(np.zeros((5, 16, 8))).shape
    (5, 4, 8)
    """

    def __init__(
        self, layers: Sequence[Layer], algebra: str | Algebra = "G(3)", channels: int = 1, *, seed: int = 0,
        dtype: Any = np.float64, loss: str = "squares",
    ) -> None:  # fmt: skip
        if not layers or not all(isinstance(layer, Layer) for layer in layers):
            raise TypeError(f"layers: {layers!r}; expected a sequence of at least one layer, such as Linear(4)")
        if not is_count(channels) or loss not in LOSSES:
            raise ValueError(
                f"channels {channels!r}, loss {loss!r}; expected a positive integer and one of {sorted(LOSSES)}"
            )
        if np.dtype(dtype) not in (np.float32, np.float64):
            raise TypeError(f"dtype: {dtype}; expected float32 or float64")
        self.layers, self.algebra, self.channels, self.loss_name = tuple(layers), Algebra.of(algebra), channels, loss
        self._seed, self._dtype = seed, dtype
        random, self.stages = np.random.default_rng(seed), [(self.algebra, channels)]
        arrays: list[list[Array]] = []
        for layer in self.layers:
            self.stages.append(layer.output(*self.stages[-1]))
            if not is_count(self.stages[-1][1]):
                raise ValueError(f"{layer}: {self.stages[-1][1]!r} channels; expected a positive integer")
            arrays.append(layer.initial(*self.stages[-2], random))
        self._plan = joined(self.layers, self.algebra, channels)
        self._shapes = [[array.shape for array in own] for own in arrays]
        flat = [array.ravel() for own in arrays for array in own]
        self.parameters: Array = np.concatenate([*flat, np.zeros(0)]).astype(dtype)
        self._workspace = Workspace()

    def __sklearn_clone__(self) -> Network:
        """Return a network with the initial parameters, for ``sklearn.base.clone``."""
        return type(self)(
            self.layers, self.algebra, self.channels, seed=self._seed, dtype=self._dtype, loss=self.loss_name
        )

    @property
    def weights(self) -> list[list[Array]]:
        """The arrays of parameters of each layer, views of `parameters`."""
        return self._split(self.parameters)

    def _split(self, flat: Array) -> list[list[Array]]:
        found, start = [], 0
        for shapes in self._shapes:
            own = []
            for shape in shapes:
                stop = start + int(np.prod(shape))
                own.append(flat[start:stop].reshape(shape))
                start = stop
            found.append(own)
        return found

    def inputs(self, x: ArrayLike) -> Array:
        """Check inputs, (samples, channels, blades), and convert them to the type of the parameters.

        Elements of the algebra, (samples, channels), are converted to the order of blades of the network.
        """
        algebra, size = self.algebra, self.algebra.size
        array = real_array(with_all_blades(x, "X", algebra.signature, algebra.bitmaps), "X")
        if array.ndim == 2 and size == 1:
            array = array[..., None]
        if array.ndim != 3 or array.shape[1:] != (self.channels, size):
            raise ValueError(
                f"X: shape {array.shape}; expected (samples, {self.channels}, {size}): {self.channels} channels with "
                f"the {size} coefficients of {algebra}"
            )
        return finite(array, "X").astype(self.parameters.dtype, copy=False)

    def targets(self, y: ArrayLike, samples: int) -> Array:
        """Check targets: labels for the cross entropy, else arrays of the shape of predictions."""
        algebra, channels = self.stages[-1]
        if samples == 0:
            raise ValueError("X: no samples; expected at least one for a loss or gradient")
        if self.loss_name == "entropy":
            labels = as_given(y, "y")
            is_label = labels.dtype.kind in "iu" and labels.shape == (samples,)
            if not is_label or labels.min() < 0 or labels.max() >= channels:
                raise ValueError(f"y: expected {samples} integer labels from 0 to {channels - 1}, one for each channel")
            return labels
        array = real_array(with_all_blades(y, "y", algebra.signature, algebra.bitmaps), "y")
        if array.ndim == 2 and algebra.size == 1:
            array = array[..., None]
        if array.shape != (samples, channels, algebra.size):
            raise ValueError(f"y: shape {array.shape}; expected {(samples, channels, algebra.size)}")
        return finite(array, "y").astype(self.parameters.dtype, copy=False)

    def _steps(self) -> list[tuple[Layer, Algebra, list[Array]]]:
        """Return what computes the results: layers, or chains of several, with their algebras and parameters."""
        weights, found, start = self.weights, [], 0
        for layer, count in self._plan:
            own = [array for arrays in weights[start : start + count] for array in arrays]
            found.append((layer, self.stages[start][0], own))
            start += count
        return found

    def forward(self, x: Array) -> list[Array]:
        """Return the input and the results of all layers but those inside of chains, without checks."""
        values = [x]
        for layer, algebra, own in self._steps():
            values.append(layer.value(algebra, values[-1], own))
        return values

    def backward(self, values: Sequence[Array], d: Array) -> Array:
        """Return the gradient of ``d . y`` with respect to the parameters: back-propagation."""
        gradients: list[Array] = []
        steps = self._steps()
        for k in reversed(range(1, len(steps))):
            layer, algebra, weights = steps[k]
            d, own = layer.pull(algebra, values[k], weights, values[k + 1], d)
            gradients[:0] = [one.ravel() for one in own]
        layer, algebra, weights = steps[0]
        own = layer.pull_parameters(algebra, values[0], weights, values[1], d)
        return np.concatenate([*(one.ravel() for one in own), *gradients, np.zeros(0, d.dtype)])

    def predict(self, x: ArrayLike) -> Array:
        """Return the results, (samples, channels, blades); for elements, elements if the algebra is the same."""
        algebra, _ = self.stages[-1]
        return restorer(x, algebra.signature, algebra.bitmaps)(self.forward(self.inputs(x))[-1])  # type: ignore[no-any-return]

    def loss(self, x: ArrayLike, y: ArrayLike) -> float:
        """Return the mean loss."""
        inputs = self.inputs(x)
        return LOSSES[self.loss_name](self.forward(inputs)[-1], self.targets(y, len(inputs)))[0]

    def gradient(self, x: ArrayLike, y: ArrayLike) -> tuple[float, Array]:
        """Return the mean loss and its gradient with respect to `parameters`."""
        inputs = self.inputs(x)
        return self.checked_gradient(inputs, self.targets(y, len(inputs)))

    def checked_gradient(self, x: Array, y: Array) -> tuple[float, Array]:
        """Return the mean loss and its gradient for arrays that `inputs` and `targets` returned."""
        with self._workspace.used():
            values = self.forward(x)
            loss, d = LOSSES[self.loss_name](values[-1], y)
            return loss, self.backward(values, d)

    def fit(
        self, x: ArrayLike, y: ArrayLike, optimizer: Optimizer | str = "adam", *, epochs: int = 100,
        batch: int | None = 32, schedule: Schedule | None = None,
        validation: tuple[ArrayLike, ArrayLike] | None = None, patience: int | None = None,
        decay: float = 0.0, seed: int = 0, progress: Callable[[int, float], None] | None = None,
        clip: float | None = None,
    ) -> TrainingResult:  # fmt: skip
        """Train the network.

        Parameters
        ----------
        x, y : array_like
            Inputs (samples, channels, blades), and targets of the shape of predictions or labels.
        optimizer : Optimizer or {"sgd", "rprop", "adam", "lbfgs"}
            Rprop and L-BFGS use all samples in each step.
        epochs : int
            For L-BFGS, the maximum number of iterations.
        batch : int, optional
            The number of samples of a step; all if None.
        schedule : callable, optional
            The factor of the rate in an epoch.
        validation : tuple, optional
            Inputs and targets that select the epoch whose parameters are kept.
        patience : int, optional
            Stop after so many epochs without a smaller validation loss.
        decay : float
            The factor of half the squared parameters in the loss.
        seed : int
            Of the order of samples.
        progress : callable, optional
            Called with the epoch and the loss.
        clip : float, optional
            The largest norm of the gradient of a step; longer gradients are shortened. L-BFGS does not use it.

        Warns
        -----
        RuntimeWarning
            If the loss diverges.
        """
        inputs = self.inputs(x)
        held = None
        if validation is not None:
            held_x = self.inputs(validation[0])
            held = held_x, self.targets(validation[1], len(held_x))
        elif patience is not None:
            raise ValueError("patience: given without validation data; expected validation=(X, y)")
        targets = self.targets(y, len(inputs))
        return train(
            self, inputs, targets, optimizer, epochs, batch, schedule, held, patience, decay, seed, progress, clip
        )  # fmt: skip

    def save(self, path: str | Path) -> None:
        """Write the layers and parameters into a file in numpy's npz format."""
        if self.algebra.module is not None:
            raise ValueError("save: the algebra uses a module, which a file cannot contain; save `parameters` instead")
        layers = [_fields(layer) for layer in self.layers]
        text = json.dumps(
            {"layers": layers, "algebra": str(self.algebra), "channels": self.channels, "loss": self.loss_name}
        )
        np.savez(path, definition=np.array(text), parameters=self.parameters)

    @classmethod
    def load(cls, path: str | Path) -> Network:
        """Read a file written by `save`. Nothing in it is executed."""
        with np.load(path, allow_pickle=False) as file:
            if set(file.files) != {"definition", "parameters"}:
                raise ValueError(f"{path}: contains {sorted(file.files)}; expected a file written by Network.save")
            definition, parameters = json.loads(str(file["definition"])), file["parameters"]
        layers = [_layer(path, *each) for each in definition["layers"]]
        found = cls(
            layers, definition["algebra"], definition["channels"], dtype=parameters.dtype, loss=definition["loss"]
        )
        if parameters.shape != found.parameters.shape:
            raise ValueError(f"{path}: {parameters.size} parameters; expected {found.parameters.size}")
        found.parameters = parameters
        return found


def _fields(value: Any) -> Any:
    """Return the name and the fields of a layer, for JSON; layers inside of it in the same form."""
    if isinstance(value, Layer):
        return [type(value).__name__, {each.name: _fields(getattr(value, each.name)) for each in fields(value)}]
    return [_fields(each) for each in value] if isinstance(value, tuple) else value


def _layer(path: Any, name: str, given: dict[str, Any]) -> Layer:
    """Return the layer that `_fields` describes."""
    if name not in _LAYERS:
        raise ValueError(f"{path}: layer {name!r}; expected one of {sorted(_LAYERS)}")

    def restored(value: Any) -> Any:
        if not isinstance(value, list):
            return value
        is_layer = len(value) == 2 and isinstance(value[1], dict)
        return _layer(path, *value) if is_layer else tuple(map(restored, value))

    return _LAYERS[name](**{key: restored(value) for key, value in given.items()})
