"""The systems and architectures for which compilers produce code, and a compiler for each of them."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Sequence
from importlib.util import find_spec
from typing import NamedTuple

from ..errors import BackendError

_ZIG = {
    "linux-x86_64": "x86_64-linux-gnu.2.17",
    "linux-aarch64": "aarch64-linux-gnu.2.17",
    "macos-x86_64": "x86_64-macos.11.0",
    "macos-arm64": "aarch64-macos.11.0",
    "windows-amd64": "x86_64-windows-gnu",
    "windows-arm64": "aarch64-windows-gnu",
}
"""Zig's names of the platforms, with the earliest versions of their systems."""

PLATFORMS = tuple(_ZIG)
"""The platforms for which ``gac package --platform`` builds wheels."""


class Target(NamedTuple):
    """What a compiler produces code for.

    Attributes
    ----------
    machine : str
        The architecture, as Linux names it: ``x86_64`` or ``aarch64``.
    system : str
        ``linux``, ``darwin``, ``windows`` or another system.
    """

    machine: str
    system: str


def compiler_for(platform: str) -> tuple[str, ...]:
    """Return the command of a C compiler for one of `PLATFORMS`: zig, from the package ``ziglang``.

    Raises
    ------
    BackendError
        If it is not installed.
    """
    if find_spec("ziglang") is None:
        raise BackendError(
            f"gac package --platform {platform}", "no C compiler for other systems", "the package ziglang",
            "run: pip install ziglang, or set CC to a compiler for this platform and omit --platform",
        )  # fmt: skip
    return (sys.executable, "-m", "ziglang", "cc", "-target", _ZIG[platform])


def compiler_target(compiler: Sequence[str]) -> Target:
    """Return what a compiler produces code for.

    Raises
    ------
    BackendError
        If the compiler does not report it.
    """
    # Versions in a target, as zig has them, are errors for -dumpmachine; clang also names the target with its version.
    for option, pattern in (("--version", r"^Target: (\S+)"), ("-dumpmachine", r"^(\S+)")):
        done = subprocess.run([*compiler, option], capture_output=True, text=True)
        found = re.search(pattern, done.stdout, re.MULTILINE)
        if done.returncode == 0 and found:
            return _target(found[1])
    raise BackendError(compiler[0], "it does not report its target architecture", "gcc or clang")


def _target(triple: str) -> Target:
    """Return the target with this name, such as ``arm64-apple-macosx11.0.0``."""
    machine, _, rest = triple.partition("-")
    systems = {"windows": "windows", "mingw": "windows", "linux": "linux", "darwin": "darwin", "macos": "darwin"}
    system = next((system for word, system in systems.items() if word in rest), rest)
    return Target({"arm64": "aarch64", "amd64": "x86_64"}.get(machine, machine), system)
