"""panda: kinematics and dynamics with folded constants.

From the table of that name in algorithms.kinematics.

Joint variables are in radians, or in metres for prismatic joints.
"""

from gacompiler import SCALAR, array, kernel, robots
from gacompiler.algebra.catalog import PGA3

ROBOT = robots.Chain(
    kinds=("revolute", "revolute", "revolute", "revolute", "revolute", "revolute", "revolute"),
    parents=(-1, 0, 1, 2, 3, 4, 5),
    axes=(
        (1.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        (0.0, -1.0, 0.0, -0.333, 0.0, 0.0),
        (1.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        (0.0, 1.0, 0.0, 0.649, 0.0, -0.0825),
        (1.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        (0.0, 1.0, 0.0, 1.033, 0.0, 0.0),
        (-1.0, 0.0, 0.0, 0.0, 0.088, 0.0),
    ),
    tip=6,
    tool=(0.0, 0.0, 0.0, -1.0, 0.0, -0.463, 0.0, 0.044),
    inertias=(
        (4.970684, 0.003875, 0.002081, 0.333, 0.70337, -0.000139, 0.006772, 0.70661, 0.019169, 0.009117),
        (0.646926, -0.003141, 0.003495, 0.36172, 0.007962, 0.010254, 0.003925, 0.025995, -0.000704, 0.02811),
        (3.228604, 0.027518, 0.039252, 0.582498, 0.037242, -0.004761, -0.011396, 0.036155, -0.012805, 0.01083),
        (3.587895, 0.02933, -0.027454, 0.753419, 0.025853, 0.001332, 0.007796, 0.028323, -0.008641, 0.019552),
        (1.225946, -0.011953, 0.041065, 0.994563, 0.035549, -0.002117, -0.004037, 0.029474, 0.000229, 0.008627),
        (1.666555, 0.060149, 0.010517, 1.018883, 0.001964, 0.001158, 0.000109, 0.005433, -0.000341, 0.004354),
        (0.735522, 0.098517, 0.004252, 0.971403, 0.012516, 0.000428, 0.001196, 0.010027, -0.000741, 0.004815),
    ),
    gravity=(0.0, 0.0, -9.81),
)
__doc__ = robots.signed(__doc__, ROBOT)
JOINTS = array(SCALAR, 7)


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
