"""Every operation on every backend, and everything that a caller of a generated module can do right or wrong."""

from __future__ import annotations

import importlib.util
import pickle
import random
import re
import shutil
import subprocess
import sys
from fractions import Fraction
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from backend_programs import (
    ALL_OPERATIONS,
    CONSTANTS,
    DISTANCE,
    INTERPOLATE,
    MATRIX_PRODUCT,
    MOVE_POINT,
    NORMALIZE,
    ODD_NAMES,
    OPERATIONS,
    SWAP,
    module_source,
)

from gacompiler.backends import (
    ModuleSource,
    body_is_intact,
    build_library,
    c_functions,
    c_header,
    c_source,
    library_path,
    python_functions,
    python_source,
)
from gacompiler.errors import BackendError
from gacompiler.ir.interpret import interpret
from gacompiler.ir.program import Program
from gacompiler.ir.scalar import Op

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
BACKENDS = ("c", "numba", "arrays")

needs_compiler = pytest.mark.skipif(not shutil.which("gcc"), reason="no gcc on the PATH")


def write(module: ModuleSource, folder: Path) -> Path:
    (folder / f"{module.name}.c").write_text(c_source(module))
    (folder / f"{module.name}.h").write_text(c_header(module))
    (folder / f"{module.name}.py").write_text(python_source(module))
    return folder / f"{module.name}.c"


