"""Read what libraries for macOS and Windows need: their architecture, the earliest system, and other libraries."""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator

from ..errors import BackendError

_MACHO = 0xFEEDFACF
"""The first word of a library for macOS with 64 bits."""
_MACHO_MACHINES = {0x01000007: "x86_64", 0x0100000C: "arm64"}
_LOAD_DYLIB, _VERSION_MIN, _BUILD_VERSION = 0xC, 0x24, 0x32

_PE_MACHINES = {0x8664: "amd64", 0xAA64: "arm64"}
_OF_WINDOWS = re.compile(r"(kernel32|msvcrt|ucrtbase|api-ms-win-crt-[\w-]+)\.dll", re.IGNORECASE)
"""Libraries that every Windows 10 has."""

_PE_IMPORTS = 1
"""The place of the imports among the tables of a library."""


def is_macho(content: bytes) -> bool:
    """Whether a file is a library for macOS with one architecture."""
    return content[:4] == struct.pack("<I", _MACHO)


def is_pe(content: bytes) -> bool:
    """Whether a file is a library for Windows."""
    start = struct.unpack_from("<I", content, 60)[0] if content[:2] == b"MZ" and len(content) >= 64 else 0
    return bool(start) and content[start : start + 4] == b"PE\0\0"


def macos_platform(name: str, content: bytes) -> tuple[str, tuple[int, int]]:
    """Return the architecture of a library for macOS, and the earliest version of the system.

    Raises
    ------
    BackendError
        If it is for another architecture, or needs a library that is not part of the C library.
    """
    machine = _MACHO_MACHINES.get(struct.unpack_from("<I", content, 4)[0])
    if machine is None:
        raise BackendError(name, "a library for an unknown architecture", " or ".join(_MACHO_MACHINES.values()))
    earliest = (0, 0)
    for kind, command in _commands(content):
        if kind == _LOAD_DYLIB:
            needed = _text(command, struct.unpack_from("<I", command, 8)[0])
            if not needed.startswith("/usr/lib/libSystem."):
                raise BackendError(name, f"it needs {needed}", "a library that depends only on libSystem")
        elif kind in (_BUILD_VERSION, _VERSION_MIN):
            packed = struct.unpack_from("<I", command, 12 if kind == _BUILD_VERSION else 8)[0]
            earliest = (packed >> 16, packed >> 8 & 0xFF)
    if earliest == (0, 0):
        raise BackendError(name, "it does not say for which version of macOS it is", "a library for a known version")
    return machine, earliest


def _commands(content: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield the load commands of a library for macOS: their kinds and contents."""
    place = 32
    for _ in range(struct.unpack_from("<I", content, 16)[0]):
        kind, size = struct.unpack_from("<II", content, place)
        yield kind, content[place : place + size]
        place += size


def windows_machine(name: str, content: bytes) -> str:
    """Return the architecture of a library for Windows, as in the tags of wheels.

    Raises
    ------
    BackendError
        If it is for another architecture, or needs a library that is not part of Windows.
    """
    header = struct.unpack_from("<I", content, 60)[0] + 4
    machine, n_sections, optional = struct.unpack_from("<HH12xH", content, header)
    if machine not in _PE_MACHINES:
        raise BackendError(name, "a library for an unknown architecture", " or ".join(_PE_MACHINES.values()))
    first = header + 20
    sections = [struct.unpack_from("<8xIIII", content, first + optional + 40 * k) for k in range(n_sections)]

    def place(address: int) -> int:
        """Return the place in the file of an address in memory."""
        for _, start, size, offset in sections:
            if start <= address < start + size:
                return int(address - start + offset)
        raise BackendError(name, "a damaged table of imports", "a library that a linker wrote")

    imports = struct.unpack_from("<I", content, first + 112 + 8 * _PE_IMPORTS)[0]
    entry = place(imports) if imports else None
    while entry is not None:
        address = struct.unpack_from("<12xI4x", content, entry)[0]
        if not address:
            break
        needed = _text(content, place(address))
        if not _OF_WINDOWS.fullmatch(needed):
            raise BackendError(name, f"it needs {needed}", "a library that depends only on Windows")
        entry += 20
    return _PE_MACHINES[machine]


def _text(content: bytes, place: int) -> str:
    """Return the text that ends with a zero."""
    return content[place : content.index(b"\0", place)].decode()
