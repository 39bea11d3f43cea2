"""Compare transforms of signals with the complex transforms that they consist of, and with other libraries."""

from __future__ import annotations

import importlib
import importlib.util
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy.fft
import scipy.ndimage

from algorithms.wavelets import (
    QuaternionPyramid,
    clifford_fft,
    complex_gabor_bank,
    discrete_wavelet,
    disparity,
    dual_tree,
    dwt,
    idwt,
    optical_flow,
    qft,
    rqft,
    stationary_wavelet,
    wavelet_packets,
)

from . import pages
from .machine import version
from .markdown import paragraph
from .timing import minimum_times

PAGE = Path("docs/signals.md")
REPEATS = 11
SPAN = 2e-3
"""Seconds of a measurement, a thousand times the resolution of the clock and of calls of Python."""

NOTES = paragraph(
    "The motion of `optical_flow` needs half of its time in two comparisons and solutions at the finest level. Fewer",
    "comparisons or sweeps, one reweighting instead of two, and comparisons at the nodes alone were tried: they save a",
    "tenth each and lose 3 to 26 % of accuracy. The results of `rqft` are twice as large as those of rfft2; to combine",
    "and to check them takes the rest of its time. First calls of transforms in a process take some 100 ms longer than",
    "second ones, the time in which `scipy.fft` is imported; numpy's transforms take 1.2 to 1.3 times scipy's.",
)
"""What was found about missed targets."""

Call = Callable[[], object]


@dataclass(frozen=True, slots=True)
class Row:
    """The times of one transform and of the call that it is compared with.

    Attributes
    ----------
    title : str
    peer : str
        The name of the call that it is compared with; empty if there is none.
    own, other : float
        Minimum time of a call in seconds; `other` is 0 without a peer.
    target : float
        Maximum of the ratio, or of the time in seconds without a peer.
    """

    title: str
    peer: str
    own: float
    other: float
    target: float

    @property
    def figure(self) -> float:
        """The ratio, or the time in seconds without a peer."""
        return self.own / self.other if self.peer else self.own


def cases(size: int) -> list[tuple[str, str, Call, Call | None, float]]:
    """Return title, peer, own call, call of the peer, and target for each transform. Targets are for size 512."""
    rng = np.random.default_rng(0)
    field = rng.normal(size=(2 * size, 2 * size, 4))
    single, first = field.astype(np.float32), np.moveaxis(np.moveaxis(field, -1, 0).copy(), 0, -1)
    image = field[..., 0].copy()
    planes = [field[..., k] + 1j * field[..., k + 1] for k in (0, 2)]
    thin = [plane.astype(np.complex64) for plane in planes]
    side = size // 8
    volume = rng.normal(size=(side, side, side, 8))
    cubes = [volume[..., k] + 1j * volume[..., 7 - k] for k in range(4)]
    small = rng.normal(size=(size, size))
    smooth = scipy.ndimage.gaussian_filter(rng.normal(size=(size + 18, size + 18)), 1.2)
    a, b = smooth[4 : size + 4, 4 : size + 4], smooth[2 : size + 2, 5 : size + 5]

    def fft2(arrays: list[Any]) -> Call:
        return lambda: [scipy.fft.fft2(array) for array in arrays]

    two, thin_two = "two complex FFTs", "two complex64 FFTs"
    found: list[tuple[str, str, Call, Call | None, float]] = [
        (f"`qft`, {2 * size}² quaternions", two, lambda: qft(field), fft2(planes), 1.1),
        ("the same, coefficients first", two, lambda: qft(first), fft2(planes), 1.1),
        ("the same, float32", thin_two, lambda: qft(single), fft2(thin), 1.1),
        ("the same, left-sided", two, lambda: qft(field, side="left"), fft2(planes), 1.1),
        ("the same, axes j and k", two, lambda: qft(field, axes=("j", "k")), fft2(planes), 1.1),
        (f"`qft`, {2 * size}² real numbers", two, lambda: qft(image), fft2(planes), 0.6),
        (f"`rqft`, {2 * size}² real numbers", two, lambda: rqft(image), fft2(planes), 0.6),
        (
            f"`clifford_fft`, {side}³ of G(3)",
            "four complex FFTs",
            lambda: clifford_fft(volume),
            lambda: [scipy.fft.fftn(cube) for cube in cubes],
            1.2,
        ),
    ]
    found.append((f"`rqft`, {size}² real numbers", "rfft2", lambda: rqft(small), lambda: scipy.fft.rfft2(small), 1.2))
    if importlib.util.find_spec("cv2"):
        cv2: Any = importlib.import_module("cv2")
        cv2.setNumThreads(1)
        found += _images(cv2, size, small, (a, b))
        if hasattr(cv2, "ximgproc"):
            found.append(
                (
                    f"`qft`, {2 * size}² quaternions",
                    "OpenCV `qdft`",
                    lambda: qft(field),
                    lambda: cv2.ximgproc.qdft(field, 0, True),
                    1 / 3,
                )
            )
    if importlib.util.find_spec("pywt"):
        pywt: Any = importlib.import_module("pywt")
        for name in ("haar", "db4", "sym8", "bior4.4"):
            coefficients, pyramid = pywt.wavedec2(small, name), discrete_wavelet(small, name)
            forth: Any = (lambda name=name: discrete_wavelet(small, name), lambda name=name: pywt.wavedec2(small, name))
            back: Any = (pyramid.inverse, lambda c=coefficients, name=name: pywt.waverec2(c, name))
            found += [
                (f"`discrete_wavelet`, {size}², {name}", "PyWavelets", *forth, 0.4),
                ("its inverse", "PyWavelets", *back, 0.4),
            ]
    levels = 4
    quaternions = QuaternionPyramid(small, levels)
    found += [
        (f"`QuaternionPyramid`, {size}², {levels} levels", "", lambda: QuaternionPyramid(small, levels), None, 0.012),
        ("its inverse", "", quaternions.inverse, None, 0.033),
        (f"`optical_flow`, {size}²", "", lambda: optical_flow(a, b), None, 0.1),
    ]
    return found + _lines(size) + _trees(size, small, volume[..., 0].copy(), levels)


