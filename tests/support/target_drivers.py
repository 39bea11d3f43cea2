"""Programs that run kernels emitted in other languages on numbers from one file and write another file.

A driver makes every `Call` in order. It reads float64 numbers, argument after argument, and writes the results, each as
float64. A machine that has the compiler needs no more than this to run the text that is printed.
"""

from __future__ import annotations

import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from math import prod
from pathlib import Path
from typing import Any

import numpy as np

from gacompiler.ir.interpret import Tape, evaluate
from gacompiler.ir.program import Argument, Program, Result
from gacompiler.ir.scalar import Op

Array = np.ndarray[Any, Any]
PRECISIONS = ("double", "float")
FUNCTIONS = {Op.SIN, Op.COS, Op.ATAN2, Op.ACOS, Op.EXP, Op.LOG}
"""Operations whose rounding IEEE 754 does not specify."""


def size(part: Argument | Result) -> int:
    """The number of scalars per element."""
    return prod(part.shape)


@dataclass(frozen=True)
class Call:
    """A kernel on a batch; an array of one element is used for all elements."""

    module: str
    program: Program
    arrays: tuple[Array, ...]
    """One for each argument, (n, size) or (1, size)."""
    by_component: bool = False
    """Whether arrays lie in memory with elements as their last axis."""

    @property
    def n(self) -> int:
        return max(map(len, self.arrays))

    def stored(self) -> list[Array]:
        """The content of the file."""
        return [array.T if self.by_component else array for array in self.arrays]


def interpreted(call: Call, real: type) -> list[Array]:
    """Interpret in one precision, with every operation rounded once; shape (n, size) for each result."""

    def function(op: Op, values: list[Any]) -> Any:
        if op is Op.MINIMUM or op is Op.MAXIMUM:  # the second of two zeros, where numpy specifies nothing
            a, b = values
            return np.where((a < b if op is Op.MINIMUM else a > b) | (a != a), a, b)
        return np.asarray(evaluate(op, values), real)  # comparisons of arrays give doubles

    with np.errstate(all="ignore"):
        columns = [column for array in call.arrays for column in array.astype(real).T]
        flat = iter(Tape(call.program).run_in_double(columns, function))
        results = [[next(flat) for _ in result.operands] for result in call.program.results]
    return [np.stack([np.broadcast_to(np.asarray(x, real), call.n) for x in each], -1) for each in results]


def exact_entries(program: Program) -> list[Array]:
    """For each result, a mask of the numbers that depend on no function whose rounding differs between platforms."""
    rough: set[Any] = set()
    for line in program.lines:
        if line.op in FUNCTIONS or rough.intersection(line.operands):
            rough.add(line.target)
    return [np.array([operand not in rough for operand in result.operands]) for result in program.results]


