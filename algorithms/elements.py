"""Elements as arguments of the public functions of chapters, and as their results.

Functions compute with arrays. The decorator `elements` names the layouts of their parameters: elements are converted to
them or refused by name, and the results are elements of the same kind.
"""

from __future__ import annotations

import dataclasses
import functools
import inspect
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ParamSpec, TypeAlias, TypeVar, cast

import numpy as np

from generated.gac_runtime.annotations import Stored
from generated.gac_runtime.arrays import element_of, entries_of
from generated.gac_runtime.arrays import plain as without_element
from generated.gac_runtime.layout import Layout, layout

P = ParamSpec("P")
R = TypeVar("R")
E = TypeVar("E", bound=Stored)
Some: TypeAlias = E | Sequence[E]
"""Elements, or a list of them."""
Layouts = tuple[Layout, ...]

Coefficients: TypeAlias = Any
"""An array of coefficients, or elements of the kind of the arguments: which one depends on the values of a list."""

# As in `generated`, whose modules are not imported here, since most chapters need one or two of them.
MOTOR = (
    layout("PGA3.MOTOR", "1 e12 e13 e23 e01 e02 e03 e0123", unit=True),
    layout("CGA3.MOTOR", "1 e12 e13 e23 e1inf e2inf e3inf e123inf", unit=True),
)
"""Motors by algebra; their coefficients are the same numbers."""
ROTOR = tuple(layout(f"{algebra}.ROTOR", "1 e12 e13 e23", unit=True) for algebra in ("VGA3", "PGA3", "CGA3"))
LINE = (layout("PGA3.LINE", "e12 e13 e23 e01 e02 e03"),)
PLANE = (layout("PGA3.PLANE", "e1 e2 e3 e0"),)
_VERSOR = "1 e12 e13 e23 e10 e20 e30 e1inf e2inf e3inf e0inf e1230 e123inf e120inf e130inf e230inf"
VERSOR = (layout("CGA3.UNIT_EVEN", _VERSOR, unit=True),)
_SQUARE = "1/2*e1*e1 + 1/2*e2*e2 + 1/2*e3*e3"
POINT = (
    layout("PGA3.POINT", "e032 e013 e021", fixed="e123 = 1"),
    layout("CGA3.POINT", "e1 e2 e3", fixed="e0 = 1", implied=f"einf = {_SQUARE}"),
    layout("VGA3.VECTOR", "e1 e2 e3"),
)
"""Points by algebra; their coefficients are coordinates."""
DIRECTION = (layout("PGA3.DIRECTION", "e032 e013 e021"), layout("VGA3.VECTOR", "e1 e2 e3"))


def elements(
    returns: Layouts | Mapping[str, Layouts] | None = None, /, **parameters: Layouts
) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Let a function of arrays take elements for some parameters, and return elements if it got one.

    Parameters
    ----------
    returns : tuple of Layout, or mapping of str to it, optional
        The layouts of the result, or of fields of the result, by algebra; None if it has no coefficients. A result is
        of the algebra of the arguments, or of the first of these if there is none.
    **parameters : tuple of Layout
        The layouts of each parameter, at most one for each algebra. A list of elements is an array of them.

    Returns
    -------
    decorator
        The decorated function raises TypeError, which names the parameter, for elements of other layouts.
    """

    def decorated(function: Callable[P, R]) -> Callable[P, R]:
        places = {name: k for k, name in enumerate(inspect.signature(function).parameters)}

        @functools.wraps(function)
        def run(*args: P.args, **kwargs: P.kwargs) -> R:
            given = {name: args[k] if (k := places[name]) < len(args) else kwargs.get(name) for name in parameters}
            found = {name: element for name, value in given.items() if (element := element_of(value)) is not None}
            if not found:
                return function(*args, **kwargs)
            positional, named = list[Any](args), dict[str, Any](kwargs)
            for name in found:
                array = plain(given[name], name, parameters[name])
                if places[name] < len(args):
                    positional[places[name]] = array
                else:
                    named[name] = array
            result: Any = function(*positional, **named)
            if isinstance(returns, tuple):
                result = restorer(given[next(iter(found))], returns)(result)
            elif returns is not None:
                restored = {name: restorer(given[next(iter(found))], each) for name, each in returns.items()}
                result = dataclasses.replace(result, **{name: f(getattr(result, name)) for name, f in restored.items()})
            return cast(R, result)

        return run

    return decorated


def plain(value: Any, name: str, layouts: Layouts) -> Any:
    """Return the coefficients of an element or of a list of elements, in the layout of their algebra.

    All else is returned unchanged.

    Raises
    ------
    TypeError
        If an element has another layout.
    """
    value, is_list = entries_of(value)
    if is_list:
        return np.stack([plain(each, f"{name}[{k}]", layouts) for k, each in enumerate(value)])
    stored = getattr(value, "stored", None)
    return value if stored is None else without_element(name, value, _of_algebra(layouts, stored[1].algebra))


def restorer(given: Any, layouts: Layouts) -> Callable[[Any], Any]:
    """Return the function that returns coefficients as elements of the kind of `given`, or as they are for arrays."""
    element = element_of(given)
    if element is None:
        return np.asarray
    like, found = element.like, _of_algebra(layouts, element.stored[1].algebra)
    return lambda coefficients: like(found, np.asarray(coefficients))


def _of_algebra(layouts: Layouts, algebra: str) -> Layout:
    return next((each for each in layouts if each.algebra == algebra), layouts[0])
