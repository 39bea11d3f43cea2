"""Masks and models of spheres for the tests of `algorithms.shapes`."""

from pathlib import Path

import numpy as np

MASKS = Path(__file__).parents[1] / "data" / "shapes" / "sphere_masks.npz"
LUNG_SPACING = (1.366, 1.366, 2.5)


def stored_mask(name: str) -> np.ndarray:
    """A mask of real data: lung_fixed, lung_moving or liver."""
    with np.load(MASKS) as file:
        shape = tuple(file[f"{name}_shape"])
        return np.unpackbits(file[name])[: np.prod(shape)].reshape(shape).astype(bool)


def ball_mask(radius: float, n: int = 33) -> np.ndarray:
    """The voxels of a ball in the middle of a cube of n voxels."""
    grid = np.indices((n, n, n)) - n // 2
    return (grid**2).sum(0) < radius**2


def border_points(mask: np.ndarray, spacing: tuple[float, float, float] = (1, 1, 1)) -> np.ndarray:
    """The centres of voxels of the object with an outer neighbour along an axis."""
    padded = np.pad(mask, 1)
    inner = padded[1:-1, 1:-1, 1:-1].copy()
    for axis in range(3):
        for step in (1, -1):
            inner &= np.roll(padded, step, axis)[1:-1, 1:-1, 1:-1]
    return np.argwhere(mask & ~inner) * np.array(spacing, float)


def distance_from_spheres(points: np.ndarray, balls: np.ndarray) -> np.ndarray:
    """The distance of each point from the nearest sphere."""
    least = np.full(len(points), np.inf)
    for x, y, z, r in balls:
        np.minimum(least, np.abs(np.sqrt(((points - (x, y, z)) ** 2).sum(1)) - r), out=least)
    return least


def warped_models(seed: int, inliers: int = 200, outliers: int = 40) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Two models with outliers in both, and the index of the partner of each ball of the first, -1 for an outlier."""
    rng = np.random.default_rng(seed)
    phase = rng.uniform(0, 6, 3)
    centres, radii = rng.uniform(-10, 10, (inliers, 3)), rng.uniform(0.3, 1.5, inliers)
    moved = 1.05 * centres + 0.5 * np.sin(centres[:, [1, 2, 0]] / 5 + phase) + [3, 1, -2]
    order = rng.permutation(inliers)
    low, high = moved.min(0), moved.max(0)
    first = (
        np.column_stack([centres, radii]),
        np.column_stack([rng.uniform(-10, 10, (outliers, 3)), rng.uniform(0.3, 1.5, outliers)]),
    )
    second = (
        np.column_stack([moved, 1.05 * radii])[order],
        np.column_stack([rng.uniform(low, high, (outliers, 3)), rng.uniform(0.3, 1.5, outliers)]),
    )
    return np.vstack(first), np.vstack(second), np.concatenate([np.argsort(order), np.full(outliers, -1)])