def load(path: Path, name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def modules(tmp_path_factory: pytest.TempPathFactory) -> dict[str, ModuleType]:
    folder = tmp_path_factory.mktemp("generated")
    c_path = write(module_source("kernels", *PROGRAMS), folder)
    build_library(c_path)
    loaded = {}
    with pytest.MonkeyPatch.context() as patch:
        for name in BACKENDS:
            if name == "c" and not library_path(c_path).exists():
                continue
            patch.setenv("GAC_BACKEND", name)
            loaded[name] = load(folder / "kernels.py", f"kernels_{name}")
    return loaded


@pytest.fixture(params=BACKENDS)
def module(request: pytest.FixtureRequest, modules: dict[str, ModuleType]) -> ModuleType:
    if request.param not in modules:
        pytest.skip("no C compiler")
    return modules[request.param]


def inputs(program: Program, leading: tuple[int, ...] = (), dtype: Any = float, order: Any = "C") -> list[Any]:
    random_numbers = np.random.default_rng(len(program.lines))
    return [
        np.asarray(random_numbers.uniform(0.1, 0.9, (*leading, *argument.shape)), dtype, order=order)
        for argument in program.arguments
    ]


def expected(program: Program, arrays: list[Any]) -> list[np.ndarray[Any, Any]]:
    """What the interpreter gives, on float64 components."""
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


def check(module: ModuleType, program: Program, arrays: list[Any], tolerance: float = 1e-15) -> None:
    found = getattr(module, program.name)(*arrays)
    found = found if isinstance(found, tuple) else (found,)
    for a, b in zip(found, expected(program, arrays), strict=True):
        assert a.shape == b.shape
        np.testing.assert_allclose(a, b, tolerance, tolerance)


# operations


@pytest.mark.parametrize(("dtype", "tolerance"), [(np.float64, 2e-16), (np.float32, 2e-7)])
def test_every_operation_on_every_backend(module: ModuleType, dtype: Any, tolerance: float) -> None:
    for arrays in ([0.4, 0.7, 0.2], [0.7, 0.4, 0.2], [0.5, 0.5, 0.1], [0.0, 0.3, 0.4]):
        arguments = [dtype(x) for x in arrays]
        with np.errstate(divide="ignore"):
            (right,) = expected(ALL_OPERATIONS, arguments)
        found = module.all_operations(*arguments)
        assert found.dtype == dtype
        for k, line in enumerate(ALL_OPERATIONS.lines):
            assert found[k] == pytest.approx(right[k], rel=4 * tolerance, abs=0), line.op
        batch = module.all_operations(*(np.full(9, x) for x in arguments))
        np.testing.assert_allclose(batch, np.tile(found, (9, 1)), 4 * tolerance)


def test_nan_propagates(module: ModuleType) -> None:
    names = [line.op for line in ALL_OPERATIONS.lines]
    for arguments in ((np.nan, 0.5, 0.5), (0.5, np.nan, 0.5)):
        found = dict(zip(names, module.all_operations(*arguments), strict=True))
        for op in (Op.ADD, Op.MULTIPLY, Op.DIVIDE, Op.ATAN2, Op.MINIMUM, Op.MAXIMUM):
            assert np.isnan(found[op]), op
    assert np.isnan(module.normalize(np.zeros(3))[0]).all()


EXACT_POINTS = {
    Op.SQRT: (Fraction(4, 9),), Op.SIN: (0,), Op.COS: (0,), Op.ATAN2: (0, 1), Op.ACOS: (1,), Op.EXP: (0,), Op.LOG: (1,),
}  # fmt: skip


@pytest.mark.parametrize("program", OPERATIONS, ids=lambda program: program.name)
def test_every_operation_is_read_back(program: Program) -> None:
    module = module_source("one", program)
    point = EXACT_POINTS.get(program.lines[0].op, (Fraction(2, 3), Fraction(-5, 7), 3)[: len(program.arguments)])
    right = interpret(program, {name.name: [x] for name, x in zip(program.arguments, point, strict=True)})["out"]
    for functions in (c_functions(c_source(module)), python_functions(python_source(module))):
        assert functions[program.name](*([x] for x in point)) == (right,)


# readers


def exact_point(program: Program, seed: int = 0) -> list[list[Fraction]]:
    numbers = random.Random(seed)
    return [
        [Fraction(numbers.randint(-99, 99), numbers.randint(1, 9)) for _ in argument.components]
        for argument in program.arguments
    ]


@pytest.mark.parametrize(
    "program", [MOVE_POINT, MATRIX_PRODUCT, SWAP, CONSTANTS, INTERPOLATE, DISTANCE, ODD_NAMES], ids=lambda p: p.name
)
def test_text_is_the_program_exactly(program: Program) -> None:
    module = module_source("one", program)
    point = exact_point(program)
    names = [argument.name for argument in program.arguments]
    right = tuple(interpret(program, dict(zip(names, point, strict=True))).values())
    assert c_functions(c_source(module))[program.name](*point) == right
    assert python_functions(python_source(module))[program.name](*point) == right


def mutations(text: str) -> list[str]:
    """The text with one sign, operator, index, operand or comparison changed, at every place where that is possible."""
    places = []
    lines = text.splitlines(keepends=True)
    for k, line in enumerate(lines):
        if line.startswith(("#", "//")) or not re.match(r"\s+\S|.*def |INLINE|WIDE", line):
            continue
        for match in re.finditer(r"(?<= )[-+*/](?= )|\b[a-z]_\d\b|\bt\d+\b|\[\d\]|[<>]", line):
            old = match[0]
            swaps = {"+": "-", "-": "+", "*": "+", "/": "*", "<": ">", ">": "<"}
            new = swaps.get(old) or re.sub(r"\d", lambda digit: str((int(digit[0]) + 1) % 8), old, count=1)
            places.append("".join([*lines[:k], line[: match.start()] + new + line[match.end() :], *lines[k + 1 :]]))
    return places


@pytest.mark.parametrize("language", ["c", "python"])
def test_one_changed_sign_or_operand_is_caught(language: str) -> None:
    module = module_source("one", MOVE_POINT, NORMALIZE)
    text = c_source(module) if language == "c" else python_source(module)
    if language == "python":
        head, tail = text.split("def _move_point(", 1)
        changed = [head + "def _move_point(" + rest for rest in mutations(tail) if "doc=" not in rest.splitlines()[0]]
        changed = [t for t in changed if strip_documentation(t) != strip_documentation(text)]
    else:
        changed = mutations(text)
    assert len(changed) > 200
    functions = c_functions if language == "c" else python_functions
    points = [exact_point(MOVE_POINT, seed) for seed in range(2)]
    names = [argument.name for argument in MOVE_POINT.arguments]
    right = [tuple(interpret(MOVE_POINT, dict(zip(names, point, strict=True))).values()) for point in points]
    unit = tuple(interpret(NORMALIZE, {"v": (2, 3, 6)}).values())
    for wrong in random.Random(1).sample(changed, 100):
        assert not body_is_intact(wrong)
        try:
            found = functions(wrong)
            same = [found["move_point"](*point) for point in points] == right
            same = same and found["normalize"]((2, 3, 6)) == unit
        except Exception:
            continue
        assert not same


def strip_documentation(text: str) -> str:
    return re.sub(r'doc=""".*?"""', "", text, flags=re.DOTALL)


def test_headers_and_bodies() -> None:
    module = module_source("one", MOVE_POINT)
    for text in (c_source(module), c_header(module), python_source(module)):
        first, command, spec, *_ = text.splitlines()
        assert first.endswith("Generated by gacompiler. Do not edit.")
        assert command.endswith("gac generate one.py") and "0" * 64 in spec
        assert body_is_intact(text) and not body_is_intact(text + "\n")
        assert max(map(len, text.splitlines())) <= 120
    assert "-ffp-contract=off" in c_source(module)


def test_a_kernel_may_not_hide_what_the_module_needs() -> None:
    for name in ("abs", "Kernel", "np", "minimum", "kernels"):
        program = Program(name, SWAP.arguments, SWAP.lines, SWAP.results)
        with pytest.raises(BackendError, match=name):
            python_source(module_source("one", program))


# calls


@pytest.mark.parametrize("program", PROGRAMS, ids=lambda program: program.name)
def test_one_element_and_batches(module: ModuleType, program: Program) -> None:
    for leading in ((), (1,), (67,), (3, 5), (0,), (2, 0, 3)):
        for order in ("C", "F"):
            check(module, program, inputs(program, leading, order=order))


def test_single_precision(module: ModuleType) -> None:
    for program in (MOVE_POINT, NORMALIZE, MATRIX_PRODUCT, INTERPOLATE):
        arrays = inputs(program, (67,), np.float32)
        check(module, program, arrays, 2e-6)
        results = getattr(module, program.name)(*arrays)
        assert all(result.dtype == np.float32 for result in (results if isinstance(results, tuple) else (results,)))
        mixed = getattr(module, program.name)(arrays[0].astype(float), *arrays[1:])
        assert all(result.dtype == np.float64 for result in (mixed if isinstance(mixed, tuple) else (mixed,)))


def test_leading_axes_broadcast(module: ModuleType) -> None:
    m, p = inputs(MOVE_POINT, (7, 5))
    check(module, MOVE_POINT, [m[0, 0], p])
    check(module, MOVE_POINT, [m, p[0, 0]])
    check(module, MOVE_POINT, [m[:, :1], p[:1]])
    check(module, MOVE_POINT, [m[0], p])
    check(module, MOVE_POINT, [np.broadcast_to(m[0, 0], (7, 5, 8)), p])
    check(module, MOVE_POINT, [np.asfortranarray(m.reshape(35, 8))[3], np.asfortranarray(p.reshape(35, 3))])


def test_any_strides(module: ModuleType) -> None:
    m, p = inputs(MOVE_POINT, (8, 6))
    check(module, MOVE_POINT, [m[::-1], p[:, ::-1]])
    check(module, MOVE_POINT, [m[::2, ::3], p[1::2, 1::3]])
    check(module, MOVE_POINT, [m[..., ::-1], p[..., ::-1]])
    check(module, MOVE_POINT, [m.swapaxes(0, 1), p.swapaxes(0, 1)])
    wide = np.random.default_rng(0).uniform(size=(8, 6, 11))
    check(module, MOVE_POINT, [wide[..., :8], wide[..., 8:]])
    a, b = inputs(MATRIX_PRODUCT, (9,))
    check(module, MATRIX_PRODUCT, [a.swapaxes(1, 2), b[:, ::-1]])
    check(module, MATRIX_PRODUCT, [np.asfortranarray(a), np.moveaxis(np.moveaxis(b, 0, -1).copy(), -1, 0)])
    packed = np.zeros(4, np.dtype([("pad", "u1"), ("m", float, 8), ("p", float, 3)]))
    packed["m"], packed["p"] = m[0, :4], p[0, :4]
    check(module, MOVE_POINT, [packed["m"], packed["p"]])
    m.flags.writeable = p.flags.writeable = False
    check(module, MOVE_POINT, [m, p])
    check(module, MOVE_POINT, [m[0, 0], p[0, 0]])
    check(module, MOVE_POINT, [m.astype(">f8"), p])


def test_scalars_and_lists(module: ModuleType) -> None:
    p, q, _ = inputs(INTERPOLATE)
    check(module, INTERPOLATE, [p, q, 0.25])
    check(module, INTERPOLATE, [list(p), tuple(q), 1])
    check(module, INTERPOLATE, [[1, 2, 3], [3, 2, 2], np.float64(0.5)])
    check(module, INTERPOLATE, [p, q, np.array([0.25, 0.5])])
    assert module.interpolate(p.astype("f4"), q.astype("f4"), 0.5).dtype == np.float32
    result = module.distance(3.0, 4)
    assert isinstance(result, np.float64) and result == 25.0
    unit, length = module.normalize([3, 0, 4])
    assert isinstance(length, np.float64) and length == 5.0 and unit.shape == (3,)


def test_out_is_written_and_returned(module: ModuleType) -> None:
    for leading in ((), (11,), (3, 4)):
        m, p = inputs(MOVE_POINT, leading)
        for out in (np.empty_like(p), np.empty((*leading, 6))[..., ::2], np.empty(p.shape, order="F")):
            assert module.move_point(m, p, out=out) is out
            np.testing.assert_allclose(out, expected(MOVE_POINT, [m, p])[0], 1e-14)
        (v,) = inputs(NORMALIZE, leading)
        outs = np.empty_like(v), np.empty(leading)
        assert module.normalize(v, out=outs) is outs
        for found, right in zip(outs, expected(NORMALIZE, [v]), strict=True):
            np.testing.assert_allclose(found, right, 1e-14)


def test_out_may_overlap_an_input(module: ModuleType) -> None:
    for leading in ((), (40,)):
        m, p = inputs(MOVE_POINT, leading)
        right = expected(MOVE_POINT, [m, p])[0]
        np.testing.assert_allclose(module.move_point(m, p, out=p), right, 1e-14)
        (a,) = inputs(SWAP, leading)
        right = expected(SWAP, [a])[0]
        np.testing.assert_array_equal(module.swap(a, out=a), right)
    line = np.random.default_rng(0).uniform(size=(41, 2))
    right = expected(SWAP, [line[:-1]])[0]
    np.testing.assert_array_equal(module.swap(line[:-1], out=line[1:]), right)
    right = expected(SWAP, [line[::-1]])[0]
    np.testing.assert_array_equal(module.swap(line[::-1], out=line), right)
    m, p = inputs(MOVE_POINT, (40,))
    right = expected(MOVE_POINT, [m, p[3]])[0]
    np.testing.assert_allclose(module.move_point(m, p[3], out=p), right, 1e-14)


def test_complex_where_the_kernel_is_polynomial(module: ModuleType) -> None:
    m, p = inputs(MOVE_POINT, (5,))
    real, imaginary = expected(MOVE_POINT, [m, p])[0], expected(MOVE_POINT, [m * 0, p])[0]
    found = module.move_point(m + 0j, p + 0j)
    assert found.dtype == complex and imaginary.shape == real.shape
    np.testing.assert_allclose(found, real, 1e-14)
    squares = module.distance(np.array([1j, 2.0]), 0.0)
    np.testing.assert_array_equal(squares, [-1, 4])
    with pytest.raises(TypeError, match=r"normalize.*complex"):
        module.normalize(np.zeros(3, complex))


# wrong calls


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        ((np.zeros(7), np.zeros(3)), ValueError, ["move_point", "argument m", "(7,)", "(..., 8)", "e0 e1"]),
        ((np.zeros(8), np.float64(1)), ValueError, ["argument p", "()", "(..., 3)"]),
        ((np.zeros((4, 8)), np.zeros((5, 3))), ValueError, ["broadcast", "(4, 8)", "(5, 3)"]),
        ((np.zeros(8, int), np.zeros(3)), TypeError, ["argument m", "int64", ".astype(float)"]),
        ((np.zeros(8), np.zeros(3, bool)), TypeError, ["argument p", "bool", ".astype(float)"]),
        ((np.zeros(8), np.zeros(3, object)), TypeError, ["argument p", "object", ".astype(float)"]),
        ((np.zeros(8), np.zeros(3, np.float16)), TypeError, ["float16"]),
        ((np.zeros(8), [[1], [1, 2]]), ValueError, ["argument p"]),
        ((np.zeros(8), "abc"), TypeError, ["argument p"]),
        ((np.zeros(8),), TypeError, ["move_point", "1", "2", "m, p"]),
    ],
)
def test_wrong_arguments(module: ModuleType, arguments: Any, error: Any, words: list[str]) -> None:
    with pytest.raises(error) as caught:
        module.move_point(*arguments)
    for word in words:
        assert word in str(caught.value)
    assert "\n" not in str(caught.value)


