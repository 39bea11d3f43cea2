"""Packages for CMake, cargo and npm: they are built and called by programs that use them as users do."""

from __future__ import annotations

import json
import math
import re
import subprocess
from pathlib import Path

import pytest
from click.testing import CliRunner
from programs import needs

from gacompiler.backends.module import ModuleSource
from gacompiler.cli import main
from gacompiler.generation.projects import cargo_package

SPEC = '''"""Moves, and the pose of an arm."""

from gacompiler import array, cos, fold, kernel, sandwich, sin
from gacompiler.algebra.catalog import PGA3, VGA2
from gacompiler.algebra.layout import SCALAR

E1, E2 = VGA2.basis()


@kernel(v=PGA3.UNIT_EVEN, x=PGA3.POINT)
def move(v, x):
    """Move a point."""
    return sandwich(v, x)


@kernel(q=array(SCALAR, "n"))
def forward(q):
    """Orientation of an end effector."""
    return fold(lambda m, angle: m * (cos(angle / 2) - sin(angle / 2) * E1 * E2), 1, q)
'''
LIFTED = "1, 0, 0, 0, 0, 0, -0.5, 0"
"""The translation by one along the third axis."""


def generate(*words: str | Path) -> str:
    result = CliRunner().invoke(main, ["generate", *map(str, words)])
    assert result.exit_code == 0, result.output
    return result.output


