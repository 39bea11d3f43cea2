"""How good planned grasps are, how long planning takes, and how far contacts are from the scans."""

from __future__ import annotations

import importlib
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from algorithms.grasping import GraspStatus, grasp_quality, plan_grasps
from generated import grasping

from . import pages
from .libraries import installed
from .machine import version

PAGE = Path("docs/grasping-speed.md")
SCANS = Path("tests/data/grasping/scans.npz")
NAMES = "MustardBottle", "Banana", "PowerDrill", "TomatoSoupCan", "CrackerBox", "FoamBrick"
POSES, QUICK_POSES = 20, 2
TRIPLES = 2000
Array = np.ndarray[Any, Any]


def random_best(vertices: Array, faces: Array, count: int = TRIPLES, seed: int = 0) -> float:
    """Return the largest quality of random triples of the surface, with the same cones, centre and length."""
    areas, volume, first, _ = grasping.mesh_moments(vertices, *np.ascontiguousarray(faces.T))
    centre = first / volume
    length = float(np.linalg.norm(vertices - centre, axis=1).max())
    sizes = np.linalg.norm(areas, axis=1)
    rng = np.random.default_rng(seed)
    chosen = rng.choice(len(faces), 3 * count, p=sizes / sizes.sum())
    shares = rng.dirichlet(np.ones(3), 3 * count)
    points = (shares[..., None] * vertices[faces[chosen]]).sum(1).reshape(-1, 3, 3)
    normals = (areas[chosen] / sizes[chosen, None]).reshape(-1, 3, 3)
    twists = rng.standard_normal((64, 6))
    twists /= np.linalg.norm(twists, axis=1, keepdims=True)
    bounds = grasping.quality_bound((points - centre) / length, normals, 0.5, twists)
    best = 0.0
    for row in np.argsort(-bounds):
        # The bounds of all remaining triples are lower than the quality that has been found.
        if bounds[row] <= best:
            break
        best = max(best, grasp_quality(points[row], normals[row], centre=centre, length=length))
    return best


def objects(poses: int) -> list[str]:
    """Return a row for each scan and style."""
    rows = []
    with np.load(SCANS) as file:
        scans = {name: (file[f"{name}_vertices"] / 2e5, file[f"{name}_faces"].astype(np.intp)) for name in NAMES}
    for name, (vertices, faces) in scans.items():
        reference = random_best(vertices, faces)
        for style in (1, 2, 3):
            closed, ratios, gaps, spent = 0, [], [], []
            for seed in range(poses):
                turn = Rotation.random(random_state=seed).as_matrix()
                moved = vertices @ turn.T + np.random.default_rng(seed).uniform(-1, 1, 3)
                start = time.process_time()
                plan = plan_grasps(moved, faces, style)
                spent.append(1e3 * (time.process_time() - start))
                closed += plan.status == GraspStatus.OK
                ratios.append(plan[0].quality / reference)
                gaps.append(distance(moved, faces, plan[0].contacts))
            gap = "" if np.isnan(gaps).all() else f"{1e6 * np.nanmax(gaps):.3f}"
            rows.append(
                f"| {name} | {style} | {closed} of {poses} | {min(ratios):.2f} | {gap} "
                f"| {np.median(spent):.1f} | {max(spent):.1f} |"
            )
    return rows


def distance(vertices: Array, faces: Array, contacts: Array) -> float:
    """Return the largest distance of contacts from a mesh by trimesh; NaN if it is not installed."""
    if not installed("trimesh") or not np.isfinite(contacts).all():
        return np.nan
    # Only faces near the contacts, so that no search tree is needed.
    near = np.linalg.norm(vertices[faces].mean(1)[:, None] - contacts, axis=-1).argsort(0)[:200]
    triangles = importlib.import_module("trimesh.triangles")
    gaps = [
        np.linalg.norm(triangles.closest_point(vertices[faces[near[:, k]]], np.tile(p, (len(near), 1))) - p, axis=1)
        for k, p in enumerate(contacts)
    ]
    return float(max(gap.min() for gap in gaps))


def page(rows: list[str]) -> str:
    """All figures as Markdown."""
    peer = f"trimesh {version('trimesh')}" if installed("trimesh") else "trimesh, which is not installed"
    lines = [
        "# How good planned grasps are, and how fast",
        "",
        f"Written by `python -m benchmarks grasping`. Distances are those of {peer}. Times are",
        "processor milliseconds of one thread for one call of `plan_grasps`.",
        "",
        "Each scan is put into random poses. The ratio is that of the quality of the best grasp to the best of",
        f"{TRIPLES:,} random triples of the surface, which need not be within reach of a hand; the smallest of all",
        "poses. Friction is 0.5.",
        "",
        "| scan | style | force closure | ratio | distance µm | median ms | worst ms |",
        "| --- | ---: | ---: | ---: | ---: | ---: | ---: |",
        *rows,
        "",
    ]
    return "\n".join(lines)


def main(arguments: list[str] | None = None) -> int:
    """Write the page."""
    options = pages.options("grasping", __doc__, PAGE).parse_args(arguments)
    rows = objects(QUICK_POSES if options.quick else POSES)
    return pages.publish("grasping", options.out, page(rows), f"{len(rows)} rows")


if __name__ == "__main__":
    sys.exit(main())
