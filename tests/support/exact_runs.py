"""Run a kernel with loops in the arithmetic of its arguments, such as integers and fractions."""

from __future__ import annotations

from collections.abc import Mapping
from math import prod
from typing import Any

import numpy as np

from gacompiler.ir.procedure import Procedure
from gacompiler.ir.run_procedure import run_procedure


def run_exactly(procedure: Procedure, given: Mapping[str, Any]) -> list[np.ndarray[Any, Any]]:
    """Interpret a procedure on arrays of objects. Lengths are those of the arrays."""
    lengths: dict[str, int] = {}
    rows: dict[str, Any] = {}
    for table in procedure.parameters:
        values = np.asarray(given[table.name], object)
        lengths.update(zip(table.lengths, values.shape, strict=False))
        rows[table.name] = values.reshape(prod(values.shape[: len(table.lengths)]), table.size).tolist()
    found = run_procedure(procedure, lengths, rows)
    return [
        np.array(found[table.name], object).reshape((*(lengths[name] for name in table.lengths), *table.shape))
        for table in procedure.results
    ]
