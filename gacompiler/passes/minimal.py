"""Kernels for which an exhaustive search has proved that no program has fewer operations.

The search (``python -m benchmarks minimal``) computes with residues at two points that satisfy the relations of the
inputs. If a program computes a kernel, its values at these points are those of the kernel. The search finds that no
sequence of fewer sums, differences and products of residues, which begins with the inputs, the numbers 1 and 2 and
those of the program at hand, contains the residues of the results. Hence no such program exists. Negations are free, as
in the cost.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from fractions import Fraction
from random import Random

from ..frontend.kernel import Kernel
from ..ir.interpret import Tape
from ..ir.program import Program
from ..ir.scalar import RING
from .minimal_counts import PROVED
from .samples import sample

PRIME = 2**31 - 1
"""The modulus."""
NUMBERS = (1, 2)
"""Numbers that a program may use, in addition to those in the program at hand."""
POINTS = 2
_SEED = 5

Residues = tuple[int, ...]
"""The residues of a value at the points, up to a common sign."""


@dataclass(frozen=True, slots=True)
class Problem:
    """The residues of the inputs with the numbers, and those of the results that differ from them, without repetition.

    Values that differ by their sign only are the same.
    """

    inputs: tuple[Residues, ...]
    results: tuple[Residues, ...]

    @property
    def key(self) -> str:
        """A digest, by which the proved minimum is found."""
        text = repr((sorted(self.inputs), sorted(self.results)))
        return hashlib.sha256(text.encode()).hexdigest()[:16]


def problem(kernel: Kernel, program: Program) -> Problem | None:
    """Return the problem that the programs of a kernel solve, or None if `program` has other operations than + - *."""
    if any(line.op not in RING for line in program.lines):
        return None
    used = {abs(operand) for line in program.lines for operand in line.operands if isinstance(operand, Fraction)}
    constants: list[int | Fraction] = [*NUMBERS, *sorted(used - set(NUMBERS))]
    random, tape = Random(_SEED), Tape(program)
    inputs, results = list[list[int]](), list[list[int]]()
    for _ in range(POINTS):
        values = sample(kernel, random)
        numbers = [values[name] for argument in program.arguments for name in argument.components]
        if not all(isinstance(value, (int, Fraction)) for value in numbers):
            return None
        inputs.append([*map(_residue, numbers), *map(_residue, constants)])
        results.append([_residue(value) for value in tape.run(numbers)])
    given = tuple(dict.fromkeys(up_to_sign(each) for each in zip(*inputs, strict=True)))
    wanted = dict.fromkeys(up_to_sign(each) for each in zip(*results, strict=True))
    return Problem(given, tuple(each for each in wanted if each not in given and any(each)))


def proved_minimum(kernel: Kernel, program: Program) -> int | None:
    """Return the proved minimum of the number of sums, differences and products of a kernel, or None."""
    found = problem(kernel, program)
    return None if found is None else PROVED.get(found.key)


def up_to_sign(value: Residues) -> Residues:
    """Return the residues of a value or of its negative, so that both have the same."""
    return min(value, tuple(-each % PRIME for each in value))


def _residue(value: int | Fraction) -> int:
    return value.numerator * pow(value.denominator, -1, PRIME) % PRIME
