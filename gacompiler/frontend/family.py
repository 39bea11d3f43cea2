"""Families of kernels that several specs share, declared once by a function of an algebra."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from ..errors import KernelError
from .kernel import Kernel, kernel


class Family:
    """A collection of kernels that a function of an algebra declares, by name.

    A module that specs import declares the kernels with `Family.kernel`, as a spec does with `gacompiler.kernel`. A
    spec assigns the kernels that it uses to their own names: ``move_point = motions(PGA2).move_point``.

    Parameters
    ----------
    name : str
        The name of the family in messages.
    **words : str
        The replacement of ``{word}`` in the docstrings of the kernels. Other braces in a docstring are doubled.

    Examples
    --------
    >>> from gacompiler.algebra.catalog import PGA2, PGA3
    >>> def motions(algebra, space):
    ...     family = Family("motions", space=space)
    ...
    ...     @family.kernel(m=algebra.MOTOR, p=algebra.POINT)
    ...     def move_point(m, p):
    ...         '''The point `p` of {space} moved by the unit motor `m`.'''
    ...         return m * p * ~m
    ...
    ...     return family
    >>> motions(PGA2, "the plane").move_point.summary
    'The point `p` of the plane moved by the unit motor `m`.'
    """

    def __init__(self, name: str, **words: str) -> None:
        self._name, self._words = name, words
        self._kernels: dict[str, Kernel] = {}

    def kernel(self, *, returns: Any = None, **parameters: Any) -> Callable[[Callable[..., Any]], Kernel]:
        """Declare the decorated function as a kernel of this family; the arguments are those of `gacompiler.kernel`.

        Raises
        ------
        KernelError
            Under the conditions of `gacompiler.kernel`, or if the family already has a kernel of this name or a word is
            unknown.
        """
        plain = kernel(returns=returns, **parameters)

        def declare(function: Callable[..., Any]) -> Kernel:
            declared = plain(function)
            if declared.name in self._kernels:
                first = self._kernels[declared.name].where
                raise KernelError(
                    declared.where,
                    f"already declared in the family {self._name}, at {first}",
                    remedy="rename one of them",
                )
            if hasattr(Family, declared.name):
                raise KernelError(declared.where, "its name is that of a method of Family", remedy="rename it")
            try:
                summary = declared.summary.format(**self._words)
            except (LookupError, ValueError) as error:
                raise KernelError(
                    declared.where,
                    f"its docstring cannot be formatted: {type(error).__name__}: {error}",
                    f"braces around one of: {', '.join(self._words) or 'no words'}",
                    "double all other braces",
                ) from error
            self._kernels[declared.name] = replace(declared, summary=summary)
            return self._kernels[declared.name]

        return declare

    def __getattr__(self, name: str) -> Kernel:
        kernels: dict[str, Kernel] = self.__dict__.get("_kernels", {})  # empty during unpickling
        if name not in kernels:
            raise AttributeError(f"the family {self.__dict__.get('_name', '')} has no kernel {name}")
        return kernels[name]

    def __eq__(self, other: object) -> bool:
        """Return whether the names, words and kernels of two families are equal."""
        return isinstance(other, Family) and self.__dict__ == other.__dict__

    def __hash__(self) -> int:
        return hash(self._name)  # the rest grows while kernels are declared

    def __repr__(self) -> str:
        return f"Family({self._name}: {' '.join(self._kernels)})"
