"""Numeric objects compile their functions with default settings and an empty cache, and never wait for them.

Every program runs in a separate process on one processor, so that a single build fills the queue.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import sysconfig
import time
from pathlib import Path

import pytest

from gacompiler.backends import find_compiler

ROOT = Path(__file__).parents[2]
PATIENCE = 60.0
"""Seconds after which a test gives up; nothing is measured."""

pytestmark = [
    pytest.mark.skipif(find_compiler() is None, reason="no C compiler"),
    pytest.mark.skipif(os.environ.get("GAC_BACKEND", "") not in ("", "c"), reason="C is not wanted"),
]

HEAD = """
import os, sys, time, warnings
from pathlib import Path
if hasattr(os, "sched_setaffinity"):
    os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:1])
import numpy as np
from gacompiler.errors import BackendError
from gacompiler.objects import CGA3, PGA3, VGA3, arrays, builds, native, operators
if "EXTENSION" in os.environ:
    native.generated_folder = lambda: Path(os.environ["EXTENSION"])
elif arrays.extension() is None:
    print("no extension")
    sys.exit(0)

def until(condition):
    for _ in range(6000):
        if condition():
            return
        time.sleep(0.01)
    raise AssertionError(builds())

def libraries():
    # without files that a compiler is writing
    return sorted(Path(os.environ["GAC_CACHE"]).glob("objects/[!.]*.so"))

def refuse(*_):
    raise AssertionError("not from the extension")
"""


def environment(folder: Path, compiler: Path | None = None) -> dict[str, str]:
    more = {"GAC_CACHE": str(folder / "cache"), "MPLBACKEND": "Agg"}
    return {**os.environ, **more, **({"CC": str(compiler)} if compiler else {})}


def ran(program: str, env: dict[str, str]) -> str:
    """The output of a program; the test is skipped if single objects are arrays."""
    done = subprocess.run(
        [sys.executable, "-c", HEAD + program], env=env, cwd=ROOT, capture_output=True, text=True, timeout=PATIENCE * 2
    )
    assert done.returncode == 0, done.stderr
    if done.stdout.startswith("no extension"):
        pytest.skip("no extension")
    return done.stdout


def own_compiler(folder: Path, first: str, of: str = "*/objects/*") -> Path:
    """A C compiler that first runs a command when it compiles an operation, or another given source."""
    path = folder / "own_cc"
    real = " ".join(find_compiler() or ())
    path.write_text(f'#!/bin/sh\ncase "$*" in {of}) {first};; esac\nexec {real} "$@"\n')
    path.chmod(0o755)
    return path


PRODUCTS = """
m, n = PGA3.motor([1, 2, 3], 0.3, 2), PGA3.motor([0, 1, 0], -0.4, 1)
first = m * n
for _ in range(1000):
    m = (m * n)
until(lambda: len(libraries()) == len(operators.operators()))  # nothing of this package is called meanwhile
m = m * n
arrays.apply = refuse
for _ in range(1000):
    m = m * n
assert not builds().pending and not builds().failed and len(builds().ready) == len(operators.operators()) >= 5
print("compiled")
"""


@pytest.mark.slow
def test_the_example_of_the_readme_is_compiled_automatically(tmp_path: Path) -> None:
    """Run with an empty cache, and again in a second process, which has nothing to compile."""
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)
    (example,) = (block for block in blocks if "gacompiler.objects" in block)
    example = example.replace("scene.html", str(tmp_path / "scene.html"))
    assert ran(example + PRODUCTS, environment(tmp_path)).endswith("compiled\n")
    second = """
m, n = PGA3.motor([1, 2, 3], 0.3, 2), PGA3.motor([0, 1, 0], -0.4, 1)
first = m * n
arrays.apply = refuse
assert m * n == first
assert not builds().pending and len(builds().ready) == len(operators.operators())
print("started compiled")
"""
    assert ran(second, environment(tmp_path)).endswith("started compiled\n")


@pytest.mark.slow
def test_no_call_waits_for_a_compiler(tmp_path: Path) -> None:
    """The compiler is blocked at first; all calls return before it runs, with the same numbers as afterwards."""
    go = tmp_path / "go"
    program = f"""
go = Path({str(go)!r})
m, p, v = PGA3.motor([1, 2, 3], 0.3, 2), PGA3.point(1, 2, 3), VGA3.vector(1, 2, 3)
many = PGA3.of(PGA3.LINE, np.random.default_rng(0).normal(size=(1500, 6)))
def results():
    return [m * m, m >> p, m.log(), ~m, 2 * m, v.norm(), p - p, *many.exp()]
