"""Constructors of motors, rotors and unit quaternions from matrices and quaternions.

They are the inverses of `to_matrix`, `quaternion` and `dual_quaternion` of elements.
"""

from __future__ import annotations

from typing import Any, Generic

import numpy as np

from ..algebra.algebra import Algebra
from ..algebra.catalog import CGA2, PGA2, QUATERNIONS, VGA2, VGA3
from ..errors import LayoutError
from ..gac_runtime.annotations import Numbers
from ..gac_runtime.arrays import plain
from .layouts import plain_layout
from .motions import IN_SPACE, TRANSLATING
from .shapes import Reals
from .spaces import M, numbers, stacked

_HAMILTON = plain_layout(VGA3.layout("QUATERNION", "1 e32 e13 e21"))


class Poses(Generic[M]):
    """Constructors of spaces from matrices and quaternions."""

    algebra: Algebra

    def from_matrix(self, matrix: Numbers) -> M:
        """Create the motors or rotors of rigid motions from matrices.

        Parameters
        ----------
        matrix : array_like
            (..., 4, 4) in PGA3 and CGA3, (..., 3, 3) in PGA2 and CGA2, matrices of homogeneous coordinates. In VGA3 and
            QUATERNIONS (..., 3, 3) and in VGA2 (..., 2, 2), matrices of rotations.

        Raises
        ------
        LayoutError
            If a matrix is not that of a rigid motion within 1e-6.
        """
        translates, d = self.algebra in TRANSLATING, 2 if self.algebra in (PGA2, CGA2, VGA2) else 3
        m = numbers("from_matrix", matrix)
        size = d + translates
        if m.ndim < 2 or m.shape[-2:] != (size, size):
            raise LayoutError("from_matrix", f"an array of shape {m.shape}", f"(..., {size}, {size})")
        r = m[..., :d, :d]
        rigid = np.abs(r @ np.swapaxes(r, -1, -2) - np.eye(d)).max(initial=0.0) < 1e-6 and np.all(np.linalg.det(r) > 0)
        if not rigid or np.abs(m[..., d:, :] - np.eye(size)[d:]).max(initial=0.0) > 1e-6:
            also = f", a translation, and {' '.join('0' * d)} 1" if translates else " matrix of determinant 1"
            raise LayoutError("from_matrix", "a matrix that is not a rigid motion", f"a rotation{also}")
        rotor = self._rotor_of(_quaternion_of_matrix(r))
        return self.translator(m[..., :d, d]) * rotor if translates else rotor  # type: ignore[attr-defined]

    def from_quaternion(self, *quaternion: Numbers) -> M:
        """Create the rotors of unit quaternions w, x, y, z, or of an array with these along its last axis.

        Raises
        ------
        LayoutError
            If a quaternion is not of unit norm within 1e-9.
        """
        return self._rotor_of(stacked_quaternion("from_quaternion", quaternion))

    def from_dual_quaternion(self, dual_quaternion: Numbers) -> M:
        """Create the motors of unit dual quaternions, (..., 8): q, then ``t q / 2`` for a translation t after q.

        Raises
        ------
        LayoutError
            If a dual quaternion is not of unit norm within 1e-9, or its two parts are not orthogonal.
        """
        x = numbers("from_dual_quaternion", dual_quaternion)
        if x.ndim == 0 or x.shape[-1] != 8:
            raise LayoutError("from_dual_quaternion", f"an array of shape {x.shape}", "(..., 8), with scalars first")
        q, r = x[..., :4], x[..., 4:]
        off = np.abs(np.sum(q * r, axis=-1)) > 1e-9 * np.maximum(1.0, np.max(np.abs(r), axis=-1))
        if np.any(off):
            raise LayoutError("from_dual_quaternion", "parts that are not orthogonal", "a unit dual quaternion")
        # t = 2 r conj(q), whose scalar is 0.
        t = 2 * (q[..., :1] * r[..., 1:] - r[..., :1] * q[..., 1:] - np.cross(r[..., 1:], q[..., 1:]))
        return self.translator(t) * self._rotor_of(q)  # type: ignore[attr-defined]

    def _rotor_of(self, q: Reals) -> Any:
        """Return the rotors of quaternions, which in the plane are those of rotations about the z axis."""
        algebra, (w, x, y, z) = self.algebra, np.moveaxis(q, -1, 0)
        if algebra == QUATERNIONS:
            return self.of(algebra.UNIT_QUATERNION, w, x, y, z)  # type: ignore[attr-defined]
        if algebra in IN_SPACE:
            return self.of(algebra.ROTOR, w, -z, y, -x)  # type: ignore[attr-defined]
        if np.any(x) or np.any(y):
            raise LayoutError("from_quaternion", "a rotation out of the plane", "x = y = 0")
        return self.of(algebra.ROTOR, w, -z)  # type: ignore[attr-defined]


def stacked_quaternion(what: str, coefficients: tuple[Any, ...]) -> np.ndarray[Any, Any]:
    """Return quaternions w, x, y, z as by `stacked`, or those of elements of the module `quaternion`."""
    if len(coefficients) == 1:
        coefficients = (plain(what, coefficients[0], _HAMILTON),)
    return stacked(what, ("w", "x", "y", "z"), coefficients)


def _quaternion_of_matrix(r: Reals) -> Reals:
    """Return the quaternion of a rotation matrix of the plane or of space."""
    from scipy.spatial.transform import Rotation

    if r.shape[-1] == 2:
        half = np.arctan2(r[..., 1, 0], r[..., 0, 0]) / 2
        return np.stack([np.cos(half), np.zeros_like(half), np.zeros_like(half), np.sin(half)], -1)
    q = Rotation.from_matrix(r.reshape(-1, 3, 3)).as_quat(canonical=True).reshape((*r.shape[:-2], 4))
    return np.asarray(np.concatenate([q[..., 3:], q[..., :3]], -1))
