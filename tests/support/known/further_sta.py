"""Further expressions of space-time algebra, signature ``+ - - -``."""

from gacompiler import commutator, inner_product, kernel, sandwich, scalar_product
from gacompiler.algebra.catalog import STA

VECTOR, BIVECTOR, ROTOR = STA.VECTOR, STA.BIVECTOR, STA.ROTOR
BOOST = STA.layout("BOOST", "1 g10 g20 g30", unit=True)
RAPIDITY = STA.layout("RAPIDITY", "g10 g20 g30")
TIME = STA.multivector({"g0": 1})


@kernel(r=ROTOR, v=VECTOR)
def lorentz_vector(r, v):
    """An event after a Lorentz transformation."""
    return sandwich(r, v)


@kernel(b=BOOST, v=VECTOR)
def boost_vector(b, v):
    """An event after a boost."""
    return sandwich(b, v)


@kernel(r=ROTOR, f=BIVECTOR)
def lorentz_field(r, f):
    """An electromagnetic field after a Lorentz transformation."""
    return sandwich(r, f)


@kernel(b=BOOST, f=BIVECTOR)
def boost_field(b, f):
    """An electromagnetic field after a boost."""
    return sandwich(b, f)


@kernel(f=BIVECTOR)
def field_invariants(f):
    """Both invariants of a field: its square."""
    return f * f


@kernel(r=ROTOR, f=BIVECTOR)
def invariants_of_transformed_field(r, f):
    """Both invariants of a field after a Lorentz transformation."""
    return sandwich(r, f) * sandwich(r, f)


@kernel(f=BIVECTOR, u=VECTOR)
def lorentz_force(f, u):
    """The force on a unit charge of four-velocity `u`."""
    return inner_product(f, u)


@kernel(f=BIVECTOR, n=VECTOR)
def energy_momentum(f, n):
    """The energy-momentum map of a field."""
    return f * n * ~f / 2


@kernel(f=BIVECTOR)
def energy_flow(f):
    """Energy density and Poynting vector for the observer at rest."""
    return f * TIME * ~f / 2


@kernel(a=BOOST, b=BOOST)
def composed_boosts(a, b):
    """Two boosts one after the other: a boost and a rotation."""
    return a * b


@kernel(a=RAPIDITY, b=RAPIDITY)
def thomas_rotation(a, b):
    """The generator of the rotation that two small boosts leave."""
    return commutator(a, b)


@kernel(r=ROTOR, a=VECTOR, b=VECTOR)
def interval_of_transformed_events(r, a, b):
    """The inner product of two events after a Lorentz transformation."""
    return scalar_product(sandwich(r, a), sandwich(r, b))