def _images(cv2: Any, size: int, image: Any, pair: tuple[Any, Any]) -> list[tuple[str, str, Call, Call | None, float]]:
    """Return the cases of filters, motions and disparities beside OpenCV."""
    angles = np.arange(8) * np.pi / 8
    waves = [(cycles, angle) for cycles in (0.05, 0.1, 0.15, 0.2) for angle in angles]
    frequencies = [(cycles * np.cos(angle), cycles * np.sin(angle)) for cycles, angle in waves]
    kernels = [
        cv2.getGaborKernel((33, 33), 4.0, angle, 1 / cycles, 1.0, phase)
        for cycles, angle in waves
        for phase in (0, np.pi / 2)
    ]
    grey = [np.rint(127 + 40 * each / each.std()).clip(0, 255).astype(np.uint8) for each in pair]
    rows, columns, levels = size * 300 // 512, size * 400 // 512, size * 80 // 512 // 16 * 16
    left, right = (np.ascontiguousarray(each[:rows, :columns]) for each in grey)
    flow = cv2.DISOpticalFlow_create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)
    matcher = cv2.StereoSGBM_create(0, max(levels, 16), 3, P1=8 * 9, P2=32 * 9)
    return [
        (
            f"`complex_gabor_bank`, {size}², 8 x 4",
            "`filter2D`",
            lambda: complex_gabor_bank(image, frequencies),
            lambda: [cv2.filter2D(image, cv2.CV_64F, each) for each in kernels],
            0.7,
        ),
        (
            f"`optical_flow`, {size}²",
            "DIS, medium",
            lambda: optical_flow(*grey),
            lambda: flow.calc(*grey, None),
            2.5,
        ),
        (
            f"`disparity`, {columns} x {rows}, {max(levels, 16)} levels",
            "SGBM",
            lambda: disparity(left, right, max(levels, 16) - 1),
            lambda: matcher.compute(left, right),
            3.0,
        ),
    ]


def _lines(size: int) -> list[tuple[str, str, Call, Call | None, float]]:
    """Return the cases of transforms of signals beside PyWavelets, if it is installed."""
    if not importlib.util.find_spec("pywt"):
        return []
    pywt: Any = importlib.import_module("pywt")
    found: list[tuple[str, str, Call, Call | None, float]] = []
    name, lengths = "db4", (64, 256, 4096, 16384, 65536) if size == 512 else (64, 256)
    for length in lengths:
        line = np.random.default_rng(1).normal(size=length)
        halves = pywt.dwt(line, name)
        pairs: list[tuple[str, Call, Call]] = [
            ("dwt", lambda x=line: dwt(x, name), lambda x=line: pywt.dwt(x, name)),  # type: ignore[misc]
            ("idwt", lambda h=halves: idwt(*h, name), lambda h=halves: pywt.idwt(*h, name)),  # type: ignore[misc]
            (
                "stationary_wavelet",
                lambda x=line: stationary_wavelet(x, name, 3),  # type: ignore[misc]
                lambda x=line: pywt.swt(x, name, 3),  # type: ignore[misc]
            ),
            (
                "wavelet_packets",
                lambda x=line: wavelet_packets(x, name, 3),  # type: ignore[misc]
                lambda x=line: pywt.WaveletPacket(x, name, maxlevel=3).get_level(3),  # type: ignore[misc]
            ),
        ]
        found += [(f"`{title}`, {length} samples, {name}", "PyWavelets", *calls, 1.0) for title, *calls in pairs]
    return found


