"""From spec files to the text of modules. Pure but for `load_spec`, `write` and `compare`, which touch files."""

from __future__ import annotations

import ast
import difflib
import hashlib
import importlib.util
import os
import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType

from .algebra.layout import Layout
from .backends import c_header, c_source, python_source, taken_names
from .backends.cuda import cuda_source
from .backends.javascript import javascript_source
from .backends.module import KernelSource, LayoutText, ModuleSource
from .backends.opencl import opencl_source
from .backends.operators import OPERATORS, python_operator
from .backends.rust import rust_source
from .cluscript import load_script
from .errors import BackendError, GacError, SpecError
from .frontend.kernel import Kernel
from .passes.pipeline import compile_kernel
from .passes.record import Compilation
from .passes.single_operation import single_operation
from .prove import rounding_error
from .rings.polynomial import PolynomialRing
from .spec_files import check_names, digest_of, imports_beside, kernels_of, place_of_failure

Progress = Callable[[str], None]

TARGETS: Mapping[str, tuple[str, Callable[[ModuleSource], str]]] = {
    "rust": ("rs", rust_source),
    "javascript": ("mjs", javascript_source),
    "cuda": ("cu", cuda_source),
    "opencl": ("cl", opencl_source),
}
"""Languages beside C and Python: the ending of their file, and what prints it."""


@dataclass(frozen=True, slots=True)
class Spec:
    """A file of kernels."""

    name: str
    command: str
    summary: str
    digest: str
    kernels: tuple[Kernel, ...]
    path: Path
    algebra: str | None = None


def load_spec(path: Path, command: str | None = None, algebra: str | None = None) -> Spec:
    """Run a spec file and collect its kernels, in the order of their definition.

    They are those that it defines, and those that it assigns to their own names, as from a `Family`; what it imports
    is none of them.

    A file ``.clu`` is a script of Gaalop's language in the named `algebra`, and one kernel.

    Raises
    ------
    SpecError
        When the file is missing, is not Python, fails, or defines no kernel.
    """
    if not path.is_file():
        raise SpecError(
            str(path), "no such file", "a Python file with @kernel functions", "write one with `gac new NAME`"
        )
    text = path.read_text()
    if path.suffix == ".clu":
        return _script_spec(path, text, algebra)
    try:
        code = compile(text, str(path), "exec")
    except SyntaxError as error:
        raise SpecError(f"{path}:{error.lineno}:{error.offset}", f"syntax error: {error.msg}") from error
    name = path.stem
    if not name.isidentifier():
        raise SpecError(str(path), f"{name!r} cannot name a module", "letters, digits and _", "rename the file")
    module = ModuleType(f"_gac_spec_{name}")
    module.__file__ = str(path)
    try:
        with imports_beside(path, text):
            exec(code, module.__dict__)
    except GacError as error:
        if str(path) in str(error):
            raise
        raise error.at(place_of_failure(path, text, error))  # noqa: B904
    except Exception as error:
        raise SpecError(place_of_failure(path, text, error), f"{type(error).__name__}: {error}") from error
    tree = ast.parse(text)
    kernels = kernels_of(module, tree)
    if not kernels:
        raise SpecError(str(path), "no kernel in it", "at least one function under @kernel(...)")
    for kernel in kernels:
        if kernel.name in taken_names():
            raise SpecError(kernel.where, "its name belongs to the generated module itself", remedy="rename it")
    check_names(path, tree, kernels)
    return Spec(
        name,
        command or f"gac generate {path.name}",
        (module.__doc__ or f"Kernels of {path.name}.").strip(),
        digest_of(path, text),
        kernels,
        path,
    )


def _script_spec(path: Path, text: str, algebra: str | None) -> Spec:
    script = load_script(path, algebra)
    command = f"gac generate {path.name}" + (f" --algebra {algebra}" if algebra else "")
    digest = hashlib.sha256(text.encode()).hexdigest()[:16]
    return Spec(script.name, command, f"The script {path.name}.", digest, (script,), path, algebra)


def layout_text(layout: Layout, proved: bool = True) -> LayoutText:
    """A layout as generated modules carry it; not `unit` where a result is that only for arguments of more meaning."""
    fixed = tuple((slot.name, str(value)) for slot, value in layout.fixed)
    implied = tuple((slot.name, "implied") for slot, _ in layout.implied)
    name = layout.name if layout.is_scalar else str(layout)
    return LayoutText(
        name,
        () if layout.is_scalar else layout.blades,
        (*fixed, *implied),
        layout.unit and proved,
        layout.user_relations is not None and proved,
        _implied(layout),
    )


def _implied(layout: Layout) -> tuple[tuple[str, str], ...]:
    """Coefficients that follow from the stored ones, and the sums of products that they are."""
    ring = PolynomialRing()
    stored = {name: ring.variable(name) for name in layout.blades}
    found = []
    for slot, function in layout.implied:
        polynomial = ring.lift(function(stored))
        terms = ["*".join([str(factor), *(ring.names[k] for k in m)]) for m, factor in polynomial.terms.items()]
        found.append((slot.name, " + ".join(terms) or "0"))
    return tuple(found)


