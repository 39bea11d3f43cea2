"""Depth images of objects on the table z = 0, by rays that are intersected with closed forms or with triangles."""

import numpy as np

from algorithms.vision import Camera
from generated import pga3

SIZE = 640, 480


def depth_camera(at, azimuth, elevation, distance=0.5):
    """Return a camera that looks at a point from above, with angles in degrees."""
    a, e = np.radians([azimuth, elevation])
    z = -np.array([np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)])
    x = np.cross(z, [0, 0, 1.0])
    x /= np.linalg.norm(x)
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = np.column_stack([x, np.cross(z, x), z]), at - distance * z
    return Camera.from_intrinsics(600.0, (319.5, 239.5), pga3.motor_from_matrix(matrix))


def depth_image(camera, hits, noise=0.0, rng=None):
    """Return the depths (h, w) of an object on the table, and which pixels show the object.

    The function `hits` returns depths (h, w), infinite without a surface, for the matrix of the pose of the camera
    (4, 4), and rays of depth 1 (h, w, 3) in the world.
    """
    matrix, k = np.asarray(pga3.motor_to_matrix(camera.pose)), camera.intrinsics
    u, v = np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1]))
    rays = np.stack([(u - k[0, 2]) / k[0, 0], (v - k[1, 2]) / k[1, 1], np.ones(u.shape)], -1) @ matrix[:3, :3].T
    with np.errstate(all="ignore"):
        table = np.where(rays[..., 2] < 0, -matrix[2, 3] / rays[..., 2], np.inf)
        found = hits(matrix, rays)
    depth = np.minimum(found, table)
    return depth + (rng.normal(0, noise, depth.shape) if noise else 0), found < table


def ball(centre, radius):
    def hits(matrix, rays):
        off = centre - matrix[:3, 3]
        a, b = (rays * rays).sum(-1), rays @ off
        root = b * b - a * (off @ off - radius**2)
        return np.where(root > 0, (b - np.sqrt(np.maximum(root, 0))) / a, np.inf)

    return hits


def can(radius, height):
    """A cylinder that stands in the origin."""

    def hits(matrix, rays):
        eye = matrix[:3, 3]
        a, b = (rays[..., :2] ** 2).sum(-1), -rays[..., :2] @ eye[:2]
        root = b * b - a * (eye[:2] @ eye[:2] - radius**2)
        side = (b - np.sqrt(np.maximum(root, 0))) / a
        level = eye[2] + side * rays[..., 2]
        side = np.where((root > 0) & (level > 0) & (level < height), side, np.inf)
        top = (height - eye[2]) / rays[..., 2]
        inside = ((eye[:2] + top[..., None] * rays[..., :2]) ** 2).sum(-1) < radius**2
        return np.minimum(side, np.where(inside & (top > 0), top, np.inf))

    return hits


def mesh(vertices, faces):
    def hits(matrix, rays):
        found, shape = np.full(rays.shape[:2], np.inf), np.array(SIZE)
        flat = rays @ matrix[:3, :3]
        pitch = flat[0, 1, 0] - flat[0, 0, 0]
        corners = (vertices - matrix[:3, 3]) @ matrix[:3, :3]
        pixels = (corners[:, :2] / corners[:, 2:] - flat[0, 0, :2]) / pitch
        for face in faces:
            low = np.maximum(np.ceil(pixels[face].min(0)), 0).astype(int)
            high = np.minimum(np.floor(pixels[face].max(0)), shape - 1).astype(int)
            part = slice(low[1], high[1] + 1), slice(low[0], high[0] + 1)
            a, b, c = corners[face]
            normal, d = np.cross(b - a, c - a), flat[part]
            z = (a @ normal) / (d @ normal)
            p = z[..., None] * d
            sides = [np.cross(r - q, p - q) @ normal >= 0 for q, r in ((a, b), (b, c), (c, a))]
            found[part] = np.where(np.logical_and.reduce(sides) & (z > 0), np.minimum(z, found[part]), found[part])
        return found

    return hits