def test_wrong_out_writes_nothing(module: ModuleType) -> None:
    m, p = inputs(MOVE_POINT, (4,))
    module.move_point(m[0], p[0])
    frozen = np.zeros((4, 3))
    frozen.flags.writeable = False
    for out, error, word in (
        (np.zeros((5, 3)), ValueError, "(5, 3)"),
        (np.zeros((4, 2)), ValueError, "(4, 3)"),
        (np.zeros((4, 3), np.float32), TypeError, "float32"),
        (np.zeros((4, 3), int), TypeError, "int64"),
        (frozen, ValueError, "read-only"),
    ):
        with pytest.raises(error, match=re.escape(word)):
            module.move_point(m, p, out=out)
        assert not out.any()
    with pytest.raises(TypeError, match="list"):
        module.move_point(m, p, out=out.tolist())
    with pytest.raises(ValueError, match="read-only"):
        module.move_point(m[0], p[0], out=frozen[0])
    with pytest.raises(TypeError, match="unit, length"):
        module.normalize(p, out=np.zeros((4, 3)))


# the module


def test_what_a_module_says(module: ModuleType, modules: dict[str, ModuleType]) -> None:
    assert modules[module.backend] is module
    assert module.kernels == tuple(program.name for program in PROGRAMS)
    assert set(module.kernels) <= set(module.__all__)
    kernel = module.move_point
    assert kernel.name == "move_point" and kernel.signature == "(8),(3)->(3)" == MOVE_POINT.signature
    assert module.matrix_product.signature == "(4,4),(4,4)->(4,4)" and module.distance.signature == "(),()->()"
    assert kernel.cost["mul"] == 21 and kernel.cost["add"] == 18 and kernel.cost["sqrt"] == 0
    layout = kernel.layouts["m"]
    assert layout.name == "TEST.M" and layout.blades[0] == "e0" and layout.fixed == () and not layout.unit
    assert "(..., 8)" in kernel.__doc__ and "21 mul, 18 add" in kernel.__doc__ and "Parameters" in kernel.__doc__
    assert "move_point" in repr(kernel) and "(8),(3)->(3)" in repr(kernel)
    assert pickle.loads(pickle.dumps(kernel)) is kernel
    with pytest.raises((AttributeError, TypeError)):
        layout.name = "other"


