"""The quaternion Fourier transform against direct sums, closed forms, numpy's transforms and a real image."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from algorithms.wavelets import iqft, irqft, qft, rqft
from tests.support.all_cases import all_cases

SIDES = ("two", "left", "right")
SIZES = ((6, 5), (4, 7), (8, 8), (1, 5), (5, 1), (1, 1), (3, 4), (2, 2))
UNITS = {"i": (1, 0, 0), "j": (0, 1, 0), "k": (0, 0, 1)}
OBLIQUE = (0.6, 0.0, 0.8)
ACROSS = (0.8, 0.0, -0.6)


def product(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Hamilton's product of (w, x, y, z), written out."""
    a, b, c, d = np.moveaxis(p, -1, 0)
    e, f, g, h = np.moveaxis(q, -1, 0)
    return np.stack(
        [
            a * e - b * f - c * g - d * h,
            a * f + b * e + c * h - d * g,
            a * g - b * h + c * e + d * f,
            a * h + b * g - c * f + d * e,
        ],
        -1,
    )


def exponential(axis: Any, angle: np.ndarray) -> np.ndarray:
    """``exp(axis angle)``."""
    x, y, z = UNITS.get(axis, axis) if isinstance(axis, str) else axis
    return np.stack([np.cos(angle), x * np.sin(angle), y * np.sin(angle), z * np.sin(angle)], -1)


def direct(field: np.ndarray, side: str = "two", axes: Any = ("i", "j"), sign: float = -1.0) -> np.ndarray:
    """The sum over all pixels for each frequency."""
    m, n = field.shape[:2]
    x, y = np.arange(m)[:, None], np.arange(n)[None, :]
    result = np.empty_like(field)
    for u in range(m):
        for v in range(n):
            s, t = sign * 2 * np.pi * u * x / m + 0 * y, sign * 2 * np.pi * v * y / n + 0 * x
            if side == "two":
                terms = product(product(exponential(axes[0], s), field), exponential(axes[1], t))
            elif side == "left":
                terms = product(exponential(axes[0], s + t), field)
            else:
                terms = product(field, exponential(axes[1], s + t))
            result[u, v] = terms.sum((0, 1))
    return result


def quaternions(*shape: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=(*shape, 4))


def embedded(image: np.ndarray) -> np.ndarray:
    return np.stack([image, *np.zeros((3, *image.shape))], -1)


@pytest.fixture(scope="module")
def camera() -> np.ndarray:
    data = pytest.importorskip("skimage.data")
    return data.camera()


@all_cases("size", SIZES)
@all_cases("side", SIDES)
def test_direct_sum_and_inverse(side: str, size: tuple[int, int]) -> None:
    field = quaternions(*size)
    spectrum = qft(field, side)
    assert np.abs(spectrum - direct(field, side)).max() < 1e-12
    assert np.abs(iqft(spectrum, side) - field).max() < 1e-14
    assert np.abs(iqft(field, side) - direct(field, side, sign=1.0) / np.prod(size)).max() < 1e-13


@all_cases("side", SIDES)
@all_cases(
    "axes",
    [(a, b) for a in "ijk" for b in "ijk"]
    + [(OBLIQUE, ACROSS), (OBLIQUE, "j"), ("k", "k"), ("j", (0.0, -1.0, 0.0)), (OBLIQUE, (-0.6, 0.0, -0.8))]
    + [
        ("i", (0.6, 0.8, 0.0)),
        ((0.0, -0.8, 0.6), OBLIQUE),
        ("j", (1e-7, np.sqrt(1 - 1e-14), 0.0)),
        ("k", (1e-5, 0.0, -np.sqrt(1 - 1e-10))),
    ],
)
def test_all_axes(side: str, axes: Any) -> None:
    """Axes at all angles, named or not, of quaternions and of real images."""
    field = quaternions(4, 5, seed=1)
    spectrum = qft(field, side, axes)
    assert np.abs(spectrum - direct(field, side, axes)).max() < 1e-12
    assert np.abs(iqft(spectrum, side, axes) - field).max() < 1e-14
    assert np.abs(qft(field[..., 0], side, axes) - direct(embedded(field[..., 0]), side, axes)).max() < 1e-12


