"""Scenes of scans and volumes of another kind for the page of evidence: objects of primitives, views, other noise."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy

from algorithms.registration import Registration, estimate_normals, extract_curves, register, separate_motions
from algorithms.shapes import maximal_balls, register_spheres, segment
from generated import pga3

from .evidence_scenes import Trial, rotation, row


class _Solid(NamedTuple):
    """A box, a cylinder or an ellipsoid: half extents, axes as columns, and the middle."""

    kind: int
    half: np.ndarray
    axes: np.ndarray
    middle: np.ndarray

    def sampled(self, rng: np.random.Generator, density: float) -> tuple[np.ndarray, np.ndarray]:
        """Return points of the surface with about this number for each unit of area, and normals."""
        a, b, c = self.half
        if self.kind == 0:
            areas = 4 * np.array([b * c, a * c, a * b])
            axis = rng.choice(3, rng.poisson(2 * density * areas.sum()), p=areas / areas.sum())
            points = rng.uniform(-1, 1, (len(axis), 3))
            rows = np.arange(len(axis))
            points[rows, axis] = np.sign(points[rows, axis])
            normals = np.zeros_like(points)
            normals[rows, axis] = points[rows, axis]
        elif self.kind == 1:
            side, lid = 4 * np.pi * np.sqrt((a * a + b * b) / 2) * c, 2 * np.pi * a * b
            count = rng.poisson(density * (side + lid))
            angle, on_lid = rng.uniform(0, 2 * np.pi, count), rng.random(count) < lid / (side + lid)
            radius = np.where(on_lid, np.sqrt(rng.random(count)), 1)
            height = np.where(on_lid, rng.choice([-1, 1], count), rng.uniform(-1, 1, count))
            points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), height])
            normals = np.where(on_lid[:, None], [0, 0, 1] * np.sign(height)[:, None], points * [1, 1, 0])
        else:
            count = rng.poisson(
                4 * np.pi * density * ((a * b) ** 1.6 / 3 + (a * c) ** 1.6 / 3 + (b * c) ** 1.6 / 3) ** 0.625
            )
            normals = rng.normal(size=(4 * count + 8, 3))
            points = normals / np.linalg.norm(normals, axis=1, keepdims=True)
            # Even on the ellipsoid: directions of the sphere are kept with the ratio of areas.
            stretch = np.linalg.norm(points / self.half, axis=1)
            points = points[rng.random(len(points)) < stretch / (1 / self.half.min())][:count]
            normals = points.copy()
        normals = normals / self.half
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        return (points * self.half) @ self.axes.T + self.middle, normals @ self.axes.T

    def contains(self, points: np.ndarray) -> np.ndarray:
        local = np.abs((points - self.middle) @ self.axes / self.half)
        if self.kind == 0:
            return np.asarray((local < 1).all(1))
        if self.kind == 1:
            return np.asarray((np.hypot(local[:, 0], local[:, 1]) < 1) & (local[:, 2] < 1))
        return np.asarray((local**2).sum(1) < 1)


def _object(rng: np.random.Generator, least: float = 0.25) -> list[_Solid]:
    """Three to six primitives, each of which overlaps an earlier one; no symmetry takes the object to itself."""
    solids: list[_Solid] = []
    for _ in range(int(rng.integers(3, 7))):
        middle = np.zeros(3)
        if solids:
            other = solids[rng.integers(len(solids))]
            middle = other.middle + other.axes @ (other.half * rng.uniform(-1, 1, 3))
        kind = int(rng.integers(3))
        half = rng.uniform(least, 1, 3)
        if kind == 1:
            half[1] = half[0]
        solids.append(_Solid(kind, half, rotation(rng, np.pi), middle))
    return solids


def _cloud(rng: np.random.Generator, solids: list[_Solid], count: int) -> tuple[np.ndarray, np.ndarray]:
    """About so many points of the union, and normals."""
    density = count / sum(8 * (np.prod(s.half) / s.half).sum() for s in solids) * 1.4
    points, normals = [], []
    for k, solid in enumerate(solids):
        own, across = solid.sampled(rng, density)
        out = ~np.any(
            [other.contains(own) for j, other in enumerate(solids) if j != k] or [np.zeros(len(own), bool)], 0
        )
        points.append(own[out])
        normals.append(across[out])
    return np.concatenate(points), np.concatenate(normals)


def _noisy(rng: np.random.Generator, points: np.ndarray, noise: float, outliers: float) -> np.ndarray:
    size = np.ptp(points, axis=0)
    wrong = points.min(0) - 0.1 * size + 1.2 * size * rng.random((int(outliers * len(points)), 3))
    moved = points + noise * np.linalg.norm(size) * rng.normal(size=points.shape)
    return np.asarray(rng.permutation(np.concatenate([moved, wrong])))


def _judged(found: Registration, turn: np.ndarray, shift: np.ndarray, here: np.ndarray, angle: float = 5.0) -> Trial:
    """Right if the motion ``turn @ x + shift`` is met within an angle in degrees, and a twentieth of the size."""
    matrix = pga3.motor_to_matrix(found.motor)
    cosine = (np.trace(matrix[:3, :3] @ turn.T) - 1) / 2
    middle = here.mean(0)
    off = matrix[:3, :3] @ middle + matrix[:3, 3] - turn @ middle - shift
    near = np.linalg.norm(off) < 0.05 * np.linalg.norm(np.ptp(here, axis=0))
    return Trial(found.status == 0, bool(cosine > np.cos(np.radians(angle)) and near))


def _placed(
    rng: np.random.Generator, x: np.ndarray, y: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Source, target, rotation and translation, in units from micrometres to kilometres, far from the origin."""
    unit, turn = 10 ** rng.uniform(-3, 3), rotation(rng, np.pi)
    shift = unit * rng.normal(0, 3, 3)
    return unit * x, unit * y @ turn.T + shift, turn, shift


