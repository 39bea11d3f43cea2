"""The entries of the toolkit in the plane-based algebras of space and of the plane, and for motors."""

from __future__ import annotations

from toolkit_table import rows

PGA = "Gunn, *Geometric Algebras for Euclidean Geometry*, AACA 2017"
DORST = "Dorst and De Keninck, *A Guided Tour to the Plane-Based Geometric Algebra PGA*, 2022"
SHOEMAKE = "Shoemake, *SIGGRAPH* 1985"
BERNARDES = "Bernardes and Viollet, *PLoS ONE* 17(11), 2022"
ROELFS = "Roelfs and De Keninck, *Graded Symmetry Groups*, 2023"
MARKLEY = "Markley et al., *J. Guidance* 30:1193, 2007; Kavan et al., 2006"
PENNEC = "Pennec and Arsigny, *Matrix Information Geometry*, 2013"
KIM = "Kim, Kim and Shin, *SIGGRAPH* 1995"
KAVAN = "Kavan et al., *Dual Quaternions for Rigid Transformation Blending*, 2006"
SHEPPERD = "Shepperd, *J. Guidance and Control* 1:223, 1978"
PLUCKER = "Shoemake, *Pluecker Coordinate Tutorial*, Ray Tracing News 11, 1998"
DORAN = "Doran and Lasenby, *Geometric Algebra for Physicists*, 2003"
VECTORS = "definition, vector algebra"
BOOK = "Bayro-Corrochano, *Geometric Computing*, 2010, motor algebra"
FEATHERSTONE = "Featherstone, *Rigid Body Dynamics Algorithms*, 2008, ch. 2"
DYNAMICS = "test_dynamics.py::test_"
MURRAY = "Murray, Li and Sastry, *Robotic Manipulation*, 1994, ch. 2"

SPECS, GEOMETRY, MOTORS, ALGORITHMS = (
    "test_specs.py::test_",
    "test_toolkit_pga.py::test_",
    "test_toolkit_pga_motors.py::test_",
    "test_motors.py::test_",
)

