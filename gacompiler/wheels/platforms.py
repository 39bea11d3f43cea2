"""Compute the platform tag of a wheel from the requirements of its libraries."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from io import BytesIO

from elftools.common.exceptions import ELFError
from elftools.elf.dynamic import DynamicSection
from elftools.elf.elffile import ELFFile
from elftools.elf.gnuversions import GNUVerNeedSection

from ..errors import BackendError
from .formats import is_macho, is_pe, macos_platform, windows_machine

_MACHINES = {"EM_X86_64": "x86_64", "EM_AARCH64": "aarch64"}

_LIBRARIES = re.compile(r"lib(c|m|dl|rt|pthread)\.so\.\d|ld-linux-[\w-]+\.so\.\d")
"""The libraries of glibc, which are present on every manylinux platform."""

_EARLIEST = 17
"""Minor version of the earliest glibc, 2.17, for which manylinux platforms exist on these architectures."""

_LATER = {"GLIBC_ABI_DT_RELR": 36}
"""Symbol versions without a number, and the minor version of glibc that introduced them."""


def platform_tag(libraries: Iterable[tuple[str, bytes]]) -> str:
    """Return the earliest platform on which libraries can be loaded.

    This is ``manylinux_2_17_x86_64``, ``macosx_11_0_arm64``, ``win_amd64`` or a similar one.

    Parameters
    ----------
    libraries : iterable of (str, bytes)
        The names of the libraries, for error messages, and their contents.

    Raises
    ------
    BackendError
        If a file is not a library for Linux, macOS or Windows, depends on libraries other than those of the system, or
        is for a different platform than the others.
    """
    known, latest = ("", ""), (0, 0)
    for name, content in libraries:
        system, machine, version = _platform(name, content)
        if known not in (("", ""), (system, machine)):
            expected = f"one for {' '.join(known)}"
            raise BackendError(name, f"a library for {system} {machine}", expected, "choose the compiler with CC")
        known, latest = (system, machine), max(latest, version)
    system, machine = known
    if system == "win":
        return f"win_{machine}"
    # Versions of macOS from 11 on differ in their first numbers only, in the tags of wheels.
    return f"{system}_{latest[0]}_{0 if system == 'macosx' and latest[0] > 10 else latest[1]}_{machine}"


def _platform(name: str, content: bytes) -> tuple[str, str, tuple[int, int]]:
    """Return the system, the architecture and the earliest version of the system of a library."""
    if is_macho(content):
        machine, version = macos_platform(name, content)
        return "macosx", machine, version
    if is_pe(content):
        return "win", windows_machine(name, content), (0, 0)
    try:
        elf = ELFFile(BytesIO(content))
    except ELFError as error:
        found, expected = f"not an ELF library ({error})", "a library for Linux, macOS or Windows"
        raise BackendError(name, found, expected, "choose the compiler with CC, or use --no-build") from error
    machine, minor = _MACHINES.get(elf["e_machine"], str(elf["e_machine"])), _EARLIEST
    if machine not in _MACHINES.values():
        expected = f"one for {' or '.join(_MACHINES.values())}"
        raise BackendError(name, f"a library for {machine}", expected, "choose the compiler with CC")
    for library in _needed(elf):
        if not _LIBRARIES.fullmatch(library):
            remedy = "choose a compiler for glibc with CC"
            raise BackendError(name, f"it needs {library}", "a library that depends only on glibc", remedy)
    for symbol_version in _versions(elf):
        number = re.fullmatch(r"GLIBC_2\.(\d+)(\.\d+)?", symbol_version)
        if number is None and symbol_version not in _LATER:
            raise BackendError(name, f"it needs the version {symbol_version}", "versions of glibc such as GLIBC_2.17")
        minor = max(minor, int(number[1]) if number else _LATER[symbol_version])
    return "manylinux", machine, (2, minor)


def _needed(elf: ELFFile) -> Iterator[str]:
    """Yield the names of the libraries that a library is linked with."""
    for section in elf.iter_sections():
        if isinstance(section, DynamicSection):
            yield from (tag.needed for tag in section.iter_tags("DT_NEEDED"))


def _versions(elf: ELFFile) -> Iterator[str]:
    """Yield the versions of the symbols that a library imports."""
    for section in elf.iter_sections():
        if isinstance(section, GNUVerNeedSection):
            for _, auxiliaries in section.iter_versions():
                yield from (auxiliary.name for auxiliary in auxiliaries)
