"""Operation counts of the known expressions with published counts, which the tests assert and the pages show.

``published`` is the best count known from elsewhere (asserted by GAmphetamine's tests, reached by kingdon 3, or derived
by hand), ``reached`` is ours.
"""

from __future__ import annotations

COUNTS: dict[str, tuple[tuple[int, int], tuple[int, int]]] = {
    # name: published (mul, add), reached (mul, add)
    "motor_point": ((21, 18), (21, 18)),
    "motor_point_spelled_out": ((21, 18), (21, 18)),
    "motor_direction": ((18, 12), (18, 12)),
    "motor_origin": ((15, 9), (15, 9)),
    "motor_x_direction_half": ((6, 4), (6, 4)),
    "motor_trivector": ((25, 18), (25, 18)),
    "motor_plane": ((26, 18), (26, 18)),
    "motor_line": ((51, 39), (51, 39)),
    "motor_motor": ((48, 40), (48, 40)),
    "motor_translation": ((12, 12), (12, 12)),
    "translation_translation": ((0, 3), (0, 3)),
    "rotation_rotation": ((9, 12), (9, 12)),
    "join_2_points": ((6, 6), (6, 6)),
    "join_point_line": ((9, 9), (9, 8)),
    "join_3_points": ((9, 12), (9, 11)),
    "join_4_points": ((9, 14), (9, 14)),
    "project_point_plane": ((18, 12), (9, 8)),
    "project_point_unit_plane": ((6, 6), (6, 6)),
    "project_point_unit_line": ((15, 15), (12, 8)),
    "distance_squared": ((3, 5), (3, 5)),
    "distance_squared_unnormalised": ((9, 5), (9, 5)),
    "area_squared": ((9, 11), (9, 11)),
    "composed_motors_point": ((42, 36), (42, 36)),
    "nested_motors_point": ((42, 36), (42, 36)),
    "join_of_moved_points": ((48, 42), (45, 42)),
    "distance_squared_of_moved_points": ((3, 5), (3, 5)),
    "rotor_vector": ((18, 12), (18, 12)),
    "sphere_4_points": ((54, 40), (44, 37)),
    "circle_3_points": ((55, 42), (36, 28)),
    "point_pair": ((23, 20), (20, 14)),
    "versor_vector": ((120, 100), (110, 91)),
    "even_product": ((144, 160), (148, 136)),
    "full_product": ((288, 416), (240, 368)),
}
