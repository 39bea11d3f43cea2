"""Robots as they are drawn: places of points that their links carry, in Python and in pages of browsers.

The tables are those of `gacompiler.specs.robots`; `owners` is the joint that carries each point.
"""

from gacompiler import SCALAR, array, each, gather, index, kernel, scan
from gacompiler.specs import robots


@kernel(
    q=robots.POSITIONS, parents=robots.PARENTS, **robots.JOINTS, owners=index("v", into="n"),
    points=array(SCALAR, "v", 3, shared=True), **robots.BASE, returns=array(SCALAR, "v", 3),
)  # fmt: skip
def places_of_points(q, parents, variables, ratios, offsets, places, screws, turns, owners, points, base):
    """Compute the places in the world of points in the frames of joints."""
    own = robots.own_poses(q, variables, ratios, offsets, places, screws, turns)
    poses = scan(robots._after, robots._base(q, base), own, parents=parents)

    def place(pose, point):
        return tuple(x + y for x, y in zip(pose.place, robots.rotated(pose.rotor, point), strict=True))

    return each(place, gather(poses, owners), points)
