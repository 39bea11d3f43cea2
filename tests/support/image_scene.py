"""Raster images of a ball, a can and a box, for tests of measurements in images."""

from dataclasses import replace
from functools import cache

import numpy as np

from algorithms.vision import Camera, Distortion
from algorithms.vision.objects import ImageSettings, ObjectModel, Scene, SceneCamera, SceneObject, scene_image
from generated import pga3
from tests.support.grasp_scene import EDGES, FACES, TARGET, VERTICES, looking, motor
from tests.support.scans import box, cylinder, sphere

RED = (0.8, 0.25, 0.15)
BALL, CAN = ObjectModel.of(spheres=[[0, 0, 0, 0.04]]), ObjectModel.of(cylinders=[[0, 0, -0.05, 0, 0, 0.05, 0.033]])
BOX = ObjectModel.of(edges=EDGES)
THINGS = {"ball": (BALL, *sphere(0.04)), "can": (CAN, *cylinder(0.033, 0.1)), "box": (BOX, VERTICES, FACES)}
TRUTH = motor((0.2, 0.3, 0.5), TARGET)
NEAR = pga3.motor_product(TRUTH, motor((0.04, 0.03, -0.04), (0.002, 0.003, -0.002)))
HALF_TURNS = [motor(np.pi * axis, (0, 0, 0)) for axis in (np.zeros(3), *np.eye(3))]
SETTINGS = ImageSettings(blur=0.6, noise=0.01, samples=4)
SIZE = (320, 240)
PLACES = np.array([[1.0, -0.3, 0.6], [0.9, 0.5, 0.6]])
CAMERAS = tuple(
    SceneCamera(
        Camera.from_intrinsics(500.0, (160.0, 120.0), looking(TARGET, place), distortion=Distortion("brown", (-0.1,))),
        SIZE,
    )
    for place in PLACES
)


def thing(name, pose=TRUTH, colour=RED):
    """An object; spheres and cylinders of models are rendered without a mesh."""
    model, vertices, faces = THINGS[name]
    return (
        SceneObject(name, model, pose, vertices, faces, colour)
        if name == "box"
        else SceneObject(name, model, pose, colour=colour)
    )


def in_front(share, aside, size=(0.03, 0.1, 0.3)):
    """A wall between the first camera and the target, moved to the side of the image."""
    z = TARGET - PLACES[0]
    x = np.cross(z, [0, 0, 1.0])
    x /= np.linalg.norm(x)
    whole = np.eye(4)
    whole[:3, :3] = np.column_stack([np.cross(x, [0, 0, 1.0]), x, [0, 0, 1.0]])
    wide = wall((0, 0, 0), size)
    whole[:3, 3] = TARGET - share * z + aside * x
    return replace(wide, pose=pga3.motor_from_matrix(whole))


@cache
def plain(name):
    """Return the cameras and images of an object alone."""
    return imaged(thing(name))


def wall(place, size, colour=(0.2, 0.5, 0.3), turn=(0, 0, 0)):
    """An object that hides others."""
    return SceneObject("wall", ObjectModel.of(points=[[0, 0, 0]]), motor(turn, place), *box(*size), colour)


def imaged(*objects, n=2, settings=SETTINGS, seed=0, among=CAMERAS):
    """Return the cameras of a scene and their images."""
    built = Scene(among[:n], objects)
    images = [scene_image(built, k, settings, seed=10 * seed + k) for k in range(n)]
    return [built.placed_camera(k) for k in range(n)], images


def error(name, found, truth):
    """The largest distance in millimetres between two poses of points of an object, up to its symmetries."""
    model = THINGS[name][0]
    if name == "ball":
        options = [np.zeros((1, 3))]
        samples = options[0]
    elif name == "can":
        samples = model.tubes[0, :6].reshape(2, 3)
        options = [samples, samples[::-1]]
    else:
        samples = model.samples
        options = [pga3.move_point(turn, samples) for turn in HALF_TURNS]
    there = pga3.move_point(found, samples)
    return 1e3 * min(np.linalg.norm(pga3.move_point(truth, np.array(o)) - there, axis=1).max() for o in options)