def _composed(rng: np.random.Generator, cut: float, noise: float, outliers: float) -> Trial:
    solids, count = _object(rng), int(rng.integers(1200, 3000))
    clouds = []
    for _ in range(2):
        points = _cloud(rng, solids, count)[0]
        along = points @ rng.normal(size=3)
        points = points[along <= np.quantile(along, 1 - cut)]
        clouds.append(_noisy(rng, points, noise, outliers))
    source, target, turn, shift = _placed(rng, *clouds)
    return _judged(register(source, target), turn, shift, source)


@row(
    "`register`",
    "objects of 3 to 6 primitives, complete, other samples, noise up to 0.5 %, any unit",
    good=True,
    slow=True,
)
def composed_objects(rng: np.random.Generator) -> Trial:
    return _composed(rng, 0.0, rng.uniform(0, 0.005), 0.0)


@row("`register`", "the same, both cut by 10 to 30 %, noise up to 1 %, up to 30 % of outliers", slow=True)
def composed_parts(rng: np.random.Generator) -> Trial:
    return _composed(rng, rng.uniform(0.1, 0.3), rng.uniform(0, 0.01), rng.uniform(0, 0.3))


@row("`register`", "objects of primitives, seen from two places 20 to 70 degrees apart", slow=True)
def two_views(rng: np.random.Generator) -> Trial:
    solids, count = _object(rng), int(rng.integers(2500, 5000))
    eye = rng.normal(size=3)
    eye /= np.linalg.norm(eye)
    across = np.cross(eye, rng.normal(size=3))
    across /= np.linalg.norm(across)
    angle = np.radians(rng.uniform(20, 70))
    clouds = []
    for view in (eye, np.cos(angle) * eye + np.sin(angle) * across):
        points, normals = _cloud(rng, solids, count)
        points, normals = points[normals @ view > 0], normals[normals @ view > 0]
        # A point is hidden if the ray to the eye, an orthographic one, passes through a solid.
        steps = np.linspace(0.02, 4, 60)[:, None, None] * view
        hidden = np.any([s.contains((points + steps).reshape(-1, 3)).reshape(60, -1).any(0) for s in solids], axis=0)
        clouds.append(_noisy(rng, points[~hidden], rng.uniform(0, 0.005), 0.0))
    source, target, turn, shift = _placed(rng, *clouds)
    return _judged(register(source, target), turn, shift, source)


@row("`register`", "two objects of primitives of about one size; wrong: any OK", slow=True)
def other_objects(rng: np.random.Generator) -> Trial:
    x, y = (_cloud(rng, _object(rng), int(rng.integers(1200, 3000)))[0] for _ in range(2))
    y *= np.linalg.norm(x.std(0)) / np.linalg.norm(y.std(0))
    source, target, _, _ = _placed(rng, _noisy(rng, x, 0.003, 0), _noisy(rng, y, 0.003, 0))
    return Trial(register(source, target).status == 0, False)


