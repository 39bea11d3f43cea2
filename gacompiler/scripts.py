"""Gaalop scripts that can be called with numbers."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import Any

from .algebra.algebra import Algebra
from .cluscript import Script, read_script
from .frontend.expression import Expression
from .runtime import compile


@dataclass(frozen=True, eq=False)
class CallableScript(Script):
    """A script that is compiled on its first call with numbers or arrays as keyword arguments.

    The result is a named tuple of arrays. A script is also a kernel; see `gacompiler.cluscript.Script`.
    """

    def __call__(self, /, *arguments: Any, **named: Any) -> Any:
        if any(isinstance(argument, Expression) for argument in (*arguments, *named.values())):
            return super().__call__(*arguments, **named)
        return compile(self)(*arguments, **named)

    @cached_property
    def layouts(self) -> Any:
        """The layouts of the results by name. Access compiles the script."""
        return compile(self).layouts


def read_cluscript(
    text: str, algebra: str | Path | Algebra | None = None, name: str = "script", file: str = ""
) -> CallableScript:
    """Read a Gaalop script.

    Parameters
    ----------
    text : str
        The script.
    algebra : str, Path or Algebra
        A name (``cga``, ``cga3``, ``3dpga``), a folder with a ``definition.csv`` of the user, or an algebra. Can be
        omitted if the script defines it (``DefVarsN3();``).
    name : str
        The name of the generated function.
    file : str, optional
        The name of the script in messages.

    Returns
    -------
    CallableScript
        A function of the free identifiers of the script, scalars or arrays given by keyword. The result is a named
        tuple in the order of the output marks. Each field is an array over the blades of its layout, or an array of
        scalars.

    Raises
    ------
    ScriptError
        If the script cannot be read. The error has the attributes `line` and `column`.
    SpecError
        If the algebra does not exist.

    Examples
    --------
    >>> script = read_cluscript("?d = (x*e1 + y*e2) . (x*e1 + y*e2);", "2d")
    >>> script.inputs, script.outputs
    (('x', 'y'), ('d',))
    >>> float(script(x=3.0, y=4.0).d)
    25.0
    """
    script = read_script(text, algebra, name, file)
    return CallableScript(*(getattr(script, field.name) for field in fields(script)))
