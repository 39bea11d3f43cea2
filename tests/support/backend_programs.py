"""Programs for the backend tests, built without the frontend, and modules of them on every backend."""

from __future__ import annotations

import importlib.util
import sys
import zlib
from collections.abc import Callable
from fractions import Fraction
from math import prod
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from gacompiler.backends import c_header, c_source, python_source, runtime_files
from gacompiler.backends.module import KernelSource, ModuleSource
from gacompiler.gac_runtime.layout import Layout
from gacompiler.generation.files import write as write_files
from gacompiler.ir.cost import cost
from gacompiler.ir.interpret import interpret
from gacompiler.ir.program import Argument, Line, Program, Result
from gacompiler.ir.scalar import ARITY, LEAVES, Graph, Op, Scalar
from gacompiler.ir.verify import verify
from gacompiler.runtime import load_module

Shape = tuple[int, ...]


def argument(name: str, shape: Shape) -> Argument:
    """An argument whose components are numbered."""
    return Argument(name, shape, tuple(f"{name}_{k}" for k in range(prod(shape))) if shape else (name,))


def traced(
    name: str, shapes: dict[str, Shape], function: Callable[..., Any], results: dict[str, Shape] | None = None
) -> Program:
    """The program of a function of lists of scalars (or scalars) that returns one list, scalar, or a tuple of them."""
    graph = Graph()
    arguments = tuple(argument(key, shape) for key, shape in shapes.items())
    values = [
        [graph.variable(c) for c in part.components] if part.shape else graph.variable(part.components[0])
        for part in arguments
    ]
    returned = function(*values)
    outputs = returned if isinstance(returned, tuple) else (returned,)
    flat = [list(output) if isinstance(output, (list, tuple)) else [output] for output in outputs]
    shapes_out = results or {"out": (len(flat[0]),)}
    lines: dict[int, Line] = {}

    def operand(node: Scalar) -> Any:
        if node.op in LEAVES:
            return node.value
        if node.index not in lines:
            operands = tuple(operand(a) for a in node.arguments)
            lines[node.index] = Line(f"t{len(lines)}", node.op, operands)
        return lines[node.index].target

    final = tuple(
        Result(key, shape, tuple(operand(graph.lift(x)) for x in values_out))
        for (key, shape), values_out in zip(shapes_out.items(), flat, strict=True)
    )
    return verify(Program(name, arguments, tuple(lines.values()), final))


def cross(a: list[Any], b: list[Any]) -> list[Any]:
    """The cross product."""
    return [a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3] for k in range(3)]


def _move_point(m: list[Any], p: list[Any]) -> list[Any]:
    """The rigid motion of a point; the motor has w, b (3), t (3), s."""
    w, b, t, s = m[0], m[1:4], m[4:7], m[7]
    first = [x + y for x, y in zip(cross(b, p), t, strict=True)]
    second = [w * x + y - s * z for x, y, z in zip(first, cross(b, first), b, strict=True)]
    return [x + 2 * y for x, y in zip(p, second, strict=True)]


def _normalize(v: list[Any]) -> tuple[list[Any], Any]:
    squared = v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
    norm = squared.graph.apply(Op.SQRT, squared)
    return [x / norm for x in v], norm


def _matrix_product(a: list[Any], b: list[Any]) -> list[Any]:
    return [
        sum((a[4 * i + k] * b[4 * k + j] for k in range(1, 4)), a[4 * i] * b[j]) for i in range(4) for j in range(4)
    ]


MOVE_POINT = traced("move_point", {"m": (8,), "p": (3,)}, _move_point)
NORMALIZE = traced("normalize", {"v": (3,)}, _normalize, {"unit": (3,), "length": ()})
MATRIX_PRODUCT = traced("matrix_product", {"a": (4, 4), "b": (4, 4)}, _matrix_product, {"out": (4, 4)})
SWAP = traced("swap", {"a": (2,)}, lambda a: [a[1], a[0]])
CONSTANTS = traced("constants", {"x": (2,)}, lambda x: [0, x[0] / 3, -x[1] * 7 / 2, 5, x[0]])
INTERPOLATE = traced(
    "interpolate", {"p": (3,), "q": (3,), "t": ()}, lambda p, q, t: [a + t * (b - a) for a, b in zip(p, q, strict=True)]
)
DISTANCE = traced("distance", {"x": (), "y": ()}, lambda x, y: x * x + y * y, {"out": ()})


def operation(op: Op) -> Program:
    """The program that applies one operation to scalars."""
    names = ("x", "y", "z")[: ARITY[op]]
    arguments = tuple(Argument(name, (), (name,)) for name in names)
    line = Line("t0", op, names)
    return Program(f"one_{op.value}", arguments, (line,), (Result("out", (), ("t0",)),))


OPERATIONS = tuple(operation(op) for op in Op if op not in LEAVES)


def kernel_source(program: Program, **more: Any) -> KernelSource:
    """A kernel with numbered layouts."""
    layouts = tuple(
        (part.name, Layout(f"TEST.{part.name.upper()}", tuple(f"e{k}" for k in range(part.shape[0]))))
        for part in (*program.arguments, *program.results)
        if len(part.shape) == 1
    )
    return KernelSource(program, f"What {program.name} does.\n\nAt length.", layouts, cost(program), **more)


