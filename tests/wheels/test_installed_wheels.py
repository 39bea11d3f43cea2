"""Wheels installed with numpy only: no compiler, no cffi, no numba."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from wheel_examples import SPEC, Environment, compilers, packaged

from gacompiler.backends import find_compiler
from gacompiler.cli import main
from gacompiler.gac_runtime.processor import machine_level

ROOT = Path(__file__).parents[2]
SHIPPED = ("gacompiler", "algorithms", "generated")
MODULE = "vga2"
"""The module of the project that is compiled here; all of them take minutes."""

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(find_compiler() is None, reason="no C compiler"),
    pytest.mark.skipif(sys.platform != "linux", reason="wheels with libraries are for Linux"),
]

LEVELS = [level for level in (1, 3, 4) if level <= machine_level()]
LEVEL = ["--target-level", f"v{LEVELS[-1]}"] if LEVELS else []
"""Options for libraries of one level."""

PLANE = """
import json, sys
import numpy as np
from generated import vga2
R, points = np.array({rotation}), np.array({points})
r = vga2.rotor_from_matrix(R)
turned = vga2.rotate_vector(r, points)
one = vga2.rotate_vector(r, points[0])
single = vga2.rotate_vector(r.astype(np.float32), points.astype(np.float32))
product = vga2.Rotor(r) * vga2.Rotor(r)
loaded = sorted({{line.rpartition("/")[2].strip() for line in open("/proc/self/maps") if "/_build/" in line}})
others = sorted({{"numba", "_cffi_backend", "scipy", "gacompiler"}} & set(sys.modules))
results = [array.tolist() for array in (turned, one, single, product.values)]
print(json.dumps([vga2.backend, loaded, others, *results]))
"""
ROTATION = np.array([[np.cos(0.7), -np.sin(0.7)], [np.sin(0.7), np.cos(0.7)]])
POINTS = np.random.default_rng(7).normal(size=(37, 2))


def run_vga2(where: Environment, **variables: str) -> tuple[str, list[str], np.ndarray]:
    """The backend, what was loaded, and the turned points, which are checked against the matrix."""
    code = PLANE.format(rotation=ROTATION.tolist(), points=POINTS.tolist())
    backend, loaded, others, turned, one, single, product = json.loads(where.output(code, **variables))
    expected = POINTS @ ROTATION.T
    assert np.allclose(turned, expected, rtol=0, atol=1e-14)
    assert np.allclose(one, expected[0], rtol=0, atol=1e-14)
    assert np.allclose(single, expected, rtol=0, atol=1e-5)
    # The rotor of twice the rotation: its scalar is the cosine of half the angle, 2 * 0.7 / 2.
    assert np.isclose(abs(product[0]), np.cos(0.7))
    assert others == []
    return backend, loaded, np.array(turned)


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The project's files, with one generated module."""
    folder = tmp_path_factory.mktemp("project")
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, folder)
    for name in SHIPPED:
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__", "_build"))
    for path in (folder / "generated").glob("*.[pch]*"):
        if path.stem not in (MODULE, "__init__") and path.name != "py.typed":
            path.unlink()
    return folder


@pytest.fixture(scope="module")
def pure(source: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel of the project without libraries, as ``make wheel`` begins."""
    folder = tmp_path_factory.mktemp("pure")
    options = ["--no-index", "--no-deps", "--no-build-isolation", "--quiet", "--wheel-dir", str(folder)]
    subprocess.run([sys.executable, "-m", "pip", "wheel", *options, str(source)], check=True)
    (wheel,) = folder.glob("*.whl")
    return wheel


@pytest.fixture(scope="module")
def wheel(pure: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel with libraries."""
    return packaged(pure, output=tmp_path_factory.mktemp("compiled"))


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Environment:
    """An environment with numpy and the wheel."""
    where = Environment(tmp_path_factory.mktemp("installed") / "venv")
    where.install(wheel, alone=True)
    return where


@pytest.fixture
def empty(tmp_path: Path) -> Environment:
    """An environment with numpy."""
    return Environment(tmp_path / "venv")


def library_of(loaded: list[str], module: str) -> list[str]:
    return [name for name in loaded if name.startswith(f"{module}-")]


def test_the_wheel_has_every_file(pure: Path, source: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "zipfile", "-l", str(pure)], capture_output=True, text=True, check=True
    )
    names = {line.split()[0] for line in done.stdout.splitlines()}
    paths = [path for name in SHIPPED for path in (source / name).rglob("*") if path.is_file()]
    wanted = {path.relative_to(source).as_posix() for path in paths}
    assert len(wanted) > 200 and wanted <= names, sorted(wanted - names)


