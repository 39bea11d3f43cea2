"""The text that backends print: it is the program, it compiles, and a change in it is seen."""

from __future__ import annotations

import importlib
import random
import re
import shutil
import subprocess
import sys
from fractions import Fraction
from pathlib import Path

import pytest
from backend_programs import (
    CONSTANTS,
    DISTANCE,
    INTERPOLATE,
    MATRIX_PRODUCT,
    MOVE_POINT,
    NORMALIZE,
    ODD_NAMES,
    OPERATIONS,
    SWAP,
    load,
    module_source,
    write,
)

from gacompiler.backends import (
    body_is_intact,
    build_libraries,
    build_library,
    c_functions,
    c_header,
    c_source,
    python_functions,
    python_source,
)
from gacompiler.backends.c_batch import C_HELPERS
from gacompiler.backends.c_functions import TRANSCENDENTAL
from gacompiler.backends.printers import RESERVED
from gacompiler.errors import BackendError
from gacompiler.ir.interpret import interpret
from gacompiler.ir.program import Program
from gacompiler.ir.scalar import Op

needs_compiler = pytest.mark.skipif(not shutil.which("gcc"), reason="no gcc on the PATH")

ROOT = Path(__file__).parents[2]


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
    changed = [wrong for wrong in mutations(text) if without_documentation(wrong) != without_documentation(text)]
    assert len(changed) > 200
    functions = c_functions if language == "c" else python_functions
    points = [exact_point(MOVE_POINT, seed) for seed in range(2)]
    names = [argument.name for argument in MOVE_POINT.arguments]
    right = [tuple(interpret(MOVE_POINT, dict(zip(names, point, strict=True))).values()) for point in points]
    unit = tuple(interpret(NORMALIZE, {"v": (3, 4, 12)}).values())
    for wrong in random.Random(1).sample(changed, 100):
        assert not body_is_intact(wrong)
        try:
            found = functions(wrong)
            same = [found["move_point"](*point) for point in points] == right
            same = same and found["normalize"]((3, 4, 12)) == unit
        except Exception:
            continue
        assert not same


def without_documentation(text: str) -> str:
    """What is left when docstrings, layouts and counts, which do not compute, are taken out."""
    text = re.sub(r"^_LAYOUT_.*?^\)$|^    cost=.*?$", "", text, flags=re.DOTALL | re.MULTILINE)
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
    for name in ("abs", "Kernel", "SCALAR", "kernels", "batch", "load_3x3"):
        program = Program(name, SWAP.arguments, SWAP.lines, SWAP.results)
        with pytest.raises(BackendError, match=name):
            python_source(module_source("one", program))


@pytest.mark.parametrize("module", ["arms", "cga3", "pga3", "quaternion"])
def test_every_function_that_kernels_share_is_known_by_name(module: str) -> None:
    text = (ROOT / "generated" / f"{module}.c").read_text()
    kernels = importlib.import_module(f"generated.{module}").kernels
    defined = set(re.findall(r"^(?:\w+ )?static .*?\bNAME\((\w+)\)", text, re.M)) | set(
        re.findall(r"NAME\((call_\w+)\)", text)
    )
    shared = {name for name in defined if not any(name == own or name.startswith(f"{own}_") for own in kernels)}
    assert {"batch", "move_part", "load_rows"} <= shared
    assert [name for name in sorted(shared) if not C_HELPERS.fullmatch(name)] == []


@pytest.mark.parametrize("op", [op for op in OPERATIONS if op.lines[0].op in TRANSCENDENTAL], ids=lambda op: op.name)
def test_a_kernel_may_be_called_as_a_function(op: Program) -> None:
    name = op.lines[0].op.value
    module = module_source("one", Program(name, op.arguments, op.lines, op.results))
    assert f"def {name}(" in python_source(module)
    assert f"NAME({name})(" in c_source(module)


def test_no_variable_has_the_name_of_a_macro() -> None:
    """Of one without arguments: the others are macros only where a parenthesis follows."""
    text = (ROOT / "generated" / "cga3.c").read_text()
    macros = set(re.findall(r"^\s*#\s*define (\w+)(?![\w(])", text, re.M))
    assert {"REAL", "LOG_0", "TILE"} <= macros <= RESERVED


