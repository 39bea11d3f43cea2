"""Headers without runtime: valid C99 and C++, small objects, and the numbers of Python."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import gacompiler as ga
from gacompiler.algebra.catalog import PGA3
from gacompiler.cli import main

SPEC = '''"""Kernels of a header."""

import gacompiler as ga
from gacompiler import kernel, sandwich
from gacompiler.algebra.catalog import PGA3
from gacompiler.algebra.layout import SCALAR


@kernel(v=PGA3.UNIT_EVEN, x=PGA3.POINT)
def move(v, x):
    """Move a point."""
    return sandwich(v, x)


@kernel(new=SCALAR, b=SCALAR)
def choose(new, b):
    """Use functions, comparisons, and names that are words of C++."""
    return ga.select(new < b, ga.sqrt(new) + ga.atan2(new, b), ga.minimum(abs(new), ga.exp(b) / 3)), ga.sin(new) * b
'''
PROGRAM = """
#include <stdio.h>
#include "shapes_inline.h"
int main(void) {
  const double v[8] = {%s}, x[3] = {0.3, -1.25, 2.0};
  double out[3], first, second;
  shapes_move(v, x, out);
  shapes_choose(0.25, 0.5, &first, &second);
  printf("%%.17g %%.17g %%.17g %%.17g %%.17g\\n", out[0], out[1], out[2], first, second);
  shapes_choose(0.75, 0.5, &first, &second);
  printf("%%.17g %%.17g\\n", first, second);
  return 0;
}
"""
STRICT = ("-O1", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror", "-pedantic")


@ga.kernel(v=PGA3.UNIT_EVEN, x=PGA3.POINT)
def move(v, x):
    """Move a point."""
    return ga.sandwich(v, x)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the header of the spec."""
    place = tmp_path_factory.mktemp("header")
    (place / "shapes.py").write_text(SPEC)
    result = CliRunner().invoke(main, ["generate", str(place / "shapes.py"), "--header-only", "-o", str(place)])
    assert result.exit_code == 0, result.output
    assert sorted(each.name for each in place.iterdir() if each.suffix) == ["shapes.py", "shapes_inline.h"]
    return place


def motor() -> np.ndarray:
    """A unit motor: a rotation about an axis through the origin, and a translation."""
    c, s = np.cos(0.4), np.sin(0.4)
    rotor = np.array([c, s * 2 / 3, -s / 3, s * 2 / 3])
    return np.asarray(ga.compile(product, "arrays", effort=0)(rotor, [0.5, -1.0, 0.25]))


@ga.kernel(r=PGA3.ROTOR, t=PGA3.TRANSLATOR)
def product(r, t):
    """The product of a translator and a rotor."""
    return t * r


@pytest.mark.parametrize(("compiler", "standard"), [("gcc", "c99"), ("g++", "c++11"), ("g++", "c++20")])
def test_programs_compute_what_python_computes(folder: Path, compiler: str, standard: str) -> None:
    if shutil.which(compiler) is None:
        pytest.skip(f"no {compiler}")
    v, x = motor(), [0.3, -1.25, 2.0]
    source = folder / f"main.{'c' if compiler == 'gcc' else 'cpp'}"
    source.write_text(PROGRAM % ", ".join(f"{each:.17g}" for each in v))
    program = folder / f"{compiler}_{standard}"
    command = [compiler, f"-std={standard}", *STRICT, str(source), "-o", str(program), "-lm"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    found = list(map(float, subprocess.run([str(program)], capture_output=True, text=True, check=True).stdout.split()))
    moved = np.asarray(ga.compile(move, "arrays", effort=0)(v, x))
    right = [*moved, np.sqrt(0.25) + np.arctan2(0.25, 0.5), np.sin(0.25) * 0.5]
    right += [min(0.75, np.exp(0.5) / 3), np.sin(0.75) * 0.5]
    assert np.allclose(found, right, rtol=1e-15, atol=1e-15)
    assert np.isclose(np.linalg.norm(moved - [-1.0, 2.0, -0.5]), np.linalg.norm(x)), "the translation is -2 t"


def test_an_object_with_a_kernel_has_at_most_two_kilobytes_and_needs_nothing(folder: Path) -> None:
    if shutil.which("gcc") is None or shutil.which("nm") is None:
        pytest.skip("no gcc")
    (folder / "one.c").write_text(
        '#include "shapes_inline.h"\n'
        "void one(const double *v, const double *x, double *out) { shapes_move(v, x, out); }\n"
    )
    command = ["gcc", "-std=c99", "-Os", "-fno-asynchronous-unwind-tables", "-c", "one.c", "-o", "one.o"]
    subprocess.run(command, cwd=folder, check=True)
    subprocess.run(["strip", "--strip-debug", "one.o"], cwd=folder, check=True)
    assert os.path.getsize(folder / "one.o") <= 2048
    found = subprocess.run(["nm", "-u", "one.o"], cwd=folder, capture_output=True, text=True, check=True).stdout
    assert not found.strip()


def test_what_has_no_header_is_refused(tmp_path: Path) -> None:
    text = "from gacompiler import array, kernel, total\nfrom gacompiler.algebra.layout import SCALAR\n"
    text += '@kernel(x=array(SCALAR, \'n\'))\ndef added(x):\n    """Add numbers."""\n    return total(lambda a: a, x)\n'
    (tmp_path / "sums.py").write_text(text)
    run = CliRunner().invoke
    result = run(main, ["generate", str(tmp_path / "sums.py"), "--header-only", "-o", str(tmp_path)])
    assert result.exit_code == 1 and "added, a kernel with loops" in result.output
    for more in (["--standalone"], ["--target", "rust"]):
        result = run(main, ["generate", str(tmp_path / "sums.py"), "--header-only", *more])
        assert result.exit_code == 2 and "writes one file" in result.output
    result = run(main, ["generate", "--all", "--header-only"])
    assert result.exit_code == 2 and "choose their folder" in result.output
