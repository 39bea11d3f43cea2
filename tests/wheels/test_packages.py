"""The wheels of ``gac package`` as files: content, metadata, platforms; the same specs give the same bytes."""

from __future__ import annotations

import base64
import csv
import email
import hashlib
import io
import os
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest
from click.testing import CliRunner
from wheel_examples import SPEC, package, packaged

from gacompiler.backends import find_compiler, runtime_files
from gacompiler.cli import main
from gacompiler.errors import BackendError
from gacompiler.wheels.archive import wheel_bytes
from gacompiler.wheels.distribution import REQUIRES_NUMPY, REQUIRES_PYTHON
from gacompiler.wheels.libraries import LEVELS, compiled_files
from gacompiler.wheels.platforms import platform_tag

ROOT = Path(__file__).parents[2]
needs_compiler = pytest.mark.skipif(find_compiler() is None, reason="no C compiler")


@pytest.fixture(scope="module")
def spec(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("spec") / "my_kernels.py"
    path.write_text(SPEC)
    return path


@pytest.fixture(scope="module")
def pure(spec: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A wheel without libraries."""
    return packaged(spec, "--no-build", "--version", "1.2", output=tmp_path_factory.mktemp("pure"))


def contents(wheel: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(wheel) as archive:
        assert archive.testzip() is None
        return {name: archive.read(name) for name in archive.namelist()}


def test_files_of_a_package(pure: Path) -> None:
    assert pure.name == "my_kernels-1.2-py3-none-any.whl"
    names = set(contents(pure))
    inside = {f"my_kernels/{name}" for name in runtime_files()}
    inside |= {f"my_kernels/{name}" for name in ("__init__.py", "py.typed")}
    inside |= {f"my_kernels/my_kernels.{ending}" for ending in ("py", "pyi", "c", "h")}
    assert names == inside | {f"my_kernels-1.2.dist-info/{name}" for name in ("METADATA", "WHEEL", "RECORD")}


def test_a_package_gives_the_kernels_of_its_module(pure: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(pure) as archive:
        archive.extractall(tmp_path)
    code = "import my_kernels as k; print(k.move_point([1, 0, 0, 0, 0, 0, 0, 0], [1, 2, 3]), 'move_point' in dir(k))"
    environment = {**os.environ, "GAC_BACKEND": "arrays", "PYTHONPATH": str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert done.stdout == "[1. 2. 3.] True\n", done.stderr


def test_record_has_every_file_and_its_digest(pure: Path) -> None:
    files = contents(pure)
    record = "my_kernels-1.2.dist-info/RECORD"
    rows = {name: (digest, size) for name, digest, size in csv.reader(io.StringIO(files[record].decode()))}
    assert rows.pop(record) == ("", "")
    assert rows == {
        name: (f"sha256={base64.urlsafe_b64encode(hashlib.sha256(data).digest()).decode().rstrip('=')}", str(len(data)))
        for name, data in files.items()
        if name != record
    }


def test_metadata(pure: Path) -> None:
    files = contents(pure)
    metadata = email.message_from_bytes(files["my_kernels-1.2.dist-info/METADATA"])
    shown = {key: metadata.get_all(key) for key in ("Name", "Version", "Summary", "Requires-Dist", "Requires-Python")}
    assert shown["Name"] == ["my-kernels"] and shown["Version"] == ["1.2"]
    assert shown["Summary"] == ["Motions of points, and sums."]
    assert shown["Requires-Dist"] == ["numpy<3,>=2.1"] and shown["Requires-Python"] == [">=3.11"]
    wheel = email.message_from_bytes(files["my_kernels-1.2.dist-info/WHEEL"])
    assert (wheel["Wheel-Version"], wheel["Root-Is-Purelib"], wheel["Tag"]) == ("1.0", "true", "py3-none-any")


def test_bounds_are_those_of_the_project() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert REQUIRES_NUMPY in project["dependencies"]
    assert project["requires-python"] == REQUIRES_PYTHON


def test_the_same_spec_gives_the_same_bytes(
    spec: Path, pure: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("time.time", lambda: 2e9)
    copy = tmp_path / spec.name
    copy.write_text(SPEC)
    again = packaged(copy.name, "--no-build", "--version", "1.2", output=tmp_path / "again")
    assert again.read_bytes() == pure.read_bytes()
    done = package(copy.name, "--no-build", "--version", "1.2", "-o", tmp_path / "again")
    assert "unchanged" in done.output


def test_dates_are_those_of_source_date_epoch(monkeypatch: pytest.MonkeyPatch) -> None:
    name, files = "a-1-py3-none-any.whl", {"a-1.dist-info/WHEEL": b"", "a.py": b"1\n"}
    monkeypatch.delenv("SOURCE_DATE_EPOCH", raising=False)
    with zipfile.ZipFile(io.BytesIO(wheel_bytes(name, files))) as archive:
        assert archive.namelist() == ["a.py", "a-1.dist-info/WHEEL", "a-1.dist-info/RECORD"]
        assert {info.date_time for info in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}
    monkeypatch.setenv("SOURCE_DATE_EPOCH", str(86400 * 365 * 20))
    with zipfile.ZipFile(io.BytesIO(wheel_bytes(name, files))) as archive:
        assert {info.date_time for info in archive.infolist()} == {(1989, 12, 27, 0, 0, 0)}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--name", "2 kernels"), "2 kernels: not a valid package name"),
        (("--name", "2-kernels"), "Python cannot import '2_kernels'"),
        (("--name", "class"), "Python cannot import 'class'"),
        (("--version", "first"), "first: not a valid version"),
        (("--no-build", "--target-level", "v3"), "--no-build compiles nothing"),
        (("other.py",), "name their package with --name"),
        (("other.whl",), "a wheel must be the only argument"),
    ],
)
def test_wrong_arguments(spec: Path, tmp_path: Path, arguments: tuple[str, ...], message: str) -> None:
    done = CliRunner().invoke(main, ["package", str(spec), *arguments, "-o", str(tmp_path)])
    assert done.exit_code and message in " ".join(done.output.split()) and not list(tmp_path.iterdir())


def test_no_compiler(spec: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CC", "no-such-compiler")
    done = package(spec, "-o", tmp_path)
    assert done.exit_code == 1 and "no-such-compiler" in done.output and "--no-build" in done.output


@needs_compiler
def test_a_runtime_of_another_version_is_refused(pure: Path) -> None:
    files = contents(pure)
    with pytest.raises(BackendError, match="no generated C file next to a runtime"):
        compiled_files({name: data for name, data in files.items() if "gac_runtime" not in name})
    files["my_kernels/gac_runtime/names.py"] += b"\n"
    with pytest.raises(BackendError, match=r"names\.py: not the runtime of this version"):
        compiled_files(files)


def test_a_damaged_wheel_is_refused(pure: Path, tmp_path: Path) -> None:
    files = contents(pure)
    files["my_kernels/my_kernels.c"] += b"\n"
    with zipfile.ZipFile(tmp_path / pure.name, "w") as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    done = package(tmp_path / pure.name, "-o", tmp_path / "dist")
    assert done.exit_code == 1 and "Hash mismatch" in done.output
    assert "for every platform" in package("a-1-cp311-cp311-linux_x86_64.whl", "-o", tmp_path / "dist").output


# Platforms.


def library(folder: Path, text: str, *options: str) -> tuple[str, bytes]:
    """A library of some C."""
    compiler = find_compiler()
    assert compiler is not None
    source, target = folder / "text.c", folder / "libtext.so"
    source.write_text(text)
    subprocess.run([*compiler, "-shared", "-fPIC", str(source), "-o", str(target), *options], check=True)
    return target.name, target.read_bytes()


@needs_compiler
def test_the_platform_is_the_earliest_that_has_the_symbols(tmp_path: Path) -> None:
    plain = library(tmp_path, "int f(int a) { return a; }\n")
    earliest = platform_tag([plain])
    assert earliest in ("manylinux_2_17_x86_64", "manylinux_2_17_aarch64")
    # A symbol of a version that glibc has had since 2.28.
    later = library(tmp_path, "int fcntl64(int, int, ...);\nint f(void) { return fcntl64(0, 1); }\n")
    assert platform_tag([plain, later]) == platform_tag([later]) == earliest.replace("2_17", "2_28")


@needs_compiler
def test_what_needs_more_than_glibc_has_no_platform(tmp_path: Path) -> None:
    library(tmp_path, "int g(void) { return 1; }\n", "-Wl,-soname,libother.so.1")
    (tmp_path / "libtext.so").rename(tmp_path / "libother.so")
    dependent = library(tmp_path, "int g(void);\nint f(void) { return g(); }\n", f"-L{tmp_path}", "-lother")
    with pytest.raises(BackendError, match=r"it needs libother\.so\.1; expected a library that depends only on glibc"):
        platform_tag([dependent])
    with pytest.raises(BackendError, match="not an ELF library"):
        platform_tag([("text.so", b"text" * 20)])


def test_levels_are_those_of_the_runtime() -> None:
    assert LEVELS == (1, 3, 4)
