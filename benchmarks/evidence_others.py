"""Scenes of images and of layers for the page of evidence."""

from __future__ import annotations

import numpy as np
import scipy

from algorithms.learning import Gate
from algorithms.learning.algebra import Algebra
from algorithms.learning.linear import left_matrix, right_matrix
from algorithms.wavelets import disparity, optical_flow

from .evidence_scenes import Trial, row


def _texture(rng: np.random.Generator) -> np.ndarray:
    """A random texture, smooth over up to four pixels."""
    noise = rng.normal(size=(72, 120))
    smooth = scipy.ndimage.gaussian_filter(noise, rng.uniform(0.3, 4))
    return np.asarray(smooth / smooth.std())


def _pair(rng: np.random.Generator, related: bool) -> tuple[np.ndarray, np.ndarray]:
    """Two images, of which the second is the first one moved to the left by four pixels if they are related."""
    one = _texture(rng)
    two = one if related else (_texture(rng) if rng.random() < 0.8 else np.full_like(one, rng.normal()))
    first, second = one[:, :96], two[:, 4:100]
    if not related and rng.random() < 0.2:
        first = np.full_like(first, 1.0)
    return first, second + rng.normal(0, 0.2, second.shape) * related


@row("`disparity`", "unrelated or constant images; OK: more than 5 % of the pixels with confidence above 0.1")
def unrelated_pairs(rng: np.random.Generator) -> Trial:
    found = disparity(*_pair(rng, False), 10)
    return Trial(bool((found.confidence > 0.1).mean() > 0.05), False)


@row("`disparity`", "textures moved by four pixels, noise of a fifth of the contrast; OK: 80 %", good=True)
def stereo_pairs(rng: np.random.Generator) -> Trial:
    found = disparity(*_pair(rng, True), 10)
    sure = found.confidence > 0.1
    return Trial(bool(sure.mean() > 0.8), bool(np.median(np.abs(found.disparity[sure] - 4)) < 1))


@row("`optical_flow`", "unrelated or constant images; OK: more than 5 % of the pixels visible", slow=True)
def unrelated_images(rng: np.random.Generator) -> Trial:
    return Trial(bool(optical_flow(*_pair(rng, False)).visible.mean() > 0.05), False)


@row(
    "`optical_flow`", "textures moved by four pixels, noise of a fifth of the contrast; OK: 80 %", good=True, slow=True
)
def moved_images(rng: np.random.Generator) -> Trial:
    found = optical_flow(*_pair(rng, True))
    return Trial(bool(found.visible.mean() > 0.8), bool(np.median(np.abs(found.uv[..., 0] + 4)) < 1))


@row("`Gate`", "rotations of G(1,3), G(4,1), G(3,0,1) and G(2,1); wrong: not equivariant to 1e-6")
def gate(rng: np.random.Generator) -> Trial:
    algebra = Algebra.of(str(rng.choice(["G(1,3)", "G(4,1)", "G(3,0,1)", "G(2,1)"])))
    plane = np.where(algebra.grades == 2, 0.4 * rng.normal(size=algebra.size), 0)
    rotor, term = np.zeros(algebra.size), np.eye(algebra.size)[0]
    for k in range(1, 30):
        rotor, term = rotor + term, algebra.product(term, plane) / k
    turn = left_matrix(algebra, rotor) @ right_matrix(algebra, rotor * algebra.reversal)
    x = rng.normal(size=(2, 2, algebra.size))
    parameters = Gate().initial(algebra, 2, rng)
    y, turned = (Gate().value(algebra, one, parameters) for one in (x, x @ turn.T))
    return Trial(True, bool(np.abs(y @ turn.T - turned).max() < 1e-6 * max(np.abs(turned).max(), 1)))
