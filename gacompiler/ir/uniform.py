"""Programs in two parts, for batches in which some arguments are the same for every element.

Values that depend only on these arguments are computed once, into one array. The other part runs for each element.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from .cost import Cost, cost
from .program import Argument, Line, Operand, Program, Result
from .verify import verify

MOST = 32
"""Maximum number of arguments and results of a program that is split: a batch loop has one bit for each in a word."""


@dataclass(frozen=True, slots=True)
class Uniform:
    """A kernel split into two programs.

    Attributes
    ----------
    same : tuple of str
        The arguments that are the same for the whole batch.
    prepare : Program
        Computes an array of numbers from these arguments.
    apply : Program
        Computes the results from this array and the other arguments.
    """

    same: tuple[str, ...]
    prepare: Program
    apply: Program

    @property
    def costs(self) -> tuple[Cost, Cost]:
        """The costs per batch and per element."""
        return cost(self.prepare), cost(self.apply)

    def least(self, program: Program) -> int:
        """Return the batch size (at least 2) from which this takes fewer operations than running `program`."""
        once, each = self.costs
        return max(2, 1 + once.total // max(1, cost(program).total - each.total))


def split(program: Program, same: Sequence[str]) -> Uniform | None:
    """Split `program` in two, preserving the order of lines.

    Return None if nothing can be computed in advance, or if `program` has more than `MOST` arguments and results.
    """
    if len(program.arguments) + len(program.results) > MOST:
        return None
    fixed = [argument for argument in program.arguments if argument.name in same]
    rest = [argument for argument in program.arguments if argument.name not in same]
    known = {component for argument in fixed for component in argument.components}
    once, each = [], []
    for line in program.lines:
        if all(not isinstance(operand, str) or operand in known for operand in line.operands):
            known.add(line.target)
            once.append(line)
        else:
            each.append(line)
    operands = [*(o for line in each for o in line.operands), *(o for r in program.results for o in r.operands)]
    used = list(dict.fromkeys(operand for operand in operands if operand in known and isinstance(operand, str)))
    taken = {argument.name for argument in program.arguments} | {result.name for result in program.results}
    name = "prepared"
    while name in taken:
        name += "_"
    suffix = "_".join(same)
    prepare = Program(
        f"{program.name}_prepare_{suffix}", tuple(fixed), tuple(once), (Result(name, (len(used),), tuple(used)),)
    )
    held = Argument(name, (len(used),), tuple(used))
    apply = Program(f"{program.name}_apply_{suffix}", (held, *rest), tuple(each), program.results)
    return Uniform(tuple(same), verify(_pruned(prepare)), verify(apply)) if used else None


def _pruned(program: Program) -> Program:
    """Remove the lines that no result depends on."""
    needed: set[Operand] = {operand for result in program.results for operand in result.operands}
    kept = []
    for line in reversed(program.lines):
        if line.target in needed:
            needed.update(line.operands)
            kept.append(line)
    return Program(program.name, program.arguments, tuple(reversed(kept)), program.results)


def joined(form: Uniform, program: Program) -> Program:
    """Join both parts into one program with the argument names of `program`."""
    components: dict[str, tuple[str, ...]] = {argument.name: argument.components for argument in program.arguments}
    once: dict[Operand, Operand] = {}
    for name, argument in zip(form.same, form.prepare.arguments, strict=True):
        once.update(zip(argument.components, components[name], strict=True))
    first = [Line(f"once_{line.target}", line.op, line.operands) for line in form.prepare.lines]
    once.update((line.target, f"once_{line.target}") for line in form.prepare.lines)
    each: dict[Operand, Operand] = {}
    prepared, *rest = form.apply.arguments
    (held,) = form.prepare.results
    each.update(zip(prepared.components, (once.get(o, o) for o in held.operands), strict=True))
    changing = [argument for argument in program.arguments if argument.name not in form.same]
    for mine, theirs in zip(changing, rest, strict=True):
        each.update(zip(theirs.components, mine.components, strict=True))
    second = [Line(f"each_{line.target}", line.op, line.operands) for line in form.apply.lines]
    each.update((line.target, f"each_{line.target}") for line in form.apply.lines)
    lines = [*(_renamed(line, once) for line in first), *(_renamed(line, each) for line in second)]
    results = [Result(r.name, r.shape, tuple(each.get(o, o) for o in r.operands)) for r in form.apply.results]
    return verify(Program(program.name, program.arguments, tuple(lines), tuple(results)))


def _renamed(line: Line, names: Mapping[Operand, Operand]) -> Line:
    return Line(line.target, line.op, tuple(names.get(operand, operand) for operand in line.operands))
