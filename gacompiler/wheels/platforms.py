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

_MACHINES = {"EM_X86_64": "x86_64", "EM_AARCH64": "aarch64"}

_LIBRARIES = re.compile(r"lib(c|m|dl|rt|pthread)\.so\.\d|ld-linux-[\w-]+\.so\.\d")
"""The libraries of glibc, which are present on every manylinux platform."""

_EARLIEST = 17
"""Minor version of the earliest glibc, 2.17, for which manylinux platforms exist on these architectures."""

_LATER = {"GLIBC_ABI_DT_RELR": 36}
"""Symbol versions without a number, and the minor version of glibc that introduced them."""


def platform_tag(libraries: Iterable[tuple[str, bytes]]) -> str:
    """Return the earliest manylinux platform on which libraries can be loaded, such as ``manylinux_2_17_x86_64``.

    Parameters
    ----------
    libraries : iterable of (str, bytes)
        The names of the libraries, for error messages, and their contents.

    Raises
    ------
    BackendError
        If a file is not an ELF library, depends on libraries other than glibc, or is for a different architecture than
        the others.
    """
    machine, minor = "", _EARLIEST
    for name, content in libraries:
        try:
            elf = ELFFile(BytesIO(content))
        except ELFError as error:
            remedy = "build it on Linux, or use --no-build"
            raise BackendError(name, f"not an ELF library ({error})", "a library for Linux", remedy) from error
        own = _MACHINES.get(elf["e_machine"], str(elf["e_machine"]))
        if own not in _MACHINES.values() or machine not in ("", own):
            known = machine or " or ".join(_MACHINES.values())
            raise BackendError(name, f"a library for {own}", f"one for {known}", "choose the compiler with CC")
        machine = own
        for library in _needed(elf):
            if not _LIBRARIES.fullmatch(library):
                remedy = "choose a compiler for glibc with CC"
                raise BackendError(name, f"it needs {library}", "a library that depends only on glibc", remedy)
        for version in _versions(elf):
            number = re.fullmatch(r"GLIBC_2\.(\d+)(\.\d+)?", version)
            if number is None and version not in _LATER:
                raise BackendError(name, f"it needs the version {version}", "versions of glibc such as GLIBC_2.17")
            minor = max(minor, int(number[1]) if number else _LATER[version])
    return f"manylinux_2_{minor}_{machine}"


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
