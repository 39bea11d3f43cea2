"""Compare matrices in kernels with numpy.linalg, and linear equations of two views with OpenCV."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import cv2
import numpy as np

import gacompiler
from algorithms.vision.fundamental import eight_points
from algorithms.vision.planes import linear_homography
from gacompiler import SCALAR, array, eigenvectors_symmetric, kernel
from gacompiler.matrices import three_singular_vectors
from generated import matrices

from . import pages
from .machine import version
from .markdown import paragraph
from .timing import FULL, QUICK, Effort, median_times

PAGE = Path("docs/matrix-speed.md")
MANY, FEW = 100_000, 1_000
Numbers = np.ndarray[Any, Any]
Error = Callable[[Numbers, Any], float]


@kernel(matrix=array(SCALAR, 3, 3), returns=(array(SCALAR, 3), array(SCALAR, 3, 3)))
def three(matrix: Any) -> Any:
    """The eigenvectors of a symmetric matrix of three rows."""
    return eigenvectors_symmetric(matrix)


@kernel(matrix=array(SCALAR, 4, 4), returns=(array(SCALAR, 4), array(SCALAR, 4, 4)))
def four(matrix: Any) -> Any:
    """The eigenvectors of a symmetric matrix of four rows."""
    return eigenvectors_symmetric(matrix)


@kernel(matrix=array(SCALAR, 3, 3), returns=array(SCALAR, 3))
def three_values(matrix: Any) -> Any:
    """The singular values of a matrix of three rows."""
    return three_singular_vectors(matrix)[0]


@dataclass(frozen=True, slots=True)
class Task:
    """A computation for a batch of matrices by a kernel and by numpy, and the error of a result."""

    title: str
    ours: Callable[[Numbers], Any]
    in_numpy: Callable[[Numbers], Any]
    given: Numbers
    error: Error


def tasks(count: int) -> list[Task]:
    """Return the computations on random matrices of a fixed seed."""
    rng = np.random.default_rng(0)

    def square(n: int) -> Numbers:
        return rng.normal(size=(count, n, n))

    def symmetric(n: int) -> Numbers:
        a = square(n)
        return np.ascontiguousarray((a + np.swapaxes(a, 1, 2)) / 2)

    compiled = gacompiler.compile
    singular = partial(np.linalg.svd, compute_uv=False)
    return [
        Task("eigenvectors, 3 x 3", compiled(three), np.linalg.eigh, symmetric(3), _of_eigenvectors),
        Task("eigenvectors, 4 x 4", compiled(four), np.linalg.eigh, symmetric(4), _of_eigenvectors),
        Task("eigenvectors, 9 x 9", matrices.eigenvectors, np.linalg.eigh, symmetric(9), _of_eigenvectors),
        Task("null vector, 9 x 9", _null_vector, _last_vector, square(9), _of_null_vectors),
        Task("singular values, 3 x 3", compiled(three_values), singular, square(3), _of_values),
        Task("singular vectors, 9 x 9", matrices.singular_vectors, np.linalg.svd, square(9), _of_singular),
    ]  # fmt: skip


def _null_vector(a: Numbers) -> Any:
    return matrices.null_vector(a)[0]


def _last_vector(a: Numbers) -> Any:
    return np.linalg.svd(a)[2][..., -1, :]


def _size(a: Numbers) -> Any:
    return np.linalg.norm(a, axis=(-1, -2))


def _of_eigenvectors(a: Numbers, found: Any) -> float:
    values, vectors = found[0], found[1]
    residual = _size(a @ vectors - vectors * values[:, None, :]) / _size(a)
    skew = _size(np.swapaxes(vectors, 1, 2) @ vectors - np.eye(a.shape[-1]))
    return float(max(residual.max(), skew.max()))


def _of_null_vectors(a: Numbers, found: Any) -> float:
    least = np.linalg.svd(a)[1][:, -1]
    return float((np.abs(np.linalg.norm(a @ found[..., None], axis=(1, 2)) - least) / _size(a)).max())


def _of_values(a: Numbers, found: Any) -> float:
    """The sum of squares and the absolute determinant are known without an algorithm for singular values."""
    squares = np.abs((found**2).sum(1) / (a * a).sum((1, 2)) - 1)
    product = np.abs(found.prod(1) - np.abs(np.linalg.det(a))) / _size(a) ** a.shape[-1]
    return float(max(squares.max(), product.max()))


def _of_singular(a: Numbers, found: Any) -> float:
    is_numpy = len(found[0].shape) == 3
    values, vectors = (found[1], np.swapaxes(found[2], 1, 2)) if is_numpy else (found[0], found[1])
    images = np.abs(np.linalg.norm(a @ vectors, axis=1) - values).max(1) / _size(a)
    return float(max(images.max(), _size(np.swapaxes(vectors, 1, 2) @ vectors - np.eye(a.shape[-1])).max()))


def measure(task: Task, effort: Effort) -> str:
    """Return the row of a task.

    Raises
    ------
    RuntimeError
        If the errors of a kernel are more than twice those of numpy.
    """
    some = task.given[:FEW]
    ours, other = task.error(some, task.ours(some)), task.error(some, task.in_numpy(some))
    if ours > 2 * other:
        raise RuntimeError(f"{task.title}: error {ours:.1e}; expected at most twice {other:.1e}, that of numpy")
    cells = []
    for given, count in ((task.given, len(task.given)), (task.given[0].copy(), 1)):
        times = median_times({"ours": partial(task.ours, given), "numpy": partial(task.in_numpy, given)}, effort)
        cells += [f"{1e6 * times[name] / count:.2f}" for name in times] + [f"{times['numpy'] / times['ours']:.1f}"]
    return f"| {task.title} | {' | '.join(cells)} | {ours:.0e} | {other:.0e} |"


def views(effort: Effort) -> list[str]:
    """Return the rows of linear equations of two views of 50 points, compared with OpenCV."""
    rng = np.random.default_rng(1)
    places = rng.normal([0, 0, 6], 1, (50, 3))
    first = 800 * places[:, :2] / places[:, 2:] + 320
    moved = places + np.array([1, 0.1, 0.2])
    second = 800 * moved[:, :2] / moved[:, 2:] + 320 + rng.normal(0, 0.5, (50, 2))
    plane = 1.1 * first + rng.normal(0, 0.5, (50, 2))
    rows = []
    for title, ours, other in (
        ("fundamental matrix", partial(eight_points, first, second),
         partial(cv2.findFundamentalMat, first, second, cv2.FM_8POINT)),
        ("homography", partial(linear_homography, first, plane), partial(cv2.findHomography, first, plane, 0)),
    ):  # fmt: skip
        times = median_times({"ours": ours, "OpenCV": other}, effort)
        cells = [f"{1e6 * times[name]:.1f}" for name in times]
        rows.append(f"| {title} | {' | '.join(cells)} | {times['ours'] / times['OpenCV']:.2f} |")
    return rows


def page(rows: list[str], rows_of_views: list[str], count: int) -> str:
    """Return the text of the page."""
    lines = [
        "# Matrices in kernels: times and errors",
        "",
        paragraph(
            f"`python -m benchmarks matrices` writes this page; numpy {version('numpy')}, OpenCV "
            f"{version('opencv-python-headless')}.",
            f"Microseconds for each matrix in a batch of {count:,}, and of a call for a single one, on doubles and one "
            "thread: medians of repeated runs, measured alternately. The ratios are the time of numpy.linalg divided "
            "by that of the kernel.",
            "Errors are the largest of 1,000 matrices: residuals relative to the norm, and deviations of vectors from "
            "an orthonormal basis.",
        ),
        "",
        "| | kernel | numpy | ratio | single: kernel | numpy | ratio | error | of numpy |",
        "|---|---:|---:|---:|---:|---:|---:|---:|---:|",
        *rows,
        "",
        paragraph(
            "Kernels for three and four rows are closed forms (`eigenvectors_symmetric`, `three_singular_vectors`); "
            "the others are those of `gacompiler.matrices` for any size. Batches run in vector lanes. A single matrix "
            "of nine rows does not, and takes about as long as in LAPACK. Loops of a length that the C "
            "compiler knows would take .7 of its time, and the QR algorithm written by hand for nine rows, which only "
            "rotates the remaining block, .35."
        ),
        "",
        "## Linear equations of two views",
        "",
        paragraph(
            "Microseconds for 50 pairs of points: normalisation, equations, null vector, and, for the fundamental "
            "matrix, the nearest matrix of rank 2. `cv2.findHomography` also refines its result."
        ),
        "",
        "| | kernels | OpenCV | ratio |",
        "|---|---:|---:|---:|",
        *rows_of_views,
    ]
    return "\n".join(lines) + "\n"


def main(arguments: list[str] | None = None) -> int:
    """Measure, and write the page; arguments are those of the command line, or by default of the process."""
    options = pages.options("matrices", __doc__, PAGE).parse_args(arguments)
    effort, count = (QUICK, FEW) if options.quick else (FULL, MANY)
    cv2.setNumThreads(1)
    rows = [measure(task, effort) for task in tasks(count)]
    return pages.publish("matrices", options.out, page(rows, views(effort), count), f"{len(rows) + 2} rows")


if __name__ == "__main__":
    sys.exit(main())
