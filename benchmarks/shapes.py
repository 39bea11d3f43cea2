"""How near contours, segments and models of shapes are to the truth, and how long they take, beside other libraries."""

from __future__ import annotations

import importlib
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from algorithms.shapes import (
    fit_balls,
    march,
    marching_cubes,
    register_spheres,
    segment,
    surface,
    trace_contour,
    union_of_spheres,
)  # fmt: skip
from algorithms.shapes.contours import dense

from . import pages
from .libraries import installed
from .machine import version

PAGE = Path("docs/shapes-speed.md")
DATA = Path(__file__).parents[1] / "tests" / "data" / "shapes"
LUNG = (1.366, 1.366, 2.5)
LIVER = (3.0, 3.0, 3.0)
SEEDS = 6
DRIFT = 400
"""Points of a surface for pycpd, whose time grows with their square."""
PEERS = {"skimage": "scikit-image", "SimpleITK": "SimpleITK", "pycpd": "pycpd", "trimesh": "trimesh"}
Array = np.ndarray[Any, Any]


def timed(call: Callable[[], Any], repeats: int = 3) -> tuple[Any, float]:
    """Return a result, and the least seconds of processor time that it took."""
    found, least = None, np.inf
    for _ in range(repeats):
        start = time.process_time()
        found = call()
        least = min(least, time.process_time() - start)
    return found, least


def mask_of(name: str) -> Array:
    """Return a stored mask."""
    with np.load(DATA / "sphere_masks.npz") as file:
        shape = tuple(file[f"{name}_shape"])
        return np.asarray(np.unpackbits(file[name])[: np.prod(shape)].reshape(shape).astype(bool))


def dice(a: Array, b: Array) -> float:
    """Return the Dice coefficient of two masks."""
    return float(2 * np.count_nonzero(a & b) / (np.count_nonzero(a) + np.count_nonzero(b)))


def both_ways(path: Array, truth: Array) -> str:
    """Return the larger mean and the largest distance of two closed paths, as columns."""
    a, b = dense(path), dense(truth)
    there, back = cKDTree(a).query(b)[0], cKDTree(b).query(a)[0]
    return f"{max(there.mean(), back.mean()):.2f} | {max(there.max(), back.max()):.1f}"


def contours() -> list[str]:
    """Return the rows of contours of the horse of scikit-image."""
    if not installed("skimage"):
        return []
    data, measure, segmentation = (importlib.import_module(f"skimage.{m}") for m in ("data", "measure", "segmentation"))
    mask = ~data.horse()
    line = max(measure.find_contours(np.pad(mask, 1).astype(float), 0.5), key=len)[:-1] - 1
    found, spent = timed(lambda: trace_contour(mask))
    rows = [f"| `trace_contour` | {len(found.path)} | {both_ways(found.path, line)} | {spent:.2f} |"]
    smooth = ndimage.gaussian_filter(mask.astype(float), 2)
    turns = np.linspace(0, 2 * np.pi, 400, endpoint=False)
    half = (np.array(mask.shape) - 1) / 2
    start = half + half * np.column_stack([np.sin(turns), np.cos(turns)])
    snake, spent = timed(lambda: segmentation.active_contour(smooth, start, alpha=0.001, beta=0.1, gamma=0.01), 1)
    rows.append(f"| scikit-image, `active_contour` | {len(snake)} | {both_ways(snake, line)} | {spent:.2f} |")
    edges = segmentation.inverse_gaussian_gradient(mask.astype(float), 100, 1)
    level = np.zeros(mask.shape, np.int8)
    level[5:-5, 5:-5] = 1
    region, spent = timed(lambda: segmentation.morphological_geodesic_active_contour(edges, 300, level, 1, 0.7, -1), 1)
    path = max(measure.find_contours(np.pad(region, 1).astype(float), 0.5), key=len)[:-1] - 1
    name = "scikit-image, `morphological_geodesic_active_contour`"
    return [*rows, f"| {name} | {len(path)} | {both_ways(path, line)} | {spent:.2f} |"]


