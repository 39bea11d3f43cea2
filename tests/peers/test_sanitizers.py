"""No kernel reads or writes out of bounds, on arrays of any shape and strides, according to the sanitizers of gcc."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from gacompiler.backends import library_name, runtime_files
from gacompiler.generation.checked_in import generated_folder
from gacompiler.generation.files import write

pytestmark = pytest.mark.peers

FLAGS = ["-O1", "-std=c17", "-fPIC", "-shared", "-ffp-contract=off", "-fno-math-errno", "-fsanitize=address,undefined"]
ROUNDS = 60
WIDTHS = {
    "#define LOOPS(name) GAC_FOR(v3, NAME(name), NAME(name##_v3)) GAC_FOR(v4, NAME(name), NAME(name##_v4))":
        "#define LOOPS(name) GAC_FOR(v3, NAME(name), NAME(name##_v3))",
    "WIDTHS(name) {NAME(name##_v3), NAME(name##_v4)}": "WIDTHS(name) {NAME(name##_v3), NAME(name##_v3)}",
}  # fmt: skip
"""Loops have one text for vectors of either width; one of them is compiled, in half the time."""
MODULES = sorted(path.stem for path in generated_folder().glob("*.c"))


def runtime(compiler: str) -> str:
    """The path of the library of the sanitizer, which must be loaded before Python."""
    found = subprocess.run([compiler, "-print-file-name=libasan.so"], capture_output=True, text=True, check=False)
    return found.stdout.strip()


@pytest.mark.parametrize("name", MODULES)
def test_every_kernel_stays_within_bounds(name: str, tmp_path: Path) -> None:
    compiler = shutil.which("gcc")
    if compiler is None or not Path(runtime(compiler)).is_file():
        pytest.skip("no gcc with sanitizers")
    for ending in ("py", "c", "h"):
        shutil.copy(generated_folder() / f"{name}.{ending}", tmp_path)
    source = tmp_path / f"{name}.c"
    write(runtime_files(), tmp_path)
    header = tmp_path / "gac_runtime" / "gac_runtime.h"
    text = header.read_text()
    for both, one in WIDTHS.items():
        assert text.count(both) == 1
        text = text.replace(both, one)
    header.write_text(text)
    library = tmp_path / "_build" / library_name(name, source.read_text())
    library.parent.mkdir()
    sources = [str(source), str(tmp_path / "gac_runtime" / "gac_runtime.c")]
    subprocess.run([compiler, *FLAGS, "-fno-sanitize-recover=all", *sources, "-o", str(library), "-lm"], check=True)
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
