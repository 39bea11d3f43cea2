"""ur5: kinematics and dynamics with folded constants.

From the table of that name in algorithms.kinematics.

Joint variables are in radians, or in metres for prismatic joints.
"""

from gacompiler import SCALAR, array, kernel, robots
from gacompiler.algebra.catalog import PGA3

ROBOT = robots.Chain(
    kinds=("revolute", "revolute", "revolute", "revolute", "revolute", "revolute"),
    parents=(-1, 0, 1, 2, 3, 4),
    axes=(
        (1.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        (0.0, 1.0, 0.0, 0.089459, 0.0, 0.0),
        (0.0, 1.0, 0.0, 0.089459, 0.0, 0.425),
        (0.0, 1.0, 0.0, 0.089459, 0.0, 0.81725),
        (-1.0, 0.0, 0.0, 0.10915, -0.81725, 0.0),
        (0.0, 1.0, 0.0, -0.005191, 0.0, 0.81725),
    ),
    tip=5,
    tool=(
        0.7071067811865476,
        0.0,
        0.0,
        -0.7071067811865475,
        0.288941508462353,
        0.06952309227965195,
        -0.0658525009785126,
        -0.28894150846235295,
    ),
    inertias=(
        (3.7, 0.0, -0.00193, 0.063849, 0.010267495893, 0.0, 0.0, 0.010267495893, 0.0, 0.00666),
        (8.393, -0.2125, -0.11336, 0.089459, 0.0151074, 0.0, 0.0, 0.22689067591, 0.0, 0.22689067591),
        (2.33, -0.66725, -0.0265, 0.089459, 0.004095, 0.0, 0.0, 0.049443313556, 0.0, 0.049443313556),
        (1.219, -0.81725, -0.10735, 0.073119, 0.111172755531, 0.0, 0.0, 0.21942, 0.0, 0.111172755531),
        (1.219, -0.81725, -0.12549, -0.006991, 0.111172755531, 0.0, 0.0, 0.111172755531, 0.0, 0.21942),
        (0.1897, -0.81725, -0.190291, -0.005191, 0.0171364731454, 0.0, 0.0, 0.033822, 0.0, 0.0171364731454),
    ),
    gravity=(0.0, 0.0, -9.81),
)
__doc__ = robots.signed(__doc__, ROBOT)
JOINTS = array(SCALAR, 6)


@kernel(q=JOINTS, returns=PGA3.MOTOR)
def forward(q):
    """The pose of the end effector: the unit motor from its frame to the base frame."""
    return robots.forward(ROBOT, q)


@kernel(q=JOINTS, returns=array(SCALAR, 6, ROBOT.n_variables))
def jacobian(q):
    """The geometric Jacobian of the end effector: angular over linear velocity, in the base frame."""
    return robots.jacobian(ROBOT, q)


@kernel(q=JOINTS, qd=JOINTS, qdd=JOINTS, returns=JOINTS)
def inverse_dynamics(q, qd, qdd):
    """The joint forces and torques for given accelerations, including gravity."""
    return robots.inverse_dynamics(ROBOT, q, qd, qdd)


@kernel(q=JOINTS, returns=JOINTS)
def gravity(q):
    """The joint forces and torques that balance gravity."""
    return robots.gravity(ROBOT, q)


@kernel(q=JOINTS, returns=array(SCALAR, ROBOT.n_variables, ROBOT.n_variables))
def mass_matrix(q):
    """The symmetric mass matrix."""
    return robots.mass_matrix(ROBOT, q)
