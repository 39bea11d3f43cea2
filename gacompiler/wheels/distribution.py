"""Files of a wheel of a user's own kernels: a package of modules with their runtime, and metadata."""

from __future__ import annotations

import keyword
from collections.abc import Mapping
from typing import NamedTuple

from packaging.metadata import Metadata
from packaging.utils import InvalidName, canonicalize_name
from packaging.version import InvalidVersion, Version

from ..backends import runtime_files
from ..errors import SpecError
from .archive import wheel_bytes, wheel_name, wheel_text

REQUIRES_NUMPY = "numpy>=2.1,<3"
"""The requirement of generated modules, which is the same in the metadata of this project."""

REQUIRES_PYTHON = ">=3.11"


class Distribution(NamedTuple):
    """Name and version of an installable distribution, and the name of its package."""

    name: str
    version: str

    @property
    def package(self) -> str:
        """Name under which the package is imported, also used in file names: ``my_kernels``."""
        return self.name.replace("-", "_")

    @property
    def metadata_folder(self) -> str:
        """Folder that contains METADATA, WHEEL and RECORD."""
        return f"{self.package}-{self.version}.dist-info"


def distribution(name: str, version: str) -> Distribution:
    """Return a distribution with its name and version normalised as in package indices.

    Raises
    ------
    SpecError
        If the name is not a valid package name, or the version is invalid.
    """
    try:
        found = Distribution(canonicalize_name(name, validate=True), str(Version(version)))
    except InvalidName:
        raise SpecError(name, "not a valid package name", "letters, digits, - and _") from None
    except InvalidVersion:
        raise SpecError(version, "not a valid version", "a version such as 1.0 or 2026.1.3") from None
    if not found.package.isidentifier() or keyword.iskeyword(found.package):
        raise SpecError(name, f"Python cannot import {found.package!r}", "letters, digits, - and _, a letter first")
    return found


_FORWARDING = '''
from importlib import import_module
from typing import Any


def __getattr__(name: str) -> Any:
    """Return an attribute of the module of the same name, so that ``import NAME`` gives its kernels."""
    if name.startswith("__") and name != "__all__":
        raise AttributeError(name)
    return getattr(import_module(".NAME", __name__), name)


def __dir__() -> list[str]:
    return dir(import_module(".NAME", __name__))
'''
"""The code of a package that has a module of its own name."""


def package_files(known: Distribution, modules: Mapping[str, str], files: Mapping[str, str]) -> dict[str, bytes]:
    """Return the files of a wheel without compiled libraries and RECORD.

    Parameters
    ----------
    known : Distribution
    modules : mapping of str to str
        The summary of each module, by its name.
    files : mapping of str to str
        The texts of the modules, by file name.

    Notes
    -----
    The package contains its own runtime, so that packages with different versions of the runtime can be used together.
    """
    lines = [f"    from {known.package} import {module}" for module in modules]
    summary = next(iter(modules.values())).partition("\n")[0]
    init = '"""Kernels that gacompiler generated:\n\n' + "\n".join(lines) + '\n"""\n'
    if known.package in modules:
        init += _FORWARDING.replace("NAME", known.package)
    texts = {"__init__.py": init, "py.typed": "\n", **runtime_files(), **files}
    inside = {f"{known.package}/{name}": text for name, text in texts.items()}
    inside[f"{known.metadata_folder}/METADATA"] = _metadata(known, summary, modules)
    inside[f"{known.metadata_folder}/WHEEL"] = wheel_text("any")
    return {name: text.encode() for name, text in inside.items()}


def _metadata(known: Distribution, summary: str, modules: Mapping[str, str]) -> str:
    """Return the text of METADATA, validated by `packaging`."""
    sections = [f"## `from {known.package} import {module}`\n\n{about}\n" for module, about in modules.items()]
    found = Metadata.from_raw(
        {
            "metadata_version": "2.4",
            "name": known.name,
            "version": known.version,
            "summary": summary,
            "requires_python": REQUIRES_PYTHON,
            "requires_dist": [REQUIRES_NUMPY],
            "description_content_type": "text/markdown",
            "description": "\n".join([f"# {known.name}\n", *sections]),
        }
    )
    return found.as_rfc822().as_bytes().decode()


def retagged(known: Distribution, platform: str, files: Mapping[str, bytes]) -> tuple[str, bytes]:
    """Return the file name and the contents of the wheel of these files for a platform, which may be ``any``."""
    name = wheel_name(known.package, known.version, platform)
    return name, wheel_bytes(name, {**files, f"{known.metadata_folder}/WHEEL": wheel_text(platform).encode()})
