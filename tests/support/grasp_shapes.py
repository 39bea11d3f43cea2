"""Closed meshes of objects that differ from the stored scans: hollow, thin, long, bent, with holes and handles."""

from functools import cache

import numpy as np

from tests.support.scans import box, cylinder, sphere, torus


def revolved(profile, count=64):
    """Return the closed surface of revolution about z of a profile (radius, z) that begins and ends on the axis."""
    profile = np.asarray(profile, float)
    angles = 2 * np.pi * np.arange(count) / count
    inner = profile[1:-1]
    rings = np.stack(
        [inner[:, None, 0] * np.cos(angles), inner[:, None, 0] * np.sin(angles), np.repeat(inner[:, 1:], count, 1)], -1
    )
    ends = np.array([[0, 0, profile[0, 1]], [0, 0, profile[-1, 1]]])
    vertices = np.concatenate([rings.reshape(-1, 3), ends])
    first, last = len(vertices) - 2, len(vertices) - 1
    k = np.arange(count)
    following = (k + 1) % count
    faces = [np.stack([np.full(count, first), following, k], -1)]
    for row in range(len(inner) - 1):
        a, b = row * count + k, row * count + following
        faces += [np.stack([a, b, b + count], -1), np.stack([a, b + count, a + count], -1)]
    top = (len(inner) - 1) * count
    faces.append(np.stack([np.full(count, last), top + k, top + following], -1))
    return vertices, np.concatenate(faces)


def extruded(outline, height):
    """Return the prism over a simple polygon (n, 2), counter-clockwise, triangulated by cutting off ears."""
    outline = np.asarray(outline, float)
    count = len(outline)
    vertices = np.concatenate([np.c_[outline, np.full(count, -height / 2)], np.c_[outline, np.full(count, height / 2)]])
    left, caps = list(range(count)), []

    def area(a, b, c):
        (ax, ay), (bx, by), (cx, cy) = outline[a], outline[b], outline[c]
        return (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)

    while len(left) > 3:
        for k in range(len(left)):
            a, b, c = left[k - 1], left[k], left[(k + 1) % len(left)]
            others = [p for p in left if p not in (a, b, c)]
            inside = any(area(a, b, p) >= 0 and area(b, c, p) >= 0 and area(c, a, p) >= 0 for p in others)
            if area(a, b, c) > 0 and not inside:
                caps.append((a, b, c))
                left.pop(k)
                break
        else:
            raise ValueError("extruded: the polygon has no ear; expected a simple one, counter-clockwise")
    caps.append(tuple(left))
    caps = np.array(caps)
    k = np.arange(count)
    n = (k + 1) % count
    sides = np.concatenate([np.stack([k, n, n + count], -1), np.stack([k, n + count, k + count], -1)])
    return vertices, np.concatenate([caps[:, ::-1], caps + count, sides])


def divided(vertices, faces, longest):
    """Return a mesh of the same surface whose edges are at most `longest`, by division of all faces into four."""
    while np.linalg.norm(vertices[faces] - np.roll(vertices[faces], 1, 1), axis=-1).max() > longest:
        edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), 1)
        unique, number = np.unique(edges, axis=0, return_inverse=True)
        middle = len(vertices) + number.reshape(3, -1)
        vertices = np.concatenate([vertices, vertices[unique].mean(1)])
        (a, b, c), (p, q, r) = faces.T, middle
        faces = np.concatenate([np.stack(x, -1) for x in ((a, p, r), (p, b, q), (r, q, c), (p, q, r))])
    return vertices, faces


def _arc(radius, centre, start, stop, count=12):
    angles = np.linspace(start, stop, count)
    return [(radius * np.cos(t), centre + radius * np.sin(t)) for t in angles]


def capsule(radius, length):
    h = length / 2
    lower = _arc(radius, -h, -np.pi / 2, 0)
    upper = _arc(radius, h, 0, np.pi / 2)
    return revolved([(0, -h - radius), *lower[1:], *upper[:-1], (0, h + radius)])


def bowl(radius, thickness):
    outer = _arc(radius, 0, -np.pi / 2, 0, 24)
    inner = _arc(radius - thickness, 0, 0, -np.pi / 2, 24)
    return revolved([(0, -radius), *outer[1:], *inner[:-1], (0, -radius + thickness)])


def dumbbell(large, small, length):
    h, t = length / 2, np.arcsin(small / large)
    left = _arc(large, -h, -np.pi / 2, np.pi / 2 - t, 20)
    right = _arc(large, h, -np.pi / 2 + t, np.pi / 2, 20)
    return revolved([(0, -h - large), *left[1:], *right[:-1], (0, h + large)])


def tube(outer, inner, height):
    """A cup: a cylinder that is hollow except for its bottom."""
    t, h = outer - inner, height / 2
    return revolved([(0, -h), (outer, -h), (outer, h), (inner, h), (inner, -h + t), (0, -h + t)])


def cone(radius, height):
    return revolved([(0, -height / 3), (radius, -height / 3), (0, 2 * height / 3)])


def plate(radius, height, thickness):
    return revolved(
        [(0, 0), (0.6 * radius, 0), (radius, height), (radius, height + thickness), (0.6 * radius, thickness),
         (0, thickness)]
    )  # fmt: skip


def l_shape(long, short, thick, height):
    return extruded([(0, 0), (long, 0), (long, thick), (thick, thick), (thick, short), (0, short)], height)


def clamp(size, thick, height):
    """A block with a slot: the letter C."""
    s, t = size, thick
    return extruded([(0, 0), (s, 0), (s, t), (t, t), (t, s - t), (s, s - t), (s, s), (0, s)], height)


def wedge(length, height, width):
    return extruded([(0, 0), (length, 0), (0, height)], width)


