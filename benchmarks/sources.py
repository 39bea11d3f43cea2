"""Read which files of the project import which, and find the tests that a change can affect.

    python -m benchmarks.sources algorithms/vision      # a folder or a file; several are allowed

Imports are read from the source, those inside functions and for type checkers too. A process that a test starts may
import more, so that the whole suite remains the last word.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SOURCES = ("gacompiler", "generated", "algorithms", "benchmarks", "tests", "docs")
PATHS = (Path(), Path("tests/support"), Path("docs"))
"""Folders in which absolute imports are searched, as pytest does."""


def files(root: Path = ROOT) -> frozenset[Path]:
    """Return the Python files of the project, relative to the root."""
    return frozenset(path.relative_to(root) for name in SOURCES for path in (root / name).rglob("*.py"))


def imports(path: Path, known: frozenset[Path], root: Path = ROOT) -> set[Path]:
    """Return those of the `known` files that a file imports. A generated module is not read: it imports the runtime."""
    if is_module(path):
        return {other for other in known if other.parent == Path("generated/gac_runtime")}
    return set(_imported(path, (root / path).read_text(), known))


def imports_of_files(root: Path = ROOT) -> dict[Path, set[Path]]:
    """Return the imports of all files."""
    known = files(root)
    return {path: imports(path, known, root) for path in known}


def is_module(path: Path) -> bool:
    """Whether a file is a generated module."""
    return path.parent == Path("generated")


def _imported(path: Path, text: str, known: frozenset[Path]) -> Iterator[Path]:
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            names, homes = [alias.name for alias in node.names], PATHS
        elif isinstance(node, ast.ImportFrom):
            names = [".".join(filter(None, (node.module, alias.name))) for alias in node.names]
            homes = (path.parents[node.level - 1],) if node.level else PATHS
        else:
            continue
        for name in names:
            parts = name.split(".")
            for home in homes:
                for count in range(1, len(parts) + 1):
                    place = home.joinpath(*parts[:count])
                    yield from known & {place.with_suffix(".py"), place / "__init__.py"}


def affected(changed: Iterable[str], imported: dict[Path, set[Path]]) -> list[Path]:
    """Return the files of tests that import a changed file or a file of a changed folder, and the folder of its tests.

    Parameters
    ----------
    changed : iterable of str
        Files and folders, relative to the root.
    imported : dict
        The result of `imports_of_files`.

    Raises
    ------
    ValueError
        If there is no Python file in one of them.
    """
    reached: set[Path] = set()
    mirrored: set[Path] = set()
    for name in map(Path, changed):
        inside = {path for path in imported if path == name or name in path.parents}
        if not inside:
            raise ValueError(f"ONLY={name}: no Python file; expected a folder or file such as algorithms/vision")
        reached |= inside
        if len(name.parts) > 1:
            mirrored.add(Path("tests", name.parts[1]))
    importers: dict[Path, list[Path]] = {}
    for path, targets in imported.items():
        for target in targets:
            importers.setdefault(target, []).append(path)
    waiting = list(reached)
    while waiting:
        for path in importers.get(waiting.pop(), ()):
            if path not in reached:
                reached.add(path)
                waiting.append(path)
    tests = (path for path in imported if path.parts[0] == "tests" and path.name.startswith("test_"))
    return sorted(path for path in tests if path in reached or path.parent in mirrored)


def main() -> int:
    """Print the files of tests, one per line."""
    try:
        print(*affected(sys.argv[1:], imports_of_files()), sep="\n")
    except ValueError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
