"""How long operators and layers take on a device: moving points beside a copy, loops, and products beside einsum.

Times are those of events of the device, in ms. On the CPU (``--device cpu``), which shows only that the script runs,
they are CPU times of the process.
"""

from __future__ import annotations

import argparse
import importlib
import sys
import time
from collections.abc import Callable, Mapping
from functools import partial
from statistics import median
from typing import Any

from algorithms.learning import Algebra, GradeProduct
from algorithms.learning.frameworks import torch_module
from gacompiler import SCALAR, array, cos, fold, kernel, sandwich, sin
from gacompiler.algebra.catalog import PGA3, VGA3

from .libraries import installed
from .tensors import PRODUCTS, by_einsum, step

ROUNDS = 9


@kernel(m=PGA3.MOTOR, p=PGA3.POINT)
def move_point(m: Any, p: Any) -> Any:
    """Move a point."""
    return sandwich(m, p)


@kernel(q=array(SCALAR, "n"), axes=array(VGA3.BIVECTOR, "n"), tool=VGA3.ROTOR)
def arm(q: Any, axes: Any, tool: Any) -> Any:
    """Return the orientation of a tool by a product of exponentials."""
    return fold(lambda m, a, axis: m * (cos(a / 2) - sin(a / 2) * axis), 1, q, axes) * tool


def milliseconds(torch: Any, device: str, calls: Mapping[str, Callable[[], object]]) -> dict[str, float]:
    """Return the medians of rounds that measure all calls alternately, after one call of each that compiles."""
    found: dict[str, list[float]] = {name: [] for name in calls}
    for call in calls.values():
        call()
    for _ in range(ROUNDS):
        for name, call in calls.items():
            if device == "cpu":
                start = time.process_time()
                call()
                found[name].append(1e3 * (time.process_time() - start))
                continue
            first, last = (torch.cuda.Event(enable_timing=True) for _ in range(2))
            first.record()
            call()
            last.record()
            torch.cuda.synchronize()
            found[name].append(first.elapsed_time(last))
    return {name: median(times) for name, times in found.items()}


def gradient(run: Callable[..., Any], learned: Any, given: Any) -> None:
    """Compute the gradient of a sum by the first argument."""
    run(learned, given).sum().backward()


def rows(torch: Any, device: str, count: int) -> list[str]:
    """Return the rows of the table: what is measured, its time, that of the peer, and the ratio."""
    operator = importlib.import_module("gacompiler.torch").operator
    found = []
    for real in ("float32", "float64"):
        like: Any = {"device": device, "dtype": getattr(torch, real)}
        motor = torch.eye(8, **like)[0]
        points = torch.randn(3, count, **like).T  # structures of arrays
        moved, learned = operator(move_point), motor.clone().requires_grad_()
        calls: dict[str, Callable[[], object]] = {
            "moved": partial(moved, motor, points),
            "copy": points.clone,
            "gradient": partial(gradient, moved, learned, points),
        }
        times = milliseconds(torch, device, calls)
        for name, text in (("moved", "points moved"), ("gradient", "gradient by the motor")):
            found.append(row(f"{count:,} {text}, {real}", times[name], "copy", times["copy"]))
        q, axes, tool = torch.randn(count // 10, 6, **like), torch.eye(3, **like).repeat(2, 1), torch.eye(4, **like)[0]
        times = milliseconds(torch, device, {"arm": partial(operator(arm), q, axes, tool)})
        found.append(row(f"{count // 10:,} arms of six joints, {real}", times["arm"]))
    for name, channels in PRODUCTS:
        algebra = Algebra.of(name)
        x = torch.randn(4096 if device != "cpu" else 16, channels, algebra.size, device=device, requires_grad=True)
        module = torch_module(GradeProduct(), algebra, channels)
        peer = by_einsum(module, algebra).to(device)
        module = module.to(device)
        calls = {"kernels": step(module, x), "peer": step(peer, x)}
        if device != "cpu":
            calls |= {"compiled": step(torch.compile(module), x), "peer": step(torch.compile(peer), x)}
        times = milliseconds(torch, device, calls)
        found.append(row(f"GradeProduct, {name}, {channels} channels", times["kernels"], "einsum", times["peer"]))
        if "compiled" in times:
            found.append(row(f"the same by torch.compile, {name}", times["compiled"], "einsum", times["peer"]))
    return found


def row(text: str, time: float, peer: str = "", other: float = 0.0) -> str:
    """Return a row of the table."""
    return f"| {text} | {time:.3f} | " + (f"{peer} {other:.3f} | {time / other:.2f} |" if peer else "| |")


def main(arguments: list[str] | None = None) -> int:
    """Measure and print. Return the exit status, which is 1 without a device."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks gpu", description=__doc__)
    parser.add_argument("--device", default="cuda")
    parser.add_argument("--count", type=int, default=1_000_000, help="number of points")
    given = parser.parse_args(arguments)
    if not installed("torch"):
        print("gpu: torch is not installed; run: pip install torch", file=sys.stderr)
        return 1
    torch = importlib.import_module("torch")
    if given.device != "cpu" and not torch.cuda.is_available():
        print(f"gpu: torch {torch.__version__} finds no device; expected one, or --device cpu", file=sys.stderr)
        return 1
    torch.manual_seed(0)
    name = "the CPU" if given.device == "cpu" else torch.cuda.get_device_name(given.device)
    print(f"On {name}, torch {torch.__version__}; medians of {ROUNDS} rounds, in ms.\n")
    print("| | time | peer | ratio |\n|---|---:|---:|---:|")
    for line in rows(torch, given.device, given.count):
        print(line)
    return 0


if __name__ == "__main__":
    sys.exit(main())