ENTRIES = (
    *rows("pga3", PGA, SPECS + "pga3_joins_meets_and_distances_are_those_of_vectors", """
        line of two points: join_points
        line of point and direction: join_point_direction
        plane of point and line: join_point_line
        plane of three points: join_three_points
        signed volume of four points, orientation: join_four_points
        line through a point orthogonal to a plane: line_orthogonal_to_plane
        plane through a point orthogonal to a line: plane_orthogonal_to_line
        parallel plane through a point (projection of plane on point): plane_through_point
        distance of points: distance_points distance_squared_points
        distance of point and plane, signed: signed_distance_point_plane
        distance of point and line: distance_point_line
        moment of lines, distance times sine, signed: mutual_moment
        projection of point on plane: project_point_on_plane project_point_on_unit_plane
        projection of point on line: project_point_on_line project_point_on_unit_line
        projection of line on plane: project_line_on_unit_plane
        reflection of point in plane: reflect_point
        normalisation: normalize_line normalize_plane
    """),
    *rows("pga3", PGA, SPECS + "pga3_meets_are_solutions_of_linear_systems", """
        point with weight 1: point_from_trivector
        meet of planes, at infinity where parallel: meet_planes
        meet of line and plane, a direction where parallel: meet_line_plane
        meet of three planes: meet_three_planes
    """),
    *rows("pga3", VECTORS, SPECS + "angles_are_accurate_where_they_are_small", """
        angle of planes: angle_between_planes
        angle of lines: angle_between_lines
    """),
    *rows("pga3", DORST, GEOMETRY + "lines_and_planes_from_numbers_and_back", """
        line of Pluecker coordinates, and back: line_from_direction_moment line_to_direction_moment
        Pluecker condition: plucker_residual
        support point of a line: line_support
        point on a line at a distance, and back: point_on_line position_along_line
        plane of normal and distance, and back: plane_from_normal plane_to_normal
        plane of point and normal: plane_from_point_normal
        plane of point and two directions: join_point_directions
        support point of a plane: plane_support
    """),
    *rows("pga3", VECTORS, GEOMETRY + "bisectors_and_midpoints", """
        bisector of points: bisector_plane
        bisectors of planes: bisectors_of_planes
        midpoint: midpoint
    """),
    *rows("pga3", DORST, GEOMETRY + "distances_and_closest_points_of_skew_and_crossing_lines", """
        distance of lines, signed: distance_lines signed_distance_lines
        closest points of lines: closest_points_of_lines
        common perpendicular: common_perpendicular
        meet of lines: meet_lines
        plane of lines that meet: join_lines
    """),
    *rows("pga3", VECTORS, GEOMETRY + "parallel_and_coincident_lines", """
        how lines lie (same, parallel, meeting, skew): relation_of_lines
    """),
    *rows("pga3", VECTORS, GEOMETRY + "distances_and_angles_of_lines_and_planes", """
        distance of line and plane, signed: signed_distance_line_plane
        angle of line and plane, signed: signed_angle_line_plane
        how line and plane lie (in it, parallel, meeting): relation_of_line_plane
    """),
    *rows("pga3", VECTORS, GEOMETRY + "distances_angles_and_relations_of_planes", """
        distance of planes, signed: signed_distance_planes
        how planes lie (same, parallel, meeting): relation_of_planes
        directed angles about an axis: signed_angle_between_planes signed_angle_between_lines
    """),
    *rows("pga3", VECTORS, GEOMETRY + "what_three_planes_have_in_common", """
        what three planes have in common: relation_of_three_planes
    """),
    *rows("pga3", DORST, GEOMETRY + "rejections_complete_projections", """
        rejection of point from plane, line: reject_point_from_plane reject_point_from_line
        rejection of line from plane: reject_line_from_plane
        parallel line through a point (projection of line on point): project_line_on_point
        projection and rejection of plane and line: project_plane_on_line reject_plane_from_line
    """),
    *rows("pga3", DORST, GEOMETRY + "reflections_in_planes_lines_and_points", """
        reflection of line, plane in plane: reflect_line reflect_plane
        half turn about a line: reflect_point_in_line reflect_line_in_line reflect_plane_in_line
        reflection in a point: reflect_point_in_point reflect_line_in_point reflect_plane_in_point
    """),
    *rows("pga3", VECTORS, GEOMETRY + "collinear_and_coplanar_residuals_are_heights", """
        collinear: collinearity_residual
        coplanar, orientation: coplanarity_residual
    """),
    *rows("pga3", BOOK, GEOMETRY + "flags", """
        flag of point, line and plane: flag_from_points flag_from_motor
        flag is nested: flag_residuals
        motor of a flag, of three points: motor_from_flag motor_from_points
    """),
    *rows("pga3", PLUCKER, GEOMETRY + "rays_hit_planes_and_triangles", """
        ray and plane: hit_ray_plane
        ray and triangle: hit_ray_triangle
    """),
    *rows("pga3", BOOK, GEOMETRY + "forms_in_vectors_of_space_are_exact", """
        line in G(3,0), and back: line_to_vector_algebra line_from_vector_algebra
        plane in G(3,0), and back: plane_to_vector_algebra plane_from_vector_algebra
    """),
    *rows("pga3", VECTORS, GEOMETRY + "forms_in_homogeneous_coordinates_are_exact", """
        homogeneous points and directions, and back: point_to_projective direction_to_projective
        homogeneous points and directions, and back: trivector_from_projective
        homogeneous lines, and back: line_to_projective line_from_projective
        homogeneous planes, and back: plane_to_projective plane_from_projective
    """),
    *rows("pga3", BOOK, GEOMETRY + "the_motor_algebra_of_the_book_moves_points_lines_and_planes", """
        point 1 + I x, and back: point_to_motor_algebra point_from_motor_algebra
        line n + I m, and back: line_to_motor_algebra line_from_motor_algebra
        plane n - I d, and back: plane_to_motor_algebra plane_from_motor_algebra
        its laws of motion: move_point_of_motor_algebra move_plane_of_motor_algebra
    """),
    *rows("pga3", PGA, SPECS + "motors_move_everything_as_matrices_do", """
        motion of points, directions, lines, planes: move_point move_point_back move_direction move_line move_plane
        6 x 6 adjoint: motor_to_adjoint
    """),
    *rows("pga3", "Bayro-Corrochano, Daniilidis and Sommer, *JMIV* 13:79, 2000",
          "test_hand_eye.py::test_the_equation_vanishes_on_the_motor_between_both_places", """
        equation a x = x b of hand and eye: motor_equation
    """),
    *rows("pga3", PGA, SPECS + "motors_compose_and_invert_as_matrices_do", """
        product, inverse, conjugation: motor_product motor_inverse move_motor even_product
    """),
    *rows("pga3", SHEPPERD, SPECS + "motors_of_matrices_are_those_matrices_in_every_branch", """
        4 x 4 matrix, and back: motor_from_matrix motor_to_matrix
        3 x 3 matrix, and back: rotor_from_matrix rotor_to_matrix
    """),
    *rows("pga3", PGA, SPECS + "pga3_constructors_are_those_of_scipy", """
        rotor of axis and angle: rotor_from_axis_angle
        rotor of a rotation vector: rotor_from_rotation_vector
        translator: translator_from_vector
        motor of rotor and translation, and back: motor_from_rotor_translation motor_to_rotor_translation
        quaternion, scalar first, and back: rotor_from_quaternion rotor_to_quaternion
    """),
    *rows("pga3", KAVAN, SPECS + "dual_quaternions_are_half_the_translation_times_the_rotation", """
        dual quaternion, scalars first, and back: motor_from_dual_quaternion motor_to_dual_quaternion
    """),
    *rows("pga3", PGA, SPECS + "motors_about_lines_and_screws", """
        rotation about a line: motor_from_line
        screw of line, angle, distance: motor_from_screw
    """),
    *rows("pga3", "Craig, *Introduction to Robotics*", SPECS + "denavit_hartenberg_rows", """
        Denavit-Hartenberg row: motor_from_denavit_hartenberg motor_from_modified_denavit_hartenberg
    """),
    *rows("pga3", ROELFS, MOTORS + "exponentials_to_rounding", """
        exponential: motor_exponential
    """),
    *rows("pga3", ROELFS, MOTORS + "exponential_of_logarithm_to_rounding", """
        logarithm: motor_logarithm
        square root: motor_square_root
        power: motor_power
    """),
    *rows("pga3", MURRAY, MOTORS + "screws_and_motors", """
        screw of a motor: motor_to_screw
        screw of line, angle, pitch: motor_from_screw_pitch
        screw of a twist or wrench, and back: bivector_to_screw bivector_from_screw
    """),
    *rows("pga3", MURRAY, MOTORS + "twists_velocities_and_accelerations", """
        twist of a motor, and back: motor_to_twist motor_from_twist
        twist of velocities, and back: twist_from_velocities twist_to_velocities
        acceleration of a point: acceleration_of_point
        rate of a motor, and back: motor_derivative twist_from_motor_derivative
    """),
    *rows("pga3", BOOK, SPECS + "rates_of_change_are_derivatives", """
        velocity of point, line, plane: twist_on_point twist_on_line twist_on_plane
        Lie bracket: line_commutator
    """),
    *rows("pga3", FEATHERSTONE, DYNAMICS + "momenta_and_wrenches_equal_those_of_point_masses", """
        inertia of a moved body: inertia_of_moved_body
        momentum of a body: momentum
        wrench of a body that accelerates: inertial_wrench
        power of a wrench: power
    """),
    *rows("pga3", FEATHERSTONE, DYNAMICS + "the_twist_after_a_joint_is_a_derivative", """
        twist of what a joint carries, and its rate: twist_after_joint twist_rate_after_joint
    """),
    *rows("pga3", VECTORS, MOTORS + "rotations_in_other_forms", """
        rotation vector of a rotor: rotor_to_rotation_vector
        axis and angle of a rotor: rotor_to_axis_angle
        rotation vector and translation, and back: motor_from_rotation_vector_translation
        rotation vector and translation, and back: motor_to_rotation_vector_translation
        quaternion and translation, and back: motor_from_quaternion_translation motor_to_quaternion_translation
        quaternion, scalar last, and back: rotor_from_quaternion_scalar_last rotor_to_quaternion_scalar_last
    """),
    *rows("pga3", VECTORS, MOTORS + "dual_quaternions_scalar_last_and_adjoints", """
        dual quaternion, scalars last, and back: motor_from_dual_quaternion_scalar_last
        dual quaternion, scalars last, and back: motor_to_dual_quaternion_scalar_last
        motor of a 6 x 6 adjoint: motor_from_adjoint
    """),
    *rows("pga3", VECTORS, MOTORS + "motors_between_points_frames_and_blends", """
        translator between points: translator_between_points
        motor between frames: motor_between_frames motor_relative
        blend of two motors: blend_motors
    """),
    *rows("pga3", DORST, MOTORS + "motors_between_lines_and_planes_that_are_opposite", """
        motor between lines: motor_between_lines
        motor between planes: motor_between_planes
    """),
    *rows("pga3", DORST, MOTORS + "inverses_and_renormalisation", """
        inverse of an even element: even_inverse
        back onto the Study quadric: normalize_motor
    """),
    *rows("pga3", KAVAN, SPECS + "interpolated_motors_go_from_one_to_the_other_at_constant_twist", """
        screw interpolation: interpolate_motors
    """),
    *rows("pga3", "Davenport 1968", ALGORITHMS + "the_form_of_rotations_is_the_product_of_turned_vectors", """
        quadratic form of rotations: rotation_form
    """),
    *rows("pga3", BERNARDES, ALGORITHMS + "euler_angles_about_any_orthogonal_axes", """
        Euler angles about any orthogonal axes: rotor_from_euler_angles rotor_to_proper_euler_angles
        Euler angles about any orthogonal axes: rotor_to_tait_bryan_angles
    """),
    *rows("pga2", PGA, SPECS + "pga2_joins_meets_and_distances_are_those_of_vectors", """
        line of two points: join_points
        line of point and direction: join_point_direction
        meet of lines, a direction where parallel: meet_lines
        point with weight 1: point_from_bivector
        line through a point orthogonal to a line: line_orthogonal_to_line
        distance of points: distance_points distance_squared_points
        distance of point and line, signed: signed_distance_point_line
        signed area, orientation: signed_area
        angle of lines: angle_between_lines
        projection of point on line: project_point_on_line project_point_on_unit_line
        reflection of point in line: reflect_point
        normalisation: normalize_line
    """),
    *rows("pga2", DORST, GEOMETRY + "lines_of_the_plane_from_numbers_and_back", """
        line of normal and distance, and back: line_from_normal line_to_normal
        line of point and normal: line_from_point_normal
        direction of a line: line_direction
        support point of a line: line_support
        point on a line at a distance, and back: point_on_line position_along_line
        bisector of points: bisector_line
        bisectors of lines: bisectors_of_lines
        midpoint: midpoint
    """),
    *rows("pga2", VECTORS, GEOMETRY + "relations_of_lines_of_the_plane", """
        distance of lines, signed: signed_distance_lines
        how lines lie (same, parallel, meeting): relation_of_lines
        what three lines have in common: relation_of_three_lines
    """),
    *rows("pga2", DORST, GEOMETRY + "projections_and_reflections_of_the_plane", """
        parallel line through a point (projection of line on point): project_line_on_point
        rejection of point from line: reject_point_from_line
        reflection of line in line: reflect_line
        half turn about a point: reflect_point_in_point reflect_line_in_point
        collinear, orientation: collinearity_residual
    """),
    *rows("pga2", VECTORS, GEOMETRY + "flags_and_rays_of_the_plane", """
        flag of point and line, and back: motor_from_flag flag_from_motor
        ray and line: hit_ray_line
        ray and segment: hit_ray_segment
    """),
    *rows("pga2", PGA, SPECS + "pga2_motors_are_those_of_matrices", """
        motor of angle and translation, and back: motor_from_angle_translation motor_to_angle_translation
        3 x 3 matrix, and back: motor_from_matrix motor_to_matrix
        motion of points, directions, lines: move_point move_point_back move_direction move_line
        product, inverse: motor_product motor_inverse
        normalisation: normalize_motor
        interpolation: interpolate_motors
        translator: translator_from_vector
    """),
    *rows("pga2", DORST, MOTORS + "motors_of_the_plane_in_other_forms", """
        rotation about a point, and back: motor_from_point motor_to_point
        twist of a motor, and back: motor_to_twist motor_from_twist
        twist of velocities, and back: twist_from_velocities twist_to_velocities
        velocity of point, line: twist_on_point twist_on_line
        rate of a motor, and back: motor_derivative twist_from_motor_derivative
        3 x 3 adjoint: motor_to_adjoint
    """),
    *rows("pga2", DORST, MOTORS + "functions_of_motors_of_the_plane_to_rounding", """
        exponential: motor_exponential
        logarithm: motor_logarithm
        square root: motor_square_root
        power: motor_power
        rotor of an angle: rotor_from_angle
        product of even elements: even_product
    """),
    *rows("pga2", DORST, MOTORS + "more_motors_of_the_plane", """
        motor between frames: motor_between_frames motor_relative
        translator between points: translator_between_points
        motor between lines: motor_between_lines
        inverse of an even element: even_inverse
        blend of two motors: blend_motors
        unit complex number, and back: rotor_from_complex rotor_to_complex
    """),
    *rows("motors", MARKLEY, ALGORITHMS + "means_of_one_two_and_translations", """
        linear average, weighted: average_motors
    """),
    *rows("motors", PENNEC, ALGORITHMS + "the_mean_is_equivariant_under_motions_from_both_sides", """
        intrinsic mean, with status: mean_motor
    """),
    *rows("motors", SHOEMAKE, ALGORITHMS + "slerp_equals_that_of_scipy_and_signs_do_not_matter", """
        slerp: slerp
    """),
    *rows("motors", KAVAN, ALGORITHMS + "screw_interpolation_is_uniform_and_independent_of_signs", """
        ScLERP: sclerp
        NLERP: nlerp
    """),
    *rows("motors", SHOEMAKE, ALGORITHMS + "bezier_curves_start_and_end_along_their_controls", """
        Bezier curve: bezier
    """),
    *rows("motors", KIM, ALGORITHMS + "splines_go_through_motors_with_continuous_velocity", """
        spline through motors: MotorSpline
    """),
    *rows("motors", "Wahba 1965; Davenport 1968", ALGORITHMS + "noisy_vectors_give_the_optimum_of_scipy", """
        rotor of vectors, with status: rotor_from_vectors
        motor of points, with status: motor_from_points
    """),
    *rows("motors", "Umeyama 1991", ALGORITHMS + "similarities_are_those_of_umeyama", """
        similarity of points, with status: similarity_from_points
    """),
    *rows("motors", "Wahba 1965; Davenport 1968", ALGORITHMS + "motors_from_objects_of_all_kinds", """
        motion of points, lines, planes, spheres and circles, mixed: motor_from_objects
    """),
    *rows("motors", DORAN, ALGORITHMS + "rotors_from_oblique_frames", """
        rotor of frames: rotor_from_frames
    """),
    *rows("motors", BERNARDES, ALGORITHMS + "euler_angles_are_those_of_scipy", """
        twelve Euler sequences, rotors: rotor_from_euler rotor_to_euler
        twelve Euler sequences, matrices: matrix_from_euler matrix_to_euler
    """),
)  # fmt: skip
