"""The entries of the toolkit in the conformal algebras of space and of the plane."""

from __future__ import annotations

from toolkit_table import rows

DFM = "Dorst, Fontijne and Mann, *Geometric Algebra for Computer Science*, 2007, ch. 13-16"
DL = "Doran and Lasenby, *Geometric Algebra for Physicists*, 2003, ch. 10"
LASENBY = "Lasenby, Hadfield and Lasenby, *Advances in Applied Clifford Algebras* 29:102, 2019"
BOOK = "Bayro-Corrochano, *Geometric Computing*, 2010, ch. 6"
ROELFS = "Roelfs and De Keninck, *Graded Symmetry Groups*, 2023"
VALKENBURG = "Dorst and Valkenburg, *Guide to Geometric Algebra in Practice*, 2011, ch. 5"
COXETER = "Coxeter, *Inversive Distance*, 1966"
ERICSON = "Ericson, *Real-Time Collision Detection*, 2005, ch. 5"
VECTORS = "definition, vector algebra"
COMPLEX = "definition, complex numbers"

SPECS, SPACE, VERSORS, PLANE = (
    "test_specs.py::test_",
    "test_toolkit_cga.py::test_",
    "test_toolkit_cga_versors.py::test_",
    "test_toolkit_cga2.py::test_",
)

