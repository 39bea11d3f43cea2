"""The pictures of docs/tensor-voting.md: saliency on a sphere, curves in space, and a deformation.

``python -m benchmarks.tensor_voting_pictures`` draws them again.
"""

from __future__ import annotations

from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from algorithms.registration import extract_curves, extract_junctions, register_deformable, tensor_vote
from algorithms.registration.pictures_of_votes import plot_curves, plot_deformation, plot_saliency

ROOT = Path(__file__).parents[1]
FISH = ROOT / "tests" / "data" / "registration" / "fish.txt"
SIGMA = 0.1
Array = np.ndarray[Any, Any]


def frame_and_ring(n: int, rng: np.random.Generator) -> Array:
    """Return n tokens on each edge of a cube, 4 n on a ring inside it, and as many outliers in all."""
    corners = np.array(list(product((0.0, 1.0), repeat=3)))
    edges = [(a, b) for a in corners for b in corners if (a <= b).all() and np.abs(a - b).sum() == 1]
    turn = rng.uniform(0, 2 * np.pi, (4 * n, 1))
    ring = 0.5 + 0.3 * (np.cos(turn) * [1, 0, 0] + np.sin(turn) * [0, 0.8, 0.6])
    tokens = np.concatenate([*(a + (b - a) * rng.uniform(size=(n, 1)) for a, b in edges), ring])
    return np.concatenate([tokens, rng.uniform(-0.2, 1.2, tokens.shape)])


def draw(folder: Path, tokens: int = 80) -> None:
    """Draw the pictures, with a number of tokens for each edge."""
    rng = np.random.default_rng(0)
    sphere = rng.normal(size=(25 * tokens, 3))
    sphere /= np.linalg.norm(sphere, axis=1, keepdims=True)
    votes = tensor_vote(np.concatenate([sphere, rng.uniform(-1.5, 1.5, (75 * tokens, 3))]), sigma=0.15)
    plot_saliency(votes).savefig(folder / "tensor-voting.png", dpi=60)
    points = frame_and_ring(tokens, np.random.default_rng(0))
    curves, junctions = extract_curves(points, sigma=SIGMA), extract_junctions(points, sigma=SIGMA)
    plot_curves(points, curves, junctions).savefig(folder / "curves-in-space.png", dpi=110)
    fish = np.loadtxt(FISH)
    source, target = fish[:, :2], fish[:, 2:]
    found = register_deformable(source, target, radius=0.6)
    plot_deformation(source, target, found).savefig(folder / "deformation.png", dpi=80)


if __name__ == "__main__":
    draw(ROOT / "docs")
