"""How long a network over G(3) takes for a loss and its gradient, beside torch and jax; errors of tasks by algebra."""

from __future__ import annotations

import importlib
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from algorithms.learning import Algebra, Linear, Network, Split
from algorithms.learning import linear as layers
from algorithms.learning.experiments import TASKS, compare, encoder
from algorithms.learning.geometric_tasks import GEOMETRIC_TASKS, beside_real
from algorithms.learning.workspace import Workspace

from . import pages
from .libraries import installed
from .machine import version

PAGE = Path("docs/learning-speed.md")
BATCH, ROUNDS, SEEDS = 1024, 15, 10
Array = np.ndarray[Any, Any]


def cpu_times(calls: dict[str, Callable[[], object]], rounds: int = ROUNDS) -> dict[str, float]:
    """Return the smallest CPU time of the process in milliseconds, over rounds that measure all calls alternately."""
    found = dict.fromkeys(calls, np.inf)
    for _ in range(rounds):
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


def gradients_by(coretype: str) -> dict[str, dict[str, float]]:
    """Return the times by name of the type of numbers, measured where OpenBLAS uses the code for another processor."""
    code = (
        "import json, sys, numpy; from benchmarks.learning import gradients;"
        "json.dump({t: gradients(getattr(numpy, t))[0] for t in ('float64', 'float32')}, sys.stdout)"
    )
    environment = {**os.environ, "OPENBLAS_CORETYPE": coretype}
    done = subprocess.run([sys.executable, "-c", code], env=environment, check=True, capture_output=True, text=True)
    found: dict[str, dict[str, float]] = json.loads(done.stdout)
    return found


def has_avx512() -> bool:
    """Return whether Linux reports that the processor has AVX-512."""
    facts = Path("/proc/cpuinfo")
    return facts.exists() and "avx512f" in facts.read_text()


def crossover() -> list[str]:
    """Return the rows of the table of linear layers by matrices of spinors and by one wide real matrix."""
    rows, least = [], layers.LEAST_WIDTH
    for name in ("G(2)", "G(3)", "G(4,1)"):
        for inner, out in ((8, 8), (16, 16), (16, 64), (64, 4), (64, 64)):
            algebra, random, workspace = Algebra.of(name), np.random.default_rng(0), Workspace()
            x, d = (random.normal(size=(BATCH, count, algebra.size)) for count in (inner, out))
            layer = Linear(out, bias=False)
            w = layer.initial(algebra, inner, random)

            def call(width: float, layer: Linear = layer, algebra: Algebra = algebra, x: Array = x, d: Array = d,
                     w: list[Array] = w, workspace: Workspace = workspace) -> None:  # fmt: skip
                layers.LEAST_WIDTH = width
                with workspace.used():
                    layer.pull(algebra, x, w, layer.value(algebra, x, w), d)

            found = cpu_times({"spinors": partial(call, 0), "wide": partial(call, np.inf)}, 4)
            mean = inner * out * algebra.size / (inner + out)
            rows.append(f"| {name} | {inner} | {out} | {mean:.0f} | {found['spinors']:.2f} | {found['wide']:.2f} |")
    layers.LEAST_WIDTH = least
    return rows


def beside_real_networks() -> list[str]:
    """Return the rows of the table of tasks that are products of multivectors."""
    rows = []
    for name, (_, algebra, _) in GEOMETRIC_TASKS.items():
        found = [beside_real(name, seed) for seed in range(SEEDS)]
        own, real = (float(np.median([row[k][0] for row in found])) for k in (0, 1))
        counts = f"{found[0][0][1]} | {found[0][1][1]}"
        rows.append(f"| {name} | {algebra} | {counts} | {own:.1e} | {real:.1e} | {own / real:.2f} |")
    return rows


def main(arguments: list[str] | None = None) -> int:
    """Measure, and write the page."""
    options = pages.options("learning", __doc__, PAGE, quick=False).parse_args(arguments)
    lines = [
        "# Learning: times and errors", "",
        "Written by `python -m benchmarks learning`. Times are CPU times of the process on one thread in ms, the",
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
    if has_avx512():
        for name, times in gradients_by("SkylakeX").items():
            cells = " | ".join(f"{times[one]:.2f}" if one in times else "" for one in ("gacompiler", "torch", "jax"))
            lines.append(f"| {name}, `OPENBLAS_CORETYPE=SkylakeX` | {cells} | |")
    lines += ["", "## Linear layers by matrices of spinors and by one wide real matrix", "",
              "Values and all gradients; the width is that in `LEAST_WIDTH`.", "",
              "| algebra | inputs | results | width | spinors | wide matrix |", "|---|---|---|---|---|---|",
              *crossover()]  # fmt: skip
    lines += ["", f"## Mappings that are products, beside real networks: medians of {SEEDS} seeds", "",
              "| task | algebra | parameters | of the real network | error | of the real network | ratio |",
              "|---|---|---|---|---|---|---|", *beside_real_networks()]  # fmt: skip
    lines += ["", f"## Test errors by algebra, medians of {SEEDS} seeds", "",
              "| task | algebra | real parameters | root mean square error |", "|---|---|---|---|"]  # fmt: skip
    for name in TASKS:
        for algebra, count, error in compare(name, ["R", "C", "H", "G(3)"], 60 if name != "lorenz" else 150, SEEDS):
            lines.append(f"| {name} | {algebra} | {count} | {error:.1e} |")
    lines += ["", f"The 8-1-8 encoder reproduces all corners for {sum(encoder(k)[1] for k in range(10))} of 10 seeds."]
    return pages.publish("learning", options.out, "\n".join(lines) + "\n", "5 tables")


if __name__ == "__main__":
    sys.exit(main())