before = [results() for _ in range(2)]
found = builds()
assert len(found.running) == 1 and not found.ready and not found.failed, found
assert found.pending == len(operators.operators()) > 7
go.touch()
until(lambda: len(libraries()) == len(operators.operators()) and not builds().pending)
after = [results() for _ in range(2)]
assert not builds().pending
assert all(each == before[0] for each in before + after), "to the bit"
print("never waited")
"""
    waits = own_compiler(tmp_path, f'while [ ! -e "{go}" ]; do sleep 0.02; done')
    assert ran(program, environment(tmp_path, waits)).endswith("never waited\n")


@pytest.mark.slow
def test_started_builds_reach_the_cache_after_the_program(tmp_path: Path) -> None:
    begun, go = tmp_path / "begun", tmp_path / "go"
    program = f"""
v = VGA3.vector(1, 2, 3)
v * v
until(Path({str(begun)!r}).exists)
print("ended")
"""
    waits = own_compiler(tmp_path, f'touch "{begun}"; while [ ! -e "{go}" ]; do sleep 0.02; done')
    assert ran(program, environment(tmp_path, waits)).endswith("ended\n")
    folder = tmp_path / "cache" / "objects"
    assert not list(folder.glob("*.so"))
    go.touch()
    for _ in range(int(50 * PATIENCE)):
        if [each.suffix for each in folder.iterdir()] == [".so"]:
            break
        time.sleep(0.02)
    assert [each.suffix for each in folder.iterdir()] == [".so"], "the cache contains one library only"


def test_failed_builds_are_reported_and_block_nothing(tmp_path: Path) -> None:
    program = """
v, w = VGA3.vector(1, 2, 3), VGA3.vector(3, 1, 1)
with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("default")
    for _ in range(3):
        found = [v ^ w, v + w, v * w, ~(v * w)]
        until(lambda: not builds().pending)
assert found[0].values.tolist() == [-5, -8, -1], found[0].values
assert found[1].values.tolist() == [4, 3, 4], "which runs as text"
assert builds().failed == ("add_vector_vector",) and len(builds().ready) == 3, builds()
assert [str(each.message) for each in caught if "no adding" in str(each.message)], caught
(failed,) = (each for each in operators.operators() if each.state == "failed")
try:
    failed.wait()
except BackendError as error:
    assert "no adding" in str(error)
    print("reported")
"""
    refuses = own_compiler(
        tmp_path,
        'for file; do case $file in *.c) grep -q kernel_add "$file" && { echo no adding >&2; exit 1; };; esac; done',
    )
    assert ran(program, environment(tmp_path, refuses)).endswith("reported\n")


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
def test_a_forked_process_continues_to_build(tmp_path: Path) -> None:
    go = tmp_path / "go"
    program = f"""
v = VGA3.vector(1, 2, 3)
v * v, v ^ v, v + v
until(lambda: builds().running)
child = os.fork()
if child == 0:
    Path({str(go)!r}).touch()
    until(lambda: not builds().pending)
    os._exit(0 if len(builds().ready) == 3 else 1)
assert os.waitpid(child, 0)[1] == 0
until(lambda: not builds().pending)
print("both")
"""
    waits = own_compiler(tmp_path, f'while [ ! -e "{go}" ]; do sleep 0.02; done')
    assert ran(program, environment(tmp_path, waits)).endswith("both\n")


@pytest.mark.slow
@pytest.mark.skipif(not (Path(sysconfig.get_path("include")) / "Python.h").is_file(), reason="no headers of Python")
def test_no_call_waits_for_the_extension(tmp_path: Path) -> None:
    """Without an extension in any module, objects are arrays until it is built, and earlier objects are no slower."""
    go = tmp_path / "go"
    program = f"""
m, n = PGA3.motor([1, 2, 3], 0.3, 2), PGA3.motor([0, 1, 0], -0.4, 1)
def results():
    return [m * n, ~m, m >> PGA3.point(1, 2, 3), m.log(), 2 * m, m / 2, -n, m | n, m(PGA3.e12), (m * n).norm()]
before = results()
assert type(m).__name__ == "ArrayMultivector", type(m)
assert "extension" in builds().running and native.extension() is None, builds()
Path({str(go)!r}).touch()
until(lambda: not builds().pending)
assert native.extension() is not None
for _ in range(3):
    assert all(np.all(a == b) for a, b in zip(results(), before, strict=True))
p, q = m * n, ~m
assert type(p).__name__ == "Motor" == type(q).__name__, "of the extension"
arrays.apply = refuse
assert m * n == p and ~m == q
print("never waited")
"""
    waits = own_compiler(tmp_path, f'while [ ! -e "{go}" ]; do sleep 0.02; done', "*PyInit_calls*")
    env = {**environment(tmp_path, waits), "EXTENSION": str(tmp_path / "generated")}
    assert ran(program, env).endswith("never waited\n")
