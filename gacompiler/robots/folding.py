"""Methods of one robot written out on symbols, with constants folded, and called with anything."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

from ..algebra.layout import SCALAR
from ..errors import SpecError
from ..frontend.expression import lift
from ..frontend.kernel import Parameter, array
from ..frontend.rows import Unrolled, leaves_of, like
from ..frontend.traced import Traced
from .chains import Chain
from .constants import with_constants_folded
from .whole_angles import by_whole_angles

Scalars = Sequence[Any]
Rows = tuple[tuple[Any, ...], ...]


@lru_cache(maxsize=64)
def _traced(method: Callable[..., Any], chain: Chain, names: tuple[str, ...]) -> Traced:
    """What a method gives for symbols."""
    symbols = tuple(Parameter(name, array(SCALAR, chain.n_variables)).symbols() for name in names)
    value = _plain(method(chain, *symbols))
    folded = with_constants_folded([lift(leaf) for leaf in leaves_of(value)])
    return Traced(symbols, like(value, with_constants_folded(by_whole_angles(folded))))


def _plain(value: Any) -> Any:
    """Nested tuples with tuples in place of arrays."""
    if isinstance(value, Unrolled):
        return value.elements
    return tuple(map(_plain, value)) if isinstance(value, tuple) else value


def folded(method: Callable[..., Any], chain: Chain, **given: Scalars) -> Any:
    """The value of a method of symbols, for what is given in their place: expressions, symbols of sympy or numbers."""
    return _traced(method, chain, tuple(given))(*map(tuple, given.values()))


def square(chain: Chain, numbers: Unrolled) -> Rows:
    """The rows of a matrix over the variables."""
    n = chain.n_variables
    return tuple(tuple(numbers.elements[k * n : k * n + n]) for k in range(n))


def need(chain: Chain, name: str) -> None:
    """Refuse a chain without what a method is made from."""
    if not getattr(chain, name):
        raise SpecError("a chain", f"no {name}", "one row for each joint")
