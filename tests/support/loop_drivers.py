"""Programs that run kernels with loops, emitted in other languages, on numbers from one file and write another file.

As in `target_drivers`: a driver makes every `LoopCall` in order, reads float64 numbers, argument after argument, and
writes the results as float64. Results and work space begin as NaN.
"""

from __future__ import annotations

import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import prod
from pathlib import Path
from typing import Any

import numpy as np
from loop_examples import element, interpreted, shape_of
from target_drivers import Dialect, main_lines

from gacompiler.ir.procedure import Procedure, Storage, Table

Array = np.ndarray[Any, Any]
THREADS = 6


@dataclass(frozen=True)
class LoopCall:
    """A kernel with loops on a batch."""

    module: str
    procedure: Procedure
    lengths: Mapping[str, int]
    given: Mapping[str, Array]
    """Arguments, with a leading axis if they differ between elements, and index tables."""
    count: int

    @property
    def name(self) -> str:
        return self.procedure.name

    def numbers(self, table: Table) -> int:
        """The number of scalars per element."""
        return prod(shape_of(table, self.lengths))

    def rows(self, table: Table) -> int:
        return prod(self.lengths[name] for name in table.lengths)

    def varies(self, table: Table) -> bool:
        """Whether elements differ in an argument."""
        return bool(self.given[table.name].ndim > len(shape_of(table, self.lengths)))

    @cached_property
    def work(self) -> int:
        """The number of scalars in the work space."""
        return sum(self.numbers(table) for table in self.procedure.of(Storage.WORK) if table.lengths)

    def interpreted(self, real: type) -> list[Array]:
        """Interpret the procedure; an array of shape (count, numbers) for each result."""
        every = [
            interpreted(self.procedure, self.lengths, element(self.procedure, self.lengths, self.given, k), real)
            for k in range(self.count)
        ]
        return [np.stack([np.ravel(one) for one in each]).astype(float) for each in zip(*every, strict=True)]

    def sizes(self) -> list[str]:
        """The lengths as arguments of a call."""
        return [str(self.lengths[name]) for name in self.procedure.lengths]


def is_number(table: Table) -> bool:
    return table.storage is Storage.ARGUMENT and not table.lengths and not table.shape


def run(calls: Sequence[LoopCall], command: Sequence[str], folder: Path) -> list[list[Array]]:
    """Run a driver and return the results of all its calls."""
    arrays = [call.given[table.name].ravel() for call in calls for table in call.procedure.parameters]
    np.concatenate(arrays).astype(float).tofile(folder / "numbers")
    paths = [str(folder / "numbers"), str(folder / "found")]
    done = subprocess.run([*command, *paths], capture_output=True, text=True)
    assert done.returncode == 0, (done.returncode, done.stderr[:3000])
    numbers, found, at = np.fromfile(folder / "found"), list[list[Array]](), 0
    while at < len(numbers):
        call, results = calls[len(found) % len(calls)], []
        for table in call.procedure.results:
            end = at + call.count * call.numbers(table)
            results.append(numbers[at:end].reshape(call.count, -1))
            at = end
        found.append(results)
    return found


