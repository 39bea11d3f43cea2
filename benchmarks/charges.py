"""Errors of predicted motions of charges: `Interaction` beside the same steps with as many real parameters.

Both compute messages of pairs ten times, with the same parameters, and add them to velocities and places. Those of
`Interaction` are directions times functions of invariants. The others are functions of seven numbers, for each of both
charges: the differences of places and of velocities, and the product of the charges. Training is the same, on 1,000
motions. A second real network is shown every batch turned at random.
"""

from __future__ import annotations

import argparse
import importlib
import sys
import time
from collections.abc import Callable
from itertools import pairwise
from statistics import median
from typing import Any

import numpy as np

from algorithms.learning import Interaction, Network
from algorithms.learning.charges import PARTICLES, Motions, error_of_places, simulate_charges, train_charges

STEPS, HIDDEN, WIDTH = 10, 32, 30
"""Steps; widths of the layers of `Interaction`, and of the real ones, which then have a few parameters more."""
RATE, BATCH, CLIP = 0.002, 25, 0.75
"""Those of `train_charges`."""


def real_steps(torch: Any, steps: int = STEPS, width: int = WIDTH) -> Any:
    """Return the network of real messages as a module of torch, of motions (n, 10, 8) to places (n, 5, 3)."""
    base: Any = torch.nn.Module

    class Steps(base):  # type: ignore[misc]
        def __init__(self) -> None:
            super().__init__()
            sizes = (7, width, width, 6)
            linear = [torch.nn.Linear(a, b) for a, b in pairwise(sizes)]
            linear[-1].weight.data *= 0.1  # as in Interaction
            self.messages = torch.nn.Sequential(linear[0], torch.nn.SiLU(), linear[1], torch.nn.SiLU(), linear[2])

        def forward(self, x: Any) -> Any:
            i, j = map(torch.as_tensor, np.nonzero(~np.eye(PARTICLES, dtype=bool)))
            charge, place, velocity = x[:, :PARTICLES, 0], x[:, :PARTICLES, 1:4], x[:, PARTICLES:, 1:4]
            product = (charge[:, i] * charge[:, j])[..., None]
            for _ in range(steps):
                given = torch.cat([place[:, i] - place[:, j], velocity[:, i] - velocity[:, j], product], -1)
                message = self.messages(given)
                total = x.new_zeros(len(x), PARTICLES, 6).index_add(1, i, message)
                velocity = velocity + total[..., :3]
                place = place + velocity / steps + total[..., 3:]
            return place

    return Steps()


def trained(torch: Any, network: Any, sets: list[Motions], epochs: int, *, turned: bool) -> float:
    """Return the test error of the epoch with the smallest validation error."""
    (x, y), *others = [(torch.tensor(one.inputs).float(), torch.tensor(one.targets[..., 1:4]).float()) for one in sets]
    optimiser, batches = torch.optim.Adam(network.parameters(), lr=RATE), -(-len(x) // BATCH)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, epochs * batches)
    found = []
    for _ in range(epochs):
        for rows in torch.randperm(len(x)).split(BATCH):
            given, wanted = x[rows], y[rows]
            if turned:
                turn = torch.linalg.qr(torch.randn(len(rows), 3, 3))[0]
                given[..., 1:4] = torch.einsum("nij,ncj->nci", turn, given[..., 1:4])
                wanted = torch.einsum("nij,ncj->nci", turn, wanted)
            optimiser.zero_grad()
            (network(given) - wanted).square().mean().backward()
            torch.nn.utils.clip_grad_norm_(network.parameters(), CLIP)
            optimiser.step()
            schedule.step()
        with torch.no_grad():
            found.append([(network(a) - b).square().mean().item() for a, b in others])
    return float(min(found)[1])


def compare(torch: Any, seed: int, epochs: int, count: int) -> dict[str, tuple[float, float]]:
    """Return the test errors and the CPU times by network; the seed determines the motions and first parameters."""
    sets = [simulate_charges(count, 3000 + 3 * seed + k) for k in range(3)]
    torch.manual_seed(seed)

    def geometric() -> float:
        layer = Interaction(PARTICLES, STEPS, (HIDDEN, HIDDEN))
        network = Network([layer], "G(3)", 2 * PARTICLES, seed=seed, dtype=np.float32)
        train_charges(network, sets[0], sets[1], epochs, seed=seed)
        return error_of_places(network, sets[2])

    runs: dict[str, Callable[[], float]] = {
        "Interaction": geometric,
        "real": lambda: trained(torch, real_steps(torch), sets, epochs, turned=False),
        "real, turned": lambda: trained(torch, real_steps(torch), sets, epochs, turned=True),
    }
    found = {}
    for name, run in runs.items():
        start = time.process_time()
        found[name] = run(), time.process_time() - start
    return found


def main(arguments: list[str] | None = None) -> int:
    """Train and print. Return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks charges", description=__doc__)
    parser.add_argument("--seeds", type=int, nargs="+", default=list(range(60, 67)))
    parser.add_argument("--epochs", type=int, default=60)
    parser.add_argument("--count", type=int, default=1000, help="motions for training, selection and test, each")
    given = parser.parse_args(arguments)
    torch = importlib.import_module("torch")
    torch.set_num_threads(1)
    rows = []
    for seed in given.seeds:
        rows.append(compare(torch, seed, given.epochs, given.count))
        cells = (f"{name} {error:.4f} ({seconds:.0f} s)" for name, (error, seconds) in rows[-1].items())
        print(f"seed {seed}: {'; '.join(cells)}", flush=True)
    for name in rows[0]:
        print(f"{name}: median {median(row[name][0] for row in rows):.4f}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