def test_jit_in_a_numba_loop(module: ModuleType) -> None:
    import numba

    move, normalize = module.move_point.jit, module.normalize.jit
    m, p = inputs(MOVE_POINT, (6,))
    out, unit, length = np.empty((6, 3)), np.empty((6, 3)), np.empty(6)

    @numba.njit
    def run(m: Any, p: Any, out: Any, unit: Any, length: Any) -> None:
        for k in range(len(p)):
            move(m[k], p[k], out[k])
            normalize(p[k], unit[k], length[k : k + 1])

    run(m, p, out, unit, length)
    np.testing.assert_allclose(out, expected(MOVE_POINT, [m, p])[0], 1e-15)
    np.testing.assert_allclose(length, expected(NORMALIZE, [p])[1], 1e-15)
    one = np.empty(3)
    move(m[0], p[0], one)
    np.testing.assert_array_equal(one, out[0])


def test_what_an_import_loads(modules: dict[str, ModuleType]) -> None:
    folder = Path(str(modules["numba"].__file__)).parent
    code = (
        "import sys, kernels, numpy as np; kernels.swap([1.0, 2.0]) if kernels.backend == 'c' else None; "
        "print(kernels.backend, *[m for m in ('numba', 'sympy', 'pycparser', 'gacompiler') if m in sys.modules])"
    )
    run = subprocess.run([sys.executable, "-c", code], cwd=folder, capture_output=True, text=True, check=True)
    assert run.stdout.split() == (["c"] if "c" in modules else ["numba"])