ENTRIES = (
    *rows("cga3", DFM, SPECS + "conformal_points", """
        point of coordinates, and back: embed_point extract_point
        weight 1: normalize_vector
        inner products of points, dual spheres: inner_product_of_points inner_product_of_vectors
        distance of points: distance_squared_points distance_points
    """),
    *rows("cga3", DFM, SPECS + "spheres_and_planes", """
        sphere of four points: sphere_from_points
        sphere of centre and radius, dual and direct: dual_sphere_from_centre sphere_from_centre
        dual sphere of centre and point: dual_sphere_through_point
        plane of three points: plane_from_points
        dual plane of normal and distance: dual_plane_from_normal
        bisector of points: bisector_plane
        dual of sphere, plane: sphere_polarity plane_polarity
        centre and squared radius of a sphere: sphere_centre sphere_radius_squared
        power of a point: power_of_point
        distance of point and plane, signed: signed_distance_point_plane
        reflection of point in plane: reflect_point
        inversion of point in sphere: invert_point
    """),
    *rows("cga3", DFM, SPECS + "circles_lines_and_point_pairs", """
        point pair of two points: point_pair_from_points
        points of a pair; its distances and projections are those of the points: point_pair_points
        circle of three points: circle_from_points
        centre and squared radius of a circle: circle_centre circle_radius_squared
        centre and squared radius of a point pair: point_pair_centre point_pair_radius_squared
        plane and axis of a circle: circle_plane circle_axis
        distance of point and line: distance_point_line
    """),
    *rows("cga3", DFM, SPECS + "right_hand_rule", """
        line of two points: line_from_points
        rotation about a line: motor_from_line
        motion of point: move_point
    """),
    *rows("cga3", DFM, SPECS + "motors_about_lines_and_screws", """
        line of point and direction: line_from_point_direction
    """),
    *rows("cga3", DFM, SPECS + "conformal_meets", """
        meet of spheres, imaginary where they are apart: meet_spheres meet_three_spheres
        meet of sphere and plane, line: meet_sphere_plane meet_line_sphere
        meet of circle and plane, sphere: meet_circle_plane meet_circle_sphere
        meet of planes, of line and plane: meet_planes meet_line_plane
    """),
    *rows("cga3", DFM, SPACE + "flats_give_back_what_they_were_made_of", """
        flat point, and back: flat_point_from_point point_from_flat_point
        line of Pluecker coordinates, and back: line_from_direction_moment line_to_direction_moment
        plane of normal and distance, and back: plane_from_normal plane_to_normal
        plane of point and normal: plane_from_point_normal
        plane of point and line: join_point_line
        support point of a line: line_support
        support point of a plane; its distance from a parallel plane is theirs: plane_support
        translation between points: translator_between_points
    """),
    *rows("cga3", DFM, SPACE + "duals_and_their_inverses", """
        dual of line, circle, point pair: line_polarity circle_polarity point_pair_polarity
        direct of a dual: line_from_dual plane_from_dual sphere_from_dual circle_from_dual point_pair_from_dual
        circle of two dual spheres, line of two dual planes: circle_from_dual_spheres
        line as circle, plane as sphere: circle_from_line sphere_from_plane
    """),
    *rows("cga3", DFM, SPACE + "rounds_give_back_centre_direction_and_squared_radius", """
        point pair of centre, direction, squared radius (0 for a tangent vector): point_pair_from_centre
        circle of centre, normal, squared radius (0 for a tangent plane element): circle_from_centre
        sphere of centre and squared radius, imaginary ones too: sphere_from_centre_radius_squared
        normal of circle, direction of point pair: circle_normal point_pair_direction
        weight, orientation: circle_weight point_pair_weight sphere_weight
        line through a point pair: point_pair_line
        surrounding dual sphere: circle_surround_sphere point_pair_surround_sphere
        squared radius of a dual sphere: dual_sphere_radius_squared
    """),
    *rows("cga3", DFM, SPACE + "kinds_of_flat_and_null_rounds", """
        real, tangent, imaginary or flat: point_pair_kind circle_kind sphere_kind
    """),
    *rows("cga3", DFM, SPACE + "tangent_planes_touch", """
        tangent plane: tangent_plane_of_sphere
    """),
    *rows("cga3", VECTORS, SPACE + "distances_from_points", """
        distance of point and sphere, signed (cospherical residual): signed_distance_point_sphere
        distance of point and circle (cocircular residual): distance_point_circle
        projection of point on plane, line: project_point_on_plane project_point_on_line
        projection of point on sphere, circle: project_point_on_sphere project_point_on_circle
    """),
    *rows("cga3", VECTORS, SPACE + "distances_of_lines", """
        distance of lines: distance_lines
        closest points of lines, where they meet: closest_points_of_lines
    """),
    *rows("cga3", VECTORS, SPACE + "distances_that_are_intervals", """
        distance of line and plane, signed: signed_distance_line_plane
        distance of sphere and line, plane: distance_line_sphere distance_plane_sphere
        distance of circle and plane, sphere: distance_plane_circle distance_circle_sphere
        distance of spheres: distance_spheres
    """),
    *rows("cga3", VECTORS, "test_geometry.py::test_" + "half_squares_of_distances_and_their_derivatives", """
        half the squared distance of a point of a circle to another circle, with derivatives: distance_to_circle
    """),
    *rows("cga3", "Newton's method", "test_geometry.py::test_" + "steps_lead_to_the_least_distance_nearby", """
        points of a circle nearest to another circle: least_distances_to_circle
    """),
    *rows("cga3", VECTORS, SPACE + "closest_points_of_lines_and_circles", """
        closest points of line and circle: closest_points_line_circle
    """),
    *rows("cga3", VECTORS, SPACE + "angles", """
        angle of lines, planes, circles: angle_between_lines angle_between_planes angle_between_circles
        angle of line and plane, signed: signed_angle_line_plane
        angle of directions and normals of any two: angle_between_directions
    """),
    *rows("cga3", COXETER, SPACE + "what_conformal_maps_keep", """
        inversive distance: inversive_distance
        angle of spheres, planes: angle_between_dual_spheres
        angle of circle, line and sphere, plane: conformal_sine_circle_sphere
        angle of circles, lines on one sphere; cross-ratio: inner_product_of_circles inner_product_of_point_pairs
        any conformal map of point pair, circle: transform_point_pair transform_circle
    """),
    *rows("cga3", DFM, SPACE + "meets_lie_on_both", """
        meet of three planes: meet_three_planes
        meet of line and circle, of circles: meet_line_circle meet_circles
    """),
    *rows("cga3", DL, SPACE + "kinds_of_meets", """
        how spheres and planes meet (tangent, apart, concentric or parallel, same): meet_dual_spheres_kind
        how circle or line meets sphere or plane: meet_circle_dual_sphere_kind
        how circles and lines meet: meet_circles_kind
        product of versors: even_product
        motor, dilator as a versor: versor_from_motor versor_from_dilator
    """),
    *rows("cga3", ERICSON, SPACE + "first_hits_of_spheres", """
        ray and sphere: hit_ray_sphere
    """),
    *rows("cga3", DFM, SPACE + "inversions_and_reflections_are_those_of_points", """
        inversion in a sphere, reflection in a plane: invert_vector invert_point_pair invert_circle invert_sphere
    """),
    *rows("cga3", DFM, VERSORS + "projections_of_blades", """
        projection of circle, line on sphere, plane: project_circle_on_sphere
    """),
    *rows("cga3", DFM, SPECS + "conformal_versors", """
        product and inverse of motors: motor_product motor_inverse
        translation of a vector, dilation by a factor: translator_from_vector dilator_from_scale
        motor of rotor and translation: motor_from_rotor_translation
        motor to 4 x 4 matrix: motor_to_matrix
        point turned, translated, scaled: rotate_point translate_point dilate_point
        motion of vector, point pair, line: move_vector move_point_pair move_line
        motion of circle, plane, sphere: move_circle move_plane move_sphere
        any conformal map of a vector: transform_vector
    """),
    *rows("cga3", BOOK, SPACE + "versors_of_parts_do_what_parts_do", """
        transversion: transversor_from_vector versor_from_transversor
        factor of a dilation: dilator_to_scale
        decomposition into dilation, rotation, translation, transversion: versor_decomposition
        any conformal map of a point: transform_point
    """),
    *rows("cga3", DFM, VERSORS + "versors_move_objects_as_points", """
        rotor and translation of a motor: motor_to_rotor_translation
        any conformal map of a sphere: transform_sphere
    """),
    *rows("cga3", LASENBY, VERSORS + "versors_between_objects_take_one_to_the_other", """
        motor between lines, planes: motor_between_lines motor_between_planes
        versor between spheres: versor_between_spheres
        versor between circles, and by their duals between point pairs: versor_between_circles
    """),
    *rows("cga3", VALKENBURG, VERSORS + "sums_of_versors_become_versors", """
        nearest versor, mean of versors: normalize_versor
        inverse of a versor: even_reverse
        square root of a versor: versor_square_root
    """),
    *rows("cga3", ROELFS, VERSORS + "exponentials_logarithms_and_powers", """
        rotor of axis and angle: rotor_from_axis_angle
        exponential and logarithm of a motor: motor_exponential motor_logarithm
        root, power, interpolation of motors: motor_square_root motor_power interpolate_motors
        exponential and logarithm of a versor: versor_exponential versor_logarithm
        dual of any element: polarity
    """),
    *rows("cga2", DFM, PLANE + "products_are_consistent", """
        coordinates of a point, weight 1: extract_point normalize_vector
        distance of points: distance_squared_points distance_points
        inner product of dual circles: inner_product_of_vectors
        dual of any element: polarity
    """),
    *rows("cga2", DFM, PLANE + "lines", """
        flat point, and back: flat_point_from_point point_from_flat_point
        line of two points, of point and direction: line_from_points line_from_point_direction
        line of normal and distance, and back: line_from_normal line_to_normal
        dual line of normal and distance: dual_line_from_normal
        bisector of points: bisector_line
        dual of a line, and back: line_polarity line_from_dual
        line as circle: circle_from_line
        direction, support point of a line: line_direction line_support
        real, tangent, imaginary or flat: circle_kind
        reflection of point in line: reflect_point
    """),
    *rows("cga2", DFM, PLANE + "rounds", """
        point of coordinates: embed_point
        point pair of centre, direction, squared radius (0 for a tangent vector): point_pair_from_centre
        circle of centre and squared radius, imaginary ones too: circle_from_centre_radius_squared
        dual of a circle, and back: circle_polarity circle_from_dual
        direction, weight, line of a point pair: point_pair_direction point_pair_weight point_pair_line
    """),
    *rows("cga2", DFM, PLANE + "rounds_through_points", """
        point pair of two points, and back: point_pair_from_points point_pair_points
        circle of three points: circle_from_points
        centre, squared radius, weight (signed area) of a circle: circle_centre circle_radius_squared circle_weight
        real, tangent, imaginary or flat: point_pair_kind
    """),
    *rows("cga2", VECTORS, PLANE + "distances_projections_and_angles", """
        distance of point and line, circle, signed: signed_distance_point_line signed_distance_point_circle
        power of a point: power_of_point
        distance of lines, signed: signed_distance_lines
        distance of circle and line, of circles: distance_line_circle distance_circles
        angle of lines, of circles: angle_between_lines angle_between_dual_circles
        inversive distance: inversive_distance
        projection of point on line, circle: project_point_on_line project_point_on_circle
    """),
    *rows("cga2", DFM, PLANE + "meets_lie_on_both", """
        meet of lines, of line and circle, of circles: meet_lines meet_line_circle meet_circles
    """),
    *rows("cga2", DL, PLANE + "kinds_of_meets", """
        how circles and lines meet (tangent, apart, concentric or parallel, same): meet_dual_circles_kind
        product of versors: even_product
        motor, dilator as a versor: versor_from_motor versor_from_dilator
        motor of rotor and translation: motor_from_rotor_translation
        dilation by a factor: dilator_from_scale
        any conformal map of a vector: transform_vector
    """),
    *rows("cga2", ERICSON, PLANE + "first_hits", """
        ray and circle: hit_ray_circle
    """),
    *rows("cga2", COMPLEX, PLANE + "versors_are_moebius_maps", """
        decomposition into dilation, rotation, translation, transversion: versor_decomposition
        exponential and logarithm of a versor: versor_exponential versor_logarithm
        nearest versor: normalize_versor
        any conformal map of point, point pair, circle: transform_point transform_point_pair transform_circle
        cross-ratio: inner_product_of_point_pairs
    """),
    *rows("cga2", COMPLEX, PLANE + "transversions_are_those_of_complex_numbers", """
        transversion: transversor_from_vector versor_from_transversor
        centre and squared radius of a point pair: point_pair_centre point_pair_radius_squared
    """),
    *rows("cga2", COMPLEX, PLANE + "motors", """
        rotor of an angle, and back: rotor_from_angle rotor_to_angle
        rotation about a point: motor_from_point
        translation of a vector, between points: translator_from_vector translator_between_points
        factor of a dilation: dilator_to_scale
        inverse of a versor: even_reverse
        motion of point, line, circle: move_point move_line move_circle
        circle of centre and radius: circle_from_centre
    """),
    *rows("cga2", COMPLEX, PLANE + "parts_and_powers_of_motors", """
        rotor and translation of a motor: motor_to_rotor_translation
        motor to 3 x 3 matrix: motor_to_matrix
        product and inverse of motors: motor_product motor_inverse
        exponential and logarithm of a motor: motor_exponential motor_logarithm
        root, power, interpolation of motors: motor_square_root motor_power interpolate_motors
        square root of a versor: versor_square_root
    """),
    *rows("cga2", VECTORS, PLANE + "parts_of_rounds_and_simple_motions", """
        inner product of points: inner_product_of_points
        line of point and normal: line_from_point_normal
        dual circle of centre and radius, of centre and point: dual_circle_from_centre dual_circle_through_point
        squared radius of a dual circle: dual_circle_radius_squared
        tangent line: tangent_line_of_circle
        surrounding dual circle of a point pair: point_pair_surround_circle
        point turned, translated, scaled: rotate_point translate_point dilate_point
        motion of vector, point pair: move_vector move_point_pair
    """),
    *rows("cga2", DFM, PLANE + "inversions", """
        inversion in a circle, reflection in a line: invert_point invert_vector invert_point_pair invert_circle
    """),
    *rows("cga2", LASENBY, PLANE + "versors_between_objects", """
        motor between lines: motor_between_lines
        versor between circles, point pairs: versor_between_circles versor_between_point_pairs
    """),
)  # fmt: skip
