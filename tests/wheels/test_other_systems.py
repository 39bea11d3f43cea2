"""Wheels for other systems: the tags of libraries, whose formats are written here by hand, and what zig compiles."""

from __future__ import annotations

import os
import shutil
import struct
import subprocess
import sys
import zipfile
from importlib.util import find_spec
from pathlib import Path

import pytest
from packaging.tags import mac_platforms
from packaging.utils import parse_wheel_filename
from wheel_examples import SPEC, package, packaged

from gacompiler.errors import BackendError
from gacompiler.wheels.extensions import Python
from gacompiler.wheels.platforms import platform_tag
from gacompiler.wheels.targets import Target, compiler_target
from tests.support.all_cases import all_cases

X86_64, ARM64, POWER = 0x01000007, 0x0100000C, 0x01000012


def macho(machine: int, version: tuple[int, int], *libraries: str, is_old: bool = False) -> tuple[str, bytes]:
    """A library for macOS without code, from the definitions of mach-o/loader.h."""
    packed = version[0] << 16 | version[1] << 8
    commands = [
        struct.pack("<IIII", 0x24, 16, packed, packed)
        if is_old
        else struct.pack("<IIIIII", 0x32, 24, 1, packed, packed, 0)
    ]
    for library in libraries:
        name = library.encode() + b"\0"
        name += b"\0" * (-len(name) % 8)
        commands.append(struct.pack("<IIIIII", 0xC, 24 + len(name), 24, 2, 0, 0) + name)
    body = b"".join(commands)
    return "mac.so", struct.pack("<IIIIIIII", 0xFEEDFACF, machine, 0, 6, len(commands), len(body), 0, 0) + body


def dll(machine: int, *libraries: str) -> tuple[str, bytes]:
    """A library for Windows without code, from the specification of the format PE; its section begins at 0x1000."""
    start, at, offset = 0x80, 0x1000, 0x200
    names, places = b"", []
    for library in libraries:
        places.append(at + 20 * (len(libraries) + 1) + len(names))
        names += library.encode() + b"\0"
    content = b"".join(struct.pack("<IIIII", 0, 0, 0, place, 0) for place in places) + b"\0" * 20 + names
    tables = struct.pack("<IIII", 0, 0, at if libraries else 0, len(content)) + b"\0" * 112
    optional = struct.pack("<H", 0x20B) + b"\0" * 110 + tables
    header = b"PE\0\0" + struct.pack("<HHIIIHH", machine, 1, 0, 0, 0, len(optional), 0x2022) + optional
    header += b".rdata\0\0" + struct.pack("<IIII", len(content), at, len(content), offset) + b"\0" * 16
    before = b"MZ" + b"\0" * 58 + struct.pack("<I", start)
    return "win.so", (before.ljust(start, b"\0") + header).ljust(offset, b"\0") + content


SYSTEM = "/usr/lib/libSystem.B.dylib"


@all_cases(
    "libraries, tag",
    [
        ([macho(ARM64, (11, 0), SYSTEM)], "macosx_11_0_arm64"),
        ([macho(ARM64, (11, 0), SYSTEM), macho(ARM64, (12, 3))], "macosx_12_0_arm64"),
        ([macho(X86_64, (10, 13), SYSTEM, is_old=True)], "macosx_10_13_x86_64"),
        ([dll(0x8664, "KERNEL32.dll", "api-ms-win-crt-math-l1-1-0.dll")], "win_amd64"),
        ([dll(0xAA64), dll(0xAA64, "ucrtbase.dll")], "win_arm64"),
    ],
)
def test_tags(libraries: list[tuple[str, bytes]], tag: str) -> None:
    assert platform_tag(libraries) == tag
    if tag.startswith("macosx"):
        assert tag in mac_platforms((14, 0), tag.partition("_")[2].split("_", 2)[2])


@all_cases(
    "libraries, message",
    [
        ([macho(ARM64, (11, 0), SYSTEM, "/opt/lib/libomp.dylib")], "it needs /opt/lib/libomp.dylib"),
        ([macho(POWER, (11, 0))], "unknown architecture"),
        ([macho(ARM64, (0, 0))], "for which version of macOS"),
        ([macho(ARM64, (11, 0)), macho(X86_64, (11, 0))], "macosx x86_64; expected one for macosx arm64"),
        ([dll(0x8664, "KERNEL32.dll", "libgcc_s_seh-1.dll")], "it needs libgcc_s_seh-1.dll"),
        ([dll(0x14C)], "unknown architecture"),
        ([dll(0x8664), macho(X86_64, (11, 0))], "macosx x86_64; expected one for win amd64"),
        ([("text.so", b"MZ")], "not an ELF library"),
    ],
)
def test_libraries_without_a_tag(libraries: list[tuple[str, bytes]], message: str) -> None:
    with pytest.raises(BackendError, match=message):
        platform_tag(libraries)


