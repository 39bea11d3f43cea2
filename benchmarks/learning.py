"""How long a network over G(3) takes for a loss and its gradient, beside torch and jax; errors of tasks by algebra."""

from __future__ import annotations

import importlib
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from algorithms.learning import Algebra, Linear, Network, Split
from algorithms.learning import linear as layers
from algorithms.learning.experiments import TASKS, compare, encoder
from algorithms.learning.linear import left_matrix

from .libraries import installed
from .machine import version

PAGE = Path("docs/learning-speed.md")
BATCH, ROUNDS, SEEDS = 1024, 15, 10
Array = np.ndarray[Any, Any]


def cpu_times(calls: dict[str, Callable[[], object]]) -> dict[str, float]:
    """Return the smallest CPU time of the process in milliseconds, over rounds that measure all calls alternately."""
    found = dict.fromkeys(calls, np.inf)
    for _ in range(ROUNDS):
        for name, call in calls.items():
            start = time.process_time()
            for _ in range(4):
                call()
            found[name] = min(found[name], (time.process_time() - start) / 4)
    return {name: 1e3 * spent for name, spent in found.items()}


def by_torch(network: Network, x: Array, y: Array) -> Callable[[], Array]:
    """Return the gradient by torch, in the style of cliffordlayers: wide real matrices from weights, and autograd."""
    torch = importlib.import_module("torch")
    torch.set_num_threads(1)
    algebra = network.algebra
    targets = torch.tensor(algebra.targets)
    signs = torch.tensor(algebra.signs[algebra.targets, np.arange(8)].astype(x.dtype))
    inputs, truth = torch.tensor(x), torch.tensor(y)
    parameters = [torch.tensor(array, requires_grad=True) for own in network.weights for array in own]

    def linear(z: Any, w: Any, bias: Any) -> Any:
        wide = (w[..., targets] * signs).permute(0, 2, 1, 3).reshape(8 * len(w), -1)
        return torch.nn.functional.linear(z.reshape(len(z), -1), wide, bias.reshape(-1)).reshape(len(z), len(w), 8)

    def call() -> Array:
        z = linear(torch.tanh(linear(inputs, *parameters[:2])), *parameters[2:])
        loss = ((z - truth) ** 2).sum() / (2 * len(z))
        return np.concatenate([one.numpy().ravel() for one in torch.autograd.grad(loss, parameters)])

    return call


def by_jax(network: Network, x: Array, y: Array) -> Callable[[], Array]:
    """Return the gradient by compiled jax."""
    jax = importlib.import_module("jax")
    jax.config.update("jax_enable_x64", True)
    jnp, algebra = jax.numpy, network.algebra
    signs = algebra.signs[algebra.targets, np.arange(8)].astype(x.dtype)

    def linear(z: Any, w: Any, bias: Any) -> Any:
        wide = (w[..., algebra.targets] * signs).transpose(1, 3, 0, 2).reshape(-1, 8 * len(w))
        return (z.reshape(len(z), -1) @ wide).reshape(len(z), len(w), 8) + bias

    def loss(parameters: Any, inputs: Any, truth: Any) -> Any:
        z = linear(jnp.tanh(linear(inputs, *parameters[:2])), *parameters[2:])
        return ((z - truth) ** 2).sum() / (2 * len(z))

    gradient = jax.jit(jax.grad(loss))
    parameters = [jnp.asarray(array) for own in network.weights for array in own]
    given = jnp.asarray(x), jnp.asarray(y)

    def call() -> Array:
        return np.concatenate([np.asarray(one).ravel() for one in gradient(parameters, *given)])

    return call


def gradients(dtype: Any) -> tuple[dict[str, float], float]:
    """Return the times, and the largest relative deviation of a gradient from ours."""
    network = Network([Linear(64), Split("tanh"), Linear(4)], "G(3)", 16, dtype=dtype)
    random = np.random.default_rng(0)
    x, y = (random.normal(size=(BATCH, k, 8)).astype(dtype) for k in (16, 4))
    calls: dict[str, Callable[[], Any]] = {"gacompiler": lambda: network.checked_gradient(x, y)[1]}
    for name, peer in (("torch", by_torch), ("jax", by_jax)):
        if installed(name):
            calls[name] = peer(network, x, y)
    own = calls["gacompiler"]()
    error = max(float(np.abs(call() - own).max() / np.abs(own).max()) for call in calls.values())
    return cpu_times(calls), error


def crossover() -> list[str]:
    """Return the rows of the table of linear layers by matrices of spinors and by the table of signs."""
    rows, least = [], layers.LEAST_WIDTH
    layers.LEAST_WIDTH = 0
    for name in ("G(2)", "G(3)", "G(4,1)"):
        for channels in (4, 16, 64):
            algebra = Algebra.of(name)
            x = np.random.default_rng(0).normal(size=(BATCH, channels, algebra.size))
            w = np.random.default_rng(1).normal(size=(channels, channels, algebra.size))
            layer = Linear(channels, bias=False)
            wide = left_matrix(algebra, w).transpose(1, 3, 0, 2).reshape(x[0].size, -1)
            calls: dict[str, Callable[[], object]] = {
                "spinors": lambda layer=layer, algebra=algebra, x=x, w=w: layer.value(algebra, x, [w]),
                "table": lambda x=x, wide=wide: x.reshape(len(x), -1) @ wide,
            }
            found = cpu_times(calls)
            rows.append(f"| {name} | {channels} | {found['spinors']:.2f} | {found['table']:.2f} |")
    layers.LEAST_WIDTH = least
    return rows


def main() -> None:
    """Write the page."""
    lines = [
        "# Learning: times and errors", "",
        "Written by `python -m benchmarks.learning`. Times are CPU times of the process on one thread in ms, the",
        f"smallest of {ROUNDS} rounds that measure all libraries alternately: torch {version('torch')}, "
        f"jax {version('jax')}.",
        "The machine had other load. Like cliffordlayers, torch and jax multiply by a wide real matrix.", "",
        f"## Loss and gradient of a 16-64-4 network over G(3), batch {BATCH}", "",
        "| numbers | gacompiler | torch | jax | largest deviation of gradients |", "|---|---|---|---|---|",
    ]  # fmt: skip
    for dtype in (np.float64, np.float32):
        times, error = gradients(dtype)
        cells = " | ".join(f"{times[name]:.2f}" if name in times else "" for name in ("gacompiler", "torch", "jax"))
        lines.append(f"| {np.dtype(dtype).name} | {cells} | {error:.1e} |")
    lines += ["", "## Linear layers by matrices of spinors and by one wide real matrix", "",
              "The time of the wide matrix is that of the product alone.", "",
              "| algebra | channels | spinors | wide matrix |", "|---|---|---|---|", *crossover()]  # fmt: skip
    lines += ["", f"## Test errors by algebra, medians of {SEEDS} seeds", "",
              "| task | algebra | real parameters | root mean square error |", "|---|---|---|---|"]  # fmt: skip
    for name in TASKS:
        for algebra, count, error in compare(name, ["R", "C", "H", "G(3)"], 60 if name != "lorenz" else 150, SEEDS):
            lines.append(f"| {name} | {algebra} | {count} | {error:.1e} |")
    lines += ["", f"The 8-1-8 encoder reproduces all corners for {sum(encoder(k)[1] for k in range(10))} of 10 seeds."]
    PAGE.write_text("\n".join(lines) + "\n")
    sys.stdout.write(PAGE.read_text())


if __name__ == "__main__":
    main()