def connected(density: Array, seed: tuple[int, ...]) -> Array:
    """Return the region of a seed by ConfidenceConnected of SimpleITK, after smoothing by its curvature flow."""
    peer = importlib.import_module("SimpleITK")
    image = peer.CurvatureFlow(peer.GetImageFromArray(density.astype(np.float32)), 0.125, 5)
    found = peer.ConfidenceConnected(image, [tuple(int(i) for i in seed[::-1])], 5, 2.5, 2)
    return np.asarray(peer.GetArrayFromImage(found)) > 0


def segments(count: int) -> list[str]:
    """Return the rows of organs, each from several seeds."""
    with np.load(DATA / "abdomen.npz") as file:
        density, labels = file["density"], file["labels"]
    rows = []
    for name, label in (("liver", 5), ("spleen", 1)):
        mask = labels == label
        depth = ndimage.distance_transform_edt(mask)
        inner = np.argwhere(depth > 0.8 * depth.max())
        seeds = [tuple(seed) for seed in inner[:: max(1, len(inner) // count)][:count]]
        methods: dict[str, Callable[[Any], Array]] = {"`segment`": lambda seed: segment(density, seed, LIVER).mask}
        if installed("SimpleITK"):
            methods["SimpleITK, `ConfidenceConnected`"] = lambda seed: connected(density, seed)
        for method, call in methods.items():
            results = [timed(lambda c=call, s=seed: c(s), 1) for seed in seeds]  # type: ignore[misc]
            scores = [dice(found, mask) for found, _ in results]
            spent = float(np.median([seconds for _, seconds in results]))
            rows.append(f"| {name}, {method} | {min(scores):.3f} | {max(scores):.3f} | {spent:.2f} |")
    return rows


def surfaces() -> list[str]:
    """Return the rows of surfaces of masks."""
    rows = []
    for name, spacing in (("liver", LIVER), ("lung_fixed", LUNG)):
        found, spent = timed(lambda n=name, s=spacing: surface(mask_of(n), s), 1)  # type: ignore[misc]
        mean, largest = (100 * max(d) / found.diagonal for d in (found.mean_distances, found.largest_distances))
        rows.append(
            f"| {name}, {found.status.name} | {len(found.nodes)} | {found.genus} | {mean:.2f} | {largest:.1f} "
            f"| {spent:.1f} |"
        )
    return rows


def cubes() -> list[str]:
    """Return the rows of marching cubes."""
    mask = mask_of("lung_fixed")
    voxels = mask.sum() * float(np.prod(LUNG))
    mesh, spent = timed(lambda: marching_cubes(mask, spacing=LUNG), 9)
    rows = [f"| `marching_cubes` | {len(mesh.points):,} | {100 * mesh.volume() / voxels:.2f} | {1e3 * spent:.0f} |"]
    if installed("skimage") and installed("trimesh"):
        measure, trimesh = importlib.import_module("skimage.measure"), importlib.import_module("trimesh")
        (points, faces, *_), spent = timed(
            lambda: measure.marching_cubes(mask, 0.5, spacing=LUNG, method="lorensen"), 9
        )
        volume = abs(trimesh.Trimesh(points, faces, process=False).volume)
        rows.append(f"| scikit-image | {len(points):,} | {100 * volume / voxels:.2f} | {1e3 * spent:.0f} |")
    return rows


def models() -> list[str]:
    """Return the rows of models of spheres."""
    rows = []
    for name, spacing in (("liver", LIVER), ("lung_fixed", LUNG)):
        mask = mask_of(name)
        for size in (2, 3):
            coarse = mask[::size, ::size, ::size]
            united, spent = timed(lambda m=coarse: union_of_spheres(m, distinct=False), 1)  # type: ignore[misc]
            rows.append(f"| {name}, union of spheres, every voxel {size} | {len(united):,} | | {spent:.1f} |")
            marched, spent = timed(lambda m=mask, k=size: march(m, k), 1)  # type: ignore[misc]
            count = f"{len(marched.balls):,}"
            rows.append(
                f"| {name}, marching spheres of {size} voxels | {count} | {marched.overlap:.3f} | {spent:.1f} |"
            )
        model, spent = timed(lambda m=mask, s=spacing: fit_balls(m, 0.95, s), 2)  # type: ignore[misc]
        rows.append(f"| {name}, maximal balls | {len(model.balls):,} | {model.overlap:.3f} | {spent:.1f} |")
    return rows


def registrations() -> list[str]:
    """Return the rows of the registration of lungs at two times."""
    masks = [mask_of(name) for name in ("lung_fixed", "lung_moving")]
    balls = [fit_balls(mask, 0.95, LUNG).balls for mask in masks]
    points = [marching_cubes(np.pad(mask, 1), spacing=LUNG).points - LUNG for mask in masks]
    found, spent = timed(lambda: register_spheres(balls[0], balls[1]), 1)
    rows = [f"| `register_spheres` | {distances(found.warp(points[0]), points[1])} | {spent:.1f} |"]
    if installed("pycpd"):
        peer = importlib.import_module("pycpd")
        rng = np.random.default_rng(0)
        few = [part[rng.choice(len(part), DRIFT, replace=False)] for part in points]
        centred = [part - part.mean(0) for part in few]
        size = float(np.std(centred[1]))
        drift = peer.DeformableRegistration(X=centred[1] / size, Y=centred[0] / size, alpha=2, beta=2)
        _, spent = timed(drift.register, 1)
        scaled = (points[0] - few[0].mean(0)) / size
        moved = (scaled + np.exp(-cdist(scaled, drift.Y, "sqeuclidean") / (2 * drift.beta**2)) @ drift.W) * size + few[
            1
        ].mean(0)
        rows.append(f"| pycpd, deformable, {DRIFT} points | {distances(moved, points[1])} | {spent:.1f} |")
    return rows


def distances(moved: Array, target: Array) -> str:
    """Return the mean and the 95th percentile of distances there and back, the larger ones, as columns."""
    there, back = cKDTree(target).query(moved)[0], cKDTree(moved).query(target)[0]
    mean, most = (max(f(there), f(back)) for f in (np.mean, lambda d: np.quantile(d, 0.95)))
    return f"{mean:.2f} | {most:.2f}"


def table(head: str, rows: list[str]) -> list[str]:
    """Return the lines of a table whose first column is text."""
    columns = head.count("|") - 1
    return [head, "| --- |" + " ---: |" * (columns - 1), *rows, ""]


def page(count: int) -> str:
    """All figures as Markdown."""
    versions = ", ".join(f"{name} {version(name)}" for module, name in PEERS.items() if installed(module))
    lines = [
        "# How near shapes are to the truth, and how fast",
        "",
        f"Written by `python -m benchmarks shapes`, beside {versions}.",
        "Times are processor seconds of one thread. Data are those of `tests/data/shapes`.",
        "",
        "The silhouette of a horse (328 x 400 pixels). Distances in pixels from its level line, the larger of both",
        "directions:",
        "",
        *table("| | points | mean | largest | s |", contours()),
        f"Organs of a CT from one voxel, {count} seeds each in the inner part. Dice coefficients of the worst and the",
        "best seed:",
        "",
        *table("| | worst | best | median s |", segments(count)),
        "Surfaces of masks. Distances in percent of the diagonal, the larger of both directions:",
        "",
        *table("| | nodes | genus | mean | largest | s |", surfaces()),
        "Marching cubes of the lungs. Volumes in percent of that of the voxels:",
        "",
        *table("| | vertices | volume | ms |", cubes()),
        "Models of spheres. The overlap of marching spheres is that with the full cells inside:",
        "",
        *table("| | spheres | overlap | s |", models()),
        "The lungs of one patient at two times, registered by their maximal balls (found before) or by points.",
        "Distances of the surfaces in mm, the larger of both directions:",
        "",
        *table("| | mean | 95 % | s |", registrations()),
    ]
    return "\n".join(lines).rstrip() + "\n"


def main(arguments: list[str] | None = None) -> int:
    """Measure, and write the page; arguments are those of the command line, or by default of the process."""
    options = pages.options("shapes", __doc__, PAGE).parse_args(arguments)
    return pages.publish("shapes", options.out, page(1 if options.quick else SEEDS), "6 tables")


if __name__ == "__main__":
    sys.exit(main())