def star(outer, inner, height, points=5):
    angles = np.pi * np.arange(2 * points) / points
    radii = np.where(np.arange(2 * points) % 2 == 0, outer, inner)
    return extruded(np.c_[radii * np.cos(angles), radii * np.sin(angles)], height)


def hammer():
    """A handle with a head: two bars that cross, as one polygon."""
    return extruded(
        [(-0.012, -0.13), (0.012, -0.13), (0.012, 0.06), (0.05, 0.06), (0.05, 0.09), (-0.06, 0.09), (-0.06, 0.06),
         (-0.012, 0.06)], 0.024,
    )  # fmt: skip


def scissors():
    """A thin flat object with two holes in a row, as a polygon with slits: here, a flat letter Y."""
    return extruded(
        [(-0.008, -0.1), (0.008, -0.1), (0.012, 0.0), (0.05, 0.08), (0.035, 0.09), (0.0, 0.02), (-0.035, 0.09),
         (-0.05, 0.08), (-0.012, 0.0)], 0.008,
    )  # fmt: skip


def ellipsoid(a, b, c):
    vertices, faces = sphere(1.0)
    return vertices * [a, b, c], faces


@cache
def mug(radius=0.042, height=0.09, wall=0.005, spacing=0.002):
    """A mug with a handle: the zero surface of a sampled signed distance. Needs skimage."""
    from skimage.measure import marching_cubes

    x, y, z = np.meshgrid(
        np.arange(-radius - 0.012, radius + 0.05, spacing), np.arange(-radius - 0.012, radius + 0.013, spacing),
        np.arange(-height / 2 - 0.012, height / 2 + 0.013, spacing), indexing="ij",
    )  # fmt: skip
    r, h = np.hypot(x, y), height / 2
    outer = np.maximum(r - radius, np.abs(z) - h)
    hollow = np.maximum(r - radius + wall, -h + wall - z)
    ring = np.hypot(np.hypot(x - radius, z) - 0.028, y) - 0.006
    handle = np.maximum(ring, radius - wall / 2 - r)
    value = np.minimum(np.maximum(outer, -hollow), handle)
    vertices, faces, _, _ = marching_cubes(value, 0.0, spacing=(spacing,) * 3)
    vertices, faces = np.asarray(vertices, float), np.asarray(faces, np.intp)
    vertices = vertices - vertices.mean(0)
    normals = np.cross(vertices[faces[:, 1]] - vertices[faces[:, 0]], vertices[faces[:, 2]] - vertices[faces[:, 0]])
    inward = (vertices[faces[:, 0]] * normals).sum() < 0
    return vertices, faces[:, ::-1] if inward else faces


SHAPES = {
    "ball 33": lambda: sphere(0.033),
    "ball 15": lambda: sphere(0.015),
    "ball 60": lambda: sphere(0.06),
    "die 16": lambda: box(0.016, 0.016, 0.016),
    "die 16 fine": lambda: divided(*box(0.016, 0.016, 0.016), 0.002),
    "block 25": lambda: box(0.025, 0.025, 0.025),
    "box large": lambda: box(0.06, 0.16, 0.21),
    "box sugar": lambda: divided(*box(0.038, 0.089, 0.175), 0.004),
    "box pudding": lambda: box(0.035, 0.11, 0.089),
    "box gelatin": lambda: divided(*box(0.028, 0.085, 0.073), 0.003),
    "cube 70": lambda: box(0.07, 0.07, 0.07),
    "rod 5": lambda: cylinder(0.0025, 0.12),
    "marker": lambda: cylinder(0.009, 0.12),
    "rod 20": lambda: cylinder(0.01, 0.25),
    "can tuna": lambda: cylinder(0.0425, 0.033),
    "can coffee": lambda: cylinder(0.051, 0.139),
    "disc": lambda: cylinder(0.04, 0.012),
    "coin": lambda: cylinder(0.015, 0.003),
    "capsule": lambda: capsule(0.015, 0.06),
    "bowl": lambda: bowl(0.08, 0.004),
    "bowl small": lambda: bowl(0.05, 0.006),
    "cup": lambda: tube(0.035, 0.031, 0.08),
    "ring": lambda: torus(0.04, 0.008),
    "ring thick": lambda: torus(0.035, 0.017),
    "dumbbell": lambda: dumbbell(0.03, 0.01, 0.1),
    "cone": lambda: cone(0.04, 0.1),
    "cone flat": lambda: cone(0.05, 0.05),
    "plate": lambda: plate(0.13, 0.025, 0.005),
    "plate thin": lambda: box(0.1, 0.1, 0.004),
    "saucer": lambda: plate(0.06, 0.012, 0.005),
    "L": lambda: l_shape(0.1, 0.07, 0.025, 0.03),
    "L large": lambda: l_shape(0.16, 0.12, 0.04, 0.04),
    "clamp": lambda: clamp(0.07, 0.015, 0.025),
    "wedge": lambda: wedge(0.1, 0.05, 0.05),
    "wedge sharp": lambda: wedge(0.12, 0.03, 0.06),
    "star": lambda: star(0.05, 0.025, 0.03),
    "hammer": hammer,
    "scissors": scissors,
    "egg": lambda: ellipsoid(0.025, 0.03, 0.045),
    "lens": lambda: ellipsoid(0.06, 0.06, 0.012),
    "pear": lambda: revolved(
        [(0, -0.04), *[(0.032 * np.sin(t) * (1 + 0.35 * np.cos(t)), -0.045 * np.cos(t)) for t in
                       np.linspace(0.1, np.pi - 0.1, 40)][::1], (0, 0.05)]),
    "mug": mug,
    "mug small": lambda: mug(0.03, 0.06, 0.004, 0.0015),
}  # fmt: skip
"""Names and functions that return vertices in metres, and faces."""
