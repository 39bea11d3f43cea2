"""Compositions of Lorentz transformations with products and invariants in space-time algebra."""

from gacompiler import commutator, inner_product, kernel, sandwich, scalar_product
from gacompiler.algebra.catalog import STA

VECTOR, BIVECTOR, ROTOR = STA.VECTOR, STA.BIVECTOR, STA.ROTOR
BOOST = STA.layout("BOOST", "1 g10 g20 g30", unit=True)
TURN = STA.layout("TURN", "1 g12 g13 g23", unit=True)


@kernel(r=ROTOR, a=VECTOR, b=VECTOR)
def area_of_transformed_events(r, a, b):
    """The plane of two events after a Lorentz transformation."""
    return sandwich(r, a) ^ sandwich(r, b)


@kernel(r=ROTOR, f=BIVECTOR, u=VECTOR)
def force_in_moved_frame(r, f, u):
    """The force on a charge after a Lorentz transformation of the field and of the velocity."""
    return inner_product(sandwich(r, f), sandwich(r, u))


@kernel(b=BOOST, f=BIVECTOR)
def invariants_of_boosted_field(b, f):
    """Both invariants of a field after a boost."""
    return sandwich(b, f) * sandwich(b, f)


@kernel(b=BOOST, a=VECTOR, c=VECTOR)
def interval_of_boosted_events(b, a, c):
    """The inner product of two events after a boost."""
    return scalar_product(sandwich(b, a), sandwich(b, c))


@kernel(a=BOOST, b=BOOST, v=VECTOR)
def two_boosts_vector(a, b, v):
    """An event after two boosts."""
    return sandwich(a, sandwich(b, v))


@kernel(b=BOOST, r=TURN, v=VECTOR)
def boost_after_rotation_vector(b, r, v):
    """An event after a rotation and a boost."""
    return sandwich(b, sandwich(r, v))


@kernel(r=TURN, f=BIVECTOR)
def rotated_field(r, f):
    """A field after a rotation."""
    return sandwich(r, f)


@kernel(r=ROTOR, f=BIVECTOR, g=BIVECTOR)
def commutator_of_transformed_fields(r, f, g):
    """The commutator of two fields after a Lorentz transformation."""
    return commutator(sandwich(r, f), sandwich(r, g))


@kernel(r=ROTOR, a=VECTOR, b=VECTOR, c=VECTOR, d=VECTOR)
def volume_of_transformed_events(r, a, b, c, d):
    """The volume that four events span after a Lorentz transformation."""
    return sandwich(r, a) ^ sandwich(r, b) ^ sandwich(r, c) ^ sandwich(r, d)


@kernel(r=TURN, s=TURN, v=VECTOR)
def two_rotations_event(r, s, v):
    """An event after two rotations."""
    return sandwich(r * s, v)


@kernel(f=BIVECTOR, g=BIVECTOR)
def product_of_fields(f, g):
    """The scalar and the pseudoscalar part of the product of two fields."""
    return f * g + g * f
