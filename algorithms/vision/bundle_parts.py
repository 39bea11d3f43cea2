"""Which cameras, points and lines of a bundle observations can determine, by counting and by connected parts.

Items are points, and lines after these.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from generated import pga3

from ..arguments import Reals
from ..precision import NEGLIGIBLE
from .status import VisionStatus


@dataclass(frozen=True, slots=True, eq=False)
class Parts:
    """What can be adjusted."""

    used: Reals
    """(k,) bool: observations that are used."""
    camera_status: Reals
    """(c,)"""
    item_status: Reals
    """(m,)"""
    fixed_cameras: Reals
    """(c,) bool"""
    scaled: Reals
    """(s, 2) Cameras whose distance from a second one is held."""


def parts_of(
    camera: Reals, item: Reals, finite: Reals, valid_cameras: Reals, valid_items: Reals, motors: Reals,
    places: Reals, fixed_cameras: Reals | None, fixed_items: Reals, least_cameras: Reals, least_items: int,
) -> Parts:  # fmt: skip
    """Return what can be adjusted of cameras (c,) and items (m,) from the tables (k,) of observations.

    Items that are seen by less than `least_cameras` (m,), and cameras that see less than `least_items` others, are left
    out in turn. What remains must be connected with a camera or item that is fixed. If `fixed_cameras` is None and less
    than three items are fixed, the first camera that remains is held. So is the scale of parts with one fixed camera.
    """
    c, m = len(valid_cameras), len(valid_items)
    held = np.zeros(c, bool) if fixed_cameras is None else fixed_cameras
    cameras = np.where(valid_cameras, VisionStatus.OK, VisionStatus.NOT_FINITE)
    items = np.where(valid_items, VisionStatus.OK, VisionStatus.NOT_FINITE)
    by_default = fixed_cameras is None and fixed_items.sum() < 3
    while True:
        used = finite & (cameras[camera] == VisionStatus.OK) & (items[item] == VisionStatus.OK)
        pairs = np.unique(camera[used] * np.int64(max(m, 1)) + item[used])
        of_camera, of_item = np.bincount(pairs // max(m, 1), minlength=c), np.bincount(pairs % max(m, 1), minlength=m)
        few_items = (items == VisionStatus.OK) & ~fixed_items & (of_item < least_cameras)
        few_cameras = (cameras == VisionStatus.OK) & ~held & (of_camera < least_items)
        if not few_items.any() and not few_cameras.any():
            break
        items[few_items] = VisionStatus.TOO_FEW
        cameras[few_cameras] = VisionStatus.TOO_FEW
    if by_default and (cameras == VisionStatus.OK).any():
        held = held.copy()
        held[int(np.argmax(cameras == VisionStatus.OK))] = True
    labels = _labels(c, m, camera[used], item[used], fixed_items)
    reached = np.zeros(int(labels.max(initial=-1)) + 1, bool)
    reached[labels[:c][held & (cameras == VisionStatus.OK)]] = True
    known = used & fixed_items[item]
    reached[labels[camera[known]]] = True
    cameras[(cameras == VisionStatus.OK) & ~reached[labels[:c]]] = VisionStatus.DISCONNECTED
    items[(items == VisionStatus.OK) & ~fixed_items & ~reached[labels[c:]]] = VisionStatus.DISCONNECTED
    used &= (cameras[camera] == VisionStatus.OK) & (items[item] == VisionStatus.OK)
    known_labels = np.unique(labels[camera[known]])
    common = _Common(camera[used], item[used], c, m)
    scaled = _scaled(labels[:c], cameras == VisionStatus.OK, held, known_labels, common, motors, places)
    return Parts(used, cameras, items, held, scaled)


def _labels(c: int, m: int, camera: Reals, item: Reals, fixed_items: Reals) -> Reals:
    """Return the numbers of connected parts of cameras and items (c + m,); known items connect nothing."""
    links = ~fixed_items[item]
    edges = np.ones(int(links.sum())), (camera[links], c + item[links])
    graph = scipy.sparse.csc_array(edges, shape=(c + m, c + m))
    if not c + m:
        return np.zeros(0, np.int64)
    return np.asarray(scipy.sparse.csgraph.connected_components(graph, directed=False)[1])


@dataclass(frozen=True, slots=True, eq=False)
class _Common:
    """Observations that are used."""

    camera: Reals
    item: Reals
    n_cameras: int
    n_items: int

    def counts(self, camera: int) -> Reals:
        """Return how many of the items of a camera each camera (c,) sees."""
        seen = np.zeros(self.n_items, bool)
        seen[self.item[self.camera == camera]] = True
        return np.bincount(self.camera[seen[self.item]], minlength=self.n_cameras)


def _scaled(
    labels: Reals, usable: Reals, held: Reals, known: Reals, common: _Common, motors: Reals, places: Reals
) -> Reals:
    """Return cameras and the fixed camera whose distance defines the scale, for each part with one fixed camera.

    It is the farthest of the cameras that see at least half as many items of the fixed one as any other does.
    """
    found = []
    centres = pga3.motor_to_matrix(motors)[:, :3, 3] if len(motors) else np.zeros((0, 3))
    extent = float(np.ptp(places, axis=0).max()) if len(places) else 0.0
    for label in np.unique(labels[usable & held]):
        here = usable & (labels == label)
        if label in known or (here & held).sum() != 1:
            continue
        first = int(np.flatnonzero(here & held)[0])
        counts = np.where(here & ~held, common.counts(first), 0)
        linked = (counts > 0) & (2 * counts >= counts.max())
        distance = np.where(linked, np.linalg.norm(centres - centres[first], axis=1), 0)
        if distance.size and distance.max() > NEGLIGIBLE * extent:
            found.append((int(distance.argmax()), first))
    return np.array(found, np.int64).reshape(-1, 2)
