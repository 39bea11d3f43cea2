"""Wait for the C functions of operations on objects."""

from __future__ import annotations

from collections.abc import Collection

from gacompiler import SCALAR
from gacompiler.algebra.algebra import Algebra
from gacompiler.objects import operators


def wait_for_operators(*algebras: Algebra, names: Collection[str] = ()) -> None:
    """Build the operations of some algebras: those with the given names, or all.

    Those of others that earlier tests of this process have used may be functions of 200 numbers, which take minutes.
    """
    for operator in operators.operators():
        if names and operator.definition.name not in names:
            continue
        if {each.layout.algebra for each in operator.kernel.parameters} <= {*algebras, SCALAR.algebra}:
            operator.wait()
