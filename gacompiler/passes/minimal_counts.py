"""Proved minimal numbers of operations, written by ``python -m benchmarks minimal``; do not edit them."""

from __future__ import annotations

PROVED: dict[str, int] = {
    # area_of_turned_vectors_2d
    "b5e999d9ea2c4f7e": 3,
    # centre_of_sphere
    "de7a1faa306ddf61": 10,
    # cga2.circle_from_centre_radius_squared
    "34ab9c932ffe0a81": 5,
    # cga2.dilator_to_scale, cga3.dilator_to_scale
    "8e1a56e1b7aedc90": 2,
    # cga2.distance_squared_points, pga2.distance_squared_points, distance_squared_2d
    "11912050839571e5": 5,
    # cga2.dual_circle_from_centre, cga2.circle_from_centre
    "16bec869b546f57c": 6,
    # cga2.dual_circle_through_point
    "3d594b5999e5ec98": 7,
    # cga2.embed_point
    "ddb0eae1f816ad86": 4,
    # cga2.inner_product_of_points
    "02ef5f9c622ce56b": 6,
    # cga2.line_from_point_direction, pga2.join_point_direction, vga2.signed_area
    "270ed73439cd62f1": 3,
    # cga2.line_from_point_normal, pga2.line_from_point_normal, vga2.dot_product
    "eecd2a3d2ac0ec20": 3,
    # cga2.line_from_points, pga2.join_points, line_2_conformal_points_2d
    "2c8162323af5faa9": 5,
    # cga2.motor_from_rotor_translation
    "340ca541ae934026": 8,
    # cga2.motor_to_rotor_translation
    "855d280c80dbe72a": 8,
    # cga2.translate_point
    "55df5bc2446570a7": 4,
    # cga2.translator_between_points, pga2.translator_between_points
    "bf659dacb5ee795a": 4,
    # cga2.translator_from_vector, pga2.translator_from_vector
    "b02efe1385bcac94": 2,
    # cga3.embed_point
    "545dd0d3979d920a": 6,
    # cga3.line_from_point_direction, pga2.meet_lines, pga3.join_point_direction, projective2.join_points, vga3.wedg
    "342c8a8a8f31d5d8": 9,
    # cga3.line_from_points, pga3.join_points, line_2_conformal_points, join_2_points
    "9c745918bac206ab": 12,
    # cga3.plane_from_point_normal, pga3.plane_from_point_normal, vga3.dot_product
    "fd40c114dd2e8aaf": 5,
    # cga3.sphere_from_centre_radius_squared
    "85e1095534990469": 7,
    # cga3.translate_point
    "423926fc48142b2b": 6,
    # cga3.translator_between_points, pga3.translator_between_points
    "8c2e7ad131ff3580": 6,
    # cga3.translator_from_vector, pga3.translator_from_vector
    "7ba01a910ac86682": 3,
    # cosine_of_angle_at_point_2d
    "7c8a8d3255040200": 7,
    # distance_squared_of_mirrored_points_2d
    "e064188c9e6f8258": 5,
    # distance_squared_of_moved_conformal_points_2d, distance_squared_of_moved_points_2d
    "3f2f6f172d9a64fa": 5,
    # filters.split_2, filters.merge_1
    "d5f6baaf0139aeef": 6,
    # gyroscopic_torque
    "3a34b44c0ac946ec": 9,
    # inner_product_of_turned_vectors_2d
    "e1b5635781657750": 3,
    # pga2.bisector_line
    "17f3070daaf8a8ed": 8,
    # pga2.bisectors_of_lines
    "9d7939da43e1bc25": 6,
    # pga2.line_orthogonal_to_line
    "860baa8633938381": 3,
    # pga2.midpoint
    "d69dd0615748626a": 4,
    # pga2.point_on_line
    "39cf04d7fd76e6bf": 6,
    # pga2.position_along_line, perpendicular_through_point_2d
    "48749958f23eef08": 3,
    # pga2.project_line_on_point
    "892b7442e2d5c5cf": 3,
    # pga2.reflect_line_in_point
    "efdb1f392c629879": 5,
    # pga2.reflect_point_in_point
    "c9a102926dabe704": 4,
    # pga2.reject_point_from_line
    "bd164eccf93b0074": 6,
    # pga2.rotor_to_complex, vga2.rotor_to_matrix
    "d2304e7ed40d61da": 4,
    # pga2.signed_area
    "695a9dc1cfb9524d": 7,
    # pga2.signed_distance_point_line
    "8fb33dad09150368": 4,
    # pga2.twist_on_line
    "5b14f36947caf0f5": 5,
    # pga2.twist_on_point
    "7c86acef1c654d53": 4,
    # pga3.bisectors_of_planes
    "af5a3f41a3eb683b": 8,
    # pga3.midpoint
    "30b3a764187e19a5": 6,
    # pga3.plane_through_point
    "ec5a4ce1e641cfe2": 5,
    # pga3.plucker_residual
    "604a1e6c57b5e423": 5,
    # pga3.reflect_point_in_point
    "f940676bfc944afb": 6,
    # pga3.signed_distance_point_plane
    "384399f3f271697c": 6,
    # projective2.homography_equations, projective3.epipolar_equation
    "76c950c5958eaf37": 4,
    # quaternion.pack_two_sided
    "6269edd2818e03d2": 4,
    # quaternion.unpack_two_sided
    "96bd1a4d3ab5332a": 6,
    # spacetime.pauli_density
    "94138899bd3c0a7f": 7,
    # spacetime.pauli_to_matrix
    "0902ac79bd212e81": 8,
    # sta.interval
    "a7513863cbae492d": 7,
    # translation_translation
    "d523b314100d8c19": 3,
    # two_double_numbers
    "d4af4ba7304c3d90": 6,
    # vga2.even_product
    "cfab4df85b757c7a": 6,
    # vga2.rotor_product
    "06bebbee28135b9f": 6,
    # vga2.vector_product
    "12fca38d4ad98867": 6,
}
"""The minimum by the key of the problem (`gacompiler.passes.minimal`), with kernels that have it."""
