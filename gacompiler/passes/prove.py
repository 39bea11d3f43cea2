"""Verification of programs against their definitions at exact random points that satisfy the relations.

If two different rational functions of degree `d` in the parameters of the inputs are compared at a point whose
parameters are uniformly distributed modulo the prime ``2**127 - 1``, the probability that they agree is at most ``d``
divided by the prime (Schwartz 1980, Zippel 1979). It is below 1e-12 for every degree below ``10**26``, and every
program without functions is compared at such a point. Programs with functions, and those of layouts without a rational
parametrisation, are compared at rational points or points with many digits, for which there is no such bound.

A program with branches is first compared with its definition as a polynomial in the inputs and the values of functions.
If both are the same polynomials, they agree at all arguments, and a few points suffice to check the polynomials.
Otherwise, for example if the program relies on relations of its inputs, more points are compared. They take the
branches of conditions that are often met, but not those of an equality or of a limit far from the random numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from random import Random
from typing import Any

import mpmath

from ..algebra.multivector import Multivector
from ..errors import GacError, InexactError, ProofError
from ..frontend.expression import Expression, evaluate
from ..frontend.kernel import Kernel
from ..ir.interpret import Tape
from ..ir.program import Program
from ..ir.scalar import COMMUTATIVE, RING, Op
from ..ir.uniform import joined
from ..rings.decimals import digits, from_decimal, to_decimal
from ..rings.polynomial import Polynomial, PolynomialRing
from ..rings.residues import Residue, residue
from .lower import Slot
from .record import Compilation
from .samples import WORKING_DIGITS, Meaning, samples, to_mpmath, wide_sample
from .truth import Proof, Truth
from .undefined import reason

TOLERANCE_DIGITS = 40
"""Number of digits that must agree for irrational values, out of `WORKING_DIGITS` computed digits."""
_TOLERANCE = mpmath.mpf(10) ** -TOLERANCE_DIGITS
MOST_DIGITS = 16 * WORKING_DIGITS
"""Values that differ are computed again with four times as many digits, up to this number: cancellation of terms that
are large, compared with the result, loses any number of digits."""
EXACT_POINTS, FEW_POINTS, LONG = 5, 2, 5000
"""Number of points for polynomials and fractions; fewer for programs of more than `LONG` lines."""
BRANCH_POINTS = 60
"""Number of points for kernels with branches, so that each branch that is not rare is taken."""
LARGE = 12
"""Exponentials of larger numbers lose too many digits by cancellation. Such points are skipped if there are others."""
QUICK_POINTS = 16
"""Number of points for scripts with branches during compilation; `gac verify` uses `BRANCH_POINTS`."""
IDENTITY_TERMS, IDENTITY_EFFORT = 2_000, 30_000
"""Programs with longer polynomials, or for which more pairs of terms are multiplied, are compared at points only."""

Reader = Callable[..., Sequence[Any]]


def truths(
    kernel: Kernel,
    expressions: Sequence[Expression],
    result_slots: Sequence[Sequence[Slot]],
    program: Program,
    seed: int = 11,
    n: int | None = None,
) -> list[Truth]:
    """Return random points of a kernel and the values of its definition there, where it is defined.

    Parameters
    ----------
    kernel : Kernel
    expressions : sequence of Expression
        The definition: the results of the kernel's function on symbols.
    result_slots : sequence of sequence of Slot
        For each result array, the expression and blade of each entry.
    program : Program
        Its operations and length determine the default number of points.
    seed : int
        The seed of the random points.
    n : int, optional
        The number of points.

    Raises
    ------
    ProofError
        When the definition is undefined at all random points.
    """
    random = Random(seed)
    long = len(program.lines) > LONG
    if n is None:
        n = BRANCH_POINTS if _has_branches(program) else FEW_POINTS if long else EXACT_POINTS
    found: list[Truth] = []
    grows = any(line.op is Op.EXP for line in program.lines)
    for point, values in samples(kernel, expressions, random, 2 * n if grows else n, long):
        found.append(_truth(kernel, expressions, result_slots, point, values))
    if found and not _has_functions(program):
        found += _wide_truths(kernel, expressions, result_slots, random)
    small = [truth for truth in found if grows and all(abs(x) <= LARGE for values in truth.inputs for x in values)]
    if len(small) > 2:
        return small[:n]
    if not found:
        raise ProofError(
            kernel.where,
            f"its definition is undefined at {8 * n} random points",
            remedy=reason(kernel, expressions, random) or "check its domain",
        )
    return found


def _wide_truths(
    kernel: Kernel, expressions: Sequence[Expression], result_slots: Sequence[Sequence[Slot]], random: Random
) -> list[Truth]:
    """Return a point modulo a large prime and the values there, if the definition can be evaluated there."""
    point = wide_sample(kernel, random)
    try:
        values = None if point is None else Meaning(expressions).residues(point)
    except (ArithmeticError, InexactError):
        return []
    return [] if point is None or values is None else [_truth(kernel, expressions, result_slots, point, values)]


def _truth(
    kernel: Kernel,
    expressions: Sequence[Expression],
    result_slots: Sequence[Sequence[Slot]],
    point: Mapping[str, Any],
    values: Sequence[Multivector],
    n_digits: int = WORKING_DIGITS,
) -> Truth:
    with mpmath.workdps(n_digits):  # In mpmath, even negation rounds to the current precision.
        results = tuple(
            tuple(_signed(values[slot.expression].terms.get(slot.blade, 0), slot.sign) for slot in slots)
            for slots in result_slots
        )
    flat = [value for result in results for value in result]
    exact = all(isinstance(v, (int, Fraction, Residue)) for v in [*flat, *point.values()])
    convert = residue if any(isinstance(v, Residue) for v in (*flat, *point.values())) else lambda value: value
    inputs = tuple(tuple(convert(point[name]) for name in parameter.components) for parameter in kernel.parameters)

    def again(n: int) -> Truth:
        more = Meaning(expressions, n).at(point)
        return _truth(kernel, expressions, result_slots, point, more, n)

    return Truth(inputs, results, exact, n_digits, None if exact else again)


def _signed(value: Any, sign: int) -> Any:
    return value if sign > 0 else -value


def _has_functions(program: Program) -> bool:
    return not _FIELD.issuperset([line.op for line in program.lines])


def _has_branches(program: Program) -> bool:
    return not _FIELD.issuperset([line.op for line in program.lines if line.op is not Op.SQRT])


_FIELD = frozenset({*RING, Op.DIVIDE})


def disagreement(reader: Reader, known: Sequence[Truth]) -> str:
    """Return a description of how a function over any ring differs from the definition, or an empty string.

    `reader` takes one flat sequence for each argument and returns the concatenated flat results.
    """
    for number, truth in enumerate(known):
        difference = _difference(reader, truth)
        while difference and truth.again and truth.n_digits < MOST_DIGITS:
            truth = truth.again(4 * truth.n_digits)
            difference = _difference(reader, truth)
        if difference:
            return difference.replace("{number}", str(number))
    return ""


def _difference(reader: Reader, truth: Truth) -> str:
    """Return a description of how a function differs at one point, without the number of the point."""
    expected = [value for result in truth.results for value in result]
    try:
        found = list(read(reader, truth))
    except (ArithmeticError, ValueError, KeyError, NameError, TypeError, IndexError, InexactError) as error:
        return f"fails at point {{number}}: {type(error).__name__}: {error}"
    if len(found) != len(expected):
        return f"returns {len(found)} numbers, expected {len(expected)}"
    for k, (a, b) in enumerate(zip(found, expected, strict=True)):
        if not same(a, b, n_digits=truth.n_digits):
            return f"entry {k} at point {{number}} is {_short(a)}, expected {_short(b)}"
    return ""


def read(reader: Reader, truth: Truth) -> Sequence[Any]:
    """Return the results of `reader` at a point, exactly if possible, else with the digits of `truth`.

    Raises
    ------
    ValueError
        When a result is not a real number.
    """
    if truth.is_exact:
        try:
            return reader(*truth.inputs)
        except InexactError:
            pass
    with mpmath.workdps(truth.n_digits):
        results = reader(*(tuple(map(to_mpmath, values)) for values in truth.inputs))
    if any(isinstance(value, mpmath.mpc) for value in results):
        raise ValueError("a result is not real")
    return results


def same(a: Any, b: Any, scale: Any = 0, n_digits: int = WORKING_DIGITS) -> bool:
    """Return whether two numbers are equal, exactly if both are rational, else to `TOLERANCE_DIGITS` digits.

    The tolerance is relative to 1 plus the larger of ``abs(b)`` and `scale`.
    """
    if isinstance(a, (int, Fraction)) and isinstance(b, (int, Fraction)):
        return a == b
    if isinstance(a, Residue) or isinstance(b, Residue):
        return bool(a == b)
    if not (isinstance(a, mpmath.mpf) and isinstance(b, mpmath.mpf)):
        with mpmath.workdps(n_digits):
            a, b = to_mpmath(a), to_mpmath(b)
    # Differences are exact before they are rounded, so that those of few digits suffice.
    return bool(abs(a - b) <= _TOLERANCE * (1 + max(abs(b), to_mpmath(scale))))


def _short(value: Any) -> str:
    return mpmath.nstr(value, 12) if isinstance(value, mpmath.mpf) else str(value)


def program_reader(program: Program) -> Reader:
    """Return a program as a function of flat sequences."""

    tape = Tape(program)

    def reader(*inputs: Sequence[Any]) -> list[Any]:
        flat = [value for values in inputs for value in values]
        if not any(isinstance(value, mpmath.mpf) for value in flat):
            return tape.run(flat)
        with digits(mpmath.mp.dps):
            return list(map(from_decimal, tape.run(map(to_decimal, flat), to_decimal)))

    return reader


def prove_program(record: Compilation) -> Compilation:
    """Compare the selected program with the author's definition, and record the proof.

    Raises
    ------
    ProofError
        When they differ. This is a defect of the compiler, or a declared relation that the points do not satisfy.
    """
    assert record.trace is not None and record.decision is not None
    definition = record.kernel, record.trace.expressions, record.decision.slots
    programs = [record.program, *(joined(form, record.program) for form in record.uniform)]
    has_branches = _has_branches(record.program)
    quick = QUICK_POINTS if record.kernel.result_names and has_branches else None
    is_for_all = has_branches and are_identities(*definition, programs)
    n = EXACT_POINTS if is_for_all else quick
    try:
        known = truths(*definition, record.program, n=n)
    except ProofError:
        if n == quick:
            raise
        known = truths(*definition, record.program, n=quick)  # A few points may miss a small domain.
    difference = next(filter(None, (disagreement(program_reader(program), known) for program in programs)), "")
    if difference:
        raise ProofError(
            f"kernel {record.kernel.name}", difference, remedy="this is a defect of the compiler, please report it"
        )
    if quick and not is_for_all:
        return record  # A text is verified at more points than these few.
    return replace(record, proof=Proof(tuple(programs), tuple(known), is_for_all))


class _Identities(PolynomialRing):
    """Polynomials in which functions of two arguments that may be exchanged have one form."""

    def atom(self, op: Op, *arguments: Polynomial) -> Polynomial:
        if op is Op.SELECT and arguments[1] == arguments[2]:
            return arguments[1]
        if op in COMMUTATIVE:
            arguments = tuple(sorted(arguments, key=lambda each: each.key))
        return super().atom(op, *arguments)


def are_identities(
    kernel: Kernel,
    expressions: Sequence[Expression],
    result_slots: Sequence[Sequence[Slot]],
    programs: Sequence[Program],
) -> bool:
    """Return whether programs are proved to equal a definition for all inputs, also those that violate relations.

    Values of functions are variables, which are equal if the arguments are equal polynomials. The proof fails for
    programs that rely on relations or on identities of functions, and for long polynomials.
    """
    ring = _Identities(IDENTITY_TERMS, IDENTITY_EFFORT)
    inputs = {name: ring.variable(name) for parameter in kernel.parameters for name in parameter.components}
    try:
        values = evaluate(expressions, inputs, lift=ring.lift)
        wanted = [
            _signed(ring.lift(values[slot.expression].terms.get(slot.blade, 0)), slot.sign)
            for slots in result_slots
            for slot in slots
        ]
        return all(list(map(ring.lift, Tape(each).run(inputs.values(), ring.lift))) == wanted for each in programs)
    except GacError:
        return False
