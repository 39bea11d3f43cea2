"""Robust estimates are never OK by chance, for a plane or line, or before the requested confidence is reached."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from plane_scenes import error_on_fresh_points, seen_from_two_places
from scipy.stats import binom
from selection import some_slow

from algorithms.evidence import Consensus, Hypothesis
from algorithms.evidence.chance import Freedom, by_chance
from algorithms.vision import (
    VisionStatus,
    fundamental_matrix,
    localize,
    robust,
    robust_fundamental_matrix,
    robust_homography,
)
from generated import relative_poses, robust_views
from tests.support.all_cases import all_cases

Array = np.ndarray[Any, Any]
K = np.array([[800.0, 0, 320], [0, 800, 240], [0, 0, 1]])


RANDOM = [(8, 15), (12, 40), (20, 20), (100, 3), (2000, 1)]


@pytest.mark.parametrize(("n_points", "trials"), some_slow(RANDOM, *RANDOM[1:]))
def test_random_pairs_have_no_geometry(n_points: int, trials: int) -> None:
    rng = np.random.default_rng(n_points)
    for _ in range(trials):
        one, two = rng.uniform(0, [640, 480], (2, n_points, 2))
        found = robust_fundamental_matrix(one, two, max_samples=20000)
        assert found.status == VisionStatus.NO_CONSENSUS and np.isnan(found.model).all()
        assert robust_homography(one, two, max_samples=2000).status == VisionStatus.NO_CONSENSUS
        points = rng.uniform(-1, 1, (n_points, 3))
        assert localize(points, two, K, threshold=2.0, max_samples=500).status == VisionStatus.NO_CONSENSUS


@pytest.mark.parametrize("n_points", [20, 100])
@pytest.mark.parametrize("near", [5.0, 20.0])
def test_pairs_sought_near_each_other_have_no_geometry(n_points: int, near: float) -> None:
    rng = np.random.default_rng(n_points)
    for _ in range(4 if n_points == 20 else 1):
        one = rng.uniform(0, [640, 480], (n_points, 2))
        two = one + near * rng.normal(size=one.shape)
        assert robust_fundamental_matrix(one, two, max_samples=20000).status != VisionStatus.OK


PLANES = [(0.5, 1.0), (0.3, 2.0), (1.0, 1.0), (0.0, 1.0)]


@pytest.mark.parametrize(("noise", "threshold"), some_slow(PLANES, *PLANES[1:]))
def test_a_plane_with_wrong_pairs_does_not_determine_f(noise: float, threshold: float) -> None:
    """Wrong pairs that agree with one of the many F of a plane do not determine F, however tight the threshold is."""
    rng = np.random.default_rng(round(10 * noise))
    for n_points, wrong in ((40, 0.0), (40, 0.2), (200, 0.2), (200, 0.4), (1000, 0.2)):
        one, two, _, _ = seen_from_two_places(rng, n_points, 1.0, noise, wrong)
        found = robust_fundamental_matrix(one, two, threshold)
        assert found.status == VisionStatus.DEGENERATE and np.isnan(found.model).all()


def test_a_line_with_wrong_pairs_does_not_determine_f() -> None:
    rng = np.random.default_rng(3)
    line = np.outer(rng.uniform(-1, 1, 100), [2, 1, 0.7])
    for wrong in (0.0, 0.2):
        one, two, _, _ = seen_from_two_places(rng, 100, 0.0, 0.5, wrong, line)
        found = robust_fundamental_matrix(one, two)
        assert found.status in (VisionStatus.DEGENERATE, VisionStatus.NO_CONSENSUS)


@pytest.mark.parametrize("share", some_slow([0.0, 0.5, 0.8, 0.9, 0.95], 0.5, 0.8, 0.9))
def test_points_off_a_plane_determine_f(share: float) -> None:
    """Errors on new points are those of noise; an F of the plane alone has an error of more than ten pixels.

    Of 16 pairs off a plane, chance explains those that agree in 3 % of the scenes.
    """
    rng = np.random.default_rng(round(100 * share))
    refused = 0
    for _ in range(8):
        one, two, wrong, fresh = seen_from_two_places(rng, 400, share, 0.5, 0.2)
        found = robust_fundamental_matrix(one, two)
        refused += found.status == VisionStatus.DEGENERATE
        if share == 0.95 and found.status == VisionStatus.DEGENERATE:
            continue
        assert found.status == VisionStatus.OK
        assert found.inliers[~wrong].mean() > 0.9 and found.inliers[wrong].mean() < 0.1
        assert error_on_fresh_points(found.model, *fresh) < (1.0 if share < 0.95 else 2.0)
    assert refused <= 1


def test_no_lower_minimum_is_near_the_truth() -> None:
    """Truncated squares have several minima; those to which the best samples lead are higher in one of six scenes."""
    rng = np.random.default_rng(5)
    for _ in range(16):
        one, two, _, fresh = seen_from_two_places(rng, 150, 0.3, 0.5, 0.4)
        near = robust_views.descend_fundamental(fundamental_matrix(*fresh), one, two, 1.0, 50.0, 1e-14)[0]
        models = np.stack([robust_fundamental_matrix(one, two).model, near])
        found, known = relative_poses.truncated_squares(models, one, two, 1.0)
        assert found < known + 0.01


def test_pairs_that_are_less_exact_have_less_weight() -> None:
    """A third of the pixels has ten times the noise of the others, as those of real features: below the threshold."""
    rng, ours, squares = np.random.default_rng(21), [], []
    for _ in range(10):
        places = rng.uniform(-1, 1, (200, 3)) * [2, 1.5, 1.5]
        one, two, _, fresh = seen_from_two_places(rng, 200, 0.0, 0.05, 0.2, places)
        two = two + 0.5 * rng.normal(size=two.shape) * (rng.random((200, 1)) < 1 / 3)
        found = robust_fundamental_matrix(one, two, threshold=1.5)
        assert found.status == VisionStatus.OK
        ours.append(error_on_fresh_points(found.model, *fresh))
        squares.append(error_on_fresh_points(fundamental_matrix(one[found.inliers], two[found.inliers]), *fresh))
    assert np.median(ours) < 0.7 * np.median(squares)


def test_shuffled_partners_do_not_repeat_the_numbers_of_samples(monkeypatch: pytest.MonkeyPatch) -> None:
    """A seed gives samples and shuffles different streams, each of them always the same; a generator goes on."""
    drawn: list[float] = []

    def explained(*others: Any) -> bool:
        drawn.append(others[-1].random())
        return False

    monkeypatch.setattr(robust, "explained_by_chance", explained)
    found = Consensus(Hypothesis(0.0, np.eye(3), np.ones(9, bool)), 1, reached=True)
    for seed in (5, 5, np.random.default_rng(5)):
        assert robust.consensus_status(None, found, 1.0, seed) == VisionStatus.OK  # type: ignore[arg-type]
    assert drawn[0] == drawn[1] != drawn[2] == np.random.default_rng(5).random()


def test_shallow_scenes_are_not_planes() -> None:
    """All points within two pixels of a homography, with noise of a tenth of a pixel."""
    rng = np.random.default_rng(8)
    points = rng.uniform(-1, 1, (200, 3)) * [2, 1.5, 0.15]
    one, two, _, fresh = seen_from_two_places(rng, 200, 0.0, 0.1, 0.1, points)
    found = robust_fundamental_matrix(one, two, threshold=0.5)
    assert found.status == VisionStatus.OK and error_on_fresh_points(found.model, *fresh) < 2.0


def test_the_confidence_is_reached_or_the_status_reports_it() -> None:
    rng = np.random.default_rng(9)
    one, two, wrong, fresh = seen_from_two_places(rng, 300, 0.0, 0.3, 0.65)
    few = robust_fundamental_matrix(one, two, max_samples=2000)
    assert few.status == VisionStatus.NOT_CONVERGED and few.n_samples == 2000 and np.isnan(few.model).all()
    found = robust_fundamental_matrix(one, two)
    assert found.status == VisionStatus.OK and error_on_fresh_points(found.model, *fresh) < 0.5
    # The number of samples that contain one without wrong pairs with the requested probability.
    assert 1 - (1 - found.inliers.mean() ** 7) ** found.n_samples >= 0.999
    flat, moved = one, one + np.array([30.0, 20])
    moved = np.where(wrong[:, None], rng.uniform(0, 480, moved.shape), moved)
    assert robust_homography(flat, moved, max_samples=200).status == VisionStatus.NOT_CONVERGED
    assert robust_homography(flat, moved).status == VisionStatus.OK


@all_cases(
    "arguments, message",
    [
        ({"threshold": -1}, "threshold: -1"),
        ({"threshold": 0.0}, "threshold: 0"),
        ({"threshold": np.nan}, "threshold: nan"),
        ({"confidence": 0}, "confidence: 0"),
        ({"confidence": 1.0}, "confidence: 1"),
        ({"confidence": 2}, "confidence: 2"),
        ({"max_samples": 0}, "max_samples: 0; expected at least 1"),
        ({"max_samples": -5}, "max_samples: -5"),
    ],
)
def test_invalid_numbers(arguments: dict[str, Any], message: str) -> None:
    rng = np.random.default_rng(1)
    one, two = rng.uniform(0, 500, (2, 30, 2))
    for call in (robust_fundamental_matrix, robust_homography):
        with pytest.raises(ValueError, match=message):
            call(one, two, **arguments)
    with pytest.raises(ValueError, match=message):
        localize(rng.normal(size=(30, 3)), one, K, **{"threshold": 1.0, **arguments})
    with pytest.raises(TypeError, match=r"max_samples: 2\.5"):
        robust_homography(one, two, max_samples=2.5)  # type: ignore[arg-type]


def test_repeated_pairs_count_once() -> None:
    rng = np.random.default_rng(6)
    one, two = np.repeat(rng.uniform(0, [640, 480], (2, 9, 2)), 4, axis=1)
    assert robust_fundamental_matrix(one, two).status != VisionStatus.OK
    assert robust_homography(one, two).status != VisionStatus.OK


def test_the_bound_is_that_of_binomials() -> None:
    """At one deciding level: 3 * 2^7 * binomial(30, 7) * P(B(23, 0.02) >= k - 7)."""
    freedom = Freedom(sample_size=7, parameters=7, codimension=1, solutions=3, false_alarms=0.01)
    wrong = np.linspace(0, 100, 50001)[1:]  # a share of 0.02 within 2 pixels
    bounds = np.array([3 * 2**7 * 2035800 * binom.sf(k - 8, 23, 0.02) for k in range(8, 31)])
    least = 8 + int(np.argmax(2 * bounds < 0.01))
    for count in (least - 1, least):
        distances = np.where(np.arange(30) < count, 1.99, 50.0)
        assert by_chance(distances, wrong, 2.0, freedom) == (count < least)


def test_the_robust_method_of_fundamental_matrix_has_the_same_statuses() -> None:
    rng = np.random.default_rng(2)
    one, two, _, _ = seen_from_two_places(rng, 100, 1.0, 0.5, 0.2)
    with pytest.raises(ValueError, match="degenerate"):
        fundamental_matrix(one, two, "robust")
    with pytest.raises(ValueError, match="no consensus"):
        fundamental_matrix(*rng.uniform(0, 500, (2, 20, 2)), "robust")
