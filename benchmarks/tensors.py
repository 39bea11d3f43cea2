"""How long layers take in torch for a value and its gradients, beside products by einsum and cliffordlayers."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from algorithms.learning import Algebra, GradeLinear, GradeProduct, Linear
from algorithms.learning.frameworks import torch_module

from . import pages
from .learning import cpu_times
from .libraries import installed
from .machine import version

PAGE = Path("docs/tensor-speed.md")
BATCH, ROUNDS = 256, 9
PRODUCTS = (("G(3)", 16), ("G(3)", 64), ("G(3,0,1)", 16), ("G(3,0,1)", 64), ("G(1,3)", 16), ("G(4,1)", 16))
LINEAR = (16, 32, 64, 128)


def step(module: Any, x: Any) -> Callable[[], object]:
    """Return the call that computes a value and the gradients with respect to input and parameters."""
    variables = [x, *module.parameters()]

    def call() -> object:
        for each in variables:
            each.grad = None
        return module(x).square().sum().backward()

    return call


def by_einsum(module: Any, algebra: Algebra) -> Any:
    """Return the layer `GradeProduct` by the functions of torch, with the parameters of a module."""
    torch = importlib.import_module("torch")
    table = np.zeros((len(algebra.paths), *[algebra.size] * 3), np.float32)
    path_of = {tuple(row): k for k, row in enumerate(algebra.paths.tolist())}
    for i, j in np.argwhere(algebra.signs):
        k = algebra.targets[i, j]
        table[path_of[tuple(algebra.grades[[i, j, k]].tolist())], i, j, k] = algebra.signs[i, j]
    constants, grades = torch.tensor(table), torch.tensor(algebra.grades)
    unit = torch.eye(1, algebra.size)

    base: Any = torch.nn.Module

    class Product(base):  # type: ignore[misc]
        def __init__(self) -> None:
            super().__init__()
            self.w, self.bias, self.weights = module.weights

        def forward(self, x: Any) -> Any:
            other = torch.einsum("oik,nik->nok", self.w[..., grades], x) + self.bias[:, None] * unit
            weighted = torch.einsum("cp,pijk->cijk", self.weights, constants)
            return torch.einsum("nci,cijk,ncj->nck", x, weighted, other)

    return Product()


def products() -> list[str]:
    """Return the rows of the table of products with weights by grade."""
    torch = importlib.import_module("torch")
    rows = []
    for name, channels in PRODUCTS:
        algebra, x = Algebra.of(name), torch.randn(BATCH, channels, Algebra.of(name).size, requires_grad=True)
        module = torch_module(GradeProduct(), algebra, channels)
        peer = by_einsum(module, algebra)
        compiled = torch.compile(peer)
        expected = peer(x)
        error = ((module(x) - expected).abs().max() / expected.abs().max()).item()
        calls = {"kernels": step(module, x), "einsum": step(peer, x), "compiled": step(compiled, x)}
        for call in calls.values():
            call()  # which compiles
        times = cpu_times(calls, ROUNDS)
        cells = " | ".join(f"{times[key]:.2f}" for key in calls)
        rows.append(f"| {name} | {channels} | {cells} | {times['kernels'] / times['compiled']:.2f} | {error:.0e} |")
    return rows


def linear() -> list[str]:
    """Return the rows of the table of linear layers."""
    torch = importlib.import_module("torch")
    peer = importlib.import_module("cliffordlayers.nn.modules.cliffordlinear")
    rows = []
    for channels in LINEAR:
        x = torch.randn(BATCH, channels, 8, requires_grad=True)
        calls = {
            "Linear": step(torch_module(Linear(channels), "G(3)", channels), x),
            "GradeLinear": step(torch_module(GradeLinear(channels), "G(3)", channels), x),
            "CliffordLinear": step(peer.CliffordLinear([1, 1, 1], channels, channels), x),
        }
        times = cpu_times(calls, ROUNDS)
        cells = " | ".join(f"{times[key]:.2f}" for key in calls)
        rows.append(f"| {channels} | {cells} | {times['Linear'] / times['CliffordLinear']:.2f} |")
    return rows


def main(arguments: list[str] | None = None) -> int:
    """Measure, and write the page."""
    given = pages.options("tensors", __doc__, PAGE, quick=False).parse_args(arguments)
    torch = importlib.import_module("torch")
    torch.set_num_threads(1)
    torch.manual_seed(0)
    lines = [
        "# Tensors: times", "",
        "Written by `python -m benchmarks tensors`: values and gradients with respect to input and parameters, for",
        f"{BATCH} samples in single precision. Times are CPU times of the process on one thread in ms, the smallest of",
        f"{ROUNDS} rounds that measure all alternately, with torch {version('torch')}. The machine had other load.", "",
        "## Products with a weight for each triple of grades", "",
        "`GradeProduct` as a module of torch, whose kernels are generated for G(3), G(1,3) and G(3,0,1) and run over",
        "tables of terms for G(4,1); the same layer by `torch.einsum`, and this compiled by `torch.compile`.", "",
        "| algebra | channels | kernels | einsum | compiled einsum | ratio to compiled | deviation |",
        "|---|---:|---:|---:|---:|---:|---:|", *products(),
    ]  # fmt: skip
    if installed("cliffordlayers"):
        lines += [
            "", "## Linear layers over G(3)", "",
            "`Linear` and `CliffordLinear` have one multivector for each pair of channels; `GradeLinear`, which",
            f"commutes with rotations, has one number for each grade. cliffordlayers {version('cliffordlayers')}.", "",
            "| channels | Linear | GradeLinear | CliffordLinear | ratio of Linear |", "|---:|---:|---:|---:|---:|",
            *linear(),
        ]  # fmt: skip
    return pages.publish("tensors", given.out, "\n".join(lines) + "\n", "2 tables")


if __name__ == "__main__":
    sys.exit(main())