@row("`register`", "objects of primitives and their mirror images; wrong: any OK", slow=True)
def mirrored_objects(rng: np.random.Generator) -> Trial:
    solids, count = _object(rng), int(rng.integers(1200, 3000))
    x, y = (_noisy(rng, _cloud(rng, solids, count)[0], 0.003, 0) for _ in range(2))
    source, target, _, _ = _placed(rng, x, y * [1, 1, -1])
    return Trial(register(source, target).status == 0, False)


@row(
    "`register`",
    "boxes, cans and plates with another of 2 to 10 % of the area on them",
    good=True,
    slow=True,
)
def marked_objects(rng: np.random.Generator) -> Trial:
    kind, half = int(rng.integers(2)), rng.uniform(0.3, 1, 3)
    if rng.random() < 0.5:
        half[1] = half[0]
    if rng.random() < 0.3:
        half[2] = rng.uniform(0.03, 0.15)
    body = _Solid(kind, half, np.eye(3), np.zeros(3))
    area = 8 * (half[0] * half[1] + half[1] * half[2] + half[0] * half[2])
    size = np.sqrt(rng.uniform(0.02, 0.1) * area / 12) * rng.uniform(0.7, 1.4, 3)
    # Off every plane of symmetry of the body, by more than the knob.
    side = np.array([1.0, rng.uniform(0.35, 0.75), rng.uniform(0.35, 0.75)])
    knob = _Solid(int(rng.integers(3)), size, rotation(rng, np.pi), half * rng.permutation(side))
    count = int(rng.integers(1500, 3000))
    clouds = []
    for _ in range(2):
        clouds.append(_noisy(rng, _cloud(rng, [body, knob], count)[0], 0.001, 0.0))
    source, target, turn, shift = _placed(rng, *clouds)
    return _judged(register(source, target), turn, shift, source)


def _tubes(rng: np.random.Generator) -> np.ndarray:
    """Balls along curved tubes that branch, as vessels do."""
    balls: list[np.ndarray] = []
    for _ in range(int(rng.integers(3, 7))):
        place = balls[rng.integers(len(balls))][:3] if balls else np.zeros(3)
        step, radius = rng.normal(size=3), rng.uniform(0.4, 1.2)
        for _ in range(int(rng.integers(8, 25))):
            step = step / np.linalg.norm(step) + 0.25 * rng.normal(size=3)
            place = place + radius * step / np.linalg.norm(step)
            radius *= rng.uniform(0.93, 1.05)
            balls.append(np.append(place, radius))
    return np.array(balls)


@row(
    "`register_spheres`",
    "branched tubes of balls, a tenth lost, places and radii off by 5 %, any turn and unit",
    good=True,
    slow=True,
)
def tubes_of_spheres(rng: np.random.Generator) -> Trial:
    a, turn, unit = _tubes(rng), rotation(rng, np.pi), 10 ** rng.uniform(-3, 3)
    b = np.column_stack([a[:, :3] @ turn.T, a[:, 3]]) + 0.05 * a[:, 3:] * rng.normal(size=a.shape)
    order = rng.permutation(len(a))[: int(0.9 * len(a))]
    found = register_spheres(a, unit * b[order])
    right = found.match[:, 0] == order[found.match[:, 1]]
    return Trial(found.status == 0, len(right) > 0 and bool(right.mean() > 0.75))


@row(
    "`register_spheres`",
    "two trees of tubes, one of them and its mirror image, or maximal balls of two blobs",
    slow=True,
)
def other_spheres(rng: np.random.Generator) -> Trial:
    kind = int(rng.integers(3))
    if kind < 2:
        a = _tubes(rng)
        b = _tubes(rng) if kind else a * [1, 1, -1, 1]
    else:
        a, b = (_blob_balls(rng) for _ in range(2))
    b = np.column_stack([b[:, :3] @ rotation(rng, np.pi).T, b[:, 3]])
    return Trial(register_spheres(a, b).status == 0, False)


def _blob_balls(rng: np.random.Generator) -> np.ndarray:
    grid = np.indices((28, 28, 28)) - 13.5
    mask = np.zeros(grid.shape[1:], bool)
    for _ in range(int(rng.integers(2, 5))):
        turned = np.einsum("ij,jxyz->ixyz", rotation(rng, np.pi), grid - rng.uniform(-5, 5, 3)[:, None, None, None])
        mask |= ((turned / rng.uniform(3, 9, 3)[:, None, None, None]) ** 2).sum(0) < 1
    return np.asarray(maximal_balls(mask))


