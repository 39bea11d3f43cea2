"""Operation counts of the further expressions, and the page that lists all of them.

As in `test_counts.py`, a higher count fails, and a lower one must be recorded. No count exceeds that of the author's
own structure. The expressions are compiled when they are compared with kingdon's.
"""

from __future__ import annotations

import math
import re
import time
from pathlib import Path

import pytest
from known_records import compiled

from benchmarks.counts import PAGE, Peer, Row, count_cells, page, table_cells
from benchmarks.known import known
from benchmarks.worker import TimeLimitExceeded, Worker

ROOT = Path(__file__).parents[2]

FURTHER: dict[str, tuple[int, int]] = {
    # name: reached (mul, add)
    "circle_3_points_2d": (18, 14),
    "motor_circle_2d": (16, 10),
    "point_distance_squared": (3, 5),
    "power_of_point": (7, 6),
    "power_of_moved_point": (7, 6),
    "invert_point_in_sphere": (20, 14),
    "meet_of_spheres": (12, 10),
    "tangency_of_spheres": (28, 16),
    "radius_squared_of_sphere": (5, 4),
    "centre_of_sphere": (8, 2),
    "point_pair_distance": (5, 5),
    "motor_sphere": (37, 28),
    "translator_sphere": (7, 9),
    "motor_conformal_point": (25, 20),
    "motor_circle": (106, 87),
    "dilator_motor_point": (29, 23),
    "rotor_about_point": (6, 6),
    "circle_3_moved_points": (88, 75),
    "inner_product_of_moved_spheres": (5, 4),
    "rotor_vector_split": (32, 32),
    "vector_sandwich_null_pairs": (23, 13),
    "bivector_on_vector_null_pairs": (30, 24),
    "commutator_of_bivectors_null_pairs": (84, 87),
    "shear_of_vector_null_pairs": (6, 6),
    "motor_point_2d": (8, 6),
    "motor_line_2d": (10, 6),
    "relative_motor_2d": (12, 8),
    "two_motors_point_2d": (16, 12),
    "reflect_point_in_line_2d": (5, 4),
    "crossing_of_segments_2d": (10, 9),
    "area_of_moved_triangle_2d": (2, 5),
    "foot_on_line_2d": (10, 4),
    "perpendicular_through_point_2d": (2, 1),
    "reflect_motor_in_plane": (24, 16),
    "relative_motor": (48, 40),
    "relative_motor_point": (42, 36),
    "motor_in_moved_frame": (51, 39),
    "twist_in_body_frame": (51, 39),
    "velocity_of_point": (6, 6),
    "velocity_of_moved_point": (27, 24),
    "motor_rate": (42, 28),
    "commutator_of_screws": (18, 12),
    "commutator_of_moved_screws": (69, 51),
    "power_of_moved_screws": (6, 5),
    "cosine_between_moved_lines": (3, 2),
    "momentum_of_point_mass": (12, 9),
    "kinetic_energy_of_point_mass": (9, 8),
    "two_motors_line": (99, 79),
    "three_motors_point": (63, 54),
    "distance_squared_under_two_motors": (42, 41),
    "volume_of_moved_points": (9, 14),
    "moved_point_to_plane": (24, 21),
    "meet_of_moved_planes": (64, 42),
    "line_through_points_meets_plane": (18, 14),
    "project_line_on_unit_plane": (21, 11),
    "project_line_on_plane": (28, 13),
    "plane_across_line": (3, 2),
    "point_line_distance_squared": (9, 8),
    "half_turn_of_point": (15, 11),
    "reflect_line_in_plane": (24, 16),
    "ratio_of_lines": (27, 19),
    "quaternion_vector": (18, 12),
    "quaternion_difference": (16, 12),
    "quaternion_chord_squared": (4, 7),
    "two_quaternions_vector": (36, 24),
    "quaternion_rate": (15, 8),
    "three_quaternions": (32, 24),
    "lorentz_vector": (42, 42),
    "boost_vector": (9, 7),
    "lorentz_field": (66, 54),
    "boost_field": (34, 24),
    "field_invariants": (10, 7),
    "invariants_of_transformed_field": (10, 7),
    "lorentz_force": (12, 8),
    "energy_momentum": (35, 25),
    "energy_flow": (13, 8),
    "composed_boosts": (16, 9),
    "thomas_rotation": (6, 3),
    "interval_of_transformed_events": (4, 3),
    "rotor_vector_2d": (8, 3),
    "reflect_vector": (7, 5),
    "reflect_vector_twice": (14, 10),
    "two_rotors_vector": (34, 24),
    "rotor_bivector": (18, 12),
    "volume_of_rotated_vectors": (9, 5),
    "residual_of_rotation": (21, 17),
    "project_vector_on_bivector": (12, 6),
    "gyroscopic_torque": (6, 3),
    "rotor_between_vectors": (9, 6),
    "rotor_vector_4d": (32, 32),
    "even_product_4d": (40, 48),
    "commutator_of_bivectors_4d": (24, 18),
}
NAMES = list(known())


