"""Scenes of cameras whose focal length is to be found: points and their pixels, and pairs of pixels of two views."""

import numpy as np

from generated import pga3

CENTRE = np.array([600.0, 410.0])
SIZE = np.array([1200.0, 820.0])


def rotation(rng):
    matrix, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return matrix * np.sign(np.linalg.det(matrix))


def points_on(rays, rng, tilt):
    """Points on rays (n, 3), at random depths, or on a plane that is tilted by an angle."""
    if tilt is None:
        return rays * rng.uniform(3, 9, len(rays))[:, None]
    turn = rng.uniform(0, 2 * np.pi)
    normal = np.array([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt)])
    return rays * (5 / (rays @ normal))[:, None]


def seen_points(rng, n, noise=0.5, wrong=0.0, tilt=None, unit=1.0, origin=0.0):
    """Points, pixels, the focal length, the pose of the camera as a matrix (4, 4), and which pixels are wrong."""
    focal, pixels = rng.uniform(600, 1800), rng.uniform(0, 1, (n, 2)) * SIZE
    points = points_on(np.c_[(pixels - CENTRE) / focal, np.ones(n)], rng, tilt)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation(rng), unit * rng.normal(size=3) + origin
    pixels = pixels + rng.normal(0, 1, pixels.shape) * noise
    bad = rng.random(n) < wrong
    pixels[bad] = rng.uniform(0, 1, (int(bad.sum()), 2)) * SIZE
    return unit * points @ pose[:3, :3].T + pose[:3, 3], pixels, focal, pose, bad


def seen_pairs(rng, n, kind="space", noise=0.5, wrong=0.0):
    """Pairs of pixels, the focal length, the motion as a matrix (4, 4), and which pairs are wrong."""
    focal = rng.uniform(600, 1800)
    while True:
        rays = np.c_[(rng.uniform(0, 1, (n, 2)) * SIZE - CENTRE) / focal, np.ones(n)]
        points = points_on(rays, rng, rng.uniform(0.1, 0.5) if kind == "plane" else None)
        turn, way = rng.normal(size=3) * 0.15, rng.normal(size=3) * [1, 0.6, 0.5]
        if kind == "parallel":
            turn *= [0, 0, 1]
        motion = np.eye(4)
        if kind == "fixation":  # a turn about a vertical axis through the point at which both cameras look
            turn, fixed = np.array([0, rng.uniform(0.1, 0.3), 0]), np.array([0, 0, rng.uniform(4, 8)])
            motion[:3, :3] = pga3.rotor_to_matrix(pga3.rotor_from_rotation_vector(turn))[:3, :3]
            way = fixed - motion[:3, :3] @ fixed
        motion[:3, :3] = pga3.rotor_to_matrix(pga3.rotor_from_rotation_vector(turn))[:3, :3]
        motion[:3, 3] = 0 if kind == "rotation" else way / np.linalg.norm(way) if kind != "fixation" else way
        there = points @ motion[:3, :3].T + motion[:3, 3]
        if (there[:, 2] > 0.5).all() and (points[:, 2] > 0).all():
            break
    pairs = [focal * p[:, :2] / p[:, 2:] + CENTRE + noise * rng.normal(size=(n, 2)) for p in (points, there)]
    bad = rng.random(n) < wrong
    pairs[1][bad] = rng.uniform(0, 1, (int(bad.sum()), 2)) * SIZE
    motion[:3, 3] /= max(np.linalg.norm(motion[:3, 3]), 1e-300)
    return *pairs, focal, motion, bad


def deviations_off(found, focal, truth, frame):
    """How far a result is off, in standard deviations: of the rotation, of the place, of the focal length.

    `frame` is the matrix of the estimated motion, and rotations and places are along its axes.
    """
    turn = pga3.rotor_to_rotation_vector(pga3.rotor_from_matrix(np.ascontiguousarray(frame[:3, :3].T @ truth[:3, :3])))
    place = np.linalg.norm(truth[:3, 3] - frame[:3, 3])
    largest = [np.sqrt(np.linalg.eigvalsh(part)[-1]) for part in (found[:3, :3], found[3:6, 3:6])]
    return np.array([np.linalg.norm(turn) / largest[0], place / largest[1], abs(focal) / np.sqrt(found[6, 6])])