def _scanned(rng: np.random.Generator, density: np.ndarray, noise: float) -> np.ndarray:
    """A volume as of a scanner: blurred, with noise that neighbours share, and a slow change of brightness."""
    shape = density.shape
    volume = scipy.ndimage.gaussian_filter(density, rng.uniform(0.4, 1.0))
    grain = scipy.ndimage.gaussian_filter(rng.normal(size=shape), rng.uniform(0.3, 0.9))
    slope = np.einsum("k,kxyz->xyz", rng.normal(size=3), np.indices(shape) / np.array(shape)[:, None, None, None] - 0.5)
    return np.asarray(volume + noise * grain / grain.std() + rng.uniform(0, 0.3) * slope)


def _tube(rng: np.random.Generator, shape: tuple[int, int, int], radius: float) -> np.ndarray:
    """A bent tube through the middle."""
    s = np.linspace(-1, 1, 200)
    path = np.array(shape) / 2 + np.column_stack([14 * s, 6 * s**2 - 3, 5 * np.sin(2 * s)]) @ rotation(rng, np.pi).T
    far = scipy.spatial.cKDTree(path).query(np.indices(shape).reshape(3, -1).T)[0]
    return np.asarray(far.reshape(shape) < radius)


def _dice(one: np.ndarray, two: np.ndarray) -> float:
    return float(2 * (one & two).sum() / max(one.sum() + two.sum(), 1))


def _seed_in(rng: np.random.Generator, organ: np.ndarray, depth: float) -> np.ndarray:
    far = scipy.ndimage.distance_transform_edt(organ)
    inner = np.argwhere(far > min(depth, 0.7 * far.max()))
    return np.asarray(inner[rng.integers(len(inner))])


@row(
    "`segment`",
    "bent tubes, boxes and lenses among others, noise that neighbours share, uneven brightness",
    good=True,
    slow=True,
)
def scanned_organs(rng: np.random.Generator) -> Trial:
    shape = (40, 44, 36)
    grid = np.indices(shape) - np.array(shape)[:, None, None, None] / 2
    kind = int(rng.integers(3))
    turned = np.abs(np.einsum("ij,jxyz->ixyz", rotation(rng, np.pi), grid))
    half = rng.uniform(6, 12, 3)[:, None, None, None]
    if kind == 0:
        organ = _tube(rng, shape, rng.uniform(4, 7))
    elif kind == 1:
        organ = (turned < half).all(0)
    else:
        organ = (turned[0] / 16) ** 2 + (turned[1] / 14) ** 2 + (turned[2] / rng.uniform(5, 9)) ** 2 < 1
    around = np.zeros(shape)
    for _ in range(6):
        far = ((grid - rng.uniform(-20, 20, 3)[:, None, None, None]) ** 2).sum(0)
        around[far < rng.uniform(6, 14) ** 2] = rng.uniform(-1.5, 1.5)
    # Surroundings differ from the organ by at least one unit.
    density = np.where(organ, around.max() + 1 if rng.random() < 0.5 else around.min() - 1, around)
    volume = _scanned(rng, density, rng.uniform(0.03, 0.25))
    found = segment(10 ** rng.uniform(-2, 3) * volume + rng.normal(0, 100), _seed_in(rng, organ, 2.0))
    return Trial(found.status == 0, _dice(found.mask, organ) > 0.85)


@row(
    "`segment`",
    "organs of two balls of one density, with edges that fade, or of two parts; wrong: neither a part nor the whole",
    slow=True,
)
def merged_organs(rng: np.random.Generator) -> Trial:
    shape = (40, 44, 36)
    grid = np.indices(shape) - np.array(shape)[:, None, None, None] / 2
    radius = rng.uniform(7, 11)
    apart = radius * rng.uniform(1.3, 2.0)
    near = np.square(grid).sum(0) < radius**2
    kind, axis = int(rng.integers(3)), rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    along = np.einsum("k,kxyz->xyz", axis, grid)
    truths = [near]
    density = np.where(near, 1.0, 0.0)
    if kind == 0:  # Another organ of the same density, touching.
        other = np.square(grid - (apart * axis)[:, None, None, None]).sum(0) < (0.9 * radius) ** 2
        density = np.where(other, 1.0, density)
        truths = [near & (along < apart / 2 + 0.1 * radius), near | other]
    elif kind == 1:  # The outside has the density of the organ on one side.
        density = np.where(near, 1.0, np.clip((along + radius) / (2 * radius), 0, 1))
    else:  # Half of the organ has another density, which is nearer to it than to the outside.
        density = np.where(near & (along > 0), rng.uniform(0.55, 0.8), density)
        truths.append(near & (along <= 0))
    volume = _scanned(rng, density, rng.uniform(0.02, 0.1))
    found = segment(volume, _seed_in(rng, near & (along < 0), 2.0))
    return Trial(found.status == 0, any(_dice(found.mask, truth) > 0.85 for truth in truths))


