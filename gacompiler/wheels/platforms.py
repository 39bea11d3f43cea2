"""The platform tag of a wheel, computed from what its libraries need."""

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
"""The parts of glibc, which every machine of a manylinux platform has."""

_EARLIEST = 17
"""Manylinux platforms for these machines begin with glibc 2.17."""

_LATER = {"GLIBC_ABI_DT_RELR": 36}
"""Versions that have no number, and the minor version of glibc that brought them."""


def platform_tag(libraries: Iterable[tuple[str, bytes]]) -> str:
    """The earliest manylinux platform on which libraries can be loaded, ``manylinux_2_17_x86_64``.

    Parameters
    ----------
    libraries : iterable of (str, bytes)
        Their names, for errors, and their contents.

    Raises
    ------
    BackendError
        When one is no ELF library, needs more than glibc, or is for another machine than the others.
    """
    machine, minor = "", _EARLIEST
    for name, content in libraries:
        try:
            elf = ELFFile(BytesIO(content))
        except ELFError as error:
            remedy = "build it on Linux, or with --no-build"
            raise BackendError(name, f"no ELF library ({error})", "one for Linux", remedy) from error
        own = _MACHINES.get(elf["e_machine"], str(elf["e_machine"]))
        if own not in _MACHINES.values() or machine not in ("", own):
            known = machine or " or ".join(_MACHINES.values())
            raise BackendError(name, f"a library for {own}", f"one for {known}", "choose the compiler by CC")
        machine = own
        for library in _needed(elf):
            if not _LIBRARIES.fullmatch(library):
                remedy = "choose a compiler for glibc by CC"
                raise BackendError(name, f"it needs {library}", "a library that needs glibc alone", remedy)
        for version in _versions(elf):
            number = re.fullmatch(r"GLIBC_2\.(\d+)(\.\d+)?", version)
            if number is None and version not in _LATER:
                raise BackendError(name, f"it needs the version {version}", "versions of glibc, GLIBC_2.17")
            minor = max(minor, int(number[1]) if number else _LATER[version])
    return f"manylinux_2_{minor}_{machine}"


def _needed(elf: ELFFile) -> Iterator[str]:
    """The libraries that a library links to."""
    for section in elf.iter_sections():
        if isinstance(section, DynamicSection):
            yield from (tag.needed for tag in section.iter_tags("DT_NEEDED"))


def _versions(elf: ELFFile) -> Iterator[str]:
    """The versions of symbols that a library takes from others."""
    for section in elf.iter_sections():
        if isinstance(section, GNUVerNeedSection):
            for _, auxiliaries in section.iter_versions():
                yield from (auxiliary.name for auxiliary in auxiliaries)
