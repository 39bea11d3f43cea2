"""Contents of a spec file: its kernels, and the files from which it imports definitions."""

from __future__ import annotations

import ast
import hashlib
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType

from ..errors import SpecError, text_of
from ..frontend.kernel import Kernel

_PACKAGE = "gacompiler.specs."
_FOLDER = Path(__file__).parents[1] / "specs"


@contextmanager
def imports_beside(path: Path, text: str) -> Iterator[None]:
    """Allow a spec to import files from its own folder.

    The imported files of definitions are removed from `sys.modules` afterwards, so that the next spec imports the
    current files of its own folder. No bytecode is written, because Python would consider it up to date if a file
    changes within a second and keeps its length.
    """
    folder, loaded, keeps_none = str(path.resolve().parent), set(sys.modules), sys.dont_write_bytecode
    sys.path.insert(0, folder)
    sys.dont_write_bytecode = True
    try:
        yield
    finally:
        sys.dont_write_bytecode = keeps_none
        sys.path.remove(folder)
        files = {file.resolve() for file in _imported_files(path, text)}
        for name in [name for name in sys.modules if name not in loaded]:
            place = getattr(sys.modules[name], "__file__", None)
            if place and not name.startswith(_PACKAGE) and Path(place).resolve() in files:
                del sys.modules[name]


def kernels_of(module: ModuleType, tree: ast.Module) -> tuple[Kernel, ...]:
    """Return the kernels of a spec, in the order of the first assignment to their names.

    These are the kernels that the spec defines, and kernels that it assigns to their own names, such as those of a
    family. Imported kernels are not included; they can be used in other kernels.
    """
    imported = {
        alias.asname or alias.name
        for node in tree.body
        if isinstance(node, (ast.Import, ast.ImportFrom))
        for alias in node.names
    }
    return tuple(
        value
        for name, value in vars(module).items()
        if isinstance(value, Kernel)
        and (value.function.__module__ == module.__name__ or (value.name == name and name not in imported))
    )


def check_names(path: Path, tree: ast.Module, kernels: Sequence[Kernel]) -> None:
    """Check that a spec does not define the name of a kernel twice.

    Raises
    ------
    SpecError
        If it does; the error gives the line of the second definition.
    """
    names, seen = {kernel.name for kernel in kernels}, dict[str, int]()
    for name, line in _bindings(tree):
        if name in seen and name in names:
            raise SpecError(
                f"{path}:{line}",
                f"{name} is defined twice, first on line {seen[name]}",
                remedy="rename one of them",
            )
        seen[name] = line


def _bindings(tree: ast.Module) -> Iterator[tuple[str, int]]:
    """Yield the names that a file defines or assigns, with their lines, except names assigned from their old values."""
    for statement in tree.body:
        if isinstance(statement, ast.FunctionDef):
            yield statement.name, statement.lineno
        elif isinstance(statement, ast.Assign):
            used = {node.id for node in ast.walk(statement.value) if isinstance(node, ast.Name)}
            for node in (node for target in statement.targets for node in ast.walk(target)):
                if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store) and node.id not in used:
                    yield node.id, node.lineno


def digest_of(path: Path, text: str) -> str:
    """Compute the hash of the text of a spec and of the files of definitions that it imports.

    These are files in the folder of the spec and in `gacompiler.specs`, whether imported directly or by another such
    file. Files of the compiler and of libraries are not included.
    """
    texts = [text, *(text_of(file) for file in _imported_files(path, text))]
    return hashlib.sha256("\0".join(texts).encode()).hexdigest()[:16]


def place_of_failure(path: Path, text: str, error: BaseException) -> str:
    """Return the last line of a spec that led to an error, and the last line of a file of definitions that it imports.

    The second line is omitted if no such file was involved, or if the error message already names the file. See
    `digest_of` for the definition of these files.
    """
    known = {file.resolve() for file in _imported_files(path, text)}
    line, inside, trace = None, "", error.__traceback__
    while trace is not None:
        file = trace.tb_frame.f_code.co_filename
        if file == str(path):
            line, inside = trace.tb_lineno, ""
        elif Path(file).resolve() in known and file not in str(error):
            inside = f": {file}:{trace.tb_lineno}"
        trace = trace.tb_next
    return (f"{path}:{line}" if line else str(path)) + inside


def _imported_files(path: Path, text: str) -> list[Path]:
    """Return the files of definitions in the order of their first import, without duplicates and without the spec."""
    seen, found = {path.resolve()}, []
    waiting = _imports(path, text, path.parent)
    while waiting:
        file = waiting.pop(0)
        if file.resolve() not in seen:
            seen.add(file.resolve())
            found.append(file)
            waiting += _imports(file, text_of(file), path.parent)
    return found


def _imports(file: Path, text: str, folder: Path) -> list[Path]:
    """Return the files of definitions that a file imports directly; `folder` is the folder of the spec."""
    try:
        statements = ast.parse(text).body
    except SyntaxError:  # Python reports it when it imports the file.
        return []
    found = []
    for statement in statements:
        base = folder
        if isinstance(statement, ast.Import):
            names = [alias.name for alias in statement.names]
        elif isinstance(statement, ast.ImportFrom):
            module = statement.module
            names = [f"{module}.{alias.name}" if module else alias.name for alias in statement.names]
            names += [module] if module else []
            base = file.resolve().parents[statement.level - 1] if statement.level else folder
        else:
            continue
        for name in names:
            if name.startswith(_PACKAGE):
                stem = _FOLDER.joinpath(*name.removeprefix(_PACKAGE).split("."))
            elif name.partition(".")[0] != _PACKAGE.partition(".")[0]:
                stem = base.joinpath(*name.split("."))
            else:
                continue
            found += [place for place in (stem.with_suffix(".py"), stem / "__init__.py") if place.is_file()]
    return found
