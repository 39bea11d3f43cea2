"""Scores of matches: what is drawn by them, how many samples they save, and that misleading ones do no harm."""

from typing import Any

import numpy as np
import pytest

from algorithms.evidence.sampling import chance_of_right_sets, drawn_sets, random_subsets
from algorithms.vision import (
    Camera,
    VisionStatus,
    localize,
    localize_rig,
    localize_unknown_focal,
    relative_pose,
    relative_pose_unknown_focal,
    robust_fundamental_matrix,
    robust_homography,
)
from generated import pga3
from tests.support.all_cases import all_cases

K = np.array([[700.0, 0, 320], [0, 700, 240], [0, 0, 1]])
EYE = Camera(K, np.eye(8)[0])


def scene(seed: int, wrong: float, n: int = 200) -> dict[str, Any]:
    """Points, their pixels in two views, wrong partners and pixels, and scores that know something of them."""
    rng = np.random.default_rng([150, seed])
    z = rng.uniform(4, 9, n)
    points = np.c_[rng.uniform(-0.35, 0.35, (n, 2)) * z[:, None], z]
    motor = pga3.motor_from_rotation_vector_translation(
        np.array([0.05, 0.1, -0.03]) + 0.05 * rng.normal(size=3), np.array([0.8, 0.1, 0.6])
    )
    one, two = (EYE.project(p) + 0.4 * rng.normal(size=(n, 2)) for p in (points, pga3.move_point(motor, points)))
    plane = np.array([[1.1, 0.05, 3], [-0.04, 0.95, 5], [1e-4, 5e-5, 1]])
    flat = np.insert(one, 2, 1, axis=1) @ plane.T
    flat = flat[:, :2] / flat[:, 2:] + 0.4 * rng.normal(size=(n, 2))
    bad = rng.random(n) < wrong
    for view in (two, flat):
        view[bad] = rng.uniform(0, [640, 480], (int(bad.sum()), 2))
    pixels = one.copy()
    pixels[bad] = rng.uniform(0, [640, 480], (int(bad.sum()), 2))
    # Ratios of distances of descriptors are larger for wrong matches, but overlap.
    ratios = np.where(bad, rng.beta(8, 1.5, n), rng.beta(4, 3, n))
    return {"points": points, "one": one, "two": two, "flat": flat, "pixels": pixels, "bad": bad, "scores": 1 - ratios}


CALLS: dict[str, Any] = {
    "robust_fundamental_matrix": lambda s, w: robust_fundamental_matrix(s["one"], s["two"], 1.5, scores=w),
    "robust_homography": lambda s, w: robust_homography(s["one"], s["flat"], 1.5, scores=w),
    "relative_pose": lambda s, w: relative_pose(s["one"], s["two"], K, threshold=1.5, scores=w),
    "localize": lambda s, w: localize(s["points"], s["pixels"], K, 1.5, scores=w),
    "localize_rig": lambda s, w: localize_rig(s["points"], s["pixels"], [EYE], np.zeros(200, int), 1.5, scores=w),
    "localize_unknown_focal": lambda s, w: localize_unknown_focal(s["points"], s["pixels"], (320, 240), 1.5, scores=w),
    "relative_pose_unknown_focal": lambda s, w: relative_pose_unknown_focal(
        s["one"], s["two"], (320, 240), threshold=1.5, scores=w
    ),
}


@all_cases("name", sorted(CALLS))
def test_scores_good_and_misleading_give_right_results(name: str) -> None:
    data = scene(1, 0.5)
    for scores in (data["scores"], 1 - data["scores"], np.ones(200), data["scores"].astype(np.float32).tolist()):
        found = CALLS[name](data, scores)
        assert found.status == VisionStatus.OK
        assert (found.inliers & data["bad"]).sum() < 15 and found.inliers[~data["bad"]].mean() > 0.9


def test_only_ratios_of_scores_matter() -> None:
    """Also if their sum is beyond the range of doubles."""
    data = scene(2, 0.5)
    scores = data["scores"] / data["scores"].max()
    found = [robust_homography(data["one"], data["flat"], 1.5, scores=2.0**k * scores) for k in (0, 1023, -900)]
    assert len({each.n_samples for each in found}) == 1 and found[0].status == VisionStatus.OK


@all_cases("name", sorted(CALLS))
@all_cases("scores", [np.ones(199), -np.ones(200), np.zeros(200), np.full(200, np.nan)])
def test_invalid_scores_are_refused(name: str, scores: Any) -> None:
    with pytest.raises(ValueError, match="scores"):
        CALLS[name](scene(1, 0.5), scores)


def test_scores_save_samples() -> None:
    drawn = np.zeros(3)
    for seed in range(10):
        data = scene(seed, 0.6)
        for k, scores in enumerate((None, data["scores"], 1 - data["scores"])):
            found = relative_pose(data["one"], data["two"], K, threshold=1.5, scores=scores)
            assert found.status == VisionStatus.OK
            drawn[k] += found.n_samples
    assert drawn[1] < drawn[0] / 2 and drawn[2] < 2.5 * drawn[0]


def test_lines_have_no_scores() -> None:
    data = scene(1, 0.0)
    with pytest.raises(ValueError, match="scores: with lines"):
        localize(
            data["points"], data["pixels"], K, lines=data["points"].reshape(-1, 2, 3),
            image_lines=data["pixels"].reshape(-1, 2, 2), scores=np.ones(200),
        )  # fmt: skip


def test_half_of_the_sets_are_drawn_by_scores_and_the_chance_is_a_bound() -> None:
    rng = np.random.default_rng(151)
    scores = rng.uniform(size=40) ** 3
    right = rng.random(40) < 0.4
    count = 200_000
    sets = drawn_sets(np.random.default_rng(152), 40, 3, count, scores)
    plain = random_subsets(np.random.default_rng(152), 40, 3, count)
    assert (sets[: count // 2] == plain[: count // 2]).all()
    ordered = np.sort(sets, axis=1)
    assert (ordered[:, 1:] > ordered[:, :-1]).all() and sets.min() >= 0 and sets.max() < 40
    second = sets[count // 2 :]
    frequency = right[second].all(1).mean()
    chance = chance_of_right_sets(scores, right, 3)
    assert chance < frequency + 3 * np.sqrt(frequency / len(second)) and chance > frequency / 3
    # A set without an item twice is drawn with the product of the scores.
    a, b = np.argsort(scores)[-2:]
    expected = scores[a] / scores[b]
    assert (second[:, 0] == a).sum() / (second[:, 0] == b).sum() == pytest.approx(expected, rel=0.1)
    assert chance_of_right_sets(scores, np.zeros(40, bool), 3) == 0
    never = drawn_sets(np.random.default_rng(0), 5, 3, 100, np.array([1.0, 0, 0, 0, 0]))  # too few to draw from
    assert (np.sort(never, 1)[:, 1:] > np.sort(never, 1)[:, :-1]).all()
