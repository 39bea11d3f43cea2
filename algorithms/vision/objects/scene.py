"""A simulated scene: cameras, some of them on the links of a robot, and rigid objects. Scenes are immutable."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ...arguments import Reals, finite, finite_number, real_array
from ...elements import MOTOR, elements
from ...geometry.meshes import hit_mesh
from ...kinematics import Robot
from ..camera import Camera
from .pose_models import ObjectModel, View
from .scene_silhouettes import element_pixels

_NEAR = 1e-3
"""A point is hidden if a surface is nearer to the camera by more than this, in metres."""


@dataclass(frozen=True, eq=False)
class SceneCamera:
    """A camera of a scene."""

    camera: Camera
    """Its pose is in the world, or in the frame of the end effector if it is mounted. Its lens may have distortion."""
    size: tuple[int, int] = (640, 480)
    """Width and height of the image in pixels. Integer coordinates are the centres of pixels."""
    is_mounted: bool = False
    """Whether the robot carries the camera at its end effector."""

    @property
    def pinhole(self) -> Camera:
        """The camera without distortion."""
        return self.camera.pinhole


@dataclass(frozen=True, eq=False)
class SceneObject:
    """A rigid object: elements by which its pose is found, and a mesh that hides others and that a hand can hold."""

    name: str
    model: ObjectModel
    pose: Reals
    vertices: Reals = field(default_factory=lambda: np.zeros((0, 3)))
    faces: Reals = field(default_factory=lambda: np.zeros((0, 3), int))
    colour: tuple[float, float, float] = (0.8, 0.25, 0.15)
    """Red, green and blue from 0 to 1, of raster images: see `scene_image`."""


@dataclass(frozen=True, eq=False)
class Scene:
    """Cameras, objects, and a robot in a configuration."""

    cameras: tuple[SceneCamera, ...]
    objects: tuple[SceneObject, ...]
    robot: Robot | None = None
    q: Reals = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        if self.robot is None and any(one.is_mounted for one in self.cameras):
            raise ValueError("Scene: a mounted camera; expected a robot")
        names = [one.name for one in self.objects]
        if len(set(names)) < len(names):
            raise ValueError(f"Scene: objects {names}; expected distinct names")

    def object(self, name: str) -> SceneObject:
        """Return an object by its name.

        Raises
        ------
        ValueError
            If there is none.
        """
        for one in self.objects:
            if one.name == name:
                return one
        raise ValueError(f"Scene: object {name!r}; expected one of {[one.name for one in self.objects]}")

    @elements(pose=MOTOR)
    def with_pose(self, name: str, pose: ArrayLike) -> Scene:
        """Return the scene with an object at another pose, (8,)."""
        moved = replace(self.object(name), pose=finite(real_array(pose, "pose", (8,), "a motor"), "pose").astype(float))
        return replace(self, objects=tuple(moved if one.name == name else one for one in self.objects))

    def with_joints(self, q: ArrayLike) -> Scene:
        """Return the scene with the robot in another configuration, (n,)."""
        if self.robot is None:
            raise ValueError("Scene: joints of no robot; expected a scene with a robot")
        return replace(self, q=finite(real_array(q, "q", (self.robot.n_joints,)), "q").astype(float))

    def camera(self, k: int) -> Camera:
        """Return the camera k with its pose in the world."""
        one = self.cameras[k]
        if not one.is_mounted or self.robot is None:
            return one.camera
        pose = pga3.motor_product(self.robot.forward(self.q), one.camera.pose)
        return replace(one.camera, pose=pose)

    def placed_camera(self, k: int) -> SceneCamera:
        """Return the camera k with its image and its pose in the world."""
        return replace(self.cameras[k], camera=self.camera(k), is_mounted=False)

    def render(self, name: str, noise: float = 0.0, seed: int = 0) -> tuple[View, ...]:
        """Return what all cameras see of an object, with noise, occlusion and the effect of lens distortion.

        Pixels are distorted by the lens, noise is added, and the known distortion is removed again, so that views are
        those of pinhole cameras.

        Parameters
        ----------
        name : str
            The object.
        noise : float
            The standard deviation of each coordinate of a pixel.
        seed : int

        Returns
        -------
        tuple of View
            One for each camera. Points that are not seen are NaN; hidden pixels of edges and silhouettes are absent.

        Raises
        ------
        ValueError
            If there is no such object.
        """
        if finite_number(noise, "noise") < 0:
            raise ValueError(f"noise: {noise}; expected at least 0 pixels")
        rng = np.random.default_rng(seed)
        seen = self.object(name)
        return tuple(self._view(k, seen, noise, rng) for k in range(len(self.cameras)))

    def _view(self, k: int, seen: SceneObject, noise: float, rng: np.random.Generator) -> View:
        camera = self.camera(k)
        found: dict[str, object] = {}
        for kind, (index, places) in element_pixels(seen.model, seen.pose, camera.pinhole).items():
            shown = self.shows(k, places)
            pixels = _measured(camera, places, noise, rng)
            if kind == "points":
                found[kind] = np.where(shown[:, None], pixels, np.nan)
            else:
                found[kind] = (index[shown], pixels[shown])
        return View(camera.pinhole, **found)  # type: ignore[arg-type]

    def shows(self, k: int, places: Reals) -> Reals:
        """Return whether points (n, 3) of the world are in front of a camera, in its image, and not hidden."""
        camera, (width, height) = self.camera(k).pinhole, self.cameras[k].size
        front = camera.depth(places) > _NEAR
        pixels = np.full((len(places), 2), -1.0)
        pixels[front] = camera.project(places[front])
        seen = front & (pixels >= 0).all(1) & (pixels < [width, height]).all(1)
        away = places - camera.centre
        size = np.maximum(np.linalg.norm(away, axis=1), 1e-12)
        for one in self.objects:
            if len(one.faces) and seen.any():
                vertices = pga3.move_point(one.pose, one.vertices)
                near = hit_mesh(camera.centre, away / size[:, None], vertices, one.faces).distance < size - _NEAR
                seen = seen & ~near
        return np.asarray(seen)


def simulate(
    scene: Scene, name: str, control: Callable[[tuple[View, ...], Reals], Reals], n_steps: int,
    *, delay: int = 0, noise: float = 0.0, seed: int = 0, interval: float = 0.04,
) -> Iterator[Scene]:  # fmt: skip
    """Step a robot whose joint rates depend on images, and yield the scene after each step.

    Parameters
    ----------
    scene : Scene
        With a robot.
    name : str
        The object that is seen.
    control : callable
        ``control(views, q)`` returns joint rates (n,), from views that are `delay` steps old and current joints.
    n_steps : int
    delay : int
        Number of steps between an image and the command that uses it; the robot rests until the first one.
    noise, seed
        As in `Scene.render`.
    interval : float
        The duration of a step in seconds.

    Raises
    ------
    ValueError
        If the scene has no robot, or `delay` is negative.
    """
    if scene.robot is None or delay < 0:
        raise ValueError(f"simulate: robot {scene.robot}, delay {delay}; expected a robot and at least 0 steps")
    waiting: list[tuple[View, ...]] = []
    for step in range(n_steps):
        waiting.append(scene.render(name, noise, seed + step))
        if len(waiting) > delay:
            scene = scene.with_joints(scene.q + interval * np.asarray(control(waiting.pop(0), scene.q)))
        yield scene


def _measured(camera: Camera, places: Reals, noise: float, rng: np.random.Generator) -> Reals:
    """Return the pixels of a pinhole camera by measurements of points in the image of a lens."""
    with np.errstate(all="ignore"):
        exact = camera.pinhole.project(places)
        return camera.undistort(camera.distort(exact) + rng.normal(0, noise, exact.shape))
