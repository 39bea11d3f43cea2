"""Scenes of points and lines that a camera sees."""

import numpy as np
from focal_scenes import rotation

K = np.array([[800.0, 0, 400], [0, 790.0, 300], [0, 0, 1]])
SIZE = np.array([800.0, 600.0])


def pixels_of(points):
    seen = points @ K.T
    return seen[..., :2] / seen[..., 2:]


def seen_lines(rng, n_points, n_lines, noise=0.5, wrong=0.0, unit=1.0, origin=0.0):
    """Points, their pixels, lines, what is seen of them, the pose as a matrix, and which points and lines are wrong.

    The ends of what is seen of a line are not those of the line in space.
    """
    pixels = rng.uniform(0, 1, (n_points + 2 * n_lines, 2)) * SIZE
    places = np.insert((pixels - K[:2, 2]) / np.diag(K)[:2], 2, 1, axis=1) * rng.uniform(3, 9, len(pixels))[:, None]
    points, lines = places[:n_points], places[n_points:].reshape(-1, 2, 3)
    along = np.stack([rng.uniform(0, 0.2, n_lines), rng.uniform(0.8, 1, n_lines)], 1)[..., None]
    image = pixels_of(lines[:, :1] + along * (lines[:, 1:] - lines[:, :1]))
    pixels = pixels[:n_points]
    sides = []
    for each in (pixels, image):
        each += noise * rng.normal(size=each.shape)
        sides.append(rng.random(len(each)) < wrong)
        each[sides[-1]] = rng.uniform(0, 1, each[sides[-1]].shape) * SIZE
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation(rng), unit * rng.normal(size=3) + origin
    points, lines = (unit * each @ pose[:3, :3].T + pose[:3, 3] for each in (points, lines))
    return points, pixels, lines, image, pose, *sides
