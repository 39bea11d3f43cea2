"""Print programs as plain C functions, one line for each operation, with loops that call them for measurements."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from gacompiler.ir.program import Line, Operand, Program
from gacompiler.ir.scalar import Op

BATCHES = "benchmarks/program_c.py"
"""The file with the loops."""

_TEXTS = {
    Op.ADD: "{} + {}", Op.SUBTRACT: "{} - {}", Op.MULTIPLY: "{} * {}", Op.DIVIDE: "{} / {}", Op.NEGATE: "-{}",
    Op.LESS: "{} < {}", Op.LESS_EQUAL: "{} <= {}", Op.EQUAL: "{} == {}", Op.SELECT: "{} ? {} : {}",
    Op.ABS: "fabs({})", Op.FLOOR: "floor({})", Op.MINIMUM: "fmin({}, {})", Op.MAXIMUM: "fmax({}, {})",
}  # fmt: skip

_LOOPS = """\
#include <math.h>
#include <time.h>

typedef void function(const double *, double *);

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return t.tv_sec + 1e-9 * t.tv_nsec;
}

/* The time of calls, each of which depends on all results of the previous one. */
double chained(function *f, int n, int m, long calls) {
    double base[n], in[n], out[m];
    for (int k = 0; k < n; k++) base[k] = in[k] = 0.1 + 0.07 * (k % 11);
    double start = now();
    for (long i = 0; i < calls; i++) {
        f(in, out);
        for (int k = 0; k < n; k++) in[k] = base[k] + 1e-30 * out[k % m];
    }
    return now() - start;
}

/* The time of calls that do not depend on each other. */
double apart(function *f, int n, int m, long calls) {
    double in[n], out[m];
    for (int k = 0; k < n; k++) in[k] = 0.1 + 0.07 * (k % 11);
    double start = now();
    for (long i = 0; i < calls; i++) f(in, out);
    return now() - start;
}
"""


def c_text(programs: Sequence[Program]) -> str:
    """Return a C file with the functions ``program_0``, ``program_1``, ... and the loops."""
    return "\n".join([_LOOPS, *(_function(k, program) for k, program in enumerate(programs))])


def _function(number: int, program: Program) -> str:
    lines = [f"void program_{number}(const double *in, double *restrict out) {{"]
    components = [name for argument in program.arguments for name in argument.components]
    lines += [f"    double v_{name} = in[{k}];" for k, name in enumerate(components)]
    lines += [f"    double v_{line.target} = {_line(line)};" for line in program.lines]
    operands = [operand for result in program.results for operand in result.operands]
    lines += [f"    out[{k}] = {_operand(operand)};" for k, operand in enumerate(operands)]
    return "\n".join([*lines, "}", ""])


def _line(line: Line) -> str:
    operands = [_operand(operand) for operand in line.operands]
    if line.op in _TEXTS:
        return _TEXTS[line.op].format(*operands)
    return f"{line.op.value}({', '.join(operands)})"


def _operand(operand: Operand) -> str:
    if isinstance(operand, Fraction):
        return repr(float(operand)) if operand >= 0 else f"({float(operand)!r})"
    return f"v_{operand}"