def run(*words: str | Path, folder: Path) -> str:
    done = subprocess.run([str(word) for word in words], cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    return done.stdout


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the spec and a package of each kind."""
    folder = tmp_path_factory.mktemp("packages")
    (folder / "arms.py").write_text(SPEC)
    words = [f"--{kind}={folder / f'my-{kind}'}" for kind in ("cmake", "cargo", "npm")]
    found = generate(folder / "arms.py", *words)
    assert found.count("2 kernels for ") == 3 and "unchanged" not in found
    return folder


def test_files(place: Path) -> None:
    files = {path.relative_to(place).as_posix() for path in place.rglob("*") if path.is_file()}
    assert {name for name in files if not name.endswith(".pyc")} == {
        "arms.py",
        "my-cmake/CMakeLists.txt",
        "my-cmake/include/arms.h",
        "my-cmake/src/arms.c",
        "my-cmake/src/arms_batches.c",
        "my-cmake/src/gac_runtime/gac_runtime.c",
        "my-cmake/src/gac_runtime/gac_runtime.h",
        "my-cmake/src/gac_sizes.h",
        "my-cargo/Cargo.toml",
        "my-cargo/src/arms.rs",
        "my-cargo/src/lib.rs",
        "my-npm/package.json",
        "my-npm/arms.mjs",
        "my-npm/arms.d.mts",
    }


MAIN = """
#include <stdio.h>
#include "arms.h"
int main(void) {
  const double v[8] = {LIFTED};
  double x[3] = {1, 2, 3};
#ifdef WITH_LOOP
  double q[2] = {0.25, 0.5}, out[2];
  arms_forward_f64(2, q, out, NULL);
  printf("%.17g %.17g\\n", out[0], out[1]);
#endif
#ifdef WITH_BATCH
  double many[40][3], to[40][3];
  for (int i = 0; i < 120; i++) many[i / 3][i % 3] = i;
  const intptr_t w = sizeof(double), n = 40, steps[] = {0, 3 * w, 3 * w, w, w, w};
  char *args[] = {(char *)v, (char *)many, (char *)to};
  arms_move_loop_f64(args, &n, steps);
  for (int i = 0; i < 40; i++) printf("%g %g %g ", to[i][0], to[i][1], to[i][2]);
#endif
  arms_move_f64(v, x, x);
  printf("%g %g %g\\n", x[0], x[1], x[2]);
  return 0;
}
""".replace("LIFTED", LIFTED)
LISTS = """
cmake_minimum_required(VERSION 3.16)
project(programs LANGUAGES C CXX)
find_package(my-cmake 0.1 CONFIG REQUIRED)
foreach(kind IN ITEMS ONE LOOP BATCH)
  add_executable(${kind} main.c)
  target_compile_definitions(${kind} PRIVATE WITH_${kind})
  target_link_libraries(${kind} my-cmake::my-cmake)
endforeach()
add_executable(CXX main.cpp)
target_compile_definitions(CXX PRIVATE WITH_LOOP WITH_BATCH)
target_link_libraries(CXX my-cmake::my-cmake)
"""


@needs("cmake")
@needs("g++")
@needs("nm")
@pytest.mark.slow
def test_cmake_library_and_what_programs_link(place: Path) -> None:
    package, programs, inside = place / "my-cmake", place / "programs", place / "inside"
    made = run("cmake", "-S", package, "-B", package / "build", folder=place)
    assert "Warning" not in made
    run("cmake", "--build", package / "build", folder=place)
    run("cmake", "--install", package / "build", "--prefix", place / "installed", folder=place)
    programs.mkdir()
    (programs / "CMakeLists.txt").write_text(LISTS)
    for name in ("main.c", "main.cpp"):
        (programs / name).write_text(MAIN)
    run("cmake", "-B", "build", f"-DCMAKE_PREFIX_PATH={place / 'installed'}", folder=programs)
    run("cmake", "--build", "build", folder=programs)
    moved = [float(i + (i % 3 == 2)) for i in range(120)]
    rotor = [math.cos(0.375), -math.sin(0.375)]
    expected = {"ONE": [], "LOOP": rotor, "BATCH": moved, "CXX": rotor + moved}
    linked = {}
    for name, numbers in expected.items():
        found = [float(word) for word in run(programs / "build" / name, folder=place).split()]
        assert found == pytest.approx([*numbers, 1, 2, 4], rel=1e-15)
        listed = run("nm", programs / "build" / name, folder=place)
        linked[name] = set(re.findall(r"\b(?:gac|arms)_\w+", listed))
    assert "arms_move_f64" in linked["ONE"] and all(re.match("arms_(move|forward)", name) for name in linked["ONE"])
    assert not [name for name in linked["ONE"] if re.search("loop|rows|f32", name)]
    assert not [name for name in linked["LOOP"] if name.startswith("gac_")]
    spans = {int(size) for name in linked["BATCH"] for size in re.findall(r"gac_load_span_(\d+)", name)}
    assert spans == {3, 8} and "gac_batch_f64" in linked["BATCH"] and "gac_batch_f32" not in linked["BATCH"]
    # The same package as a folder of another project, as a shared library.
    inside.mkdir()
    (inside / "main.c").write_text(MAIN)
    lists = LISTS.replace("find_package(my-cmake 0.1 CONFIG REQUIRED)", f"add_subdirectory({package} my-cmake)")
    (inside / "CMakeLists.txt").write_text(lists.partition("add_executable(CXX")[0])
    run("cmake", "-B", "build", "-DBUILD_SHARED_LIBS=ON", folder=inside)
    run("cmake", "--build", "build", folder=inside)
    found = [float(word) for word in run(inside / "build" / "BATCH", folder=place).split()]
    assert found == [*moved, 1, 2, 4]


@needs("gcc")
def test_functions_of_single_elements_need_no_runtime(place: Path, tmp_path: Path) -> None:
    (tmp_path / "main.c").write_text(MAIN)
    folder = place / "my-cmake"
    options = ["-std=c17", "-O1", "-Wall", "-Wextra", "-Werror", "-pedantic", "-DWITH_LOOP", f"-I{folder / 'include'}"]
    only = ["-DGAC_ONLY_ELEMENTS", "-DONLY_F64"]
    run("gcc", *options, *only, "main.c", folder / "src" / "arms.c", "-lm", "-o", "main", folder=tmp_path)
    found = [float(word) for word in run(tmp_path / "main", folder=tmp_path).split()]
    assert found == pytest.approx([math.cos(0.375), -math.sin(0.375), 1, 2, 4], rel=1e-15)


RUST = f"""
use my_cargo::arms;

#[test]
fn moves() {{
    let (v, x) = ([{", ".join(f"{float(word)}" for word in LIFTED.split(","))}], [1.0, 2.0, 3.0]);
    let mut out = [0.0; 3];
    arms::move_(&v, &x, &mut out);
    assert_eq!(out, [1.0, 2.0, 4.0]);
    let mut pose = [0.0; 2];
    arms::forward(2, &[0.25, 0.5], &mut pose, &mut []);
    assert!((pose[0] - 0.375f64.cos()).abs() < 1e-15 && (pose[1] + 0.375f64.sin()).abs() < 1e-15);
}}
"""


@needs("cargo")
@pytest.mark.slow
def test_cargo_crate(place: Path) -> None:
    (place / "my-cargo" / "tests").mkdir()
    (place / "my-cargo" / "tests" / "moves.rs").write_text(RUST)
    assert "1 passed" in run("cargo", "test", "--offline", "--test", "moves", folder=place / "my-cargo")


PROGRAM = f"""
import {{ forward, move, move_batch }} from "my-npm";
import {{ forward_work }} from "my-npm/arms";
const v = [{LIFTED}];
const many = [...Array(120).keys()];
console.log(JSON.stringify([
  [...move(v, [1, 2, 3])], [...move_batch(v, many)],
  [...forward(2, [0.25, 0.5])], forward_work(2),
]));
"""


@needs("node")
def test_npm_package(place: Path, tmp_path: Path) -> None:
    (tmp_path / "node_modules").mkdir()
    (tmp_path / "node_modules" / "my-npm").symlink_to(place / "my-npm")
    (tmp_path / "main.mjs").write_text(PROGRAM)
    one, many, pose, work = json.loads(run("node", "main.mjs", folder=tmp_path))
    assert one == [1, 2, 4] and many == [i + (i % 3 == 2) for i in range(120)] and work == 0
    assert pose[:2] == pytest.approx([math.cos(0.375), -math.sin(0.375)], rel=1e-15)


def test_types_declare_what_the_module_exports(place: Path) -> None:
    """Names and parameters, apart from types; a parameter is optional if the function allocates it."""
    code, types = ((place / "my-npm" / name).read_text() for name in ("arms.mjs", "arms.d.mts"))
    exported = dict(re.findall(r"export function (\w+)\(([^)]*)\) \{", code))
    declared = dict(re.findall(r"export function (\w+)(?:<[^>]*>)?\(([^)]*)\):", types))
    names = {name: re.findall(r"(\w+)\??:", parameters) for name, parameters in declared.items()}
    assert names == {name: re.findall(r"\w+", parameters) for name, parameters in exported.items()}
    assert set(names) == {"move", "move_batch", "forward", "forward_work"}
    optional = {name: re.findall(r"(\w+)\?:", parameters) for name, parameters in declared.items()}
    assert optional == {"move": ["out"], "move_batch": ["out"], "forward": ["out", "work"], "forward_work": []}


TYPED = """
import { forward, move } from "./arms.mjs";
const a: Float64Array = move([1], [2]);
const b: number[] = forward(1, [0.5], [0, 0]);
// @ts-expect-error: no angles
forward(1);
// @ts-expect-error: a number is not an array
move(1, [2]);
console.log(a, b);
"""


@needs("tsc")
@pytest.mark.slow
def test_types_are_those_of_a_program(place: Path) -> None:
    (place / "my-npm" / "use.mts").write_text(TYPED)
    run("tsc", "--noEmit", "--strict", "--module", "nodenext", "--target", "es2022", "use.mts", folder=place / "my-npm")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--cmake=Upper"], "named by lower-case letters"),
        (["--npm=kernels", "--header-only"], "without other outputs"),
        (["--cargo=kernels", "--target", "rust"], "without other outputs"),
        (["--cargo=kernels", "-o", "out"], "without other outputs"),
        (["--cmake=all"], "all is a target of build systems"),
    ],
)
def test_wrong_options(words: list[str], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("arms.py").write_text(SPEC)
    result = CliRunner().invoke(main, ["generate", "arms.py", *words])
    assert result.exit_code and message in re.sub(r"\s+", " ", result.output)
    assert [path.name for path in tmp_path.iterdir() if path.suffix != ""] == ["arms.py"]


@pytest.mark.parametrize("name", ["lib", "main"])
def test_modules_that_cargo_gives_a_meaning(name: str, tmp_path: Path) -> None:
    (tmp_path / f"{name}.py").write_text(SPEC)
    result = CliRunner().invoke(main, ["generate", str(tmp_path / f"{name}.py"), f"--cargo={tmp_path / 'crate'}"])
    assert result.exit_code and "another name of the spec" in re.sub(r"\s+", " ", result.output)
    assert not (tmp_path / "crate").exists()


def test_modules_named_as_words_of_rust() -> None:
    """They are raw identifiers, for which no other name needs to be one."""
    modules = [ModuleSource(name, "", "", "", (), ()) for name in ("match", "arms")]
    lines = cargo_package("kernels", modules)["src/lib.rs"].splitlines()
    assert lines[-2:] == ["pub mod r#match;", "pub mod arms;"]
