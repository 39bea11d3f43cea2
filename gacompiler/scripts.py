"""Scripts of Gaalop's language that can be called with numbers."""

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
    """A script that is compiled when it is first called with numbers or arrays by name.

    The result is a named tuple of arrays. It is a kernel besides, see `gacompiler.cluscript.Script`.
    """

    def __call__(self, /, *arguments: Any, **named: Any) -> Any:
        if any(isinstance(argument, Expression) for argument in (*arguments, *named.values())):
            return super().__call__(*arguments, **named)
        return compile(self)(*arguments, **named)

    @cached_property
    def layouts(self) -> Any:
        """The layouts of the results by name; asking compiles the script."""
        return compile(self).layouts


def read_cluscript(
    text: str, algebra: str | Path | Algebra | None = None, name: str = "script", file: str = ""
) -> CallableScript:
    """Read a script of Gaalop's language.

    Parameters
    ----------
    text : str
        The script.
    algebra : str, Path or Algebra
        A name (``cga``, ``cga3``, ``3dpga``), a folder with a user's ``definition.csv``, or an algebra. May be left out
        where the script says it itself (``DefVarsN3();``).
    name : str
        Of the generated function.
    file : str, optional
        What messages call the script.

    Returns
    -------
    CallableScript
        Call it with its free identifiers, as scalars or arrays by name; the result is a named tuple in the order of the
        output marks, each field an array over the blades of its layout, or a plain array of scalars.

    Raises
    ------
    ScriptError
        Where the script cannot be read: it knows `line` and `column`.
    SpecError
        When there is no such algebra.

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