def test_forced_backends(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(module_source("bare", SWAP), tmp_path)
    monkeypatch.delenv("GAC_BACKEND", raising=False)
    assert load(tmp_path / "bare.py", "bare").backend == "numba"
    monkeypatch.setenv("GAC_BACKEND", "c")
    with pytest.raises(ImportError, match="gac build"):
        load(tmp_path / "bare.py", "bare")
    monkeypatch.setenv("GAC_BACKEND", "fortran")
    with pytest.raises(ImportError, match="fortran"):
        load(tmp_path / "bare.py", "bare")


def test_text_does_not_depend_on_the_hash_seed() -> None:
    code = (
        "from backend_programs import *; from gacompiler.backends import *; import hashlib; "
        "m = module_source('one', MOVE_POINT, NORMALIZE, ALL_OPERATIONS); "
        "print(hashlib.sha256((c_source(m) + c_header(m) + python_source(m)).encode()).hexdigest())"
    )
    path = [str(Path(__file__).parent), str(Path(__file__).parents[1])]
    texts = {
        subprocess.run(
            [sys.executable, "-c", f"import sys; sys.path[:0] = {path!r}; {code}"],
            env={"PYTHONHASHSEED": seed, "PATH": ""},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for seed in ("0", "1")
    }
    assert len(texts) == 1 and len(texts.pop()) == 65


# building


@needs_compiler
def test_c_compiles_without_warnings_and_vectorises(tmp_path: Path) -> None:
    c_path = write(module_source("strict", MOVE_POINT, NORMALIZE, CONSTANTS), tmp_path)
    command = ["gcc", "-std=c17", "-Wall", "-Wextra", "-Werror", "-O3", "-ffp-contract=off", "-fopt-info-vec"]
    run = subprocess.run(
        [*command, "-c", str(c_path), "-o", str(tmp_path / "strict.o")], capture_output=True, text=True
    )
    assert run.returncode == 0, run.stderr[:2000]
    lines = c_path.read_text().splitlines()
    move_point = lines.index(next(line for line in lines if "NAME(move_point_each)" in line))
    loop = next(k for k, line in enumerate(lines) if k > move_point and "for (" in line)
    assert re.search(rf"strict\.c:{loop + 1}:.*loop vectorized", run.stderr + run.stdout)


@needs_compiler
def test_a_c_program_without_python(tmp_path: Path) -> None:
    write(module_source("alone", MOVE_POINT, INTERPOLATE, NORMALIZE), tmp_path)
    (tmp_path / "main.c").write_text("""
#include <stdio.h>
#include "alone.h"

int main(void)
{
    const double m[8] = {1, 0, 0, 0, 0.5, 1, 1.5, 0};
    double p[3] = {1, 2, 3};
    float u[3] = {3, 0, 4}, length[1];
    alone_move_point_f64(m, p, p);
    alone_interpolate_f64(p, p, 0.5, p);
    alone_normalize_f32(u, u, length);
    printf("%g %g %g %g %g\\n", p[0], p[1], p[2], (double)u[0], (double)length[0]);
    return 0;
}
""")
    command = ["gcc", "-std=c17", "-Wall", "-Wextra", "-Werror", "-O1", "main.c", "alone.c", "-o", "alone", "-lm"]
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
    run = subprocess.run([tmp_path / "alone"], capture_output=True, text=True, check=True)
    m, p = [1, 0, 0, 0, 0.5, 1, 1.5, 0], [1, 2, 3]
    x, y, z = interpret(MOVE_POINT, {"m": m, "p": p}, float)["out"]
    assert [float(word) for word in run.stdout.split()] == pytest.approx([x, y, z, 0.6, 5])


def test_no_compiler_is_not_an_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    c_path = write(module_source("bare", SWAP), tmp_path)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)
    assert build_library(c_path) is None
    assert sorted(path.name for path in tmp_path.iterdir()) == ["bare.c", "bare.h", "bare.py"]


@needs_compiler
def test_a_failed_build_leaves_nothing(tmp_path: Path) -> None:
    c_path = write(module_source("bare", SWAP), tmp_path)
    good = build_library(c_path)
    assert good is not None and good.exists() and build_library(c_path) == good
    c_path.write_text(c_path.read_text() + "int wrong(void) { return nothing; }\n")
    with pytest.raises(BackendError, match=r"nothing.*undeclared"):
        build_library(c_path)
    assert [path.name for path in good.parent.iterdir()] == [good.name]
    c_path.write_text(c_source(module_source("bare", SWAP, DISTANCE)))
    c_path.with_suffix(".h").write_text(c_header(module_source("bare", SWAP, DISTANCE)))
    newer = build_library(c_path)
    assert newer is not None and [path.name for path in good.parent.iterdir()] == [newer.name]


@needs_compiler
def test_a_folder_that_cannot_be_written(tmp_path: Path) -> None:
    c_path = write(module_source("bare", SWAP), tmp_path)
    (tmp_path / "_build").write_text("in the way")
    with pytest.raises(BackendError, match="_build"):
        build_library(c_path)
    with pytest.raises(BackendError, match="missing"):
        build_library(tmp_path / "missing.c")