def kernel_source(record: Compilation) -> KernelSource:
    """A compiled kernel, ready to print."""
    kernel, decision, trace = record.kernel, record.decision, record.trace
    assert decision is not None and trace is not None
    layouts = [(parameter.name, layout_text(parameter.layout)) for parameter in kernel.parameters]
    layouts += [
        (output.name, layout_text(layout, proved))
        for output, layout, proved in zip(trace.outputs, decision.layouts, decision.related, strict=True)
    ]
    relations = [f"{p.name} ~{p.name} = 1" for p in kernel.parameters if p.layout.unit]
    relations += [f"the relations of {p.layout.name} on {p.name}" for p in kernel.parameters if p.layout.user_relations]
    operation = single_operation(record, OPERATORS)
    return KernelSource(
        record.program,
        kernel.summary,
        tuple(layouts),
        record.cost,
        tuple(relations),
        record.uniform,
        python_operator(*operation) if operation else None,
        kernel.result_names,
        rounding_error(record),
    )


def compile_kernels(spec: Spec, progress: Progress = lambda name: None) -> list[Compilation]:
    """Compile every kernel of a spec; `progress` is told each one's name before its turn."""
    records = []
    for kernel in spec.kernels:
        progress(f"{spec.name}.{kernel.name}")
        records.append(compile_kernel(kernel))
    return records


def source_of(spec: Spec, records: Sequence[Compilation]) -> ModuleSource:
    """What is printed of a spec, from its compiled kernels."""
    return ModuleSource(spec.name, spec.summary, spec.command, spec.digest, tuple(map(kernel_source, records)))


def compile_spec(spec: Spec, progress: Progress = lambda name: None) -> ModuleSource:
    """Both at once."""
    return source_of(spec, compile_kernels(spec, progress))


def render(module: ModuleSource) -> dict[str, str]:
    """The files of a module: name -> text."""
    return {
        f"{module.name}.py": python_source(module),
        f"{module.name}.c": c_source(module),
        f"{module.name}.h": c_header(module),
    }


def render_targets(module: ModuleSource, targets: Iterable[str]) -> dict[str, str]:
    """The files of a module in other languages, `TARGETS`: name -> text."""
    files = {}
    for target in targets:
        ending, source = TARGETS[target]
        files[f"{module.name}.{ending}"] = source(replace(module, command=f"{module.command} --target {target}"))
    return files


def write(files: Mapping[str, str | bytes], folder: Path) -> list[Path]:
    """Write files whole or not at all: all are first written beside their places, then renamed.

    Returns the paths whose content changed.

    Raises
    ------
    BackendError
        When the folder cannot be written; existing files are then as they were.
    """
    temporary: dict[Path, Path] = {}
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in files.items():
            path, content = folder / name, text.encode() if isinstance(text, str) else text
            if path.is_file() and path.read_bytes() == content:
                continue
            path.parent.mkdir(parents=True, exist_ok=True)
            handle, scratch = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
            temporary[path] = Path(scratch)
            with os.fdopen(handle, "wb") as stream:
                stream.write(content)
            os.chmod(scratch, 0o644)
        for path, scratch_path in temporary.items():
            os.replace(scratch_path, path)
    except OSError as error:
        for scratch_path in temporary.values():
            scratch_path.unlink(missing_ok=True)
        raise BackendError(
            str(folder), error.strerror or str(error), "a folder that can be written", "choose another with -o"
        ) from error
    return list(temporary)


def compare(files: Mapping[str, str], folder: Path) -> list[str]:
    """Unified diffs from the files in `folder` to what they should be; empty when all are current."""
    diffs = []
    for name, text in files.items():
        path = folder / name
        found = path.read_text().splitlines(keepends=True) if path.is_file() else []
        diff = difflib.unified_diff(
            found, text.splitlines(keepends=True), f"{path}", f"{path} (as the spec gives it now)"
        )
        diffs.append("".join(diff))
    return [diff for diff in diffs if diff]


def own_specs() -> list[Path]:
    """The spec files of the modules that are checked in under ``generated``."""
    folder = Path(__file__).parent / "specs"
    return sorted(path for path in folder.glob("*.py") if path.stem != "__init__")


def generated_folder() -> Path:
    """Where the checked-in modules live: the ``generated`` package beside this one."""
    found = importlib.util.find_spec("generated")
    if found is not None and found.submodule_search_locations:
        return Path(next(iter(found.submodule_search_locations)))
    return Path(__file__).parent.parent / "generated"


def render_own(paths: Iterable[Path], progress: Progress = lambda name: None) -> dict[str, str]:
    """The text of checked-in modules."""
    files: dict[str, str] = {}
    for path in paths:
        spec = load_spec(path, f"gac generate --all {path.stem}")
        files |= render(compile_spec(spec, progress))
    return files
