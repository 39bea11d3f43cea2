"""No kernel reads or writes out of bounds, on arrays of any shape and strides, according to the sanitizers of gcc.

The loops of a straight-line kernel are macros of the shapes of its arguments and results. They are compiled for the
first kernel with these shapes in all modules; `test_indices_of_kernels.py` reads the indices in the other bodies. Both
precisions are one text, so that each module is compiled with the sanitizers for one of them, in turn.
"""

import os
import re
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

from gacompiler.backends import library_name, runtime_files
from gacompiler.generation.checked_in import generated_folder
from gacompiler.generation.files import write

pytestmark = pytest.mark.peers

PLAIN = ["-std=c17", "-fPIC", "-ffp-contract=off", "-fno-math-errno"]
FLAGS = [*PLAIN, "-Og", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
ROUNDS = 60
WIDTHS = {
    "#define LOOPS(name) GAC_FOR(v3, NAME(name), NAME(name##_v3)) GAC_FOR(v4, NAME(name), NAME(name##_v4))":
        "#define LOOPS(name) GAC_FOR(v3, NAME(name), NAME(name##_v3))",
    "WIDTHS(name) {NAME(name##_v3), NAME(name##_v4)}": "WIDTHS(name) {NAME(name##_v3), NAME(name##_v3)}",
}  # fmt: skip
"""Loops have one text for vectors of either width; one of them is compiled, in half the time."""


def _size(name: str) -> int:
    return (generated_folder() / f"{name}.c").stat().st_size


MODULES = sorted((path.stem for path in generated_folder().glob("*.c")), key=lambda name: (-_size(name), name))
"""The largest first, so that no process compiles one of them while the others have nothing left to do."""


def runtime(compiler: str) -> str:
    """The path of the library of the sanitizer, which must be loaded before Python."""
    found = subprocess.run([compiler, "-print-file-name=libasan.so"], capture_output=True, text=True, check=False)
    return found.stdout.strip()


@pytest.fixture(scope="module")
def compiler() -> str:
    """The path of gcc, if it has the sanitizers."""
    found = shutil.which("gcc")
    if found is None or not Path(runtime(found)).is_file():
        pytest.skip("no gcc with sanitizers")
    return found


@pytest.fixture(scope="module")
def compiled_runtime(compiler: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the runtime, for vectors of one width, and its object file."""
    folder = tmp_path_factory.mktemp("runtime")
    write(runtime_files(), folder)
    header = folder / "gac_runtime" / "gac_runtime.h"
    text = header.read_text()
    for both, one in WIDTHS.items():
        assert text.count(both) == 1
        text = text.replace(both, one)
    header.write_text(text)
    source = folder / "gac_runtime" / "gac_runtime.c"
    subprocess.run([compiler, *FLAGS, "-c", str(source), "-o", str(folder / "gac_runtime.o")], check=True)
    return folder


def without_known_loops(text: str, earlier: set[str]) -> str:
    """Return the text of a module without the loops of straight-line kernels that have the shapes of an earlier one."""
    joined = re.sub(r"\s*\\\n\s*", " ", text)
    parts = dict(re.findall(r"^#define PARTS_(\w+)\(IN, NUMBER, OUT, AND\) (.*)$", joined, re.MULTILINE))

    def kernel(found: re.Match[str]) -> str:
        name, kind, dense = found.groups()
        shapes = f"{parts[name]} {kind} {dense}"
        if shapes not in earlier:
            earlier.add(shapes)
            return found[0]
        return (
            f"void NAME({name}_loop)(char **args, const intptr_t *dimensions, const intptr_t *steps)"
            " { (void)args, (void)dimensions, (void)steps; }"
        )

    return re.sub(r"^GAC_KERNEL\((\w+), (\w+), (\w+)\)$", kernel, text, flags=re.MULTILINE)


@cache
def texts() -> dict[str, str]:
    """The C text of every module as it is compiled here."""
    earlier: set[str] = set()
    folder = generated_folder()
    return {name: without_known_loops((folder / f"{name}.c").read_text(), earlier) for name in sorted(MODULES)}


def test_loops_are_left_out_once_they_are_known() -> None:
    shapes = "#define PARTS_{0}(IN, NUMBER, OUT, AND) IN(0, 0, 3, {1}) AND \\\n    OUT(1, 1, 3)"
    text = shapes + "\nGAC_KERNEL({0}, PLAIN, NO)\n"
    earlier: set[str] = set()
    assert without_known_loops(text.format("f", 3), earlier) == text.format("f", 3)
    assert without_known_loops(text.format("g", 4), earlier) == text.format("g", 4)
    assert "\nvoid NAME(h_loop)" in without_known_loops(text.format("h", 3), earlier)


@pytest.mark.parametrize("name", MODULES)
def test_every_kernel_stays_within_bounds(name: str, compiler: str, compiled_runtime: Path, tmp_path: Path) -> None:
    for ending in ("py", "c", "h"):
        shutil.copy(generated_folder() / f"{name}.{ending}", tmp_path)
    shutil.copytree(compiled_runtime / "gac_runtime", tmp_path / "gac_runtime")
    source = tmp_path / "shortened" / f"{name}.c"
    source.parent.mkdir()
    source.write_text(texts()[name])
    library = tmp_path / "_build" / library_name(name, (tmp_path / f"{name}.c").read_text())
    library.parent.mkdir()
    halves = ("F64", "F32") if sorted(MODULES).index(name) % 2 else ("F32", "F64")
    for half, flags in zip(halves, (FLAGS, PLAIN), strict=True):
        command = [compiler, *flags, f"-I{tmp_path}", f"-DONLY_{half}", "-c", str(source), "-o", str(tmp_path / half)]
        subprocess.run(command, check=True)
    parts = [str(compiled_runtime / "gac_runtime.o"), *(str(tmp_path / half) for half in halves)]
    subprocess.run([compiler, *FLAGS, "-shared", *parts, "-o", str(library), "-lm"], check=True)
    environment = {
        **os.environ,
        "LD_PRELOAD": runtime(compiler),
        "ASAN_OPTIONS": "detect_leaks=0",
        "GAC_BACKEND": "c",
    }
    script = Path(__file__).with_name("sanitized.py")
    run = subprocess.run(
        [sys.executable, str(script), str(tmp_path), name, str(ROUNDS)],
        env=environment, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert run.returncode == 0, run.stdout + run.stderr[-4000:]
    assert run.stdout.endswith("calls\n")