def module_source(name: str, *programs: Program) -> ModuleSource:
    """A module of programs."""
    return ModuleSource(
        name, "Kernels of the tests.", f"gac generate {name}.py", "0" * 64, tuple(map(kernel_source, programs))
    )


def _all_operations() -> Program:
    arguments = tuple(Argument(name, (), (name,)) for name in ("x", "y", "z"))
    operations = [op for op in Op if op not in LEAVES]
    lines = tuple(Line(f"t{k}", op, ("x", "y", "z")[: ARITY[op]]) for k, op in enumerate(operations))
    return Program(
        "all_operations", arguments, lines, (Result("out", (len(lines),), tuple(line.target for line in lines)),)
    )


ALL_OPERATIONS = _all_operations()

ODD_NAMES = Program(
    "odd_names",
    (
        Argument("lambda", (2,), ("I", "t0")),
        Argument("args", (), ("for",)),
        Argument("out", (2,), ("sqrt", "REAL")),
        Argument("i", (), ("n",)),
    ),
    (
        Line("a b", Op.MULTIPLY, ("I", "for")),
        Line("out", Op.SUBTRACT, ("sqrt", "a b")),
        Line("x0", Op.MAXIMUM, ("out", "REAL")),
        Line("_", Op.SELECT, ("n", "x0", Fraction(-1, 3))),
    ),
    (Result("result", (2,), ("_", "t0")), Result("lambda_", (), ("x0",))),
)


def write(module: ModuleSource, folder: Path) -> Path:
    write_files(runtime_files(), folder)
    (folder / f"{module.name}.c").write_text(c_source(module))
    (folder / f"{module.name}.h").write_text(c_header(module))
    (folder / f"{module.name}.py").write_text(python_source(module))
    return folder / f"{module.name}.c"


def bits(results: Any) -> list[bytes]:
    """The bytes of the results, with the sign of NaN removed, because it is not specified."""
    parts = results if isinstance(results, tuple) else (results,)
    return [np.ascontiguousarray(np.where(np.isnan(one), abs(one), one)).tobytes() for one in parts]


def load(path: Path, name: str) -> ModuleType:
    """Import a generated module with the runtime of the compiler."""
    return load_module(path, name)


def load_beside(path: Path, name: str) -> ModuleType:
    """Import a generated module from its folder, with the copy of the runtime in that folder."""
    package = f"_folder_{zlib.crc32(str(path.parent).encode()):08x}"
    folder = sys.modules.setdefault(package, ModuleType(package))
    folder.__path__ = [str(path.parent)]
    spec = importlib.util.spec_from_file_location(f"{package}.{name}", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[f"{package}.{name}"] = module
    spec.loader.exec_module(module)
    return module


def extension_of(module: ModuleType) -> Any:
    """The extension that calls the kernels of a module, or None."""
    runtime = module.Kernel.__module__.rpartition(".")[0]
    return sys.modules[f"{runtime}.extension"].extension


PROGRAMS = (
    MOVE_POINT,
    NORMALIZE,
    MATRIX_PRODUCT,
    SWAP,
    CONSTANTS,
    INTERPOLATE,
    DISTANCE,
    ODD_NAMES,
    ALL_OPERATIONS,
)

MANY = traced(
    "many",
    {f"x{k}": (2,) if k % 2 else () for k in range(7)},
    lambda *x: ([x[0] + x[2] * x[4], x[1][0] * x[3][1] - x[5][0]], x[1][1] * x[6]),
    {"pair": (2,), "number": ()},
)
"""More arguments than a call on one element takes at once."""

INNER = traced("inner", {"a": (3,), "b": (3,)}, lambda a, b: a[0] * b[0] + a[1] * b[1] + a[2] * b[2], {"out": ()})
"""A number of two elements that have an axis."""


BACKENDS = ("c", "numba", "arrays")


def inputs(program: Program, leading: tuple[int, ...] = (), dtype: Any = float, order: Any = "C") -> list[Any]:
    random_numbers = np.random.default_rng(len(program.lines))
    return [
        np.asarray(random_numbers.uniform(0.1, 0.9, (*leading, *argument.shape)), dtype, order=order)
        for argument in program.arguments
    ]


def expected(program: Program, arrays: list[Any]) -> list[np.ndarray[Any, Any]]:
    """The results of the interpreter for float64 components."""
    n_leading = [np.ndim(x) - len(a.shape) for x, a in zip(arrays, program.arguments, strict=True)]
    leading = np.broadcast_shapes(*(np.shape(x)[:n] for x, n in zip(arrays, n_leading, strict=True)))
    flat = {
        argument.name: list(
            np.moveaxis(np.reshape(np.asarray(x, float), (*np.shape(x)[:n], len(argument.components))), -1, 0)
        )
        for argument, x, n in zip(program.arguments, arrays, n_leading, strict=True)
    }
    results = interpret(program, flat, float)
    return [
        np.stack([np.broadcast_to(entry, leading) for entry in results[result.name]], -1).reshape(
            leading + result.shape
        )
        for result in program.results
    ]