@all_cases("size", SIZES)
@all_cases("side", SIDES)
@all_cases("axes", [("i", "j"), ("k", "k"), (OBLIQUE, "k"), ("i", (-1.0, 0.0, 0.0))])
def test_half_of_the_frequencies_of_real_images(side: str, axes: Any, size: tuple[int, int]) -> None:
    image = quaternions(2, *size)[..., 0]
    half = rqft(image, side, axes, "ortho")
    for k in range(2):
        truth = direct(embedded(image[k]), side, axes) / np.sqrt(np.prod(size))
        assert np.abs(half[k] - truth[:, : size[1] // 2 + 1]).max() < 1e-12
    assert np.abs(irqft(half, size[1], side, axes, "ortho") - image).max() < 1e-14
    if size[1] % 2 == 0:
        assert np.array_equal(irqft(half, None, side, axes, "ortho"), irqft(half, size[1], side, axes, "ortho"))
    single = rqft(image.astype(np.float32), side, axes)
    assert single.dtype == irqft(single, size[1], side, axes).dtype == np.float32
    assert np.abs(irqft(single, size[1], side, axes) - image).max() < 1e-5


@all_cases("size", SIZES)
@all_cases("side", SIDES)
def test_a_real_image_is_a_quaternion_image(side: str, size: tuple[int, int]) -> None:
    field = quaternions(*size)[..., 0]
    assert np.abs(qft(field, side) - qft(embedded(field), side)).max() < 1e-13


@all_cases("side", SIDES)
@all_cases("axes", [("i", "j"), ("i", "i"), ("k", "i"), ("j", (0.0, -1.0, 0.0))])
def test_norms_equal_those_of_scipy(side: str, axes: Any) -> None:
    field = quaternions(6, 5)
    plain = qft(field, side, axes)
    for norm, scale in ((None, 1.0), ("backward", 1.0), ("ortho", 30**-0.5), ("forward", 1 / 30)):
        assert np.abs(qft(field, side, axes, norm) - scale * plain).max() < 1e-13
        assert np.abs(qft(field[..., 0], side, axes, norm) - scale * qft(field[..., 0], side, axes)).max() < 1e-13
        assert np.abs(iqft(qft(field, side, axes, norm), side, axes, norm) - field).max() < 1e-14


@pytest.mark.parametrize("side", SIDES)
def test_plancherel(side: str) -> None:
    """The orthonormal transform preserves the norm."""
    field = quaternions(33, 20)
    assert (qft(field, side, norm="ortho") ** 2).sum() == pytest.approx((field**2).sum(), rel=1e-14)


def test_left_transform_of_complex_numbers_equals_the_complex_one() -> None:
    field = quaternions(9, 6)
    field[..., 2:] = 0
    expected = np.fft.fft2(field[..., 0] + 1j * field[..., 1])
    spectrum = qft(field, "left")
    assert np.abs(spectrum[..., 0] + 1j * spectrum[..., 1] - expected).max() < 1e-13
    assert np.abs(spectrum[..., 2:]).max() == 0


def test_real_image_gives_cosine_and_sine_transforms() -> None:
    """w, x, y, z are the cosine-cosine, minus the sine-cosine, minus the cosine-sine and the sine-sine sums."""
    m, n = 6, 9
    image = quaternions(m, n)[..., 0]
    rows, columns = (2 * np.pi * np.outer(np.arange(k), np.arange(k)) / k for k in (m, n))
    cosine, sine = (np.cos(rows), np.cos(columns)), (np.sin(rows), np.sin(columns))
    expected = [
        a @ image @ b.T * sign
        for a, b, sign in (
            (cosine[0], cosine[1], 1),
            (sine[0], cosine[1], -1),
            (cosine[0], sine[1], -1),
            (sine[0], sine[1], 1),
        )
    ]
    assert np.abs(qft(image) - np.stack(expected, -1)).max() < 1e-13


def test_shift_theorem() -> None:
    """A shift by (a, b) multiplies by ``exp(-i 2 pi u a / M)`` from the left and by ``exp(-j 2 pi v b / N)``
    from the right.
    """
    field, (a, b) = quaternions(7, 10), (3, 4)
    u, v = np.arange(7)[:, None] + np.zeros(10), np.zeros((7, 1)) + np.arange(10)
    left, right = exponential("i", -2 * np.pi * u * a / 7), exponential("j", -2 * np.pi * v * b / 10)
    moved = qft(np.roll(field, (a, b), (0, 1)))
    assert np.abs(moved - product(product(left, qft(field)), right)).max() < 1e-12


def test_linear_over_the_quaternions_on_the_free_side() -> None:
    """The left transform commutes with multiplication from the right, and the right one from the left."""
    field, factor = quaternions(5, 6), np.array([0.3, -1.0, 2.0, 0.5])
    right = np.broadcast_to(factor, field.shape)
    assert np.abs(qft(product(field, right), "left") - product(qft(field, "left"), right)).max() < 1e-13
    assert np.abs(qft(product(right, field), "right") - product(right, qft(field, "right"))).max() < 1e-13


def test_stacks_and_memory_order() -> None:
    stack = quaternions(2, 3, 6, 5)
    spectra = qft(stack)
    assert spectra.shape == stack.shape
    for k in np.ndindex(2, 3):
        assert np.abs(spectra[k] - qft(stack[k])).max() < 1e-14
    wide = np.zeros((12, 10, 8))
    wide[::2, ::2, ::2] = stack[0, 0]
    frozen = stack[0, 0].copy()
    frozen.flags.writeable = False
    for side in SIDES:
        for axes in (("i", "j"), ("k", "j")):
            expected = qft(stack[0, 0], side, axes)
            for same in (np.asfortranarray(stack[0, 0]), wide[::2, ::2, ::2], frozen):
                assert np.abs(qft(same, side, axes) - expected).max() < 1e-14
                assert np.abs(iqft(same, side, axes) - iqft(stack[0, 0], side, axes)).max() < 1e-14
    assert np.array_equal(frozen, stack[0, 0])
    assert np.array_equal(wide[::2, ::2, ::2], stack[0, 0])
    assert qft(stack[..., 0]).shape == stack.shape
    assert np.abs(qft(stack[..., 0])[1, 2] - qft(stack[1, 2, ..., 0])).max() < 1e-13
    assert qft(np.zeros((3, 4))).shape == (3, 4, 4)
    assert np.abs(qft(stack, workers=2) - spectra).max() == 0


@all_cases("side", SIDES)
@all_cases("axes", [("i", "j"), ("k", "j")])
def test_single_precision_is_preserved(side: str, axes: Any) -> None:
    field = quaternions(16, 9)
    single = field.astype(np.float32)
    for image in (single, single[..., 0]):
        spectrum = qft(image, side, axes)
        assert spectrum.dtype == iqft(spectrum, side, axes).dtype == np.float32
        assert np.abs(spectrum - qft(image.astype(float), side, axes)).max() < 2e-5


def test_camera_image(camera: np.ndarray) -> None:
    """An image of bytes: inverse, energy, mean, symmetry, and comparison with numpy's transform."""
    image = camera.astype(float)
    spectrum = qft(camera)
    assert np.array_equal(spectrum, qft(image))
    assert np.abs(iqft(spectrum) - embedded(image)).max() < 1e-12
    assert (spectrum**2).sum() / image.size == pytest.approx((image**2).sum(), rel=1e-13)
    assert spectrum[0, 0] == pytest.approx((image.sum(), 0, 0, 0), abs=1e-6)
    mirrored = np.roll(spectrum[::-1], 1, 0)
    assert np.abs(mirrored - spectrum * np.array([1, -1, 1, -1])).max() < 1e-7
    complex_spectrum = np.fft.fft2(image)
    w, x, y, z = np.moveaxis(spectrum, -1, 0)
    assert np.abs((w - z) + 1j * (x + y) - complex_spectrum).max() < 1e-7
    assert np.abs(qft(image, "left")[..., 0] + 1j * qft(image, "left")[..., 1] - complex_spectrum).max() < 1e-7


def test_empty_batches() -> None:
    for side in SIDES:
        for axes in (("i", "j"), ("k", "j")):
            assert qft(np.empty((0, 6, 5, 4)), side, axes).shape == (0, 6, 5, 4)
            assert iqft(np.empty((2, 0, 6, 5, 4)), side, axes).shape == (2, 0, 6, 5, 4)
            assert qft(np.empty((0, 6, 5)), side, axes).shape == (0, 6, 5, 4)


@all_cases(
    "call, error, message",
    [
        (lambda f: qft(f, side="both"), ValueError, "side: 'both'; expected 'two', 'left', 'right'"),
        (lambda f: qft(f, axes=("i", "l")), ValueError, "axes: 'l'; expected 'i', 'j', 'k' or a unit vector"),
        (lambda f: qft(f, axes="ij"), ValueError, "axes: 'ij'; expected a pair"),
        (lambda f: qft(f, axes=("i",)), ValueError, "axes: .*expected a pair"),
        (lambda f: qft(f, axes=("i", (1.0, 1.0, 0.0))), ValueError, "axes: .* a unit vector"),
        (lambda f: qft(f, axes=("i", (np.nan, 0.0, 0.0))), ValueError, "axes: .* a unit vector"),
        (lambda f: qft(f, norm="unit"), ValueError, "norm: 'unit'; expected None, 'backward', 'ortho' or 'forward'"),
        (lambda f: qft(f[0, 0]), ValueError, r"image: shape \(4,\); expected"),
        (lambda f: qft(f.astype(complex)), TypeError, "image: dtype complex128; expected real numbers"),
        (lambda f: qft(f.astype(object)), TypeError, "image: dtype object"),
        (lambda f: qft(np.empty((0, 5))), ValueError, "image: 0 x 5 pixels; expected at least one"),
        (lambda f: qft(np.empty((3, 0, 4))), ValueError, "image: 3 x 0 pixels"),
        (lambda f: iqft(f[..., 0]), ValueError, r"spectrum: shape \(6, 5\); expected \(..., any, any, 4\)"),
        (lambda f: iqft(f[..., :3]), ValueError, r"spectrum: shape \(6, 5, 3\)"),
        (lambda f: rqft(f[0, 0, 0]), ValueError, r"image: shape \(\); expected \(..., any, any\), real images"),
        (lambda f: irqft(f, 10), ValueError, "columns: 10 for 5 frequencies along the last axis; expected 8 or 9"),
        (lambda f: irqft(f[:, :1], 2), ValueError, "columns: 2 for 1 frequencies along the last axis; expected 1"),
        (lambda f: iqft(f, side="up"), ValueError, "side: 'up'"),
    ],
)
def test_bad_input(call: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        call(quaternions(6, 5))


@all_cases("value", [np.nan, np.inf, -np.inf])
@all_cases("side", SIDES)
def test_a_pixel_that_is_not_finite_is_rejected(side: str, value: float) -> None:
    """A NaN or infinity would affect every frequency."""
    field = quaternions(6, 5)
    field[3, 2, 0] = value
    for function, image in ((qft, field), (qft, field[..., 0]), (iqft, field), (rqft, field[..., 0])):
        with pytest.raises(ValueError, match="is not finite; expected finite numbers"):
            function(image, side)