@row(
    "`separate_motions`",
    "boxes and plates of centres of voxels, two or three motions, half of the matches wrong",
    good=True,
    slow=True,
)
def motions_of_voxels(rng: np.random.Generator) -> Trial:
    count, step = int(rng.integers(2, 4)), rng.uniform(0.02, 0.05)
    label = np.repeat(np.arange(count), rng.integers(60, 200, count))
    extent = rng.uniform(0.4, 1, 3) * (rng.random(3) < [1, 1, 0.7])
    x = np.round(rng.uniform(-1, 1, (len(label), 3)) * extent / step) * step
    turns = [rotation(rng, np.pi) for _ in range(count)]
    y = np.array([turns[k] @ p for k, p in zip(label, x, strict=True)]) + rng.normal(0, 0.5, (count, 3))[label]
    y = np.round(y / step) * step
    wrong = rng.random(len(label)) < 0.5
    y[wrong] = rng.permutation(y)[wrong]
    found = [each for each in separate_motions(x, y) if each.status == 0]
    pure = [np.bincount(label[m.inliers & ~wrong], minlength=count) for m in found]
    right = all(p.max() > 0.9 * p.sum() and p.sum() > 0.7 * m.inliers.sum() for p, m in zip(pure, found, strict=True))
    return Trial(len(found) > 0, len(found) == count and right)


@row(
    "`separate_motions`",
    "random matches, each up to five times, or of points on a lattice; wrong: any OK motion",
    slow=True,
)
def repeated_matches(rng: np.random.Generator) -> Trial:
    count, kind = int(rng.integers(20, 120)), int(rng.integers(3))
    x, y = rng.normal(size=(2, count, 3))
    if kind == 1:
        x, y = np.round(3 * x), np.round(3 * y)
    elif kind == 2:
        x[:, 2], y[:, 2] = 0.01 * x[:, 2], 0.01 * y[:, 2]
    times = int(rng.integers(1, 6))
    x, y = (np.repeat(p, times, 0) + 0.002 * rng.normal(size=(times * count, 3)) for p in (x, y))
    return Trial(any(each.status == 0 for each in separate_motions(x, y)), False)


def _lines(rng: np.random.Generator, d: int) -> list[np.ndarray]:
    """One to three open or closed curves apart from each other, densely sampled: helices, arcs, waves and polygons."""
    curves = []
    for k in range(int(rng.integers(1, 4))):
        s = np.linspace(0, 1, 1501)
        kind = int(rng.integers(4))
        if kind == 0:
            angle = rng.uniform(2, 6) * s
            curve = np.column_stack([np.cos(angle), np.sin(angle), rng.uniform(0, 0.5) * angle])
        elif kind == 1:
            curve = np.column_stack([3 * s, 0.4 * np.sin(rng.uniform(3, 8) * s), 0.4 * np.cos(rng.uniform(2, 5) * s)])
        elif kind == 2:
            corners = np.array([[0, 0, 0], [1.2, 0, 0], [1.2, 1, 0.3], [0.2, 1.4, 0.6]])[: int(rng.integers(2, 5))]
            at = s * (len(corners) - 1)
            curve = np.column_stack([np.interp(at, np.arange(len(corners)), c) for c in corners.T])
        else:
            curve = np.column_stack([np.cos(6.2832 * s), rng.uniform(0.4, 1) * np.sin(6.2832 * s), 0 * s])
        curve = curve - curve.mean(0)
        curve = curve[:, :2] if d == 2 else curve @ rotation(rng, np.pi).T
        curves.append(curve + 4.0 * k * np.eye(d)[0])
    return curves


