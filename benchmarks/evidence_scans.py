"""Scenes of scans, volumes and models of spheres for the page of evidence."""

from __future__ import annotations

import numpy as np
import scipy

from algorithms.registration import estimate_normals, extract_curves, register, register_matches, separate_motions
from algorithms.shapes import march, neural_gas, register_spheres, segment, union_of_spheres
from generated import pga3

from .evidence_scenes import Trial, rotation, row


def _balls(rng: np.random.Generator, count: int) -> np.ndarray:
    return np.column_stack([rng.uniform(-1, 1, (count, 3)) * [9, 11, 13], rng.gamma(6.0, 0.15, count)])


def _bent(x: np.ndarray, rng: np.random.Generator, size: float) -> np.ndarray:
    """Points moved by a random quadratic map, by a root mean square of 4 % of the extent."""
    bend = np.einsum("ni,nj,ijk->nk", x, x, rng.normal(size=(3, 3, 3)))
    return np.asarray(x + bend * (0.08 * size / np.sqrt((bend**2).sum(1).mean())))


def _turned(rng: np.random.Generator, least: float) -> tuple[np.ndarray, np.ndarray]:
    """A model of 60 to 160 balls, and its bent and turned image; a fifth of the balls are outliers in both."""
    count = int(rng.integers(60, 160))
    a, noise = _balls(rng, count), _balls(rng, count)
    turn = rotation(rng, np.pi)
    while least and np.arccos(np.clip((np.trace(turn) - 1) / 2, -1, 1)) < least:
        turn = rotation(rng, np.pi)
    b = np.column_stack([_bent(a[:, :3], rng, 11.0) @ turn.T + 5 * rng.normal(size=3), a[:, 3]])
    wrong = rng.permutation(count)[: count // 5]
    b[wrong, :3], b[wrong, 3] = noise[wrong, :3] @ turn.T + np.median(b[:, :3], 0), noise[wrong, 3]
    return a, b


@row(
    "`register_spheres`",
    "60 to 160 balls, a fifth of them outliers, bent, turned by 60 to 180 degrees",
    good=True,
    slow=True,
)
def turned_spheres(rng: np.random.Generator) -> Trial:
    a, b = _turned(rng, np.pi / 3)
    found = register_spheres(a, b)
    right = found.match[:, 0] == found.match[:, 1]
    return Trial(found.status == 0, len(right) > 0 and bool(right.mean() > 0.75))


@row("`register_spheres`", "60 to 160 balls, unrelated, or the mirror image", slow=True)
def unrelated_spheres(rng: np.random.Generator) -> Trial:
    count = int(rng.integers(60, 160))
    a = _balls(rng, count)
    b = _balls(rng, count) if rng.random() < 0.5 else a * [-1, 1, 1, 1]
    b[:, :3] = b[:, :3] @ rotation(rng, np.pi).T
    return Trial(register_spheres(a, b).status == 0, False)


@row(
    "`estimate_normals`",
    "blobs, noise of 0 to 1 %, up to 100 % of outliers; wrong: worse than principal axes of 10, 20 or 50",
    good=True,
    slow=True,
)
def normals_of_blobs(rng: np.random.Generator) -> Trial:
    count = int(rng.integers(500, 3000))
    x = rng.normal(size=(count, 3))
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    # A radius of 1 + bump, whose gradient gives the normals.
    wave, size = rng.normal(size=(3, 3)), rng.uniform(0, 0.15)
    bump, slope = np.sin(x @ wave.T).sum(1), np.cos(x @ wave.T) @ wave
    radius = 1 + size * bump
    tangent = slope - (slope * x).sum(1, keepdims=True) * x
    truth = x - size * tangent / radius[:, None]
    truth /= np.linalg.norm(truth, axis=1, keepdims=True)
    points = radius[:, None] * x
    points = points + rng.choice([0, 0.003, 0.01, 0.03]) * rng.normal(size=points.shape)
    wrong = rng.uniform(-1.5, 1.5, (int(count * rng.choice([0, 0, 0.5, 1])), 3))
    points = np.concatenate([points, wrong])
    found = estimate_normals(points)
    tree = scipy.spatial.cKDTree(points)
    errors = [_error(found.normals[:count], truth)]
    for k in (10, 20, 50):
        near = points[tree.query(points[:count], k + 1)[1]]
        near = near - near.mean(1, keepdims=True)
        errors.append(_error(np.linalg.eigh(np.einsum("nki,nkj->nij", near, near))[1][..., 0], truth))
    return Trial(bool((found.status[:count] == 0).mean() > 0.99), errors[0] <= min(errors[1:]))


def _error(normals: np.ndarray, truth: np.ndarray) -> float:
    return float(np.arccos(np.minimum(np.abs((normals * truth).sum(1)), 1)).mean())


@row(
    "`separate_motions`",
    "two to five motions 5 to 15 degrees apart, a third of the matches wrong",
    good=True,
    slow=True,
)
def near_motions(rng: np.random.Generator) -> Trial:
    count = int(rng.integers(2, 6))
    angle = np.radians(rng.uniform(5, 15)) * np.arange(count)
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    cross = np.cross(np.eye(3), axis)
    label = np.repeat(np.arange(count), int(rng.integers(80, 160)))
    x = rng.normal(size=(len(label), 3)) * [1, 0.8, 0.6]
    turns = np.eye(3) + np.sin(angle)[:, None, None] * cross + (1 - np.cos(angle))[:, None, None] * cross @ cross
    y = np.einsum("nij,nj->ni", turns[label], x) + rng.normal(0, 0.003, x.shape)
    wrong = rng.random(len(label)) < 1 / 3
    y[wrong] = rng.normal(size=(int(wrong.sum()), 3))
    found = separate_motions(x, y)
    pure = [np.bincount(label[motion.inliers]).max() > 0.9 * motion.inliers.sum() for motion in found]
    return Trial(len(found) > 0, len(found) == count and all(pure))


@row(
    "`register`",
    "2,500 points of a bottle with a knob of 2 to 10 % of its area, complete; wrong: more than 4 degrees off",
    good=True,
    slow=True,
)
def knobs(rng: np.random.Generator) -> Trial:
    share, height = rng.uniform(0.02, 0.1), rng.uniform(1, 3)
    place, size = rng.uniform(0.2, 0.8) * height, rng.uniform(0.3, 0.6)

    def bottle() -> np.ndarray:
        count = rng.binomial(2500, share)
        along, angle = height * rng.random(2500 - count), rng.uniform(0, 2 * np.pi, 2500 - count)
        radius = 1 - 0.5 * (along / height) ** 2
        body = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), along])
        out = rng.normal(size=(count, 3))
        knob = size * out / np.linalg.norm(out, axis=1, keepdims=True) * [1, 0.3, 0.6] + [1.1, 0, place]
        return np.concatenate([body, knob])

    turn = rotation(rng, np.pi)
    found = register(bottle() @ turn, bottle())
    off = pga3.motor_to_matrix(found.motor)[:3, :3] @ turn.T
    return Trial(found.status == 0, bool(np.trace(off) > 1 + 2 * np.cos(np.radians(4))))