def test_kernels_may_not_share_a_name() -> None:
    for ending in ("_loop", "_block", "_dense"):
        other = Program(f"swap{ending}", SWAP.arguments, SWAP.lines, SWAP.results)
        for programs in ((SWAP, other), (other, SWAP)):
            with pytest.raises(BackendError, match=f"swap{ending}"):
                python_source(module_source("one", *programs))


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
    path = [str(ROOT / "tests" / "support"), str(ROOT)]
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


@needs_compiler
def test_c_compiles_without_warnings_and_vectorises(tmp_path: Path) -> None:
    c_path = write(module_source("strict", MOVE_POINT, NORMALIZE, CONSTANTS), tmp_path)
    command = ["gcc", "-std=c17", "-Wall", "-Wextra", "-Werror", "-O3", "-ffp-contract=off", "-fopt-info-vec"]
    run = subprocess.run(
        [*command, "-c", str(c_path), "-o", str(tmp_path / "strict.o")], capture_output=True, text=True
    )
    assert run.returncode == 0, run.stderr[:2000]
    lines = c_path.read_text().splitlines()
    move_point = lines.index(next(line for line in lines if "NAME(move_point_block)(intptr_t n" in line))
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
    assert sorted(path.name for path in tmp_path.iterdir()) == ["bare.c", "bare.h", "bare.py", "gac_runtime"]


@needs_compiler
def test_a_failed_build_leaves_nothing(tmp_path: Path) -> None:
    c_path = write(module_source("bare", SWAP), tmp_path)
    good = build_library(c_path)
    assert good is not None and good.exists() and build_library(c_path) == good
    c_path.write_text(c_path.read_text() + "int wrong(void) { return nothing; }\n")
    with pytest.raises(BackendError, match=r"nothing.*undeclared"):
        build_library(c_path)
    assert [path.name for path in good.parent.iterdir() if not path.name.startswith("calls")] == [good.name]
    c_path.write_text(c_source(module_source("bare", SWAP, DISTANCE)))
    c_path.with_suffix(".h").write_text(c_header(module_source("bare", SWAP, DISTANCE)))
    newer = build_library(c_path)
    assert newer is not None and newer.exists() and not good.exists() and not list(good.parent.glob(".*"))


@needs_compiler
def test_what_the_linker_says(tmp_path: Path) -> None:
    c_path = write(module_source("bare", SWAP), tmp_path)
    good = c_path.read_text()
    c_path.write_text(good + "#ifndef TWICE\n#define TWICE\nint twice(void) { return 2; }\n#endif\n")
    with pytest.raises(BackendError, match=r"multiple definition.*twice"):
        build_library(c_path)
    # A file without the two halves is compiled as one.
    c_path.write_text(re.sub("#ifndef ONLY_F..", "#if 1", good))
    assert build_library(c_path) is not None


@needs_compiler
def test_many_libraries_at_once(tmp_path: Path) -> None:
    paths = [write(module_source(name, SWAP, DISTANCE), tmp_path) for name in ("one", "two", "three")]
    good = paths[1].read_text()
    paths[1].write_text(good + "wrong\n")
    with pytest.raises(BackendError, match=r"two\.c"):
        build_libraries(paths)
    assert sorted(path.name[:3] for path in (tmp_path / "_build").iterdir()) == ["one", "thr"]
    paths[1].write_text(good)
    libraries = build_libraries(paths)
    assert [library is not None and library.exists() for library in libraries] == [True] * 3
    times = [library.stat().st_mtime_ns for library in libraries if library]
    assert build_libraries(paths) == libraries
    assert times == [library.stat().st_mtime_ns for library in libraries if library]
    assert build_libraries([]) == []


@needs_compiler
def test_a_folder_that_cannot_be_written(tmp_path: Path) -> None:
    c_path = write(module_source("bare", SWAP), tmp_path)
    (tmp_path / "_build").write_text("in the way")
    with pytest.raises(BackendError, match="_build"):
        build_library(c_path)
    with pytest.raises(BackendError, match="missing"):
        build_library(tmp_path / "missing.c")