def test_an_editable_installation_is_a_path(source: Path, tmp_path: Path) -> None:
    """Type checkers follow a path, but not a finder, which is what setuptools installs by default."""
    program = f"from setuptools import build_meta; print(build_meta.build_editable({str(tmp_path)!r}))"
    subprocess.run([sys.executable, "-c", program], cwd=source, check=True, capture_output=True)
    (wheel,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        (path,) = [name for name in archive.namelist() if "dist-info" not in name]
        assert path.endswith(".pth") and archive.read(path).decode().strip() == str(source)


def test_generated_modules_need_numpy_alone(installed: Environment) -> None:
    backend, loaded, _ = run_vga2(installed)
    assert backend == "c"
    (library,) = library_of(loaded, "vga2")
    assert library.endswith(f"-v{machine_level()}.so" if machine_level() else ".so")
    assert len([name for name in loaded if name.startswith("calls_")]) == 1


def test_kernels_are_called_through_ctypes_without_the_extension(wheel: Path, empty: Environment) -> None:
    empty.install(wheel, alone=True)
    for extension in empty.site.glob("generated/_build/calls_*"):
        extension.unlink()
    backend, loaded, _ = run_vga2(empty)
    assert backend == "c" and len(loaded) == len(library_of(loaded, "vga2")) == 1


@pytest.mark.skipif(len(LEVELS) < 2, reason="needs x86-64 with AVX2")
def test_each_level_loads_its_own_library(installed: Environment) -> None:
    found = {level: run_vga2(installed, GAC_LEVEL=str(level)) for level in LEVELS}
    for level, (backend, loaded, moved) in found.items():
        (library,) = library_of(loaded, "vga2")
        assert (backend, library[-6:]) == ("c", f"-v{level}.so")
        # Some levels fuse a product and a sum into one rounding.
        assert np.allclose(moved, found[1][2], rtol=0, atol=4e-15)
    failed = installed.run("from generated import vga2", GAC_LEVEL="2")
    assert failed.stderr.splitlines()[-1] == "ImportError: GAC_LEVEL: '2'; expected 1, 3 or 4"


@pytest.mark.skipif(len(LEVELS) < 2, reason="needs x86-64 with AVX2")
def test_a_lower_level_is_loaded_where_there_is_no_other(wheel: Path, empty: Environment) -> None:
    empty.install(wheel, alone=True)
    for level in LEVELS[1:]:
        for library in empty.site.glob(f"generated/_build/*-v{level}.so"):
            library.unlink()
    backend, loaded, _ = run_vga2(empty)
    assert backend == "c" and library_of(loaded, "vga2")[0].endswith("-v1.so")


@pytest.mark.parametrize(("name", "missing"), [("gacompiler", "jinja2 mpmath"), ("algorithms", "scipy")])
def test_what_is_missing_is_named(installed: Environment, name: str, missing: str) -> None:
    done = installed.run(f"import {name}")
    last = done.stderr.splitlines()[-1]
    assert done.returncode == 1
    assert last.startswith(f"ImportError: {name} needs ") and f"run: pip install {missing}" in last


def test_the_command_says_what_is_missing_in_one_line(installed: Environment) -> None:
    done = subprocess.run([str(installed.folder / "bin" / "gac"), "new", "a"], capture_output=True, text=True, env={})
    assert done.returncode == 1 and done.stdout == ""
    (line,) = done.stderr.splitlines()
    assert line.startswith("gac: error: gacompiler needs click, jinja2") and "run: pip install click jinja2" in line


def test_a_source_install_builds_on_first_use(pure: Path, empty: Environment) -> None:
    empty.install(pure, alone=True)
    code = "from generated import vga2; print(vga2.geometric_product([2, 0, 0, 0], [0, 3, 0, 0]), vga2.backend)"
    assert empty.output(code) == "[0. 6. 0. 0.] arrays\n"
    # If it takes more than a second, a line on stderr reports it.
    assert empty.run(code, compilers()).stdout == "[0. 6. 0. 0.] c\n"
    assert len(list(empty.site.glob("generated/_build/vga2-*.so"))) == 1
    assert empty.output(code) == "[0. 6. 0. 0.] c\n"


KERNELS = """
import json
import numpy as np
from {package} import my_kernels as module
x = np.arange(12.0).reshape(3, 4)
moved = module.move_point(np.array([0.6, 0.8, 0, 0, 0, 0, 0, 0]), np.array([[1.0, 2, 3]]))
print(json.dumps([module.backend, module.squares(x).tolist(), module.squares(x[1]).tolist(), moved.tolist()]))
"""


def kernels_of(where: Environment, package: str, **variables: str) -> str:
    """The backend; the results of both kernels are checked."""
    backend, sums, one, moved = json.loads(where.output(KERNELS.format(package=package), **variables))
    assert sums == [14, 126, 366] and one == 126
    # The rotor 0.6 + 0.8 e12 turns by an angle of cosine 0.6**2 - 0.8**2 and sine of size 2 * 0.6 * 0.8.
    (x, y, z) = moved[0]
    assert np.isclose(z, 3)
    assert any(np.allclose((x, y), (-0.28 - 2 * s, -0.56 + s)) for s in (0.96, -0.96))
    return str(backend)


@pytest.fixture(scope="module")
def spec(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("spec") / "my_kernels.py"
    path.write_text(SPEC)
    return path


def test_a_package_of_kernels(spec: Path, empty: Environment, tmp_path: Path) -> None:
    """Two packages of the same kernels coexist, each with its own runtime."""
    first = packaged(spec, *LEVEL, output=tmp_path / "first")
    again = packaged(spec, *LEVEL, output=tmp_path / "again")
    assert first.read_bytes() == again.read_bytes()
    assert first.name.startswith("my_kernels-0.1.0-py3-none-manylinux_2_")
    other = packaged(spec, *LEVEL, "--name", "Other.Kernels", "--version", "2.0", output=tmp_path / "other")
    empty.install(first, other)
    for package in ("my_kernels", "other_kernels"):
        assert kernels_of(empty, package) == "c"
    both = "import my_kernels.my_kernels as a, other_kernels.my_kernels as b; print(a.Kernel is b.Kernel, "
    assert empty.output(both + "a.squares([3.0]) == b.squares([3.0]) == 9)") == "False True\n"
    for name in ("my_kernels", "other_kernels"):
        for extension in empty.site.glob(f"{name}/_build/calls_*"):
            extension.unlink()
    assert kernels_of(empty, "my_kernels") == "c"


def test_a_pure_package_runs_without_a_compiler(spec: Path, empty: Environment, tmp_path: Path) -> None:
    empty.install(packaged(spec, "--no-build", output=tmp_path / "pure"))
    assert kernels_of(empty, "my_kernels") == "arrays"
    failed = empty.run("import my_kernels.my_kernels", GAC_BACKEND="numba")
    assert "numba is not installed" in failed.stderr.splitlines()[-1]
    failed = empty.run("import my_kernels.my_kernels as m; m.move_point.jit")
    assert "numba is not installed" in failed.stderr.splitlines()[-1]


def test_a_library_that_cannot_be_loaded_has_a_fallback(spec: Path, empty: Environment, tmp_path: Path) -> None:
    empty.install(packaged(spec, *LEVEL, output=tmp_path / "one"))
    (library,) = empty.site.glob("my_kernels/_build/my_kernels-*.so")
    library.write_bytes(b"no library")
    for call, expected in (("squares([3.0, 4.0])", "25.0"), ("move_point(np.eye(8)[0], np.ones(3))", "[1. 1. 1.]")):
        code = f"import numpy as np\nfrom my_kernels import my_kernels as m\nfor _ in 'ab': print(m.{call}, m.backend)"
        done = empty.run(code)
        assert done.stdout == f"{expected} arrays\n" * 2, done.stderr
        assert "kernels run on arrays" in done.stderr


def test_another_machine(spec: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Libraries for aarch64, if its compiler is installed; they have no levels, and the extension is omitted."""
    if not shutil.which("aarch64-linux-gnu-gcc"):
        pytest.skip("no compiler for aarch64")
    monkeypatch.setenv("CC", "aarch64-linux-gnu-gcc")
    wheel = packaged(spec, output=tmp_path / "dist")
    assert wheel.name.endswith("-py3-none-manylinux_2_17_aarch64.whl")
    done = CliRunner().invoke(main, ["package", str(spec), "--target-level", "v3", "-o", str(tmp_path)])
    assert done.exit_code == 1 and "it compiles for aarch64" in done.output


def test_interpreters_of_other_machines_are_refused(spec: Path, tmp_path: Path) -> None:
    done: Any = CliRunner().invoke(main, ["package", str(spec), "--python", "no-python", "-o", str(tmp_path)])
    assert done.exit_code == 1 and "no-python: it cannot be run" in done.output