def _tissues(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """A volume of noisy tissues of different densities with blurred borders, and the organ in the middle."""
    shape = (40, 44, 36)
    grid = np.indices(shape) - np.array(shape)[:, None, None, None] / 2
    organ = np.zeros(shape, bool)
    for _ in range(int(rng.integers(1, 4))):  # Ellipsoids that overlap by far more than a neck.
        axes, place = rng.uniform(7, 13, 3), rng.uniform(-4, 4, 3)
        turned = np.einsum("ij,jxyz->ixyz", rotation(rng, np.pi), grid - place[:, None, None, None])
        organ |= ((turned / axes[:, None, None, None]) ** 2).sum(0) < 1
    field = scipy.ndimage.gaussian_filter(rng.normal(size=shape), 5)
    around = np.digitize(field / field.std(), [-0.7, 0.7])
    density = rng.permutation([-1.0, 0.0, 1.0, 2.0])
    volume = np.where(organ, density[3], density[around])
    volume = scipy.ndimage.gaussian_filter(volume, rng.uniform(0.3, 0.8))
    return volume + rng.uniform(0.05, 0.25) * rng.normal(size=shape), organ


@row(
    "`segment`",
    "organs among tissues, noise of 5 to 25 % of their difference; wrong: Dice below 0.85",
    good=True,
    slow=True,
)
def organs(rng: np.random.Generator) -> Trial:
    volume, organ = _tissues(rng)
    inner = np.argwhere(scipy.ndimage.distance_transform_edt(organ) > 2.5)
    found = segment(volume, inner[rng.integers(len(inner))])
    common = 2 * (found.mask & organ).sum() / (found.mask.sum() + organ.sum())
    return Trial(found.status == 0, bool(common > 0.85))


@row("`segment`", "sheets and rods of one to four voxels, ramps, and noise without a region", slow=True)
def no_organs(rng: np.random.Generator) -> Trial:
    shape = (36, 36, 36)
    grid = np.indices(shape)
    thick, kind = int(rng.integers(1, 5)), int(rng.integers(4))
    thin = grid[0] % 12 < thick
    volume = [thin, thin & (grid[1] % 12 < thick), grid[0] / rng.uniform(3, 10), np.zeros(shape)][kind]
    volume = volume + rng.uniform(0.05, 0.2) * rng.normal(size=shape)
    inner = np.argwhere(thin & (grid[1] % 12 < thick) & (grid[0] > 8) & (grid[0] < 28))
    found = segment(volume, inner[rng.integers(len(inner))])
    return Trial(found.status == 0, False)


@row(
    "`march`", "blobs, their shells and thin sheets; wrong: overlap below 0.95, or more balls than the union", slow=True
)
def marched(rng: np.random.Generator) -> Trial:
    field = scipy.ndimage.gaussian_filter(rng.normal(size=(32, 32, 32)), rng.uniform(2, 4))
    field, level = field / field.std(), rng.uniform(0.3, 1.2)
    mask, kind = field > level, int(rng.integers(3))
    if kind == 1:
        mask = np.abs(field - level) < rng.uniform(0.05, 0.5)
    elif kind == 2:
        mask &= ~scipy.ndimage.binary_erosion(mask, iterations=int(rng.integers(1, 4)))
    found = march(mask, int(rng.integers(2, 4)))
    overlap = (found.filled & mask).sum() / (found.filled | mask).sum()
    return Trial(found.status == 0, bool(overlap >= 0.95 and len(found.balls) <= len(union_of_spheres(mask))))


@row(
    "`separate_motions`",
    "one motion with two levels of noise or heavy tails, up to half of the matches wrong; wrong: several",
    good=True,
    slow=True,
)
def heavy_tails(rng: np.random.Generator) -> Trial:
    count, kind = int(rng.integers(150, 500)), int(rng.integers(3))
    x = rng.normal(size=(count, 3)) * [1, 0.8, 0.6]
    noise = rng.choice([0.002, 0.01]) * rng.normal(size=x.shape)
    if kind == 0:
        noise *= np.where(rng.random((count, 1)) < 0.5, 1, rng.uniform(3, 12))
    elif kind == 1:
        noise /= np.sqrt(rng.chisquare(2, x.shape) / 2)
    else:
        noise /= np.sqrt(rng.chisquare(2, (count, 1)) / 2)
    y = x @ rotation(rng, np.pi).T + noise + 1
    wrong = rng.random(count) < rng.choice([0, 0.3, 0.5])
    y[wrong] = 1 + rng.normal(size=(int(wrong.sum()), 3))
    found = separate_motions(x, y)
    return Trial(len(found) > 0, len(found) == 1)


@row(
    "`separate_motions`",
    "clouds scaled, sheared, bent or twisted by 3 to 30 %, up to 40 % of the matches wrong; wrong: any OK motion",
    slow=True,
)
def deformed_clouds(rng: np.random.Generator) -> Trial:
    count, size = int(rng.integers(100, 600)), rng.uniform(0.03, 0.3)
    x = rng.uniform(-1, 1, (count, 3)) * [1.5, 1, 0.7]
    there = (
        x
        + size
        * [
            lambda: x,
            lambda: x @ rng.normal(0, 1, (3, 3)),
            lambda: np.sin(2 * x[:, :1]) * [0, 0.5, 1] + x[:, :1] ** 2 * [0, 1, 0],
            lambda: np.cross([1.0, 0, 0], x) * x[:, :1],
        ][int(rng.integers(4))]()
    )
    y = there @ rotation(rng, np.pi).T + rng.choice([0.001, 0.004]) * rng.normal(size=x.shape)
    wrong = rng.random(count) < rng.choice([0, 0.2, 0.4])
    y[wrong] = rng.normal(size=(int(wrong.sum()), 3))
    return Trial(any(each.status == 0 for each in separate_motions(x, y)), False)


@row(
    "`extract_curves`",
    "closed curves, noise of up to 2 % of their length, up to as many outliers; wrong: a tenth of a curve is missing",
    slow=True,
)
def noisy_curves(rng: np.random.Generator) -> Trial:
    d = int(rng.integers(2, 4))
    waves = rng.normal(size=(3, d, 2)) * np.array([1, 0.3, 0.15])[:, None, None]

    def curve(turn: np.ndarray) -> np.ndarray:
        angles = turn[:, None] * [1, 2, 3]
        both = np.stack([np.cos(angles), np.sin(angles)], -1)
        return np.asarray(np.einsum("nkc,kdc->nd", both, waves))

    dense = curve(np.linspace(0, 2 * np.pi, 4001))
    length = np.linalg.norm(np.diff(dense, axis=0), axis=1).sum()
    count, noise = int(rng.uniform(200, 600)), rng.choice([0, 0.002, 0.005, 0.01, 0.02]) * length
    points = curve(rng.uniform(0, 2 * np.pi, count))
    points = points + noise * rng.normal(size=points.shape)
    low, high = points.min(0) - 0.1, points.max(0) + 0.1
    found = extract_curves(
        np.concatenate([points, rng.uniform(low, high, (int(count * rng.choice([0, 0, 0.5, 1])), d))])
    )
    if not len(found.vertices):
        return Trial(found.status == 0, False)
    away = scipy.spatial.cKDTree(found.vertices).query(dense)[0]
    return Trial(found.status == 0, bool((away < found.sigma).mean() > 0.9))


@row("`neural_gas`", "rings, spheres, tori and random points, noise of 0 to 3 %; wrong: other Betti numbers", slow=True)
def gases(rng: np.random.Generator) -> Trial:
    kind, count = int(rng.integers(4)), int(rng.integers(1500, 5000))
    u, v = rng.uniform(0, 2 * np.pi, (2, count))
    tube = rng.uniform(0.3, 0.6)
    ball = rng.normal(size=(count, 3))
    points = [
        np.stack([np.cos(u), np.sin(u)], 1),
        ball / np.linalg.norm(ball, axis=1, keepdims=True),
        np.stack([(1 + tube * np.cos(v)) * np.cos(u), (1 + tube * np.cos(v)) * np.sin(u), tube * np.sin(v)], 1),
        rng.random((count, 3)),
    ][kind]
    found = neural_gas(points + rng.choice([0, 0.01, 0.03]) * rng.normal(size=points.shape))
    return Trial(found.status == 0, kind < 3 and found.betti == [(1, 1, 0), (1, 0, 1), (1, 2, 1)][kind])


def _matched(rng: np.random.Generator, step: float, wrong: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points of a body in voxels, their partners in other voxels, a part of them wrong, and exact partners."""
    body = rng.normal(size=(int(rng.integers(60, 300)), 3)) * rng.uniform(0.4, 1, 3)
    x = np.unique(np.round(body / step), axis=0) * step
    truth = x @ rotation(rng, np.pi).T + rng.normal(size=3)
    y = np.round(truth / step) * step
    off = rng.permutation(len(x))[: int(wrong * len(x))]
    y[off] = rng.permutation(y)[: len(off)]
    return x, y, truth


@row("`register_matches`", "60 to 300 centres of voxels, a third of the partners wrong; wrong: 0.9 voxels", good=True)
def matches_of_voxels(rng: np.random.Generator) -> Trial:
    step = rng.uniform(0.05, 0.15)
    x, y, truth = _matched(rng, step, 0.33)
    found = register_matches(x, y)
    off = np.linalg.norm(pga3.move_point(found.motor, x) - truth, axis=1)
    return Trial(found.status == 0, bool(np.median(off) < 0.9 * step))


@row("`register_matches`", "the same with random partners")
def random_matches_of_voxels(rng: np.random.Generator) -> Trial:
    x, y, _ = _matched(rng, rng.uniform(0.2, 0.5), 1.0)
    return Trial(register_matches(x, y).status == 0, False)


@row("`register_matches`", "a mirrored cloud with noise of 0.5 %, up to a third of the partners wrong")
def matches_of_mirrored_clouds(rng: np.random.Generator) -> Trial:
    x = rng.normal(size=(int(rng.integers(60, 300)), 3)) * rng.uniform(0.4, 1, 3)
    y = (x * [1, 1, -1]) @ rotation(rng, np.pi).T + 0.005 * rng.normal(size=x.shape)
    off = rng.permutation(len(x))[: int(rng.uniform(0, 0.33) * len(x))]
    y[off] = rng.permutation(y)[: len(off)]
    return Trial(register_matches(x, y).status == 0, False)
