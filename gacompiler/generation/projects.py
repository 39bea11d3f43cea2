"""Write packages of other languages that build as they are: for CMake, cargo and npm."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from ..backends import c_header, c_source, runtime_files
from ..backends.build import FLAGS, GCC_FLAGS
from ..backends.c import environment
from ..backends.c_parts import batches_source, sizes_source
from ..backends.javascript import javascript_source
from ..backends.javascript_types import javascript_types
from ..backends.module import ModuleSource
from ..backends.rust import RUST, rust_source
from ..errors import SpecError

VERSION = "0.1.0"
"""The version of a new package; edit it in the package."""
_TARGETS = frozenset(
    {"all", "clean", "depend", "edit_cache", "help", "install", "list_install_components", "package", "package_source"}
    | {"preinstall", "rebuild_cache", "run_tests", "test"}
)
"""Names of targets that CMake reserves."""


def package_name(folder: Path) -> str:
    """Return the name of the package in a folder, which is that of the folder.

    Raises
    ------
    SpecError
        If no package of CMake, cargo and npm can have this name.
    """
    name = folder.absolute().name
    if name in _TARGETS:
        raise SpecError(str(folder), f"{name} is a target of build systems", "another name of the folder")
    if not re.fullmatch(r"[a-z][a-z0-9_-]*", name):
        expected = "a folder named by lower-case letters, digits, - and _, a letter first"
        raise SpecError(str(folder), "a package has the name of its folder, and this is none", expected)
    return name


def cmake_package(name: str, modules: Sequence[ModuleSource]) -> dict[str, str]:
    """Return the files of a C library with a target that ``find_package`` finds, by name."""
    listed = [module.name for module in modules]
    template = environment().get_template("CMakeLists.txt.jinja")
    # The standard and position-independent code are properties of targets.
    flags = " ".join(flag for flag in FLAGS if flag.startswith("-f") and flag != "-fPIC")
    values = {"flags": flags, "gcc_flags": ";".join(GCC_FLAGS)}
    files = {"CMakeLists.txt": template.render(name=name, version=VERSION, modules=listed, **values)}
    for module in modules:
        known = replace(module, command=f"{module.command} --cmake {name}")
        files[f"include/{module.name}.h"] = c_header(known)
        files[f"src/{module.name}.c"] = c_source(known)
        files[f"src/{module.name}_batches.c"] = batches_source(known)
    files["src/gac_sizes.h"] = sizes_source(modules)
    runtime = {path: text for path, text in runtime_files().items() if Path(path).stem == "gac_runtime"}
    return files | {f"src/{path}": text for path, text in runtime.items()}


def cargo_package(name: str, modules: Sequence[ModuleSource]) -> dict[str, str]:
    """Return the files of a crate without dependencies, by name.

    Raises
    ------
    SpecError
        If a module has the name of a file that cargo gives a meaning.
    """
    for module in modules:
        if module.name in ("lib", "main"):
            raise SpecError(
                f"{module.name}.py", "cargo gives a module of this name a meaning", "another name of the spec"
            )
    about = _summary(modules)
    manifest = (
        f'[package]\nname = "{name}"\nversion = "{VERSION}"\nedition = "2021"\ndescription = {json.dumps(about)}\n'
        "\n[dependencies]\n"
    )
    words = [f"r#{module.name}" if module.name in RUST.reserved else module.name for module in modules]
    lines = [f"//! {about}", "", *(f"pub mod {word};" for word in words), ""]
    files = {"Cargo.toml": manifest, "src/lib.rs": "\n".join(lines)}
    for module in modules:
        files[f"src/{module.name}.rs"] = rust_source(replace(module, command=f"{module.command} --cargo {name}"))
    return files


def npm_package(name: str, modules: Sequence[ModuleSource]) -> dict[str, str]:
    """Return the files of a package of JavaScript modules with types, by name."""
    exports = {
        f"./{module.name}": {"types": f"./{module.name}.d.mts", "default": f"./{module.name}.mjs"} for module in modules
    }
    if len(modules) == 1:
        exports = {".": exports[f"./{modules[0].name}"], **exports}
    manifest = {
        "name": name,
        "version": VERSION,
        "description": _summary(modules),
        "type": "module",
        "sideEffects": False,
        "files": ["*.mjs", "*.d.mts"],
        "exports": exports,
    }
    files = {"package.json": json.dumps(manifest, indent=2) + "\n"}
    for module in modules:
        known = replace(module, command=f"{module.command} --npm {name}")
        files[f"{module.name}.mjs"] = javascript_source(known)
        files[f"{module.name}.d.mts"] = javascript_types(known)
    return files


def _summary(modules: Sequence[ModuleSource]) -> str:
    """Return the first line of the docstring of the first spec."""
    lines = modules[0].summary.strip().splitlines() or [f"Kernels of {', '.join(module.name for module in modules)}."]
    return lines[0].strip()


PACKAGES: Mapping[str, Callable[[str, Sequence[ModuleSource]], dict[str, str]]] = {
    "cmake": cmake_package,
    "cargo": cargo_package,
    "npm": npm_package,
}
"""The function that returns the files of a package, by the option of ``gac generate``."""
