"""Load spec files and collect their kernels."""

from __future__ import annotations

import ast
import hashlib
import keyword
import sys
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

from ..backends import taken_names
from ..errors import GacError, SpecError, text_of
from ..frontend.kernel import Kernel
from .spec_contents import check_names, digest_of, imports_beside, kernels_of, place_of_failure


@dataclass(frozen=True, slots=True)
class Spec:
    """A file of kernels.

    Attributes
    ----------
    name : str
        The name of the module that is generated from the file.
    command : str
        The command that generates the module, as recorded in the generated files.
    summary : str
    digest : str
        A hash of the text of the file and of the definitions that it imports.
    kernels : tuple of Kernel
        The kernels in the order of their definition.
    path : Path
    algebra : str, optional
        The name of the algebra, for a script.
    """

    name: str
    command: str
    summary: str
    digest: str
    kernels: tuple[Kernel, ...]
    path: Path
    algebra: str | None = None


def load_spec(path: Path, command: str | None = None, algebra: str | None = None) -> Spec:
    """Run a spec file and collect its kernels, in the order of their definition.

    These are the kernels that it defines and those that it assigns to their own names, such as kernels of a `Family`.
    Imported kernels are not included.

    A ``.clu`` file is a script in Gaalop's language, in the named `algebra`, and defines one kernel.

    Raises
    ------
    SpecError
        If the file is missing, is not valid Python, raises an exception, or defines no kernel.
    """
    if not path.is_file():
        found = "a folder" if path.is_dir() else "no such file"
        raise SpecError(str(path), found, "a Python file with @kernel functions", "write one with `gac new NAME`")
    text = text_of(path)
    if path.suffix == ".clu":
        from ..cluscript import load_script

        digest = hashlib.sha256(text.encode()).hexdigest()[:16]
        script = load_script(path, algebra)
        command = f"gac generate {path.name}" + (f" --algebra {algebra}" if algebra else "")
        return Spec(script.name, command, f"The script {path.name}.", digest, (script,), path, algebra)
    module = _executed(path, text)
    tree = ast.parse(text)
    kernels = kernels_of(module, tree)
    if not kernels:
        raise SpecError(str(path), "no kernel in it", "at least one function under @kernel(...)")
    for kernel in kernels:
        if kernel.name in taken_names():
            raise SpecError(kernel.where, "its name is reserved in generated modules", remedy="rename it")
    check_names(path, tree, kernels)
    summary = (module.__doc__ or f"Kernels of {path.name}.").strip()
    digest = digest_of(path, text)
    return Spec(path.stem, command or f"gac generate {path.name}", summary, digest, kernels, path)


def check_module_name(name: str, where: str, remedy: str = "") -> None:
    """Raise an error for the name of a file that a program could not import, or that would hide another module.

    Raises
    ------
    SpecError
        If it is not an identifier, is a keyword of Python, or a module of Python or of what generated modules import.
    """
    expected = "letters, digits and _"
    if not name.isidentifier():
        raise SpecError(where, f"{name!r} is not a valid module name", expected, remedy)
    if keyword.iskeyword(name):
        raise SpecError(where, f"{name!r} is a keyword of Python", "a name that can be imported", remedy)
    if name in sys.stdlib_module_names or name in _NEEDED:
        raise SpecError(where, f"{name!r} would hide the module of that name", "another name", remedy)


_NEEDED = {"gac_runtime", "gacompiler", "generated", "numba", "numpy"}
"""Modules that generated modules and specs import."""


def _executed(path: Path, text: str) -> ModuleType:
    """Execute a spec file as a module that can import other files in its folder."""
    try:
        code = compile(text, str(path), "exec")
    except SyntaxError as error:
        raise SpecError(f"{path}:{error.lineno}:{error.offset}", f"syntax error: {error.msg}") from error
    name = path.stem
    check_module_name(name, str(path), "rename the file")
    module = ModuleType(f"_gac_spec_{name}")
    module.__file__ = str(path)
    try:
        with imports_beside(path, text):
            exec(code, module.__dict__)
    except GacError as error:
        if str(path) in str(error):
            raise
        raise error.at(place_of_failure(path, text, error))  # noqa: B904
    except (Exception, SystemExit) as error:
        raise SpecError(place_of_failure(path, text, error), f"{type(error).__name__}: {error}") from error
    return module