def _trees(
    size: int, image: np.ndarray, volume: np.ndarray, levels: int
) -> list[tuple[str, str, Call, Call | None, float]]:
    """Return the cases of dual trees, beside dtcwt if it can be imported.

    Install it with ``pip install --no-deps dtcwt``: its version 0.14 asks for numpy below 2 because of three names.
    """
    for name, now in (("issubsctype", np.issubdtype), ("asfarray", np.asarray), ("complex_", np.complex128)):
        if name not in np.__dict__:
            setattr(np, name, now)
    try:
        peer: Any = importlib.import_module("dtcwt")
    except (ImportError, AttributeError):
        peer = None
    found: list[tuple[str, str, Call, Call | None, float]] = []
    line = np.random.default_rng(2).normal(size=8 * size)
    # Without dtcwt, the targets are two fifths of its time in another environment of the machine that ran it.
    for array, limit, count in ((line, 0.0011, levels), (image, 0.03, levels), (volume, 0.1, 3)):
        axes = tuple(range(-array.ndim, 0))
        title = f"{array.shape[0]}{('', ' samples', '²', '³')[array.ndim]}, {count} levels"
        tree = dual_tree(array, count, axes=axes)
        calls: list[Call] = [
            lambda x=array, axes=axes, n=count: dual_tree(x, n, axes=axes),  # type: ignore[misc]
            tree.inverse,
        ]
        others: list[Call | None] = [None, None]
        if peer is not None:
            kind: Any = (peer.Transform1d, peer.Transform2d, peer.Transform3d)[array.ndim - 1]("near_sym_a", "qshift_a")
            pyramid = kind.forward(array, count)
            others = [
                lambda kind=kind, x=array, n=count: kind.forward(x, n),  # type: ignore[misc]
                lambda kind=kind, p=pyramid: kind.inverse(p),  # type: ignore[misc]
            ]
        for name, own, other in zip((f"`dual_tree`, {title}", "its inverse"), calls, others, strict=True):
            found.append((name, "dtcwt" if other else "", own, other, 0.4 if other else limit))
    return found


def page(rows: Sequence[Row]) -> str:
    """Return the page as Markdown."""
    missed = [row for row in rows if row.figure > row.target]
    lines = [
        "# Transforms of signals",
        "",
        paragraph(
            f"`python -m benchmarks signals` writes this page; numpy {version('numpy')}, scipy {version('scipy')}, "
            f"numba {version('numba')}.",
            "Times are milliseconds of the processor per call on one thread, in float64 unless stated otherwise: the "
            "minimum of repeated runs, measured alternately with the call in the third column.",
            "Targets are upper bounds of the ratio of both times or, without a comparison, of the time.",
        ),
        "",
        "| transform | ms | compared with | ms | ratio | target |",
        "|---|---:|---|---:|---:|---:|",
    ]
    for row in rows:
        other = (row.peer, _milliseconds(row.other), f"**{row.figure:.2f}**", f"{row.target:.2f}")
        cells = other if row.peer else ("", "", "", f"{row.target * 1e3:.3g} ms")
        mark = ", missed" if row in missed else ""
        lines.append(f"| {row.title} | {_milliseconds(row.own)} | {' | '.join(cells)}{mark} |")
    total = f"Missed targets: {len(missed)} of {len(rows)}, marked in the last column."
    lines += ["", total if missed else "All targets are met.", "", NOTES]
    return "\n".join(lines) + "\n"


def _milliseconds(seconds: float) -> str:
    return f"{seconds * 1e3:.2f}" if seconds >= 1e-4 else f"{seconds * 1e3:.4f}"


def main(arguments: list[str] | None = None) -> int:
    """Measure, and write the page; arguments are those of the command line, or by default of the process."""
    options = pages.options("signals", __doc__, PAGE).parse_args(arguments)
    out: Path = options.out
    rows = []
    with pages.progress() as bar:
        wanted = cases(64 if options.quick else 512)
        task = bar.add_task("signals", total=len(wanted))
        for title, peer, own, other, target in wanted:
            bar.update(task, description=title)
            calls = {"own": own} if other is None else {"own": own, "other": other}
            clock = time.process_time
            times = minimum_times(calls, 1, 0, clock) if options.quick else minimum_times(calls, REPEATS, SPAN, clock)
            rows.append(Row(title, peer, times["own"], times.get("other", 0.0), target))
            bar.advance(task)
    return pages.publish("signals", out, page(rows), f"{len(rows)} transforms")
