"""Generated modules without the compiler: with the runtime next to them, with it inside, and without it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from backend_programs import MOVE_POINT, NORMALIZE, module_source, write
from selection import some_slow

from gacompiler.backends import find_compiler, runtime_files
from gacompiler.gac_runtime.build import build_extension
from gacompiler.gac_runtime.definition import INTERFACE
from gacompiler.generation.files import write as write_files
from gacompiler.generation.rendering import render_standalone

CALLS = """
import numpy as np
p = np.array([[3.0, 0.0, 4.0], [0.0, 2.0, 0.0]])
m = np.eye(8)[0]
for backend in backends:
    module.backend = backend
    assert np.allclose(module.normalize(p)[1], [5, 2]), backend
    # With numba, move_point is compiled as a function on one element only, below.
    assert backend == "numba" or np.allclose(module.move_point(m, p), p), backend
assert "Costs" in module.move_point.__doc__ and module.move_point.signature == "(8),(3)->(3)"
assert np.allclose(module.move_point.jit(tuple(m), tuple(p[0])), p[0])
assert not {"gacompiler", "jinja2", "sympy"} & set(sys.modules)
print(backends)
"""

IMPORTS = {
    "as a member of its folder": "import sys; sys.path.insert(0, {parent!r}); from out import kernels as module",
    "from its own folder": "import sys; sys.path.insert(0, {folder!r}); import kernels as module",
    "by its path": (
        "import sys, importlib.util as util; spec = util.spec_from_file_location('any', {folder!r} + '/kernels.py'); "
        "module = util.module_from_spec(spec); spec.loader.exec_module(module)"
    ),
}


def run(code: str, folder: Path, *environment: str) -> subprocess.CompletedProcess[str]:
    """Run Python isolated from this folder and from all environment variables except PATH."""
    known = {"PATH": os.environ["PATH"], "GAC_CACHE": str(folder.parent / "cache")}
    known |= dict(one.split("=") for one in environment)
    code = code.replace("{folder!r}", repr(str(folder))).replace("{parent!r}", repr(str(folder.parent)))
    return subprocess.run([sys.executable, "-I", "-c", code], capture_output=True, text=True, env=known, cwd=folder)


def checked(code: str, folder: Path, *environment: str) -> str:
    done = run(code, folder, *environment)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def beside(tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest) -> Path:
    """A folder with the runtime next to the module, and with the extension, which others build when they are called."""
    folder = tmp_path_factory.mktemp("beside") / "out"
    folder.mkdir()
    write(module_source("kernels", MOVE_POINT, NORMALIZE), folder)
    if find_compiler():
        use_runtime(request.getfixturevalue("runtime_objects"), folder)
        build_extension(folder)
    return folder


def use_runtime(objects: Path, folder: Path) -> None:
    """Put the compiled runtime into the cache that processes in `folder` use."""
    (folder.parent / "cache").mkdir(mode=0o700)
    shutil.copytree(objects, folder.parent / "cache" / "runtime")


@pytest.fixture(scope="module")
def inside(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("inside") / "out"
    write_files(render_standalone(module_source("kernels", MOVE_POINT, NORMALIZE)), folder)
    return folder


HOW = [("beside", "from its own folder"), ("beside", "as a member of its folder"), ("inside", "by its path")]


@pytest.mark.parametrize(("kind", "how"), some_slow(HOW, *HOW[1:]))
@pytest.mark.slow
def test_a_folder_works_without_the_compiler(kind: str, how: str, request: pytest.FixtureRequest) -> None:
    folder = request.getfixturevalue(kind)
    backends = (["c"] if find_compiler() else []) + ["numba", "arrays"]
    checked(f"{IMPORTS[how]}; backends = {backends}{CALLS}", folder)


@pytest.mark.slow
def test_a_module_alone_is_one_file(inside: Path, tmp_path: Path) -> None:
    """Without its C file it runs on numba."""
    place = tmp_path / "out"
    write_files({"kernels.py": (inside / "kernels.py").read_text()}, place)
    checked(f"{IMPORTS['from its own folder']}; assert module.backend == 'numba'; backends = ['numba']{CALLS}", place)


def test_two_modules_share_the_runtime_inside_them(tmp_path: Path) -> None:
    place = tmp_path / "out"
    for name, program in (("first", MOVE_POINT), ("second", NORMALIZE)):
        write_files(render_standalone(module_source(name, program)), place)
    code = "import sys; sys.path.insert(0, {folder!r}); import first, second; assert first.Kernel is second.Kernel"
    checked(code, place)


@pytest.mark.skipif(not find_compiler(), reason="no C compiler")
def test_a_library_is_built_when_a_kernel_is_first_called(runtime_objects: Path, tmp_path: Path) -> None:
    place = tmp_path / "out"
    place.mkdir()
    use_runtime(runtime_objects, place)
    for name in ("first", "second"):
        write(module_source(name, MOVE_POINT), place)
    code = """import sys; sys.path.insert(0, {folder!r}); import first, second, os, re
