"""Segmentation by colour and contours between pixels, compared with drawn discs, whose covered areas are exact."""

import numpy as np
import pytest

from algorithms.shapes import ColourStatus, segment_colour

RED, GREY = np.array([0.8, 0.25, 0.15]), np.array([0.4, 0.45, 0.5])
FINE = 4


def drawn(*discs, size=(120, 160), colour=RED, behind=GREY, noise=0.0, shading=0.0):
    """Discs (x, y, radius), the mean of fine samples of each pixel; brightness falls towards their rims."""
    grid = (np.arange(FINE) + 0.5) / FINE - 0.5
    y = (np.arange(size[0])[:, None] + grid).ravel()[:, None]
    x = (np.arange(size[1])[:, None] + grid).ravel()
    image = np.broadcast_to(behind, (len(y), x.size, 3)).copy()
    for a, b, radius in discs:
        ratio = ((x - a) ** 2 + (y - b) ** 2) / radius**2
        inside = ratio <= 1
        image[inside] = (1 - shading * (1 - np.sqrt(1 - ratio[inside])))[:, None] * colour
    image = image.reshape(size[0], FINE, size[1], FINE, 3).mean((1, 3))
    return np.clip(image + np.random.default_rng(0).normal(0, noise, image.shape), 0, 1)


def errors(contour, disc):
    return np.hypot(contour[:, 0] - disc[0], contour[:, 1] - disc[1]) - disc[2]


@pytest.mark.parametrize("behind", [GREY, np.array([0.9, 0.9, 0.9]), np.array([0.1, 0.3, 0.7]), np.zeros(3)])
@pytest.mark.parametrize("shading", [0.0, 0.5])
def test_contours_between_pixels(behind, shading: float) -> None:
    disc = (81.3, 58.7, 33.4)
    found = segment_colour(drawn(disc, behind=behind, shading=shading, noise=0.01), RED)
    assert found.status == ColourStatus.OK and len(found.contours) == 1
    off = errors(found.contours[0], disc)
    # On black, only the brightness shows how much of a pixel is covered.
    most = 0.06 if behind.any() else 0.3
    assert abs(off.mean()) < most and np.sqrt(np.mean(off**2)) < 2 * most
    assert abs(found.coverage.sum() / (np.pi * disc[2] ** 2) - 1) < 2 * most / 30 and 0.003 < found.noise < 0.02
    assert found.mask[58, 81] and not found.mask[5, 5]


def test_samples_of_pixels_and_integers() -> None:
    disc = (81.3, 58.7, 33.4)
    image = drawn(disc, noise=0.01)
    samples = image[50:60, 70:80].reshape(-1, 3)
    for array, colour in (
        (image, samples), ((255 * image).astype(np.uint8), 255 * samples), ((255 * image).astype(np.uint8), RED),
        (image.tolist(), RED.tolist()), (image.astype(np.float32), RED),
    ):  # fmt: skip
        found = segment_colour(array, colour)
        assert found.status == ColourStatus.OK and abs(errors(found.contours[0], disc).mean()) < 0.06


def test_the_status_names_the_cause_and_the_largest_is_chosen() -> None:
    large, small = (60.0, 60.0, 30.0), (130.0, 60.0, 20.0)
    assert segment_colour(drawn(large), (0.1, 0.2, 0.9)).status == ColourStatus.NOT_FOUND
    assert segment_colour(drawn((60, 60, 3.0)), RED).status == ColourStatus.TOO_SMALL
    assert segment_colour(drawn((60, 60, 3.0)), RED, least=10).status == ColourStatus.OK
    cut = segment_colour(drawn((5, 60, 30.0)), RED)
    assert cut.status == ColourStatus.TOUCHES_BORDER
    away = cut.contours[0][cut.contours[0][:, 0] > 4]
    assert np.abs(errors(away, (5, 60, 30.0))).max() < 0.3
    two = segment_colour(drawn(large, small), RED)
    assert two.status == ColourStatus.SEVERAL and np.abs(errors(two.contours[0], large)).max() < 0.3
    assert list(two.sizes) == sorted(two.sizes, reverse=True) and len(two.sizes) == 2
    region = np.zeros((120, 160), bool)
    region[:, 100:] = True
    other = segment_colour(drawn(large, small), RED, region=region)
    assert other.status == ColourStatus.OK and np.abs(errors(other.contours[0], small)).max() < 0.3
    both = segment_colour(drawn(large, small), RED, region=np.ones_like(region))
    assert both.status == ColourStatus.OK and len(both.contours) == 2
    broken = drawn(large)
    broken[0, 0, 0] = np.inf
    assert segment_colour(broken, RED).status == ColourStatus.NOT_FINITE


def test_a_hole_is_filled() -> None:
    image = drawn((60.0, 60.0, 30.0))
    image[55:65, 50:70] = GREY
    found = segment_colour(image, RED)
    assert found.mask[60, 60] and np.abs(errors(found.contours[0], (60, 60, 30))).max() < 0.3


def test_wrong_arguments_are_refused() -> None:
    image = drawn((60.0, 60.0, 30.0))
    for wrong, colour, text in (
        (image[..., 0], RED, "image: shape"), (np.zeros((0, 4, 3)), RED, "at least one pixel"),
        (image, (0, 0, 0), "colour"), (image, (-1, 0, 2), "colour"), (image, (1, 2), "colour: shape"),
    ):  # fmt: skip
        with pytest.raises(ValueError, match=text):
            segment_colour(wrong, colour)
    with pytest.raises(ValueError, match="region"):
        segment_colour(image, RED, region=np.ones((3, 3), bool))
    with pytest.raises(ValueError, match="least"):
        segment_colour(image, RED, least=0)
    with pytest.raises(TypeError, match="complex"):
        segment_colour(image * 1j, RED)