@pytest.fixture(scope="module")
def listed() -> dict[str, tuple[str, ...]]:
    """The rows of the stored page."""
    return table_cells((ROOT / PAGE).read_text())


@pytest.mark.peers
@pytest.mark.parametrize("name", NAMES)
def test_counts_equal_those_recorded_and_listed(name: str, listed: dict[str, tuple[str, ...]]) -> None:
    record = compiled(name)
    written = record.candidates[0]
    assert written.origin == "as written"
    assert record.cost.total <= written.cost.total
    reached = (record.cost.mul, record.cost.add)
    assert reached == FURTHER.get(name, reached), f"{name}: {record.cost}; record it here if it is an improvement"
    assert listed.get(name) == count_cells(known()[name], record), f"{name}: run `make counts`"


def test_every_further_expression_is_counted_and_documented() -> None:
    further = {name: each for name, each in known().items() if each.published is None}
    assert set(further) == set(FURTHER)
    assert all(each.kernel.summary.endswith(".") for each in further.values())
    assert len({each.algebra for each in further.values()}) >= 6


def test_the_page_lists_nothing_else(listed: dict[str, tuple[str, ...]]) -> None:
    assert list(listed) == NAMES


def test_a_page_with_invented_figures() -> None:
    """The page has the counts of kingdon in sentences and in cells."""
    each = known()["rotor_vector"]
    record = compiled("rotor_vector")
    more, less, late = Peer((40, 20, 1), 0.0123), Peer((9, 6, 0), 2.0), Peer(None, 3.0, "> 3 s")
    text = page([Row(each, record, 0.5, peer) for peer in (more, less, late)], 3)
    assert [row[8:] for row in rows(text)] == [
        ("40 / 20, 1 div", "500", "12"), ("9 / 6", "500", "2000"), ("–", "500", "> 3 s"),
    ]  # fmt: skip
    flat = " ".join(text.split())
    assert "kingdon finished 2 expressions and did not finish 1." in flat
    assert "needs more operations for 1 of them, the same number for 0, and fewer for 1." in flat
    assert f"of the ratios of the counts is {(68 * 15 / 30**2) ** 0.5:.2f}." in flat
    assert "make .venv/.peers" in page([Row(each, record, 0.5, None)], 3)


def rows(text: str) -> list[tuple[str, ...]]:
    """The rows of expressions in a page."""
    lines = [line for line in text.splitlines() if re.match(r"\| \w+ \| `", line)]
    return [tuple(cell.strip() for cell in line[1:-1].split(" | ")) for line in lines]


def test_a_worker_answers_raises_and_is_stopped() -> None:
    with Worker(math.sqrt, 30) as worker:
        assert worker(4) == 2
        with pytest.raises(ValueError, match=r"domain|nonnegative"):
            worker(-1)
        assert worker(9) == 3
    with Worker(time.sleep, 0.05) as worker:
        with pytest.raises(TimeLimitExceeded, match=r"more than 0\.05 s"):
            worker(30)
        assert worker(0) is None
