"""The entries of the toolkit for any two kinds of objects, fits, surfaces, and subspaces of any dimension."""

from __future__ import annotations

from toolkit_table import rows

VECTORS = "definition, vector algebra"
VRANEK = "Vranek, *Journal of Graphics Tools* 7:23-32, 2002"
DORST = "Dorst, *Journal of Mathematical Imaging and Vision* 50:214-234, 2014"
PEARSON = "Pearson, *Philosophical Magazine* 2:559-572, 1901"
LASENBY = "Lasenby, Hadfield and Lasenby, *Advances in Applied Clifford Algebras* 29:102, 2019"
BOOK = "Bayro-Corrochano, *Geometric Computing*, 2010, ch. 6"
FONTIJNE = "Fontijne, *Efficient Implementation of Geometric Algebra*, 2007, ch. 5"
DFM = "Dorst, Fontijne and Mann, *Geometric Algebra for Computer Science*, 2007, ch. 21"
ROELFS = "Roelfs and De Keninck, *Graded Symmetry Groups*, 2023"

GEOMETRY, SUBSPACES = "test_geometry.py::test_", "test_subspaces.py::test_"
ROUNDS = "test_geometry_rounds.py::test_"
VERSORS, BIVECTORS = "test_subspaces_versors.py::test_", "test_subspaces_bivectors.py::test_"

ENTRIES = (
    *rows("cga3", VECTORS, GEOMETRY + "points_of_circles", """
        point of a circle at an angle: point_on_circle
    """),
    *rows("cga3", VECTORS, GEOMETRY + "distances_of_circles_are_those_of_nearest_points", """
        circle in the frame of a circle: circle_relative_to_circle
    """),
    *rows("cga3", VECTORS, GEOMETRY + "parallel_planes", """
        distance of planes, signed: signed_distance_planes
    """),
    *rows("geometry", VECTORS, GEOMETRY + "distances_are_least", """
        distance of any two kinds: distance
    """),
    *rows("geometry", VECTORS, GEOMETRY + "angles_of_kinds", """
        angle of any two kinds that have one: angle
    """),
    *rows("geometry", VECTORS, GEOMETRY + "meets_lie_on_both", """
        meet of any two kinds, and how they meet: meet
    """),
    *rows("geometry", VECTORS, GEOMETRY + "projections_of_kinds", """
        projection of one kind on another: project
    """),
    *rows("geometry", VRANEK, GEOMETRY + "distances_of_circles_are_those_of_nearest_points", """
        closest points and distance of circles in space: nearest_on_circles
    """),
    *rows("geometry", VECTORS, GEOMETRY + "similarities_take_rounds_to_rounds", """
        rotation, dilation and translation between rounds of one kind: similarity_between
    """),
    *rows("cga2", VECTORS, GEOMETRY + "similarities_take_rounds_to_rounds", """
        rotation, dilation and translation between rounds: similarity_between_rounds
    """),
    *rows("cga3", VECTORS, GEOMETRY + "similarities_between_centres", """
        rotation, dilation and translation between rounds: similarity_between_rounds
    """),
    *rows("geometry", LASENBY, GEOMETRY + "versors_between_objects_of_every_kind", """
        versor between two objects of any kind: versor_between
    """),
    *rows("geometry", PEARSON, GEOMETRY + "fits_of_noisy_points_are_least_squares", """
        plane, line nearest to points: fit_plane fit_line
    """),
    *rows("geometry", DORST, GEOMETRY + "fits_of_noisy_points_are_least_squares", """
        circle, sphere nearest to points: fit_circle fit_sphere
    """),
    *rows("geometry", VECTORS, ROUNDS + "with_noise_no_fit_is_better", """
        cylinder, cone nearest to points: fit_cylinder fit_cone
    """),
    *rows("geometry", VECTORS, ROUNDS + "rays_through_a_convex_hull", """
        first hit of a ray on a mesh: hit_mesh
    """),
    *rows("geometry", BOOK, "test_stereographic.py::test_round_trip", """
        stereographic projection from a sphere, and back: stereographic_projection inverse_stereographic_projection
    """),
    *rows("geometry", BOOK, GEOMETRY + "cycloidal_curves", """
        epicycloids, hypocycloids, trochoids, ellipses: cycloidal_curve
    """),
    *rows("geometry", BOOK, GEOMETRY + "ruled_surfaces_satisfy_their_equations", """
        cone about an axis, over any curve: cone cone_over
        hyperboloid of one sheet: hyperboloid
        helicoid: helicoid
        conoid: conoid
        ellipsoid: ellipsoid
    """),
    *rows("geometry", BOOK, GEOMETRY + "conics_are_sections_of_cones", """
        conic as a section of a cone, and its type: conic conic_type
    """),
    *rows("geometry", BOOK, GEOMETRY + "spheres_meet_cones", """
        curve in which a sphere meets a cone: sphere_cone_curve
    """),
    *rows("subspaces", FONTIJNE, SUBSPACES + "factors_give_the_blade_back", """
        factors of a blade, orthonormal: factorize_blade
        factors of a blade, fast form: reduced_factors
    """),
    *rows("subspaces", FONTIJNE, SUBSPACES + "dimensions_and_subspaces_of_join_and_meet", """
        join and meet with a tolerance, dimensions up to 16: join_and_meet
    """),
    *rows("subspaces", FONTIJNE, SUBSPACES + "where_the_join_is_everything_the_meet_is_the_regressive_product", """
        meet of blades: meet
    """),
    *rows("subspaces", FONTIJNE, SUBSPACES + "join_and_meet_of_exact_blades", """
        join of blades: join
    """),
    *rows("subspaces", DFM, SUBSPACES + "delta_products_of_exact_blades", """
        delta product: delta_product
    """),
    *rows("subspaces", DFM, SUBSPACES + "duals_of_exact_blades", """
        complement, metric dual: dual polarity
    """),
    *rows("subspaces", DFM, SUBSPACES + "metric_factors_are_orthogonal", """
        factors orthogonal in a metric: metric_factors
    """),
    *rows("subspaces", DFM, SUBSPACES + "thirty_dimensions", """
        blade as its factors, up to 30 dimensions: FactoredBlade
        outer product, also of factors: outer_product
    """),
    *rows("subspaces", DFM, VERSORS + "thirty_dimensions", """
        versor as reflections, up to 30 dimensions: FactoredVersor
    """),
    *rows("subspaces", DFM, VERSORS + "versors_are_factorised", """
        reflections of a versor, and its coefficients: factorize_versor versor_coefficients
    """),
    *rows("subspaces", DFM, VERSORS + "reflections_of_rotations", """
        reflections of an orthogonal map: reflections_of
    """),
    *rows("subspaces", DFM, VERSORS + "kinds_of_elements", """
        blade, versor or neither: classify
    """),
    *rows("subspaces", ROELFS, BIVECTORS + "euclidean_bivectors", """
        invariant decomposition of bivectors: split_bivectors
    """),
)  # fmt: skip