def run(calls: Sequence[Call], command: Sequence[str], folder: Path) -> Array:
    """Run a driver and return all numbers that it wrote."""
    numbers = folder / "numbers"
    np.concatenate([array.ravel() for call in calls for array in call.stored()]).astype(float).tofile(numbers)
    done = subprocess.run([*command, str(numbers), str(folder / "found")], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[:2000]
    return np.fromfile(folder / "found")


class Found:
    """Read the output of a driver in order."""

    def __init__(self, numbers: Array) -> None:
        self._numbers, self._at = numbers, 0

    def results(self, call: Call) -> list[Array]:
        """The next results of `call`, (n, size) each."""
        arrays = []
        for result in call.program.results:
            end = self._at + call.n * size(result)
            flat, self._at = self._numbers[self._at : end], end
            arrays.append(flat.reshape(-1, call.n).T if call.by_component else flat.reshape(call.n, -1))
        return arrays

    @property
    def is_read(self) -> bool:
        """Whether all numbers have been read."""
        return self._at == len(self._numbers)


def rust_driver(calls: Sequence[Call], modules: Sequence[str]) -> str:
    """All calls over the batch in every precision."""
    lines = [f"mod {module};" for module in modules]
    lines += [
        "trait Number: Copy + Default { fn from_f64(x: f64) -> Self; fn to_f64(self) -> f64; }",
        *(
            f"impl Number for {real} {{ fn from_f64(x: f64) -> Self {{ x as {real} }} "
            "fn to_f64(self) -> f64 { self as f64 } }"
            for real in ("f64", "f32")
        ),
        "struct Data { numbers: Vec<f64>, at: usize, found: Vec<u8> }",
        "impl Data {",
        "    fn scalars<T: Number>(&mut self, n: usize) -> Vec<T> {",
        "        self.at += n;",
        "        self.numbers[self.at - n..self.at].iter().map(|&x| T::from_f64(x)).collect()",
        "    }",
        "    fn arrays<T: Number, const K: usize>(&mut self, n: usize) -> Vec<[T; K]> {",
        "        (0..n).map(|_| self.scalars::<T>(K).try_into().ok().unwrap()).collect()",
        "    }",
        "    fn put<T: Number>(&mut self, x: &[T]) {",
        "        x.iter().for_each(|each| self.found.extend_from_slice(&each.to_f64().to_le_bytes()));",
        "    }",
        "}",
    ]
    for real in ("f64", "f32"):
        lines.append(f"fn run_{real}(data: &mut Data) {{")
        for call in calls:
            lines.append("    {")
            passed = []
            for k, (argument, array) in enumerate(zip(call.program.arguments, call.arrays, strict=True)):
                form = f"arrays::<{real}, {size(argument)}>" if argument.shape else f"scalars::<{real}>"
                lines.append(f"        let a{k} = data.{form}({len(array)});")
                passed.append(f"&a{k}")
            puts = []
            for k, result in enumerate(call.program.results):
                empty = f"[0.0 as {real}; {size(result)}]" if result.shape else f"0.0 as {real}"
                lines.append(f"        let mut r{k} = vec![{empty}; {call.n}];")
                passed.append(f"&mut r{k}")
                puts.append(f"        r{k}.iter().for_each(|x| data.put({'x' if result.shape else '&[*x]'}));")
            lines += [f"        {call.module}::{call.program.name}_batch({', '.join(passed)});", *puts, "    }"]
        lines.append("}")
    lines += [
        "fn main() {",
        "    let paths: Vec<String> = std::env::args().collect();",
        "    let bytes = std::fs::read(&paths[1]).unwrap();",
        "    let numbers = bytes.chunks(8).map(|x| f64::from_le_bytes(x.try_into().unwrap())).collect();",
        "    let mut data = Data { numbers, at: 0, found: vec![] };",
        "    run_f64(&mut data);",
        "    data.at = 0;",
        "    run_f32(&mut data);",
        "    std::fs::write(&paths[2], data.found).unwrap();",
        "}",
    ]
    return "\n".join(lines)


def javascript_driver(calls: Sequence[Call], modules: Sequence[str]) -> str:
    """All calls over the batch, on arrays of doubles and then on arrays of floats."""
    lines = ['import { readFileSync, writeFileSync } from "node:fs";']
    lines += [f'import * as {module} from "./{module}.mjs";' for module in modules]
    lines += [
        "const bytes = readFileSync(process.argv[2]);",
        "const numbers = new Float64Array(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length));",
        "const found = [];",
        "let at = 0;",
        "for (const Real of [Float64Array, Float32Array]) {",
        "  const take = (n) => Real.from(numbers.subarray((at += n) - n, at));",
        "  at = 0;",
    ]
    for call in calls:
        passed = [f"take({array.size})" for array in call.arrays]
        passed += [f"new Real({call.n * size(result)})" for result in call.program.results]
        spread = "..." if len(call.program.results) > 1 else ""
        lines.append(f"  found.push({spread}{call.module}.{call.program.name}_batch({', '.join(passed)}));")
    lines += ["}", "writeFileSync(process.argv[3], Float64Array.from(found.flatMap((each) => Array.from(each))));"]
    return "\n".join(lines)


@dataclass(frozen=True)
class Dialect:
    """The differences between the C drivers of two languages: names, and the text at the top."""

    prelude: str
    one: str
    """A function of one element, from module, kernel, real and suffix."""
    batch: str
    """The same over a batch; empty where it cannot be called."""
    precisions: tuple[str, ...]

    def start(self, files: Sequence[str]) -> list[str]:
        """Return the lines up to the first function: what is included, and the file of numbers and that of results."""
        return [
            *("#include <math.h>", "#include <stdio.h>", "#include <stdlib.h>"),
            self.prelude,
            *(f'#include "{file}"' for file in files),
            "static double *numbers;",
            "static FILE *found;",
        ]


def c_driver(calls: Sequence[Call], files: Sequence[str], dialect: Dialect) -> str:
    """All calls in every precision, once per element and once on the batch with strides; both results are written."""
    lines = dialect.start(files)
    for real in dialect.precisions:
        lines += [
            f"static {real} *take_{real}(long n)",
            "{",
            f"    {real} *x = ({real} *)malloc(n * sizeof *x);",
            f"    for (long i = 0; i < n; i++) x[i] = ({real})numbers[i];",
            "    numbers += n;",
            "    return x;",
            "}",
            f"static void put_{real}({real} *x, long n)",
            "{",
            "    for (long i = 0; i < n; i++) { double y = x[i]; fwrite(&y, sizeof y, 1, found); x[i] = 0; }",
            "}",
        ]
        # One function per call: compilers take many times as long for a single large function.
        for k, call in enumerate(calls):
            lines += [f"static void call_{k}_{real}(void)", "{", *_c_call(call, real, dialect), "}"]
    runs = [
        f"    numbers = start; {' '.join(f'call_{k}_{real}();' for k in range(len(calls)))}"
        for real in dialect.precisions
    ]
    return "\n".join([*lines, *main_lines(runs)])


def main_lines(runs: Sequence[str]) -> list[str]:
    """Return the function that reads all numbers, from `start` on, makes all calls, and writes what they found."""
    return [
        "int main(int n_paths, char **paths)",
        "{",
        "    if (n_paths != 3) return 2;",
        '    FILE *file = fopen(paths[1], "rb");',
        "    fseek(file, 0, SEEK_END);",
        "    long size = ftell(file);",
        "    rewind(file);",
        "    double *start = (double *)malloc(size);",
        "    if (fread(start, 1, size, file) != (size_t)size) return 3;",
        '    found = fopen(paths[2], "wb");',
        *runs,
        "    return fclose(found);",
        "}",
    ]


def _c_call(call: Call, real: str, dialect: Dialect) -> list[str]:
    names = {
        "module": call.module,
        "kernel": call.program.name,
        "real": real,
        "suffix": f"f{8 * (4 + 4 * (real == 'double'))}",
    }
    lines, one, batch, puts = [], [], [f"{call.n}"], []
    parts = [
        (f"a{k}", part, len(array))
        for k, (part, array) in enumerate(zip(call.program.arguments, call.arrays, strict=True))
    ]
    parts += [(f"r{k}", part, call.n) for k, part in enumerate(call.program.results)]  # type: ignore[misc]
    for name, part, count in parts:
        is_input = name.startswith("a")
        total, step = count * size(part), size(part) if count > 1 else 0
        start = f"take_{real}({total})" if is_input else f"({real} *)calloc({total}, sizeof({real}))"
        lines.append(f"    {real} *{name} = {start};")
        one.append(f"{name}[i * {step}]" if is_input and not part.shape else f"{name} + i * {step}")
        batch += [name, *(("1", f"{count}") if call.by_component else (f"{step}", "1"))]
        if not is_input:
            puts.append(f"    put_{real}({name}, {total});")
    if not call.by_component:
        lines += [
            f"    for (long i = 0; i < {call.n}; i++)",
            f"        {dialect.one.format(**names)}({', '.join(one)});",
            *puts,
        ]
    if dialect.batch:
        lines += [f"    THREADS {dialect.batch.format(**names)}({', '.join(batch)});", *puts]
    return lines