def rust_driver(calls: Sequence[LoopCall], modules: Sequence[str]) -> str:
    """All calls in both precisions, one element at a time."""
    lines = [f"mod {module};" for module in modules]
    lines += [
        "trait Number: Copy { fn from_f64(x: f64) -> Self; fn to_f64(self) -> f64; }",
        *(
            f"impl Number for {real} {{ fn from_f64(x: f64) -> Self {{ x as {real} }} "
            "fn to_f64(self) -> f64 { self as f64 } }"
            for real in ("f64", "f32")
        ),
        "struct Data { numbers: Vec<f64>, at: usize, found: Vec<u8> }",
        "#[allow(dead_code)]",
        "impl Data {",
        "    fn scalars<T: Number>(&mut self, n: usize) -> Vec<T> {",
        "        self.at += n;",
        "        self.numbers[self.at - n..self.at].iter().map(|&x| T::from_f64(x)).collect()",
        "    }",
        "    fn rows<T: Number, const K: usize>(&mut self, n: usize) -> Vec<[T; K]> {",
        "        (0..n).map(|_| self.scalars::<T>(K).try_into().ok().unwrap()).collect()",
        "    }",
        "    fn index(&mut self, n: usize) -> Vec<i64> {",
        "        self.scalars::<f64>(n).iter().map(|&x| x as i64).collect()",
        "    }",
        "    fn put<T: Number>(&mut self, x: &[T]) {",
        "        x.iter().for_each(|each| self.found.extend_from_slice(&each.to_f64().to_le_bytes()));",
        "    }",
        "}",
    ]
    for real in ("f64", "f32"):
        for number, call in enumerate(calls):
            lines += [f"fn call_{number}_{real}(data: &mut Data) {{", *_rust_call(call, real), "}"]
        runs = "".join(f" call_{number}_{real}(data);" for number in range(len(calls)))
        lines.append(f"fn run_{real}(data: &mut Data) {{{runs} }}")
    return "\n".join(
        [
            *lines,
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
    )


def _rust_call(call: LoopCall, real: str) -> list[str]:
    lines, passed, puts = list[str](), call.sizes(), list[str]()
    for k, table in enumerate(call.procedure.parameters):
        rows = call.rows(table)
        if table.storage is Storage.INDEX:
            lines.append(f"    let a{k} = data.index({rows} * {table.size});")
            passed.append(f"&a{k}")
            continue
        elements = call.count if call.varies(table) else 1
        form = f"rows::<{real}, {table.size}>" if table.shape else f"scalars::<{real}>"
        lines.append(f"    let a{k} = data.{form}({elements * rows});")
        first = f"i * {rows}" if call.varies(table) else "0"
        if table.lengths:
            passed.append(f"&a{k}[{first}..{first} + {rows}]")
        else:
            passed.append(f"{'&' if table.shape else ''}a{k}[{first}]")
    for k, table in enumerate(call.procedure.results):
        rows = call.rows(table)
        empty = f"[{real}::NAN; {table.size}]" if table.shape else f"{real}::NAN"
        lines.append(f"    let mut r{k} = vec![{empty}; {call.count * rows}];")
        passed.append(f"&mut r{k}[i * {rows}..(i + 1) * {rows}]" if table.lengths else f"&mut r{k}[i]")
        puts.append(f"    r{k}.iter().for_each(|x| data.put({'x' if table.shape else '&[*x]'}));")
    name = f"{call.module}::{call.name}"
    return [
        *lines,
        f"    let mut work = vec![{real}::NAN; {name}_work({', '.join(call.sizes())})];",
        f"    assert_eq!(work.len(), {call.work});",
        f"    for i in 0..{call.count} {{",
        f"        {name}({', '.join([*passed, '&mut work'])});",
        "    }",
        *puts,
    ]


def javascript_driver(calls: Sequence[LoopCall], modules: Sequence[str]) -> str:
    """All calls on arrays of doubles, one element at a time; then again without results or work space."""
    lines = [
        'import { readFileSync, writeFileSync } from "node:fs";',
        *(f'import * as {module} from "./{module}.mjs";' for module in modules),
        "const bytes = readFileSync(process.argv[2]);",
        "const numbers = new Float64Array(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length));",
        "const found = [];",
        "let at = 0;",
        "const take = (n) => numbers.slice((at += n) - n, at);",
        "for (const given of [true, false]) {",
        "  at = 0;",
    ]
    for call in calls:
        passed, results, puts = call.sizes(), list[str](), list[str]()
        lines.append("  {")
        for k, table in enumerate(call.procedure.parameters):
            size = call.numbers(table)
            varies = table.storage is not Storage.INDEX and call.varies(table)
            lines.append(f"    const a{k} = take({size * (call.count if varies else 1)});")
            first = f"i * {size}" if varies else "0"
            passed.append(f"a{k}[{first}]" if is_number(table) else f"a{k}.subarray({first}, {first} + {size})")
        for k, table in enumerate(call.procedure.results):
            size = call.numbers(table)
            lines.append(f"    const r{k} = new Float64Array({call.count * size}).fill(NaN);")
            results.append(f"r{k}.subarray(i * {size}, (i + 1) * {size})")
            puts.append(f"    found.push(r{k});")
        name, one = f"{call.module}.{call.name}", len(results) == 1
        lines += [
            f"    const work = new Float64Array({name}_work({', '.join(call.sizes())})).fill(NaN);",
            f"    if (work.length !== {call.work}) throw new Error(`work space of ${{work.length}}`);",
            f"    for (let i = 0; i < {call.count}; i++) {{",
            f"      if (given) {name}({', '.join([*passed, *results, 'work'])});",
            "      else {",
            f"        const results = {name}({', '.join(passed)});",
            *(
                f"        {target}.set([{'results' if one else f'results[{k}]'}].flatMap((x) => "
                "typeof x === 'number' ? x : Array.from(x)));"
                for k, target in enumerate(results)
            ),
            "      }",
            "    }",
            *puts,
            "  }",
        ]
    lines += ["}", "writeFileSync(process.argv[3], Float64Array.from(found.flatMap((each) => Array.from(each))));"]
    return "\n".join(lines)


@dataclass(frozen=True)
class LoopDialect(Dialect):
    """The differences between the C drivers of two languages, with tables of indices."""

    index: str
    """The type of lengths and index tables."""


def c_driver(calls: Sequence[LoopCall], files: Sequence[str], dialect: LoopDialect) -> str:
    """All calls, once per element and once on the batch with strides: contiguous elements or contiguous components."""
    lines = [
        *dialect.start(files),
        f"static {dialect.index} *take_index(long n)",
        "{",
        f"    {dialect.index} *x = ({dialect.index} *)malloc(n * sizeof *x);",
        f"    for (long i = 0; i < n; i++) x[i] = ({dialect.index})numbers[i];",
        "    numbers += n;",
        "    return x;",
        "}",
    ]
    for real in dialect.precisions:
        lines += [
            f"static {real} *nothing_{real}(long n)",
            "{",
            f"    {real} *x = ({real} *)malloc(n * sizeof *x);",
            "    for (long i = 0; i < n; i++) x[i] = NAN;",
            "    return x;",
            "}",
            f"static {real} *take_{real}(long count, long size)",
            "{",
            f"    {real} *x = nothing_{real}(count * size);",
            f"    for (long i = 0; i < count * size; i++) x[i] = ({real})numbers[i];",
            "    numbers += count * size;",
            "    return x;",
            "}",
            *(_turned_lines(real) if dialect.batch else []),
            f"static void put_{real}({real} *x, long n)",
            "{",
            "    for (long i = 0; i < n; i++) { double y = x[i]; fwrite(&y, sizeof y, 1, found); x[i] = NAN; }",
            "}",
        ]
        for layout in ("one", "rows", "columns"):
            if layout == "one" or dialect.batch:
                for k, call in enumerate(calls):
                    body = _c_call(call, real, dialect, layout)
                    lines += [f"static void call_{k}_{real}_{layout}(void)", "{", *body, "}"]
    runs = []
    for real in dialect.precisions:
        for layout in ("one", "rows", "columns")[: 3 if dialect.batch else 1]:
            runs.append(f"    numbers = start; {' '.join(f'call_{k}_{real}_{layout}();' for k in range(len(calls)))}")
    return "\n".join([*lines, *main_lines(runs)])


def _turned_lines(real: str) -> list[str]:
    """A function that converts a batch with contiguous elements to one with contiguous components."""
    return [
        f"static {real} *turned_{real}({real} *x, long count, long size)",
        "{",
        f"    {real} *y = nothing_{real}(count * size);",
        "    for (long i = 0; i < count; i++)",
        "        for (long k = 0; k < size; k++) y[k * count + i] = x[i * size + k];",
        "    return y;",
        "}",
    ]


def _c_call(call: LoopCall, real: str, dialect: LoopDialect, layout: str) -> list[str]:
    names = {"module": call.module, "kernel": call.name, "suffix": f"f{8 * (4 + 4 * (real == 'double'))}"}
    lines, puts = list[str](), list[str]()
    one, batch = call.sizes(), [str(call.count), *call.sizes()]
    turns = layout == "columns"
    for k, table in enumerate(call.procedure.parameters):
        size = call.numbers(table)
        if table.storage is Storage.INDEX:
            lines.append(f"    {dialect.index} *a{k} = take_index({size});")
            one.append(f"a{k}")
            batch.append(f"a{k}")
            continue
        varies = call.varies(table)
        lines.append(f"    {real} *a{k} = take_{real}({call.count if varies else 1}, {size});")
        if turns and varies:
            lines.append(f"    a{k} = turned_{real}(a{k}, {call.count}, {size});")
        step = size if varies else 0
        one.append(f"a{k}[i * {step}]" if is_number(table) else f"a{k} + i * {step}")
        batch += [f"a{k}", *(("1", str(call.count)) if turns and varies else (str(step), "1"))]
    for k, table in enumerate(call.procedure.results):
        size = call.numbers(table)
        lines.append(f"    {real} *r{k} = nothing_{real}({call.count * size});")
        one.append(f"r{k} + i * {size}")
        batch += [f"r{k}", *(("1", str(call.count)) if turns else (str(size), "1"))]
        turned = f"turned_{real}(r{k}, {size}, {call.count})" if turns else f"r{k}"
        puts.append(f"    put_{real}({turned}, {call.count * size});")
    function = dialect.one.format(**names)
    work = f"{function}_work({', '.join(call.sizes())})"
    lines += [
        f"    if ({work} != {call.work}) abort();",
        f"    {real} *work = nothing_{real}({call.work * (1 if layout == 'one' else THREADS)});",
    ]
    if layout == "one":
        lines += [f"    for (long i = 0; i < {call.count}; i++)", f"        {function}({', '.join([*one, 'work'])});"]
    else:
        strides = ("1", str(THREADS)) if turns else (str(call.work), "1")
        lines.append(f"    RUN_THREADS {dialect.batch.format(**names)}({', '.join([*batch, 'work', *strides])});")
        if call.work:
            # Each thread has written to its own slice only, and a thread without elements to none.
            lines += [
                f"    for (long t = 0; t < {THREADS}; t++) {{",
                "        long written = 0;",
                f"        for (long k = 0; k < {call.work}; k++)",
                f"            written += !isnan(work[t * {strides[0]} + k * {strides[1]}]);",
                f"        if ((written > 0) != (t < {call.count})) abort();",
                "    }",
            ]
    return [*lines, *puts]