@pytest.mark.parametrize(
    ("option", "printed", "target"),
    [
        ("-dumpmachine", "x86_64-linux-gnu", Target("x86_64", "linux")),
        ("-dumpmachine", "x86_64-w64-mingw32", Target("x86_64", "windows")),
        ("--version", "clang version 22\nTarget: arm64-apple-macosx11.0.0\n", Target("aarch64", "darwin")),
        ("--version", "Apple clang\nTarget: x86_64-apple-darwin23.1.0\n", Target("x86_64", "darwin")),
        ("--version", "clang version 22\nTarget: aarch64-unknown-windows-gnu\n", Target("aarch64", "windows")),
    ],
)
def test_the_target_of_a_compiler(option: str, printed: str, target: Target, tmp_path: Path) -> None:
    compiler = tmp_path / "cc"
    compiler.write_text(f'#!/bin/sh\nif [ "$1" = {option} ]; then cat <<END\n{printed}\nEND\nfi\n')
    compiler.chmod(0o755)
    assert compiler_target([str(compiler)]) == target


def test_extensions_are_built_for_the_same_system_only() -> None:
    """A library for Windows on the same architecture gets no extension for Linux."""
    own = Python("cpython", "x86_64", "Linux", "", "")
    assert own.is_for(Target("x86_64", "linux"))
    assert not own.is_for(Target("x86_64", "windows")) and not own.is_for(Target("aarch64", "linux"))
    assert Python("cpython", "AMD64", "Windows", "", "").is_for(Target("x86_64", "windows"))
    assert Python("cpython", "arm64", "Darwin", "", "").is_for(Target("aarch64", "darwin"))


@pytest.mark.skipif(find_spec("ziglang") is not None, reason="zig is installed")
def test_other_platforms_need_zig(tmp_path: Path) -> None:
    (tmp_path / "my_kernels.py").write_text(SPEC)
    done = package(tmp_path / "my_kernels.py", "--platform", "macos-arm64", "-o", tmp_path / "dist")
    assert done.exit_code == 1 and "pip install ziglang" in done.output
    done = package(tmp_path / "my_kernels.py", "--platform", "macos-arm64", "--no-build")
    assert done.exit_code == 2 and "--no-build compiles nothing" in done.output


CALLER = """
#include <stdio.h>
#include <windows.h>
int main(int count, char **words)
{
    HMODULE library = LoadLibraryA(words[1]);
    if (count < 2 || !library)
        return 1;
    void (*move)(const double *, const double *, double *) = (void *)GetProcAddress(library, "one_move_f64");
    void (*batch)(char **, const intptr_t *, const intptr_t *) = (void *)GetProcAddress(library, "one_move_loop_f64");
    const double v[8] = {1, 0, 0, 0, 0, 0, -0.5, 0};
    double x[40][3];
    for (int i = 0; i < 120; i++)
        x[i / 3][i % 3] = i;
    const intptr_t w = sizeof(double), n = 40, steps[] = {0, 3 * w, 3 * w, w, w, w};
    char *args[] = {(char *)v, (char *)x, (char *)x};
    batch(args, &n, steps);
    move(v, x[0], x[0]);
    for (int i = 0; i < 120; i++)
        printf("%g ", x[i / 3][i % 3]);
    return 0;
}
"""
ONE = '''"""Moves."""

from gacompiler import kernel, sandwich
from gacompiler.algebra.catalog import PGA3


@kernel(v=PGA3.UNIT_EVEN, x=PGA3.POINT)
def move(v, x):
    """Move a point."""
    return sandwich(v, x)
'''
TAGS = {
    "linux-aarch64": "manylinux_2_17_aarch64",
    "macos-x86_64": "macosx_11_0_x86_64",
    "macos-arm64": "macosx_11_0_arm64",
    "windows-amd64": "win_amd64",
}


@pytest.mark.skipif(find_spec("ziglang") is None, reason="no zig; run: pip install ziglang")
@pytest.mark.peers
@pytest.mark.parametrize("platform", TAGS)
def test_wheels_for_other_systems(platform: str, tmp_path: Path) -> None:
    (tmp_path / "one.py").write_text(ONE)
    wheel = packaged(tmp_path / "one.py", "--platform", platform, output=tmp_path / "dist")
    assert {str(tag) for tag in parse_wheel_filename(wheel.name)[3]} == {f"py3-none-{TAGS[platform]}"}
    with zipfile.ZipFile(wheel) as archive:
        built = [name for name in archive.namelist() if "/_build/" in name]
        assert len(built) == 1 and "-v" not in built[0].rpartition("/")[2].replace("one-", ""), "one portable library"
        assert f"Tag: py3-none-{TAGS[platform]}" in archive.read("one-0.1.0.dist-info/WHEEL").decode()
        archive.extractall(tmp_path / "inside")
    if platform != "windows-amd64" or not shutil.which("wine"):
        return
    (tmp_path / "caller.c").write_text(CALLER)
    zig = [sys.executable, "-m", "ziglang", "cc", "-target", "x86_64-windows-gnu"]
    subprocess.run([*zig, "caller.c", "-o", "caller.exe"], cwd=tmp_path, check=True, capture_output=True)
    environment = {**os.environ, "WINEPREFIX": str(tmp_path / "wine"), "WINEDEBUG": "-all", "DISPLAY": ""}
    command = ["wine", "caller.exe", f"inside/{built[0]}"]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
    found = [float(word) for word in done.stdout.split()]
    expected = [float(i + (i % 3 == 2)) for i in range(120)]
    expected[2] += 1
    assert found == expected, done.stderr[-1000:]
