"""Single elements by one compiled operation, beside the same computed from shapes in numpy."""

from __future__ import annotations

import numpy as np
import pytest

from gacompiler.errors import AlgebraError, LayoutError
from gacompiler.objects import CGA3, PGA2, PGA3, VGA3, direct, motions, quick, relations, shapes
from gacompiler.objects.arrays import ArrayMultivector
from tests.support.all_cases import all_cases

RANDOM = np.random.default_rng(3)


@all_cases("place", range(4))
def test_distances(place: int) -> None:
    for _ in range(20):
        p, (a, b) = PGA3.point(*RANDOM.normal(size=3).tolist()), RANDOM.normal(size=(2, 3))
        other = (PGA3.point(a), 3 * PGA3.line(a, b), PGA3.plane(a, 2), PGA3.line(a, b).normalize())[place]
        found = quick.distance(p, other)
        assert found is not None
        expected = relations.distance_of(shapes.shape_of("distance", p), shapes.shape_of("distance", other))
        assert found == pytest.approx(float(expected), rel=1e-13, abs=1e-14)


def test_distances_in_the_plane() -> None:
    p = PGA2.point(3, 4)
    assert p.distance(PGA2.point(0, 0)) == pytest.approx(5) and p.distance(PGA2.line(2, 0, -2)) == pytest.approx(2)


def test_other_distances_are_not_computed_here() -> None:
    p = PGA3.point(1, 2, 3)
    screw = PGA3.e01 + PGA3.e23 + 2 * PGA3.e03 + PGA3.e12
    assert quick.distance(p, PGA3.point(np.eye(3))) is None and quick.distance(p, screw) is None
    assert quick.distance(PGA3.point(1e13, 0, 0), p) is None and quick.distance(PGA3.direction(0, 0, 1), p) is None
    with pytest.raises(AlgebraError, match="a point and a screw"):
        p.distance(screw)
    with pytest.raises(AlgebraError, match="a line at infinity"):
        p.distance(PGA3.e01)
    with pytest.raises(AlgebraError, match=r"int with a PGA3\.POINT"):
        p.distance(3)


def test_elements_made_before_the_extension_share_a_type() -> None:
    """Nothing may be known of an operation by this type, which elements of all layouts have, and arrays."""
    p, q, d, plane = (
        ArrayMultivector(layout, np.array(values, float))
        for layout, values in (
            (PGA3.POINT, [1, 2, 3]), (PGA3.POINT, [1, 2, 5]), (PGA3.DIRECTION, [1, 0, 0]),
            (PGA3.PLANE, [0, 0, 1, -1]),
        )
    )  # fmt: skip
    above = ArrayMultivector(PGA3.PLANE, np.array([0, 0, 2.0, -8]))
    assert p.distance(q) == 2 and q.distance(plane) == plane.distance(q) == 4 and plane.distance(above) == 3
    for x in (d, ArrayMultivector(PGA3.MOTOR, np.eye(8)[0])):
        with pytest.raises(AlgebraError, match="distance: "):
            p.distance(x)
    for _ in range(2 * direct.OFTEN):
        assert PGA3.line(p, q).direction().tolist() == [0, 0, 1]
    assert PGA3.line(p, d).direction().tolist() == [1, 0, 0]


def test_axes() -> None:
    for angle in (*RANDOM.uniform(-6, 6, 20).tolist(), np.pi, -np.pi, 1e-4, 6.2):
        m = PGA3.motor(PGA3.line(*RANDOM.normal(size=(2, 3))), angle, float(RANDOM.normal()))
        expected = motions.axis_of(m, motions.motion_of("axis", m))
        found = quick.axis(m)
        assert found.layout == expected.layout == PGA3.LINE
        np.testing.assert_allclose(found.values, expected.values, rtol=1e-10, atol=1e-11 / min(1, abs(angle)))
    assert quick.axis(PGA3.translator(1, 2, 3)) is None and quick.axis(PGA3.random_motor(2)) is None
    with pytest.raises(LayoutError, match="does not turn"):
        PGA3.motor([0, 0, 1], 0, 1, 2, 3).axis()


def test_packed_operands_give_what_arrays_give() -> None:
    """The second call of a constructor takes the coefficients of all operands together."""
    line, angles = PGA3.line([1, 2, 3], [0, 1, 1]), [0.5, -2.0, 7]
    for angle in angles:
        for made, many in (
            (PGA3.motor(line, angle, 2), PGA3.motor(line, np.array([angle]), 2)),
            (PGA3.motor([0, 1, 2], angle, 1, 2, 3), PGA3.motor([0, 1, 2], np.array([angle]), 1, 2, 3)),
            (CGA3.sphere([1, 2, 3], abs(angle)), CGA3.sphere([1, 2, 3], np.array([abs(angle)]))),
            (VGA3.rotor([0, 0, 2], angle), VGA3.rotor([0, 0, 2], np.array([angle]))),
        ):
            assert made.layout == many.layout and made.shape == ()
            np.testing.assert_allclose(made.values, many.values[0], rtol=1e-14, atol=1e-14)
