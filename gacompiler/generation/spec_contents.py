"""What belongs to a spec file: its kernels, and the files that its definitions come from."""

from __future__ import annotations

import ast
import hashlib
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType

from ..errors import SpecError
from ..frontend.kernel import Kernel

_PACKAGE = "gacompiler.specs."
_FOLDER = Path(__file__).parents[1] / "specs"


@contextmanager
def imports_beside(path: Path, text: str) -> Iterator[None]:
    """Let a spec import what lies beside it.

    The files of definitions that it imports are forgotten again, so that the next spec has those of its own folder, and
    as they are then. Bytecode is not kept: Python takes it for current where a file changes within a second and keeps
    its length.
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
    """The kernels of a spec, in the order of the first assignment to their names.

    They are those that it defines, and those that it assigns to their own names: kernels of a family, for example. What
    it imports is there to be used in other kernels.
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
    """Check that a spec gives no kernel's name twice.

    Raises
    ------
    SpecError
        With the line of the second definition.
    """
    names, seen = {kernel.name for kernel in kernels}, dict[str, int]()
    for name, line in _bindings(tree):
        if name in seen and name in names:
            raise SpecError(
                f"{path}:{line}",
                f"{name} is defined twice, first in line {seen[name]}",
                remedy="rename one of them",
            )
        seen[name] = line


def _bindings(tree: ast.Module) -> Iterator[tuple[str, int]]:
    """The names that statements of a file define or assign, with their lines; not those made from their old values."""
    for statement in tree.body:
        if isinstance(statement, ast.FunctionDef):
            yield statement.name, statement.lineno
        elif isinstance(statement, ast.Assign):
            used = {node.id for node in ast.walk(statement.value) if isinstance(node, ast.Name)}
            for node in (node for target in statement.targets for node in ast.walk(target)):
                if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store) and node.id not in used:
                    yield node.id, node.lineno


def digest_of(path: Path, text: str) -> str:
    """The hash of a spec: of its text, and of the files of definitions that it imports.

    These are files beside the spec and in `gacompiler.specs`, also where one imports another. Files of the compiler and
    of libraries do not count.
    """
    texts = [text, *(file.read_text() for file in _imported_files(path, text))]
    return hashlib.sha256("\0".join(texts).encode()).hexdigest()[:16]


def place_of_failure(path: Path, text: str, error: BaseException) -> str:
    """The last line of a spec that led to an error, and that of a file of definitions that it imports.

    The second one is left out where there is none, and where the message of the error names the file. See `digest_of`
    for what these files are.
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
    """Files of definitions in the order of their first import, each once and without the spec itself."""
    seen, found = {path.resolve()}, []
    waiting = _imports(path, text, path.parent)
    while waiting:
        file = waiting.pop(0)
        if file.resolve() not in seen:
            seen.add(file.resolve())
            found.append(file)
            waiting += _imports(file, file.read_text(), path.parent)
    return found


def _imports(file: Path, text: str, folder: Path) -> list[Path]:
    """The files of definitions that a file imports; `folder` is that of the spec."""
    try:
        statements = ast.parse(text).body
    except SyntaxError:  # Python tells of it when it imports the file.
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
            elif name.partition(".")[0] != __package__:
                stem = base.joinpath(*name.split("."))
            else:
                continue
            found += [place for place in (stem.with_suffix(".py"), stem / "__init__.py") if place.is_file()]
    return found
