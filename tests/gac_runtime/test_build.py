"""Libraries are built once, completely, and in folders that nobody else can write to."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from backend_programs import DISTANCE, SWAP, load, module_source, write
from selection import some_slow

from gacompiler.gac_runtime import build, names
from gacompiler.gac_runtime.build import BuildError, build_module, build_modules, built_library, library_path
from gacompiler.gac_runtime.cache import CacheError, RuntimeProblem, cache_folder
from gacompiler.gac_runtime.library import Library
from gacompiler.gac_runtime.names import library_file
from gacompiler.gac_runtime.processor import PORTABLE, level_of, machine_level

pytestmark = pytest.mark.skipif(
    build.find_compiler() is None or os.name != "posix", reason="needs a C compiler, and a shell for its place"
)

_COMPILER = """\
#!/bin/sh
case "$*" in
*--version*) ;;
*) echo "$*" >> "{folder}/calls" ;;
esac
{first}
exec {compiler} "$@" -O0
"""


@pytest.fixture(name="cache")
def cache_fixture(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A separate, empty cache."""
    monkeypatch.setenv("GAC_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture(name="module")
def module_fixture(tmp_path: Path, cache: Path) -> Path:
    (tmp_path / "modules").mkdir()
    return write(module_source("bare", SWAP), tmp_path / "modules")


@pytest.fixture
def with_runtime(cache: Path, runtime_objects: Path) -> None:
    """Put the compiled runtime into the cache of the test."""
    cache.mkdir(mode=0o700)
    shutil.copytree(runtime_objects, cache / "runtime")


def use_compiler(folder: Path, monkeypatch: pytest.MonkeyPatch, first: str = "") -> Path:
    """Use a compiler that logs its calls to a file."""
    compiler = build.find_compiler()
    assert compiler is not None
    script = folder / "compiler"
    script.write_text(_COMPILER.format(folder=folder, first=first, compiler=" ".join(compiler)))
    script.chmod(0o755)
    monkeypatch.setenv("CC", str(script))
    return folder / "calls"


def compiled(calls: Path) -> list[str]:
    """The C files that were compiled, in the order in which their compilation began."""
    words = [line.split() for line in calls.read_text().splitlines()]
    return sorted(Path(line[line.index("-c") + 1]).name for line in words if "-c" in line)


def built_by_hand(text: str, library: Path) -> None:
    """Build a library from C without the runtime, whose compilation takes seconds."""
    source = library.parents[1] / "by_hand.c"
    source.write_text(text)
    library.parent.mkdir()
    subprocess.run([*(build.find_compiler() or ()), "-shared", "-fPIC", source, "-o", library], check=True)


def leftovers(folder: Path) -> list[Path]:
    return [path for path in folder.rglob(".*") if path.name != ".nothing"]


@pytest.mark.slow
def test_only_the_requested_module_is_built(module: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(module_source("other", DISTANCE), module.parent)
    calls = use_compiler(tmp_path, monkeypatch)
    assert built_library(module) is None
    library = build_module(module)
    assert library == library_path(module) == built_library(module)
    assert compiled(calls) == ["bare.c", "gac_runtime.c", "gac_runtime.c"]
    # The next module reuses the runtime, and a module that is built is not built again.
    build_module(module.with_name("other.c"))
    assert build_module(module) == library
    assert compiled(calls) == ["bare.c", "gac_runtime.c", "gac_runtime.c", "other.c"]
    assert not leftovers(tmp_path)


def test_a_library_belongs_to_its_runtime(module: Path) -> None:
    """A module is compiled with the runtime next to it, and the hash of its text is in the name of the library."""
    beside = module.parent / "gac_runtime"
    shutil.rmtree(beside, ignore_errors=True)
    before = library_path(module).name
    beside.mkdir()
    for name in build.RUNTIME_FILES:
        shutil.copy(Path(build.__file__).with_name(name), beside)
    assert build.runtime_folder(module) == beside and library_path(module).name == before
    build._texts.cache_clear()
    (beside / "gac_runtime.c").write_text((beside / "gac_runtime.c").read_text() + "// more\n")
    library_file.cache_clear()
    assert library_path(module).name != before
    build._texts.cache_clear()
    library_file.cache_clear()


@pytest.mark.parametrize("home", some_slow(["GAC_CACHE", "XDG_CACHE_HOME", "HOME"], "XDG_CACHE_HOME", "HOME"))
def test_a_folder_that_is_not_ours_is_not_written(
    home: str, module: Path, runtime_objects: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("GAC_CACHE", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv(home, str(tmp_path / "own"))
    module.parent.chmod(0o777)
    shutil.copytree(runtime_objects, cache_folder() / "runtime")
    library = build_module(module)
    places = {"GAC_CACHE": "own", "XDG_CACHE_HOME": "own/gacompiler", "HOME": "own/.cache/gacompiler"}
    folder = tmp_path / places[home]
    assert library is not None and library.parent == folder / "libraries" and library == built_library(module)
    assert folder.stat().st_mode & 0o777 == 0o700
    assert not library_path(module).exists() and build_module(module) == library


def test_a_cache_that_others_can_write_is_rejected(module: Path, runtime_objects: Path, cache: Path) -> None:
    module.parent.chmod(0o777)
    cache.mkdir()
    for mode in (0o777, 0o770, 0o1777):
        cache.chmod(mode)
        with pytest.raises(CacheError, match=rf"^{cache}: others may write to it .*chmod 700") as error:
            build_module(module)
        assert len(str(error.value).splitlines()) == 1
        assert not list(cache.iterdir()) and built_library(module) is None
    cache.chmod(0o700)
    shutil.copytree(runtime_objects, cache / "runtime")
    library = build_module(module)
    assert library is not None
    # The libraries in it are not used once others can write to it.
    cache.chmod(0o777)
    assert built_library(module) is None


def test_a_cache_of_another_user_is_rejected(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    cache_folder()
    monkeypatch.setattr(os, "geteuid", lambda: 12345)
    with pytest.raises(CacheError, match="belongs to another user"):
        cache_folder()


def test_a_cache_that_cannot_be_made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("GAC_CACHE", str(tmp_path / "file" / "cache"))
    with pytest.raises(CacheError, match="set GAC_CACHE"):
        cache_folder()


@pytest.mark.slow
def test_without_a_usable_cache_modules_are_built_in_their_folder(module: Path, cache: Path) -> None:
    cache.mkdir()
    cache.chmod(0o777)
    library = build_module(module)
    assert library == library_path(module) and library.exists()
    assert not list(cache.iterdir()) and not leftovers(module.parent)


@pytest.mark.usefixtures("with_runtime")
def test_a_failing_build_leaves_nothing(module: Path, cache: Path) -> None:
    good = module.read_text()
    module.write_text(good + "wrong\n")
    with pytest.raises(BuildError, match=r"bare\.c: .*failed"):
        build_module(module)
    assert not list((module.parent / "_build").iterdir()) and not leftovers(cache)
    module.write_text(good)
    assert build_module(module) is not None


def test_a_failing_runtime_is_reported_for_every_module(module: Path, cache: Path) -> None:
    beside = module.parent / "gac_runtime"
    beside.mkdir(exist_ok=True)
    for name in build.RUNTIME_FILES:
        shutil.copy(Path(build.__file__).with_name(name), beside)
    (beside / "gac_runtime.c").write_text("wrong\n")
    build._texts.cache_clear()
    other = write(module_source("other", DISTANCE), module.parent)
    (beside / "gac_runtime.c").write_text("wrong\n")
    with pytest.raises(BuildError, match=r"gac_runtime\.c: .*failed"):
        build_modules([module, other])
    build._texts.cache_clear()
    assert not leftovers(cache) and not leftovers(module.parent) and not list(cache.rglob("*.o"))


_BUILD = "import sys; from pathlib import Path; from gacompiler.gac_runtime.build import build_module; "
_BUILD += "print(build_module(Path(sys.argv[1])))"


def started(module: Path) -> subprocess.Popen[str]:
    """Start a process that builds a module."""
    environment = {**os.environ, "PYTHONPATH": str(Path(build.__file__).parents[2])}
    command = [sys.executable, "-c", _BUILD, str(module)]
    return subprocess.Popen(
        command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )


@pytest.mark.slow
def test_two_processes_build_it_once(module: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    calls = use_compiler(tmp_path, monkeypatch)
    processes = [started(module) for _ in range(3)]
    printed = {process.communicate()[0] for process in processes}
    assert printed == {f"{library_path(module)}\n"}
    assert compiled(calls) == ["bare.c", "gac_runtime.c", "gac_runtime.c"]


@pytest.mark.slow
@pytest.mark.usefixtures("with_runtime")
def test_a_killed_build_leaves_nothing_that_is_loaded(
    module: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A process that is killed while its compiler runs does not prevent others from building."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with monkeypatch.context() as patch:
        # The linker reports that it was reached, and waits.
        use_compiler(tmp_path, patch, first=f'case "$*" in *-shared*) echo linking > "{pipe}"; cat "{pipe}" ;; esac')
        process = started(module)
        assert pipe.read_text() == "linking\n"
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
    assert built_library(module) is None
    library = build_module(module)
    assert library is not None and built_library(module) == library


@pytest.mark.usefixtures("with_runtime")
def test_a_long_build_is_announced(
    module: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(build, "_PATIENCE", 0.0)
    build_module(module)
    assert capfd.readouterr() == ("", "gac: building bare (once)\n")
    # Nothing is built or reported if the library exists.
    build_module(module)
    assert capfd.readouterr() == ("", "")


@pytest.mark.usefixtures("with_runtime")
def test_without_a_compiler(module: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patch:
        patch.setenv("CC", "no-such-compiler")
        assert build_module(module) is None and build_modules([module]) == [None]
    library = build_module(module)
    monkeypatch.setenv("CC", "no-such-compiler")
    assert build_module(module) == library and build_modules([module]) == [library]


@pytest.mark.parametrize(("backend", "wanted"), [("", True), ("c", True), ("numba", False), ("arrays", False)])
def test_whether_modules_are_built(backend: str, wanted: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GAC_BACKEND", backend)
    assert build.is_wanted() == wanted


def test_a_missing_file(tmp_path: Path, cache: Path) -> None:
    with pytest.raises(BuildError, match=r"missing\.c"):
        build_module(tmp_path / "missing.c")


# Kinds of machines.


@pytest.mark.parametrize(
    ("flags", "level"),
    [
        ("fpu sse sse2", 1),
        ("avx avx2 f16c fma abm movbe bmi1 bmi2 popcnt cx16 lahf_lm pni ssse3 sse4_1 sse4_2", 3),
        ("avx512f avx512bw avx512cd avx512dq avx512vl avx2 fma", 1),
    ],
)
def test_a_level_needs_those_below(flags: str, level: int) -> None:
    assert level_of(flags.split()) == level


@pytest.mark.slow
@pytest.mark.skipif(machine_level() < 3, reason="a machine with vectors on which levels are known")
def test_libraries_for_other_machines_coexist(
    module: Path, with_runtime: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    own = build_module(module)
    assert own is not None and own.name.endswith(f"-v{machine_level()}.so")
    for each in (build, names):
        monkeypatch.setattr(each, "machine_level", lambda: 1)
    assert built_library(module) is None
    older = build_module(module)
    assert older is not None and older.name.endswith("-v1.so") and own.exists()
    (portable,) = build_modules([module], portable=True)
    assert portable is not None and portable == library_path(module, PORTABLE)
    older.unlink()
    assert built_library(module) == portable and build_modules([module]) == [portable]
    assert own.exists() and not older.exists()


def test_a_lower_level_can_be_requested(monkeypatch: pytest.MonkeyPatch) -> None:
    level = machine_level.__wrapped__
    own = level()
    for text, expected in (("", own), ("1", min(own, 1)), ("4", own)):
        monkeypatch.setenv("GAC_LEVEL", text)
        assert level() == expected
    monkeypatch.setenv("GAC_LEVEL", "5")
    with pytest.raises(ImportError, match=r"GAC_LEVEL: '5'; expected 1, 3 or 4"):
        level()


@pytest.mark.skipif(machine_level() < 3, reason="a machine with vectors on which levels are known")
def test_a_lower_level_is_used_where_nothing_can_be_built(module: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    lower = library_path(module, 1)
    built_by_hand("int nothing;", lower)
    library = Library(names.library_label(module.stem, module.read_text()), module)
    assert lower.exists() and library.find() is None
    monkeypatch.setenv("CC", "no-such-compiler")
    assert library.find() == lower
    library.open()
    for each in (build, names):
        monkeypatch.setattr(each, "machine_level", lambda: PORTABLE)
    assert library.find() is None


def test_a_library_that_needs_another_processor_is_rejected(module: Path) -> None:
    built_by_hand("int gac_runs_here(void);\nint gac_runs_here(void) { return 0; }\n", library_path(module))
    label = names.library_label(module.stem, module.read_text())
    with pytest.raises(RuntimeProblem, match=r"this processor lacks its instructions.*gac build --portable"):
        Library(label, module).open()


def test_floats_are_compiled_when_they_are_called(module: Path, with_runtime: None) -> None:
    """A call compiles for its own precision only, the first call of all for doubles too."""
    bare = load(module.with_suffix(".py"), "bare")
    built = module.parent / "_build"
    for n, dtype in enumerate((np.float64, np.float32), start=1):
        x = np.array([[1, 2], [3, 4]], dtype)
        for _ in range(2):
            swapped = bare.swap(x)
            assert swapped.dtype == x.dtype and np.array_equal(swapped, x[:, ::-1])
        libraries = [library_path(module, only=only) for only in ("f64", "f32")][:n]
        assert set(built.glob("bare-*.so")) == set(libraries)
        assert [path.stem[-4:] for path in libraries] == ["-f64", "-f32"][:n]
    assert np.array_equal(bare.swap(np.array([1.0, 2])), [2, 1])
