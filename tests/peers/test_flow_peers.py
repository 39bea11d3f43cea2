"""Optical flow compared with scikit-image and OpenCV on the same known motions."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from flow_truth import NAMES, SQUARES, Pair, mean_error, moving_square, pair, warped

from algorithms.wavelets import optical_flow

pytestmark = pytest.mark.peers

cv2 = pytest.importorskip("cv2")
data = pytest.importorskip("skimage.data")
registration = pytest.importorskip("skimage.registration")

Method = Callable[[np.ndarray, np.ndarray], np.ndarray]


def of_skimage(method: Callable[..., np.ndarray], **options: float) -> Method:
    return lambda a, b: np.moveaxis(method(a / 255, b / 255, **options), 0, -1)[..., ::-1]


def bytes_of(image: np.ndarray) -> np.ndarray:
    return np.round(image).clip(0, 255).astype(np.uint8)


def farneback(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return cv2.calcOpticalFlowFarneback(bytes_of(a), bytes_of(b), None, 0.5, 5, 15, 5, 7, 1.5, 0)


def best_dis(case: Pair) -> tuple[float, float]:
    """The error of DIS with the medium preset, and the least one of its three presets."""
    errors = []
    for preset in ("MEDIUM", "FAST", "ULTRAFAST"):
        method = cv2.DISOpticalFlow_create(getattr(cv2, f"DISOPTICAL_FLOW_PRESET_{preset}"))
        errors.append(case.error(method.calc(case.first, case.second, None)))
    return errors[0], min(errors)


def dis(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    method = cv2.DISOpticalFlow_create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)
    return method.calc(bytes_of(a), bytes_of(b), None)


PEERS: dict[str, Method] = {
    "ilk": of_skimage(registration.optical_flow_ilk, radius=7),
    "tvl1": of_skimage(registration.optical_flow_tvl1),
    "farneback": farneback,
    "dis": dis,
}


def test_motions_are_more_accurate_than_those_of_peers() -> None:
    """On each of four pairs, than each of them; no better method wins all with a probability of 1 / 16."""
    cases = list(zip(("brick", "grass", "gravel", "camera"), ("translation", "rotation") * 2, strict=True))
    wins = dict.fromkeys(PEERS, 0)
    for name, kind in cases:
        first, second, motion = pair(getattr(data, name)()[60:364, 60:364], kind)
        own = mean_error(optical_flow(first, second).uv, motion)
        line = [f"{name} {kind}: {own:.4f}"]
        for peer, method in PEERS.items():
            error = mean_error(method(first, second), motion)
            wins[peer] += own < error
            line.append(f"{peer} {error:.4f}")
        print(*line)
    assert all(count == 4 for count in wins.values()), wins


@pytest.mark.parametrize("kind", ["rotation", "zoom"])
@pytest.mark.parametrize("sigma", [0, 10, 25])
def test_noise_is_borne_as_well_as_by_dis(kind: str, sigma: float) -> None:
    """On each of four images. Of the 24 errors, one is larger than that of DIS: 1.22 times, of coffee with noise 10."""
    for name in NAMES[kind == "zoom" :: 2]:
        case = warped(name, kind).noisy(sigma)
        own, (medium, best) = case.error(optical_flow(case.first, case.second).uv), best_dis(case)
        print(f"{kind} {sigma} {name}: own {own:.3f}, DIS {medium:.3f}, its best preset {best:.3f}")
        assert own <= 1.3 * medium, name


@pytest.mark.parametrize("kind", SQUARES)
def test_boundaries_are_as_sharp_as_those_of_dis(kind: str) -> None:
    for name in NAMES[::2]:
        case = moving_square(name, kind).noisy(0)
        own, (medium, best) = case.error(optical_flow(case.first, case.second).uv), best_dis(case)
        print(f"{kind} {name}: own {own:.3f}, DIS {medium:.3f}, its best preset {best:.3f}")
        assert own <= 1.2 * medium, name
