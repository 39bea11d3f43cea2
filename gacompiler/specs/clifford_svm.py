"""Steps of sequential minimal optimisation for support vector machines with multivectors, and Clifford-Gabor kernels.

A machine has one variable for each sample and component. `gradient` is the derivative of the objective by the
variables of one component, without the penalty of the tube; `rise` is what has to be added for an increase of a
variable, and `fall` for a decrease. They are `FAR` and its negative for variables at a bound.
"""

import gacompiler as ga
from gacompiler import SCALAR, array, each, kernel, least

FAR = float(2**100)
"""What takes a variable at a bound out of the selection."""

NUMBERS = array(SCALAR, "n")


@kernel(gradient=NUMBERS, gain=NUMBERS, loss=NUMBERS, step=SCALAR, rise=NUMBERS, fall=NUMBERS)
def step_of_pair(gradient, gain, loss, step, rise, fall):
    """Update a gradient after a step of a pair of variables, and select the variable that gains most by an increase.

    Parameters
    ----------
    gradient
        Of all variables of a component.
    gain, loss
        The rows of the Gram matrix of the variable that has been increased, and of the one decreased by as much.
    step
        The increase.
    rise, fall
        For each variable, what is added to its gradient for an increase, and for a decrease.

    Returns
    -------
    gradient
        The new gradient.
    lowest, first
        The least derivative by an increase, and its variable.
    highest
        The greatest derivative by a decrease.
    """
    new = each(lambda g, a, b: g + step * (a - b), gradient, gain, loss)
    lowest, first = least(lambda g, r: g + r, new, rise)
    highest = ga.fold(lambda most, g, f: ga.maximum(most, g + f), -FAR, new, fall)
    return new, lowest, first, highest


@kernel(gradient=NUMBERS, fall=NUMBERS, row=NUMBERS, diagonal=NUMBERS, own=SCALAR, lowest=SCALAR, floor=SCALAR)
def second_of_pair(gradient, fall, row, diagonal, own, lowest, floor):
    """Select the variable whose decrease, with an equal increase of the first one, reduces the objective most.

    Parameters
    ----------
    gradient, fall
        As in `step_of_pair`.
    row, diagonal
        The row of the first variable in the Gram matrix, and the diagonal of the matrix.
    own, lowest
        The diagonal element of the first variable, and its derivative by an increase.
    floor
        The least curvature.

    Returns
    -------
    score, second
        The negative of twice the reduction, and the variable.
    """

    def score(g, f, k, d):
        slope = ga.maximum(g + f - lowest, 0)
        return -slope * slope / ga.maximum(own + d - 2 * k, floor)

    return least(score, gradient, fall, row, diagonal)


@kernel(squares=NUMBERS, phases=NUMBERS, width=SCALAR)
def gabor_values(squares, phases, width):
    """Evaluate Clifford-Gabor kernels ``exp(-width s) (cos p + u sin p)``, with a unit u whose square is -1.

    Parameters
    ----------
    squares, phases
        The squared distances s of samples, and the phases p of their differences.
    width
        The factor of squares.

    Returns
    -------
    real, imaginary
        The scalar part, and the coefficient of u.
    """

    def value(s, p):
        size = ga.exp(-width * s)
        return size * ga.cos(p), size * ga.sin(p)

    return each(value, squares, phases)
