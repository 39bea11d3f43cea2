"""What bundle adjustment estimates, from which observations, and the losses of these."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from generated import bundles

from ..arguments import Reals
from .plane_adjustment import N_INTRINSICS

KERNELS: dict[str, tuple[Any, Any, Any]] = {
    "pinhole": (bundles.pinhole_distances, bundles.pinhole_equations, bundles.pinhole_lens_equations),
    "brown": (bundles.brown_distances, bundles.brown_equations, bundles.brown_lens_equations),
    "fisheye": (bundles.fisheye_distances, bundles.fisheye_equations, bundles.fisheye_lens_equations),
}
LINE_KERNELS: tuple[Any, Any, Any] = bundles.line_distances, bundles.line_equations, bundles.line_lens_equations


@dataclass(frozen=True, slots=True, eq=False)
class State:
    """What is estimated."""

    motors: Reals
    """(c, 8)"""
    lenses: Reals
    """(c, q) fx, fy, cx, cy, the skew and the coefficients of the distortion."""
    points: Reals
    """(m, 3)"""
    lines: Reals
    """(l, 2, 3) Two points of each."""


class SeenLines(NamedTuple):
    """Where cameras see lines."""

    camera: Reals
    """(k,) int"""
    line: Reals
    """(k,) int"""
    pixels: Reals
    """(k, 2, 2) Pixels of the pinhole camera."""

    def some(self, used: Reals) -> SeenLines:
        """Return a part of the observations."""
        return SeenLines(*(each[used] for each in self))


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """Observations that are used, and what may move."""

    camera: Reals
    point: Reals
    pixels: Reals
    model: str
    kind: float
    scale: float
    free_cameras: Reals
    """(c,) bool"""
    free_points: Reals
    """(m,) bool"""
    lines: SeenLines
    free_lines: Reals
    """(l,) bool"""
    scaled: Reals
    """(s, 2) Cameras whose distance from a second one is held."""
    lens_of: Reals
    """(c,) The number of the lens of each camera."""
    by_parameter: Reals
    """(q, p) The numbers of a lens by its estimated parameters."""

    @property
    def n_lenses(self) -> int:
        """The number of lenses with parameters."""
        return int(self.lens_of.max(initial=-1)) + 1 if self.by_parameter.shape[1] else 0

    def seen(self, state: State) -> tuple[Reals, ...]:
        """Return the arguments of kernels for all observations of points, up to the weight."""
        take = np.take
        one = np.ones(len(self.camera))
        motors, lenses = take(state.motors, self.camera, 0), take(state.lenses, self.camera, 0)
        return motors, take(state.points, self.point, 0), lenses, self.pixels, one

    def squares(self, state: State) -> tuple[Reals, Reals]:
        """Return squared distances (k,) of pixels, and the depths of their points."""
        squares, depths = KERNELS[self.model][0](*self.seen(state))
        return squares, depths

    def of_lines(self, state: State) -> tuple[Reals, ...]:
        """Return the motors, ends, lenses and pixels of all observations of lines."""
        camera, line, pixels = self.lines
        return state.motors[camera], state.lines[line], state.lenses[camera, :N_INTRINSICS], pixels

    def all_squares(self, state: State) -> tuple[Reals, Reals]:
        """Return squared distances (k + kl,) of points and of lines, and the depths of these.

        The squared distance of a line is the sum of those of both pixels.
        """
        found = [self.squares(state)]
        if len(self.lines.line):
            found.append(LINE_KERNELS[0](*self.of_lines(state), 1.0))
        squares, depths = (np.concatenate(each) for each in zip(*found, strict=True))
        return squares, depths

    @property
    def tables(self) -> tuple[Reals, Reals]:
        """The cameras (k + kl,) of all observations, and the numbers of points, and of lines after these."""
        camera, line, _ = self.lines
        return np.concatenate([self.camera, camera]), np.concatenate([self.point, len(self.free_points) + line])

    def losses(self, squares: Reals) -> Reals:
        """Return the losses of squared distances."""
        if self.kind == 0:
            return squares
        limit = self.scale**2
        if self.kind == 1:
            return np.where(squares > limit, 2 * self.scale * np.sqrt(squares) - limit, squares)
        return np.asarray(limit * np.log1p(squares / limit))

    def influences(self, squares: Reals) -> Reals:
        """Return the derivatives of losses by squared distances."""
        if self.kind == 0:
            return np.ones_like(squares)
        limit = self.scale**2
        if self.kind == 1:
            return self.scale / np.sqrt(np.maximum(squares, limit))
        return np.asarray(limit / (limit + squares))

    def cost(self, state: State) -> float:
        """Return half the sum of losses."""
        with np.errstate(all="ignore"):
            return 0.5 * float(self.losses(self.all_squares(state)[0]).sum())
