"""The tensors of three and four views, and the transfer of points and lines between views."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from generated import projective3

from ..arguments import Reals, real_array
from ..precision import NEGLIGIBLE
from .camera import Camera
from .centring import centred_cameras
from .degeneracy import degenerate
from .fundamental import eight_points
from .normalization import homogeneous, normalized
from .status import VisionStatus, check_points, refuse


def trifocal_tensor(*views: Camera | ArrayLike) -> Reals:
    """Return the trifocal tensor: ``x_i l'_j l''_k T_ijk = 0`` for a point x and lines l', l'' through its partners.

    Parameters
    ----------
    *views : three Cameras or array_like, (..., 3, 4) or (n, 2)
        Cameras without distortion or their matrices, whose leading axes broadcast: the entries are then brackets of
        their rows. Or pixels of the same points, with n at least 7: the result is then the tensor of cameras fitted to
        linear equations.

    Returns
    -------
    array, (..., 3, 3, 3)
        Of norm 1 if computed from pixels.

    Raises
    ------
    TypeError, ValueError
        If there are not three views, or if they are neither cameras nor pixels of the same points.
    DegenerateError
        If pixels are too few or not finite, or if they are those of points on one plane or from one centre; if cameras
        have no centre or all the same centre.
    """
    if len(views) != 3:
        raise ValueError(f"trifocal_tensor: {len(views)} views; expected 3")
    if _are_cameras(views):
        matrices, _ = centred_cameras(views, "views")
        return _not_zero(projective3.trifocal_tensor_from_cameras(*matrices), matrices, (2, 1, 1), "trifocal_tensor")
    pixels, maps = _checked_pixels(views, 7, "trifocal_tensor")
    lines = [_lines_through(each) for each in pixels]
    rows = np.einsum("ni,naj,nbk->nabijk", homogeneous(pixels[0]), lines[1], lines[2]).reshape(-1, 27)
    linear = _null_vector(rows, "trifocal_tensor").reshape(3, 3, 3)
    tensor = projective3.trifocal_tensor_from_cameras(*cameras_of_tensor(linear))
    # x = S pixel: T of pixels is T(S pixel, S^-T line, S^-T line).
    back = [np.linalg.inv(each) for each in maps]
    found = np.einsum("abc,ai,jb,kc->ijk", tensor, maps[0], back[1], back[2])
    return np.asarray(found / np.linalg.norm(found))


def quadrifocal_tensor(*views: Camera | ArrayLike) -> Reals:
    """Return the quadrifocal tensor Q, with ``l_i l'_j l''_k l'''_m Q_ijkm = 0`` for lines through images of one point.

    Parameters
    ----------
    *views : four Cameras or array_like, (..., 3, 4) or (n, 2)
        Cameras without distortion or their matrices, whose leading axes broadcast: the entries are then brackets of
        their rows. Or pixels of the same points, with n at least 6: the result is then the least-squares solution
        of linear equations, which for noisy pixels need not belong to cameras.

    Returns
    -------
    array, (..., 3, 3, 3, 3)
        Of norm 1 if computed from pixels.

    Raises
    ------
    TypeError, ValueError
        If there are not four views, or if they are neither cameras nor pixels of the same points.
    DegenerateError
        As for `trifocal_tensor`.
    """
    if len(views) != 4:
        raise ValueError(f"quadrifocal_tensor: {len(views)} views; expected 4")
    if _are_cameras(views):
        matrices, _ = centred_cameras(views, "views")
        found = projective3.quadrifocal_tensor_from_cameras(*matrices)
        return _not_zero(found, matrices, (1, 1, 1, 1), "quadrifocal_tensor")
    pixels, maps = _checked_pixels(views, 6, "quadrifocal_tensor")
    lines = [_lines_through(each) for each in pixels]
    rows = np.einsum("nai,nbj,nck,ndm->nabcdijkm", *lines).reshape(-1, 81)
    tensor = _null_vector(rows, "quadrifocal_tensor").reshape(3, 3, 3, 3)
    back = [np.linalg.inv(each) for each in maps]
    found = np.einsum("abcd,ia,jb,kc,md->ijkm", tensor, *back)
    return np.asarray(found / np.linalg.norm(found))


def transfer_point(tensor: ArrayLike, pixels: ArrayLike, partners: ArrayLike) -> Reals:
    """Transfer points seen in the first two of three views to the third.

    Parameters
    ----------
    tensor : array_like, (..., 3, 3, 3)
        As returned by `trifocal_tensor`.
    pixels, partners : array_like, (..., 2)
        Points in the first and in the second view.

    Returns
    -------
    array, (..., 2)
        Not finite if the point is on the line through both centres.

    Raises
    ------
    TypeError, ValueError
        If an argument has a different shape or type.

    Notes
    -----
    Of the column and the row through a partner, the one that its epipolar line crosses at the larger angle is used.
    """
    array = real_array(tensor, "tensor", (3, 3, 3), "a trifocal tensor")
    one, two = real_array(pixels, "pixels", (2,), "x y"), real_array(partners, "partners", (2,), "x y")
    # The transfer vanishes if the line through a partner is its epipolar line: use the line with the longer result.
    x, y = two[..., 0], two[..., 1]
    nothing, unit = np.zeros_like(x), np.ones_like(x)
    candidates = [np.stack(line, -1) for line in ((unit, nothing, -x), (nothing, unit, -y))]
    images = np.stack([projective3.transfer_point(array, one, line) for line in candidates])
    sizes = np.linalg.norm(images, axis=-1)
    best = np.where((sizes[0] >= sizes[1])[..., None], images[0], images[1])
    scale = np.sqrt((array**2).sum((-1, -2, -3))) * np.sqrt(1 + (one**2).sum(-1)) * np.sqrt(1 + (two**2).sum(-1))
    with np.errstate(divide="ignore", invalid="ignore"):
        known = np.maximum(sizes[0], sizes[1]) > 1e-13 * scale
        return np.asarray(np.where(known[..., None], best[..., :2] / best[..., 2:], np.nan))


def transfer_line(tensor: ArrayLike, second: ArrayLike, third: ArrayLike) -> Reals:
    """Transfer a line in space that is seen in the second and in the third view to the first view.

    Parameters
    ----------
    tensor : array_like, (..., 3, 3, 3)
        As returned by `trifocal_tensor`.
    second, third : array_like, (..., 3)
        (a, b, c) of ``a x + b y + c = 0``.

    Returns
    -------
    array, (..., 3)
        With arbitrary norm; 0 if both lines do not determine a line in space.

    Raises
    ------
    TypeError, ValueError
        If an argument has a different shape or type.
    """
    array = real_array(tensor, "tensor", (3, 3, 3), "a trifocal tensor")
    b, c = real_array(second, "second", (3,), "a line"), real_array(third, "third", (3,), "a line")
    return projective3.transfer_line(array, b, c)


def epipoles_of_tensor(tensor: ArrayLike) -> tuple[Reals, Reals]:
    """Return the images of the first centre in the second and in the third view.

    Parameters
    ----------
    tensor : array_like, (3, 3, 3)
        As returned by `trifocal_tensor`.

    Returns
    -------
    second, third : array, (3,)
        Homogeneous, of norm 1: orthogonal to the left, and to the right, null vectors of the matrices ``T_i``.

    Raises
    ------
    TypeError, ValueError
        If `tensor` is not one tensor of finite numbers.
    """
    array = real_array(tensor, "tensor", (3, 3, 3), "a trifocal tensor")
    if array.ndim != 3 or not np.isfinite(array).all():
        raise ValueError(f"tensor: shape {array.shape}; expected (3, 3, 3), one tensor of finite numbers")
    found = []
    for slices in (array, np.swapaxes(array, 1, 2)):
        left = np.stack([np.linalg.svd(each)[0][:, 2] for each in slices])
        found.append(np.linalg.svd(left)[2][2])
    return found[0], found[1]


def cameras_of_tensor(tensor: Reals) -> tuple[Reals, Reals, Reals]:
    """Return cameras with this trifocal tensor, the first ``[I | 0]`` (Hartley and Zisserman, algorithm 15.1)."""
    second, third = epipoles_of_tensor(tensor)
    by_columns = np.stack([each @ third for each in tensor], -1)
    by_rows = np.stack([each.T @ second for each in tensor], -1)
    one = np.eye(3, 4)
    two = np.column_stack([by_columns, second])
    three = np.column_stack([(np.outer(third, third) - np.eye(3)) @ by_rows, third])
    return one, two, three


def _are_cameras(views: Sequence[Camera | ArrayLike]) -> bool:
    return any(isinstance(view, Camera) or np.shape(view)[-1:] != (2,) for view in views)


def _not_zero(tensor: Reals, matrices: list[Reals], powers: tuple[int, ...], where: str) -> Reals:
    """Return the tensor unless it is a rounding error relative to the sizes of the matrices."""
    size = np.prod([np.linalg.norm(m, axis=(-1, -2)) ** p for m, p in zip(matrices, powers, strict=True)], axis=0)
    axes = tuple(range(-len(powers) if len(powers) == 4 else -3, 0))
    if np.any(~(np.linalg.norm(tensor, axis=None) > 0)) or np.any(~(np.sqrt((tensor**2).sum(axes)) > 1e-13 * size)):
        refuse(VisionStatus.DEGENERATE, where, "finite cameras of rank 3 that do not all have the same centre")
    return tensor


def _checked_pixels(views: Sequence[Camera | ArrayLike], least: int, where: str) -> tuple[list[Reals], list[Reals]]:
    pixels = [real_array(view, f"views[{k}]", (2,), "x y") for k, view in enumerate(views)]  # type: ignore[arg-type]
    expected = f"at least {least} finite points, not on one plane, seen from different centres"
    refuse(check_points({f"views[{k}]": each for k, each in enumerate(pixels)}, least, "points"), where, expected)
    if len(pixels[0]) >= 8:
        for other in pixels[1:]:
            if degenerate(eight_points(pixels[0], other), pixels[0], other):
                refuse(VisionStatus.DEGENERATE, where, expected)
    both = [normalized(each) for each in pixels]
    return [each for each, _ in both], [matrix for _, matrix in both]


def _lines_through(points: Reals) -> Reals:
    """Return two lines through each point, (n, 2, 3): its column and its row."""
    x, y = points[:, 0], points[:, 1]
    nothing, unit = np.zeros_like(x), np.ones_like(x)
    return np.stack([np.stack([unit, nothing, -x], -1), np.stack([nothing, unit, -y], -1)], 1)


def _null_vector(rows: Reals, where: str) -> Reals:
    _, values, right = np.linalg.svd(rows, full_matrices=rows.shape[-2] < rows.shape[-1])
    if len(values) < rows.shape[1] - 1 or values[rows.shape[1] - 2] <= NEGLIGIBLE * values[0]:
        refuse(VisionStatus.DEGENERATE, where, "points in general position, seen from different centres")
    return np.asarray(right[-1])