def built():
    return sorted(re.split("[-_]", name)[0] for name in os.listdir("_build"))
os.makedirs("_build", exist_ok=True)
assert first.backend == "c" and built() == before
first.move_point([1.0] + [0] * 7, [1.0, 2, 3])
assert built() == sorted([*before, "first"])"""
    before = ["calls"] if build_extension(place) else []
    checked(f"before = {before}; {code}", place)


@pytest.mark.slow
@pytest.mark.skipif(not find_compiler(), reason="no C compiler")
def test_a_c_file_that_does_not_compile_is_reported_once(runtime_objects: Path, tmp_path: Path) -> None:
    place = tmp_path / "out"
    place.mkdir()
    use_runtime(runtime_objects, place)
    path = write(module_source("kernels", MOVE_POINT), place)
    path.write_text(f"#error broken\n{path.read_text()}")
    code = """import sys; sys.path.insert(0, {folder!r}); import kernels, warnings
with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always")
    for _ in range(2):
        assert kernels.move_point([1.0] + [0] * 7, [1.0, 2, 3]).tolist() == [1, 2, 3]
(one,) = caught
assert "broken" in str(one.message) and "numba" in str(one.message) and kernels.backend == "numba", one.message"""
    checked(code, place)
    done = run(code, place, "GAC_BACKEND=c")
    assert done.returncode and "broken" in done.stderr.splitlines()[-1]


def test_a_missing_runtime_is_named_with_the_command_that_writes_it(tmp_path: Path) -> None:
    place = tmp_path / "out"
    place.mkdir()
    write(module_source("kernels", MOVE_POINT), place)
    shutil.rmtree(place / "gac_runtime")
    done = run(IMPORTS["from its own folder"], place)
    last = done.stderr.splitlines()[-1]
    assert last.startswith("ImportError") and "gac_runtime" in last and last.endswith("gac generate kernels.py")


def test_another_version_of_the_runtime_is_rejected_by_name(tmp_path: Path) -> None:
    place = tmp_path / "out"
    place.mkdir()
    write(module_source("kernels", MOVE_POINT), place)
    path = place / "gac_runtime" / "definition.py"
    path.write_text(path.read_text().replace(f"INTERFACE = {INTERFACE}", f"INTERFACE = {INTERFACE + 1}"))
    last = run(IMPORTS["from its own folder"], place).stderr.splitlines()[-1]
    assert f"expected version {INTERFACE};" in last and f"version {INTERFACE + 1}" in last and "gac generate" in last


def test_two_versions_of_the_runtime_in_one_process(tmp_path: Path) -> None:
    """Folders that are packages have separate runtimes."""
    for folder in ("one", "two"):
        (tmp_path / folder).mkdir()
        write(module_source("kernels", MOVE_POINT), tmp_path / folder)
    for name, old, new in (("definition.py", f"INTERFACE = {INTERFACE}", "INTERFACE = 7"),):
        path = tmp_path / "two" / "gac_runtime" / name
        path.write_text(path.read_text().replace(old, new))
    path = tmp_path / "two" / "kernels.py"
    path.write_text(path.read_text().replace(f"interface={INTERFACE}", "interface=7"))
    code = """import sys; sys.path.insert(0, {parent!r})
from one import kernels as a
from two import kernels as b
assert a.Kernel is not b.Kernel
for module in (a, b):
    assert module.move_point([1.0] + [0] * 7, [1.0, 2, 3]).tolist() == [1, 2, 3]"""
    checked(code, tmp_path / "one", "GAC_BACKEND=arrays")


def test_the_copy_next_to_modules_equals_the_runtime(beside: Path) -> None:
    for name, text in runtime_files().items():
        assert (beside / name).read_text() == text
