"""Segmentation of volumes with known regions."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import ndimage

from algorithms.shapes import SegmentStatus, segment
from tests.support.all_cases import all_cases

Array = np.ndarray[Any, Any]

ABDOMEN = Path(__file__).parents[1] / "data" / "shapes" / "abdomen.npz"


def scene(noise: float = 8.0) -> tuple[Array, Array]:
    """An ellipsoid in voxels of 1 x 1 x 2 mm beside a block of equal density, joined with it by a thin rod."""
    x, y, z = (np.indices((60, 50, 30)).T * [1.0, 1, 2]).T
    ball = ((x - 22) / 16) ** 2 + ((y - 25) / 18) ** 2 + ((z - 30) / 22) ** 2 < 1
    block = x > 48
    rod = (np.hypot(y - 25, z - 30) < 3) & (x > 30)
    volume = np.where(ball | block | rod, 100.0, 0.0) + np.random.default_rng(0).normal(size=x.shape) * noise
    return volume, ball


def dice(a: Array, b: Array) -> float:
    return float(2 * (a & b).sum() / (a.sum() + b.sum()))


@pytest.mark.parametrize(
    "seed", [(14, 30, 12), *(pytest.param(seed, marks=pytest.mark.slow) for seed in ((22, 25, 15), (26, 18, 18)))]
)
def test_region_does_not_leak_through_a_neck(seed: tuple[int, int, int]) -> None:
    volume, ball = scene()
    found = segment(volume, seed, (1, 1, 2), neck=4).mask
    assert found.shape == volume.shape and found.dtype == bool
    assert dice(found, ball) > 0.95
    assert dice(segment(volume, seed, (1, 1, 2), neck=0).mask, ball) < 0.8


def test_holes_are_filled_and_slices_are_accepted() -> None:
    rows, columns = np.indices((80, 80))
    disc = np.hypot(rows - 40, columns - 40) < 22
    hole = np.hypot(rows - 45, columns - 40) < 4
    image = np.where(disc & ~hole, 500, -200) + np.random.default_rng(1).normal(size=disc.shape) * 30
    found = segment(image, (30, 40)).mask
    assert dice(found, disc) > 0.98 and found[hole].all()


@pytest.mark.parametrize(
    "kind", [np.int16, *(pytest.param(kind, marks=pytest.mark.slow) for kind in (np.uint8, np.int32, np.float32))]
)
def test_types_and_automatic_seed(kind: type) -> None:
    volume, _ = scene(2.0)
    whole = segment((volume + 20).clip(0, 200).astype(kind), neck=0).mask
    assert dice(whole, volume > 50) > 0.95


@all_cases(
    "change, message",
    [
        ({"seed": (99, 0, 0)}, "outside"),
        ({"seed": (1, 2)}, "expected 3 indices"),
        ({"spacing": (1, 1, 0)}, "expected 3 positive"),
        ({"neck": -1.0}, "at least 0"),
        ({"volume": np.full((5, 5, 5), np.nan)}, "nan at"),
        ({"volume": np.ones((5, 5, 5))}, "all voxels are equal"),
        ({"volume": np.zeros((0, 5, 5))}, "no elements"),
        ({"volume": np.broadcast_to(np.uint8(1), (3000, 3000, 3000))}, "27,000,000,000 elements"),
    ],
)
def test_errors_name_what_is_wrong(change: dict[str, Any], message: str) -> None:
    arguments: dict[str, Any] = {"volume": scene()[0], "seed": (2, 2, 2), **change}
    with pytest.raises(ValueError, match=message):
        segment(**arguments)


def test_seeds_must_be_integers() -> None:
    with pytest.raises(TypeError, match="expected indices"):
        segment(scene()[0], (1.5, 2, 3))


@pytest.mark.parametrize(("label", "count", "least"), [pytest.param(5, 1, 0.92, marks=pytest.mark.slow), (1, 1, 0.78)])
def test_organs_of_a_real_volume(label: int, count: int, least: float) -> None:
    with np.load(ABDOMEN) as file:
        density, mask = file["density"], file["labels"] == label
    depth = ndimage.distance_transform_edt(mask)
    inner = np.argwhere(depth > 0.8 * depth.max())
    for seed in inner[:: max(1, len(inner) // count)][:count]:
        assert dice(segment(density, seed, (3, 3, 3)).mask, mask) > least


def blocks(contrast: float, noise: float) -> Array:
    """A block of 18 x 18 x 18 voxels in another density, with a rod of three voxels across through the volume."""
    volume = np.zeros((30, 30, 30))
    volume[6:24, 6:24, 6:24] = contrast
    volume[26:29, 26:29] = contrast
    return volume + noise * np.random.default_rng(5).normal(size=volume.shape)


def test_result_has_a_status_and_converts_to_its_mask() -> None:
    found = segment(blocks(10.0, 1.0), (20, 20, 20))
    assert found.status == SegmentStatus.OK and found.confidence >= 0.85
    assert np.array_equal(np.asarray(found), found.mask) and np.asarray(found, float).sum() == found.mask.sum()
    assert found.interval[0] > 5 and found.seeds.tolist() == [[20, 20, 20]]
    truth = np.zeros((30, 30, 30), bool)
    truth[6:24, 6:24, 6:24] = True
    assert dice(found.mask, truth) > 0.97


def test_density_of_a_seed_is_that_of_its_region() -> None:
    """A seed in a thin rod gives the density of what surrounds the rod, so that the status must not be OK."""
    found = segment(blocks(10.0, 0.5), (27, 27, 20))
    assert found.status != SegmentStatus.OK


def test_a_region_that_nothing_limits_is_not_ok() -> None:
    volume = np.random.default_rng(6).normal(size=(30, 30, 30))
    assert segment(volume, (15, 15, 15)).status != SegmentStatus.OK


def test_other_seeds_in_the_region_contradict_it() -> None:
    """Densities that rise along an axis have no border: where the region ends depends on the seed."""
    volume = np.indices((50, 30, 30))[0] * 1.0 + np.random.default_rng(7).normal(size=(50, 30, 30))
    assert segment(volume, (20, 15, 15)).status != SegmentStatus.OK


def test_missing_voxels_are_not_read() -> None:
    volume = blocks(10.0, 1.0)
    valid: Array = np.greater(np.random.default_rng(8).random(volume.shape), 0.1)
    seed = (20, 20, 20)
    valid[seed] = True
    holes = np.where(valid, volume, np.nan)
    found = segment(holes, seed, valid=valid)
    whole = segment(volume, (20, 20, 20)).mask
    assert found.status == SegmentStatus.OK and not found.mask[~valid].any()
    assert dice(found.mask, whole & valid) > 0.97
    with pytest.raises(ValueError, match="nan at"):
        segment(holes, (20, 20, 20))
    with pytest.raises(ValueError, match="expected bool"):
        segment(volume, (20, 20, 20), valid=valid[1:])
    missing = tuple(int(i) for i in np.argwhere(~valid)[0])
    with pytest.raises(ValueError, match="missing voxel"):
        segment(volume, missing, valid=valid)


def test_order_in_memory_does_not_matter() -> None:
    volume = blocks(10.0, 1.0)
    assert np.array_equal(segment(volume, (20, 20, 20)).mask, segment(np.asfortranarray(volume), (20, 20, 20)).mask)
