"""Kernels of a chart: the equation of its geodesics, and their integration in a loop."""

from __future__ import annotations

from typing import Any

import sympy

from ..algebra.layout import SCALAR
from ..errors import AlgebraError
from ..frontend.kernel import Kernel, Parameter, array
from ..frontend.loops import scan
from ..symbolic import symbols, to_kernel
from .coordinates import Chart


def geodesic_rates(chart: Chart, *constants: Any, name: str = "geodesic_rates") -> Kernel:
    """Return the kernel of the equation of geodesics, ``u_k'' = -Gamma^k_ij u_i' u_j'``.

    Parameters
    ----------
    chart : Chart
    *constants : Symbol
        The symbols of the metric that are not coordinates, such as a mass.
    name : str

    Returns
    -------
    Kernel
        Its arguments are the coordinates ``r``, ..., their rates ``dr``, ..., and the constants. The results are the
        rates of the coordinates, and the rates of these rates, by an affine parameter such as proper time. It can be
        compiled, and called in other kernels.

    Raises
    ------
    AlgebraError
        If the metric has a symbol that is neither a coordinate nor one of the constants.
    """
    rates = _rates(chart, constants)
    n = len(rates)
    second = [
        -sympy.Add(*(chart.christoffel[k, i, j] * rates[i] * rates[j] for i in range(n) for j in range(n)))
        for k in range(n)
    ]
    summary = "The rates of the coordinates of a geodesic, and the rates of these rates."
    return to_kernel((*rates, *second), *chart.parameters, *rates, *constants, name=name, summary=summary)


def geodesic(chart: Chart, *constants: Any, name: str = "geodesic") -> Kernel:
    """Return the kernel that integrates geodesics by the classical method of Runge and Kutta, in a loop.

    Parameters
    ----------
    chart : Chart
    *constants : Symbol
        The symbols of the metric that are not coordinates, such as a mass.
    name : str

    Returns
    -------
    Kernel
        Its arguments are the coordinates ``r``, ..., their rates ``dr``, ..., the constants, and an array ``steps`` of
        increments of the affine parameter. The results are arrays: the coordinates and rates after every step. The
        error is proportional to the fourth power of the step. NaN results where the metric is singular.

    Raises
    ------
    AlgebraError
        If the metric has a symbol that is neither a coordinate nor one of the constants.

    Examples
    --------
    >>> import numpy as np
    >>> import gacompiler
    >>> theta, phi = symbols("theta phi")
    >>> sphere = Chart.of_metric([1, sympy.sin(theta) ** 2], theta, phi)
    >>> walk = gacompiler.compile(geodesic(sphere))
    >>> latitude, *_ = walk(np.pi / 2, 0.0, 1.0, 0.5, np.full(8, 0.125))
    >>> latitude.shape
    (8,)
    """
    rates = geodesic_rates(chart, *constants, name=f"{name}_rates")
    n = len(chart.parameters)

    def function(*arguments: Any) -> Any:
        start, given, steps = arguments[: 2 * n], arguments[2 * n : -1], arguments[-1]

        def step(state: Any, h: Any) -> Any:
            def moved(slope: Any, factor: Any) -> Any:
                return [x + factor * each for x, each in zip(state, slope, strict=True)]

            first = rates(*state, *given)
            second = rates(*moved(first, h / 2), *given)
            third = rates(*moved(second, h / 2), *given)
            fourth = rates(*moved(third, h), *given)
            slopes = zip(state, first, second, third, fourth, strict=True)
            return tuple(x + h / 6 * (a + 2 * b + 2 * c + d) for x, a, b, c, d in slopes)

        return scan(step, start, steps)

    function.__name__ = name
    parameters = (*(Parameter(each.name, SCALAR) for each in rates.parameters), Parameter("steps", array(SCALAR, "n")))
    summary = "The coordinates and rates of a geodesic after every step of its affine parameter."
    return Kernel(name, function, parameters, None, summary)


def _rates(chart: Chart, constants: tuple[Any, ...]) -> list[Any]:
    names = {symbol.name for symbol in (*chart.parameters, *constants)}
    unknown = sorted(str(s) for s in chart.metric.free_symbols if s not in {*chart.parameters, *constants})
    if unknown:
        raise AlgebraError(
            "geodesic()", f"the metric contains {' '.join(unknown)}", "coordinates and the constants that are passed",
            f"pass {' '.join(unknown)} as constants, or substitute numbers",
        )  # fmt: skip
    rates = [symbols(f"d{parameter.name}") for parameter in chart.parameters]
    if names & {rate.name for rate in rates}:
        raise AlgebraError(
            "geodesic()", f"symbols {' '.join(sorted(names))}", "no symbol with the name of a rate, d..."
        )
    return rates