@row(
    "`extract_curves`",
    "one to three open or closed curves, uneven points, noise up to 1 %, up to 60 % of outliers; wrong: as above",
    good=True,
    slow=True,
)
def several_curves(rng: np.random.Generator) -> Trial:
    d, unit = int(rng.integers(2, 4)), 10 ** rng.uniform(-3, 3)
    curves = _lines(rng, d)
    length = [np.linalg.norm(np.diff(c, axis=0), axis=1).sum() for c in curves]
    tokens = []
    noise = rng.uniform(0, 0.01) * max(length)
    for c, size in zip(curves, length, strict=True):
        # Even in the parameter with a density that changes by up to three.
        at = rng.random(int(60 * size)) ** rng.uniform(1, 1.5)
        at = np.where(rng.random(len(at)) < 0.5, at, rng.random(len(at)))
        tokens.append(c[(at * (len(c) - 1)).astype(int)] + noise * rng.normal(size=(len(at), d)))
    points = np.concatenate(tokens)
    low, high = points.min(0) - 0.3, points.max(0) + 0.3
    wrong = rng.uniform(low, high, (int(len(points) * rng.choice([0, 0.3, 0.6])), d))
    found = extract_curves(unit * np.concatenate([points, wrong]))
    if not len(found.vertices):
        return Trial(found.status == 0, False)
    tree = scipy.spatial.cKDTree(found.vertices)
    near = [tree.query(unit * c)[0] < found.sigma for c in curves]
    return Trial(found.status == 0, bool(all(each.mean() > 0.9 for each in near)))


@row("`extract_curves`", "random tokens, blobs, filled discs and spheres; wrong: any OK with a curve", slow=True)
def no_curves(rng: np.random.Generator) -> Trial:
    count, kind = int(rng.integers(100, 800)), int(rng.integers(4))
    ball = rng.normal(size=(count, 3))
    ball /= np.linalg.norm(ball, axis=1, keepdims=True)
    points = [
        lambda: rng.random((count, int(rng.integers(2, 4)))),
        lambda: rng.normal(size=(count, int(rng.integers(2, 4)))),
        lambda: ball[:, :2] * np.sqrt(rng.random((count, 1))) * 1.0,
        lambda: ball + 0.01 * rng.normal(size=ball.shape),
    ][kind]()
    found = extract_curves(10 ** rng.uniform(-3, 3) * points)
    return Trial(found.status == 0 and len(found.pieces) > 0, False)


@row(
    "`estimate_normals`",
    "objects of primitives and pairs of sheets, uneven points, noise up to 2 %, clusters; wrong: as above",
    good=True,
    slow=True,
)
def normals_of_objects(rng: np.random.Generator) -> Trial:
    if rng.random() < 0.3:
        thin = np.array([1.0, 1.0, rng.uniform(0.03, 0.1)])
        points, truth = _cloud(rng, [_Solid(0, thin, rotation(rng, np.pi), np.zeros(3))], int(rng.integers(800, 3000)))
    else:
        points, truth = _cloud(rng, _object(rng), int(rng.integers(800, 3000)))
    along = points @ rng.normal(size=3)
    kept = rng.random(len(points)) < np.interp(along, [along.min(), along.max()], [rng.uniform(0.2, 1), 1])
    points, truth = points[kept], truth[kept]
    noise = rng.choice([0, 0.002, 0.006, 0.02]) * np.linalg.norm(np.ptp(points, axis=0))
    count = len(points)
    points = points + noise * rng.normal(size=points.shape)
    if rng.random() < 0.4:
        points = np.concatenate([points, points[rng.integers(count)] + 0.3 * rng.normal(size=(count // 5, 3))])
    points = points * 10 ** rng.uniform(-3, 3)
    found = estimate_normals(points)
    tree = scipy.spatial.cKDTree(points)
    errors = [_angle(found.normals[:count], truth)]
    for k in (10, 20, 50):
        near = points[tree.query(points[:count], k + 1)[1]]
        near = near - near.mean(1, keepdims=True)
        errors.append(_angle(np.linalg.eigh(np.einsum("nki,nkj->nij", near, near))[1][..., 0], truth))
    return Trial(bool((found.status[:count] == 0).mean() > 0.99), errors[0] <= min(errors[1:]))


def _angle(normals: np.ndarray, truth: np.ndarray) -> float:
    return float(np.arccos(np.minimum(np.abs((normals * truth).sum(1)), 1)).mean())
