"""All public functions of the package with wrong shapes, odd sizes, integers and non-finite numbers."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from algorithms import wavelets as w
from generated import cga3, vga2
from tests.support.all_cases import all_cases

IDENTITY = np.eye(16)[0]
NO_TURN = np.array([1.0, 0, 0, 0])
E12 = [(np.eye(4)[3], (0, 1))]

Call = Callable[..., Any]

CALLS: dict[str, tuple[Call, tuple[int, ...]]] = {
    "analytic_signal": (w.analytic_signal, (9,)),
    "clifford_convolve": (
        lambda f, **o: w.clifford_convolve(f, np.ones((3, 3, 4)), vga2.geometric_product, **o),
        (9, 7, 4),
    ),
    "clifford_correlate": (
        lambda f, **o: w.clifford_correlate(f, np.ones((3, 3, 4)), vga2.geometric_product, **o),
        (9, 7, 4),
    ),
    "clifford_fft": (w.clifford_fft, (9, 7, 4)),
    "clifford_wavelet": (lambda f, **o: w.clifford_wavelet(f, [1.0], NO_TURN, **o).coefficients, (5, 7, 3, 8)),
    "clifford_wavelet_nd": (lambda f, **o: w.clifford_wavelet_nd(f, [1.0], np.eye(2), **o).coefficients, (9, 7, 4)),
    "complex_gabor_bank": (lambda f, **o: w.complex_gabor_bank(f, [(0.1, 0.2)], **o), (19, 17)),
    "complex_pyramid": (lambda f, **o: w.complex_pyramid(f, 2, **o).detail[1], (19, 17)),
    "conformal_wavelet": (lambda f, **o: w.conformal_wavelet(f, np.ones((6, 3)), IDENTITY, **o), (6, 8)),
    "continuous_wavelet": (lambda f, **o: w.continuous_wavelet(f, [2.0, 3.0], **o).coefficients, (33,)),
    "convolve": (lambda f, **o: w.convolve(f, np.ones((3, 3)), "mirror", **o), (19, 17)),
    "correlate": (lambda f, **o: w.correlate(f, np.ones((3, 3)), "wrap", **o), (19, 17)),
    "denoise": (lambda f, **o: w.denoise(f, 0.5, **o), (19, 17)),
    "denoise_wavelet": (lambda f, **o: w.denoise_wavelet(f, "db2", **o), (33,)),
    "discrete_wavelet": (lambda f, **o: w.discrete_wavelet(f, "db2", 1, **o).approx, (19, 17)),
    "disparity": (lambda f, **o: w.disparity(f, f, 4, **o).disparity, (19, 27)),
    "divergence_and_curl": (w.divergence_and_curl, (9, 7, 2)),
    "dual_tree": (lambda f, **o: w.dual_tree(f, 2, **o).detail[1], (19, 17)),
    "dwt": (lambda f, **o: w.dwt(f, "db2", **o)[1], (33,)),
    "estimated_noise": (w.estimated_noise, (19, 17)),
    "gabor_bank": (lambda f, **o: w.gabor_bank(f, [(0.1, 0.2)], **o), (19, 17)),
    "geometric_fft": (lambda f, **o: w.geometric_fft(f, vga2.geometric_product, right=E12, **o), (9, 7, 4)),
    "iclifford_fft": (w.iclifford_fft, (9, 7, 4)),
    "iconformal_wavelet": (
        lambda f, **o: w.iconformal_wavelet(f, np.eye(3)[:2], np.tile(IDENTITY, (6, 1)), **o).field,
        (6, 8),
    ),
    "idwt": (lambda f, **o: w.idwt(f, f, "db2", **o), (33,)),
    "igeometric_fft": (lambda f, **o: w.igeometric_fft(f, vga2.geometric_product, right=E12, **o), (9, 7, 4)),
    "iproduct_fft": (w.iproduct_fft, (9, 7, 4)),
    "ipseudoscalar_fft": (w.ipseudoscalar_fft, (9, 7, 4)),
    "iqft": (w.iqft, (9, 7, 4)),
    "irqft": (w.irqft, (9, 4, 4)),
    "ispacetime_fft": (w.ispacetime_fft, (3, 2, 5, 3, 16)),
    "ivolume_time_fft": (w.ivolume_time_fft, (3, 2, 5, 3, 4)),
    "key_points": (lambda f, **o: w.key_points(f, "dilation", threshold=1.0, **o).energies, (19, 17)),
    "lie_responses": (lambda f, **o: w.lie_responses(f, **o), (19, 17)),
    "local_phase": (lambda f, **o: w.local_phase(f, (0.1, -0.2), **o).frequency, (19, 17)),
    "match_template": (lambda f, **o: w.match_template(f, np.ones((3, 3, 2)), "values", **o)[0].rotor, (9, 7, 2)),
    "monogenic_signal": (lambda f, **o: w.monogenic_signal(f, **o).vector, (9, 7)),
    "optical_flow": (lambda f, **o: w.optical_flow(f, f, 1, **o).uv, (19, 17)),
    "orbit_energies": (w.orbit_energies, (19, 17)),
    "orbit_energy": (lambda f, **o: w.orbit_energy(f, "dilation", **o), (19, 17)),
    "partial_analytic_signal": (lambda f, **o: w.partial_analytic_signal(f, 0.3, **o), (9, 7)),
    "product_fft": (w.product_fft, (9, 7, 4)),
    "pseudoscalar_fft": (w.pseudoscalar_fft, (9, 7, 4)),
    "qft": (w.qft, (9, 7)),
    "quaternion_local_phase": (lambda f, **o: w.quaternion_local_phase(f, (0.1, 0.2), **o).frequency, (19, 17)),
    "quaternionic_analytic_signal": (w.quaternionic_analytic_signal, (9, 7)),
    "real_product_fft": (w.real_product_fft, (9, 7)),
    "rqft": (w.rqft, (9, 7)),
    "similarity_distance": (lambda f, **o: w.similarity_distance(f, f[::-1], [(1.0, 0.5)], **o), (19, 17)),
    "single_orthant_signal": (w.single_orthant_signal, (9, 7)),
    "spacetime_fft": (w.spacetime_fft, (3, 2, 5, 3, 16)),
    "sphere_wavelet": (lambda f, **o: w.sphere_wavelet(f, np.eye(3)[[0, 1, 2, 0]], IDENTITY, **o), (4,)),
    "stationary_wavelet": (lambda f, **o: w.stationary_wavelet(f, "db2", 2, **o).detail[1]["D"], (19, 17)),
    "texture_features": (lambda f, **o: w.texture_features(f, 2, **o), (19, 17)),
    "total_analytic_signal": (w.total_analytic_signal, (9, 7)),
    "volume_time_fft": (w.volume_time_fft, (3, 2, 5, 3, 4)),
    "wavelet_packets": (lambda f, **o: w.wavelet_packets(f, "db2", 2, **o).nodes["hd"], (19, 17)),
    "QuaternionPyramid": (lambda f, **o: w.QuaternionPyramid(f, 2, **o).detail[1]["D"], (19, 17)),
    "QuaternionPyramid of Gabor's filters": (
        lambda f, **o: w.QuaternionPyramid(f, 2, "gabor", **o).detail[1]["D"],
        (19, 17),
    ),
}
"""Each function with one array for its data, and the shape of a valid array; sizes are odd."""

OTHERS = {
    "admissibility": "takes a name",
    "bayes_threshold": "returns one number",
    "derivative_mask": "takes two numbers",
    "isphere_wavelet": "takes complex numbers",
    "lie_filter": "takes a name and a number",
    "mother_wavelet": "takes a name",
    "noise_deviation": "returns one number",
    "from_rgb": "takes colours, with nothing to transform",
    "to_rgb": "takes colours, with nothing to transform",
    "quaternion_phase": "takes numbers one by one, as kernels do",
    "shrink": "takes numbers one by one, real or complex",
    "similarity_versor": "takes versors, as kernels do",
    "sphere_versor": "takes versors, as kernels do",
    "sure_threshold": "returns one number",
    "universal_threshold": "takes two numbers",
    "wavelet_filters": "takes a name",
    "wavelet_names": "takes nothing",
}

ALONE = {
    "complex_pyramid": "sparse matrices of scipy",
    "estimated_noise": "one level",
    "key_points": "filters of scipy.ndimage",
    "lie_responses": "filters of scipy.ndimage",
    "local_phase": "one filter",
    "orbit_energies": "filters of scipy.ndimage",
    "orbit_energy": "filters of scipy.ndimage",
    "quaternion_local_phase": "one filter",
}
"""Functions of arrays that use one thread."""

DOUBLE = {
    "clifford_convolve",
    "clifford_correlate",
    "conformal_wavelet",
    "convolve",
    "correlate",
    "estimated_noise",
    "iconformal_wavelet",
    "match_template",
    "sphere_wavelet",
}
"""Functions whose other arguments are float64, or which return a Python number."""

LEVELS: dict[str, Call] = {
    "complex_pyramid": lambda levels: w.complex_pyramid(np.ones((19, 17)), levels),
    "denoise": lambda levels: w.denoise(np.ones((19, 17)), 1.0, levels),
    "discrete_wavelet": lambda levels: w.discrete_wavelet(np.ones((19, 17)), "db2", levels),
    "denoise_wavelet": lambda levels: w.denoise_wavelet(np.ones((19, 17)), "db2", levels),
    "dual_tree": lambda levels: w.dual_tree(np.ones((19, 17)), levels),
    "optical_flow": lambda levels: w.optical_flow(np.ones((19, 17)), np.ones((19, 17)), levels),
    "stationary_wavelet": lambda levels: w.stationary_wavelet(np.ones((19, 17)), "db2", levels),
    "texture_features": lambda levels: w.texture_features(np.eye(19, 17), levels),
    "wavelet_packets": lambda levels: w.wavelet_packets(np.ones((19, 17)), "db2", levels),
    "QuaternionPyramid": lambda levels: w.QuaternionPyramid(np.ones((19, 17)), levels),
    "QuaternionPyramid of Gabor's filters": lambda levels: w.QuaternionPyramid(np.ones((19, 17)), levels, "gabor"),
}


def options(name: str) -> set[str]:
    return set(inspect.signature(getattr(w, name.split()[0])).parameters)


def whole(shape: tuple[int, ...]) -> np.ndarray:
    return np.random.default_rng(0).integers(-20, 20, shape)


def test_all_public_functions_are_listed() -> None:
    functions = {name for name in w.__all__ if not inspect.isclass(getattr(w, name))}
    assert functions == ({name for name in CALLS if name.islower()} | set(OTHERS))
    takes_levels = {name for name in functions if "levels" in inspect.signature(getattr(w, name)).parameters}
    assert takes_levels <= set(LEVELS)


@all_cases("name", CALLS)
def test_integers_are_floats(name: str) -> None:
    call, shape = CALLS[name]
    integers = whole(shape)
    expected = call(integers.astype(float))
    assert np.isfinite(expected).all()
    for kind in (np.int64, np.int16, np.int8):
        assert np.array_equal(call(integers.astype(kind)), expected)
    assert np.array_equal(call(integers.tolist() if name != "similarity_distance" else integers), expected)


@all_cases("value", [np.nan, np.inf])
@all_cases("name", CALLS)
def test_numbers_that_are_not_finite_are_rejected(name: str, value: float) -> None:
    call, shape = CALLS[name]
    array = whole(shape).astype(float)
    array[tuple(n // 2 for n in shape)] = value
    with pytest.raises(ValueError, match="not finite"):
        call(array)


@all_cases("name", CALLS)
def test_other_types_of_numbers_are_rejected(name: str) -> None:
    call, shape = CALLS[name]
    for array in (np.ones(shape, complex), np.full(shape, "a"), np.ones(shape, object)):
        with pytest.raises(TypeError, match="expected real numbers"):
            call(array)


@all_cases("name", CALLS)
def test_wrong_shapes_are_rejected(name: str) -> None:
    """A scalar, an axis of length 0, and a wrong number of coefficients."""
    call, shape = CALLS[name]
    for array in (np.float64(1), np.ones((0, *shape[1:])), np.ones((*shape[:-1], 0))):
        if name == "similarity_distance" and array.ndim == 0:
            continue
        with pytest.raises(ValueError, match="expected"):
            call(array)
    if shape[-1] in (2, 4, 8, 16) and len(shape) > 1 and name != "sphere_wavelet":
        with pytest.raises((ValueError, TypeError), match=r"expected|coefficients|shape"):
            call(np.ones((*shape[:-1], 5)))


@all_cases("name", CALLS)
def test_masked_numbers_are_rejected(name: str) -> None:
    """A mask would be ignored; arrays without masked elements are accepted."""
    call, shape = CALLS[name]
    array = whole(shape).astype(float)
    mask = np.zeros(shape, bool)
    assert np.array_equal(call(np.ma.array(array, mask=mask)), call(array))
    mask[tuple(n // 2 for n in shape)] = True
    with pytest.raises(ValueError, match="1 masked numbers; expected an array without a mask"):
        call(np.ma.array(array, mask=mask))


SHAPES_ONLY = {
    "disparity",
    "key_points",
    "optical_flow",
    "local_phase",
    "match_template",
    "quaternion_local_phase",
    "similarity_distance",
}
"""Functions whose results here do not change with the size of their numbers."""

QUADRATIC = {"orbit_energies", "orbit_energy"}


@all_cases("dtype", [np.float64, np.float32])
@all_cases("name", [name for name in CALLS if name not in ("texture_features",)])
@pytest.mark.filterwarnings("error")
def test_numbers_of_any_size(name: str, dtype: type) -> None:
    """Scaling by powers of 2 scales all results, up to 1e-300 and 1e300; larger numbers may only raise an error."""
    call, shape = CALLS[name]
    if name == "denoise":
        call = w.denoise
    array = np.random.default_rng(3).normal(size=shape).astype(dtype)
    expected = np.asarray(call(array))
    degree = 2 if name in QUADRATIC else 1
    many = (996 if dtype is np.float64 else 100) // degree
    for power in (many, -many):
        found = np.asarray(call(np.ldexp(array, power)))
        back = 0 if name in SHAPES_ONLY else -degree * power
        parts = [(found.real, expected.real), (found.imag, expected.imag)]
        for one, other in parts if np.iscomplexobj(found) else parts[:1]:
            error = np.abs(np.ldexp(one, back) - other).max()
            assert error <= 100 * np.finfo(dtype).eps * np.abs(expected).max()
    huge = np.ldexp(dtype(0.99) * array / np.abs(array).max(), np.finfo(dtype).maxexp)
    try:
        found = np.asarray(call(huge))
    except ValueError as error:
        assert "finite" in str(error) or "overflow" in str(error)
    else:
        assert np.isfinite(found).all()


@pytest.mark.filterwarnings("error")
def test_amplitudes_and_phases_of_any_size() -> None:
    """Test single quaternions, bands, noise, and textures, whose logarithms are shifted."""
    rng = np.random.default_rng(4)
    q, powers = rng.normal(size=(300, 4)), rng.integers(-1000, 1000, 300)
    q[7] = 0
    one, other = w.quaternion_phase(np.ldexp(q, powers[:, None])), w.quaternion_phase(q)
    assert np.abs(np.ldexp(one.amplitude, -powers) - other.amplitude).max() < 1e-15
    assert all(np.abs(a - b).max() < 1e-15 for a, b in zip(one[1:4], other[1:4], strict=True))
    image = rng.normal(size=(32, 40))
    for power in (990, -990):
        large = np.ldexp(image, power)
        found, expected = w.texture_features(large, 2), w.texture_features(image, 2)
        expected[::3] += power * np.log(2)
        assert np.abs(found - expected).max() < 1e-12
        assert np.ldexp(w.estimated_noise(large), -power) == w.estimated_noise(image)
        assert np.array_equal(w.denoise(large, np.ldexp(0.4, power)), np.ldexp(w.denoise(image, 0.4), power))
        sizes = w.QuaternionPyramid(large, 1).amplitude()[0]["D"]
        assert np.array_equal(np.ldexp(sizes, -power), w.QuaternionPyramid(image, 1).amplitude()[0]["D"])
        local, known = w.local_phase(large, (0.1, 0.2)), w.local_phase(image, (0.1, 0.2))
        assert np.array_equal(np.ldexp(local.amplitude, -power), known.amplitude)
        assert all(np.abs(a - b).max() < 1e-11 for a, b in zip(local[1:], known[1:], strict=True))
        wave, size = w.monogenic_signal(large), w.monogenic_signal(image)
        assert np.array_equal(np.ldexp(wave.amplitude, -power), size.amplitude)
    both = np.stack([image, np.ldexp(image, 900), np.ldexp(image, -900)])
    assert np.ptp(w.local_phase(both, (0.1, 0.2)).confidence, 0).max() < 1e-12


@all_cases("name", LEVELS)
def test_too_many_levels_are_rejected(name: str) -> None:
    for levels in (12, -1, 1.5, True):
        with pytest.raises(ValueError, match=f"levels: {levels}; expected"):
            LEVELS[name](levels)


@all_cases("name", [name for name in CALLS if "workers" in options(name)])
def test_workers_change_nothing(name: str) -> None:
    call, shape = CALLS[name]
    array = np.random.default_rng(1).normal(size=shape)
    expected = call(array)
    for workers in (1, 2, 5, -1):
        assert np.array_equal(call(array, workers=workers), expected)
    with pytest.raises(ValueError, match="workers"):
        call(array, workers=0)


@all_cases("name", [name for name in CALLS if "progress" in options(name)])
def test_progress_reaches_the_total(name: str) -> None:
    call, shape = CALLS[name]
    array = np.random.default_rng(1).normal(size=shape)
    reported: list[tuple[int, int]] = []
    found = call(array, progress=lambda done, total: reported.append((done, total)))
    assert np.array_equal(found, call(array))
    assert reported == [(k + 1, len(reported)) for k in range(len(reported))]
    assert reported


def test_all_functions_of_arrays_have_workers() -> None:
    assert {name for name in CALLS if "workers" not in options(name)} == set(ALONE)


@all_cases("name", CALLS)
def test_read_only_arrays_and_single_precision(name: str) -> None:
    """The result of float32 is float32, near that of float64."""
    call, shape = CALLS[name]
    array = np.random.default_rng(2).normal(size=shape).astype(np.float32)
    array.flags.writeable = False
    kept = array.copy()
    single, double = np.asarray(call(array)), np.asarray(call(array.astype(float)))
    assert np.array_equal(array, kept)
    if name not in DOUBLE:
        assert single.dtype in (np.float32, np.complex64)
    assert double.dtype in (np.float64, np.complex128)
    assert np.abs(single - double).max() < 1e-3 * (1 + np.abs(double).max())


@all_cases("name", CALLS)
def test_other_memory_orders_give_the_same_bits(name: str) -> None:
    call, shape = CALLS[name]
    array = np.random.default_rng(5).normal(size=shape)
    expected = np.asarray(call(array))
    for same in (np.asfortranarray(array), array[::-1].copy()[::-1], np.repeat(array, 2, -1)[..., ::2]):
        assert np.array_equal(np.asarray(call(same)), expected)


@all_cases("name", CALLS)
@pytest.mark.filterwarnings("error")
def test_no_pixel_and_few_pixels(name: str) -> None:
    """The result is finite, or an error says what is expected."""
    call, shape = CALLS[name]
    for size in (0, 1, 2):
        for kept in (0, 1):
            small = (*(size for _ in shape[: len(shape) - kept]), *shape[len(shape) - kept :])
            try:
                found = np.asarray(call(np.ones(small)))
            except ValueError as error:
                assert "expected" in str(error)
            else:
                assert np.isfinite(found).all()


def few_rows(shape: tuple[int, ...]) -> list[tuple[int, ...]]:
    """Return shapes with few elements along one axis of space, and some narrow ones."""
    axes = len(shape) - (len(shape) > 1 and shape[-1] in (2, 4, 8, 16))
    shapes = [(*shape[:k], size, *shape[k + 1 :]) for k in range(axes) for size in (1, 2, 3)]
    return shapes + [(*narrow, *shape[2:]) for narrow in ((1, 50), (50, 1), (5, 41)) if axes == 2]


@all_cases(
    "name", [name for name in CALLS if name not in ("conformal_wavelet", "iconformal_wavelet", "sphere_wavelet")]
)
@pytest.mark.filterwarnings("error")
def test_few_rows_or_columns(name: str) -> None:
    """The laws of scaling, and other orders and types, hold for them, too; or an error says what is expected."""
    call, shape = CALLS[name]
    if name == "denoise":
        call = w.denoise
    for size in few_rows(shape):
        array = np.random.default_rng(7).normal(size=size)
        try:
            expected = np.asarray(call(array))
        except ValueError as error:
            assert "expected" in str(error)
            continue
        for same in (np.asfortranarray(array), array[::-1].copy()[::-1], np.repeat(array, 2, -1)[..., ::2]):
            assert np.array_equal(np.asarray(call(same)), expected)
        degree = 2 if name in QUADRATIC else 1
        for power in (498 // degree, -498 // degree) if name != "texture_features" else ():
            back = 0 if name in SHAPES_ONLY else -degree * power
            error = np.abs(np.asarray(call(np.ldexp(array, power))) * 2.0**back - expected).max(initial=0)
            assert error <= 1e-12 * np.abs(expected).max(initial=0)
        single = np.asarray(call(array.astype(np.float32)))
        assert np.abs(single - expected).max(initial=0) <= 1e-3 * (1 + np.abs(expected).max(initial=0))


def _continuous(a: np.ndarray) -> np.ndarray:
    mean = a.mean(-1, keepdims=True)
    scales = np.geomspace(1, a.shape[-1], 20).tolist()
    return mean + w.continuous_wavelet(a - mean, scales, "mexican_hat", mode="periodic").inverse()


THERE_AND_BACK: dict[str, Call] = {
    "analytic": lambda a: w.analytic_signal(a).real,
    "complex pyramid": lambda a: w.complex_pyramid(a, 1).inverse(),
    "continuous": _continuous,
    "dual tree": lambda a: w.dual_tree(a).inverse(),
    "dual tree of rows": lambda a: w.dual_tree(a, 1, axes=(-1,)).inverse(),
    "Gabor pyramid": lambda a: w.QuaternionPyramid(a, 1, "gabor").inverse(),
    "qft": lambda a: w.iqft(w.qft(a, values="real"))[..., 0],
    "quaternion pyramid": lambda a: w.QuaternionPyramid(a, 1).inverse(),
    "rqft": lambda a: w.irqft(w.rqft(a), a.shape[-1]),
    "stationary": lambda a: w.stationary_wavelet(a, "db3").inverse(),
    "tight": lambda a: w.stationary_wavelet(a, "haar", is_tight=True).inverse(),
}
for _mode in ("symmetric", "periodization", "zero", "antireflect"):
    THERE_AND_BACK[f"packets, {_mode}"] = lambda a, mode=_mode: w.wavelet_packets(a, "db3", mode=mode).inverse()
    THERE_AND_BACK[f"discrete, {_mode}"] = lambda a, mode=_mode: w.discrete_wavelet(a, "bior2.2", mode=mode).inverse()


@all_cases("name", THERE_AND_BACK)
@pytest.mark.filterwarnings("error")
def test_inverses_return_arrays_of_any_size_and_numbers(name: str) -> None:
    call, reached = THERE_AND_BACK[name], 0
    for shape in ((1,), (2,), (7,), (1, 1), (1, 9), (9, 1), (2, 3), (5, 7), (2, 7, 6)):
        array = np.random.default_rng(1).normal(size=shape)
        for dtype, powers, error in ((np.float64, (0, 400, -400), 1e-11), (np.float32, (0, 60, -60), 2e-4)):
            given = array.astype(dtype)
            for power in powers:
                try:
                    found = call(np.ldexp(given, power))
                except ValueError as refused:
                    assert "expected" in str(refused)
                    continue
                reached += 1
                assert found.shape == shape and found.dtype == dtype
                assert np.abs(np.ldexp(found, -power) - given).max() <= error * np.abs(given).max()
    assert reached >= 18


@pytest.mark.filterwarnings("error")
def test_noise_that_is_larger_by_more_than_numbers_can_be() -> None:
    image = np.random.default_rng(6).normal(size=(19, 17)) * 1e-320
    assert np.array_equal(w.denoise(image, 0.5), w.denoise(image, 1e-310))


def test_versors_and_names() -> None:
    for call, message in (
        (lambda: w.admissibility("db4"), "wavelet: 'db4'"),
        (lambda: w.wavelet_filters("morlet"), "wavelet: 'morlet'"),
        (lambda: w.derivative_mask(2, np.nan), "sigma: nan"),
        (lambda: w.quaternion_phase(np.ones(3)), "q: shape"),
        (lambda: w.similarity_versor(np.ones(3), NO_TURN, 0.0), "scale: "),
        (lambda: w.sphere_versor(NO_TURN, np.nan), "scale: "),
        (lambda: w.sphere_versor(np.ones(3), 1.0), "rotor: shape"),
    ):
        with pytest.raises(ValueError, match=message):
            call()
    assert np.array_equal(w.sphere_versor(NO_TURN, 2), w.sphere_versor(NO_TURN, 2.0))
    assert np.allclose(cga3.even_product(w.sphere_versor(NO_TURN, 2.0), w.sphere_versor(NO_TURN, 0.5)), IDENTITY)
