"""The fastest motion along a path: two passes over the stages of the path (Pham and Pham, 2018).

The square x of the speed along the path and the acceleration u along it are the unknowns of a stage. Each limit of a
joint is ``below + slope x <= u <= above + slope x``. Along a stage of length `step`, x grows by ``2 step u``; from the
end of a stage the next ones can be continued for x between 0 and a bound. The first pass computes these bounds from the
last stage to the first, the second one the largest speeds from the first stage to the last.

No stage is a linear program to be solved by iteration: its largest x is the smallest intersection of a limit from above
with one from below. Since the robot can stand still everywhere, x = 0 fulfils all limits.
"""

from gacompiler import SCALAR, array, fold, kernel, maximum, minimum, scan, select

STAGES = array(SCALAR, "n", "r")
VALUES = array(SCALAR, "n")


HUGE = 2**1000
"""Larger than all squares of speeds."""


def _reach(above, below, slope, other):
    """Return the largest x at which ``below + other x <= above + slope x``, or a huge number."""
    steeper = other - slope
    return select(steeper > 0, (above - below) / select(steeper > 0, steeper, 1), HUGE)


@kernel(above=STAGES, below=STAGES, slopes=STAGES, most=VALUES, steps=VALUES, last=SCALAR, returns=VALUES)
def reachable_speeds(above, below, slopes, most, steps, last):
    """Compute for the start of each stage the largest squared speed from which the path can be followed to its end.

    `most` are bounds of the squared speed at the start of each stage, and `last` the one at the end of the path.
    """

    def stage(after, uppers, lowers, inclines, bound, step):
        fall = -1 / (2 * step)

        def with_row(best, high, low, slope):
            # The next stage must be reached with 0 <= x + 2 step u <= after.
            here = minimum(_reach(-after * fall, low, fall, slope), _reach(high, 0, slope, fall))
            pairs = fold(
                lambda least, other_low, other: minimum(least, _reach(high, other_low, slope, other)),
                here, lowers, inclines,
            )  # fmt: skip
            return minimum(best, pairs)

        return maximum(fold(with_row, bound, uppers, lowers, inclines), 0)

    return scan(stage, last, above, below, slopes, most, steps, reverse=True)


@kernel(above=STAGES, slopes=STAGES, after=VALUES, steps=VALUES, first=SCALAR, returns=(VALUES, VALUES))
def fastest_speeds(above, slopes, after, steps, first):
    """Compute the squared speed at the end of each stage, and the acceleration along it, as large as possible.

    `after` are bounds of the squared speed at the end of each stage, and `first` is the squared speed at the start.
    """

    def stage(state, uppers, inclines, bound, step):
        x, _ = state
        most = fold(
            lambda least, high, slope: minimum(least, high + slope * x), (bound - x) / (2 * step), uppers, inclines
        )
        end = maximum(minimum(x + 2 * step * most, bound), 0)
        return end, most

    return scan(stage, (first, 0), above, slopes, after, steps)
