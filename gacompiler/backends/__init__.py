"""Print programs as C and Python text, read the text back, and build libraries."""

from __future__ import annotations

from .build import (
    build_extension,
    build_libraries,
    build_library,
    build_module,
    find_compiler,
    library_name,
    library_path,
    no_compiler,
)
from .c import c_header, c_source, standalone_c_source
from .documentation import body_is_intact
from .module import KernelSource, ModuleSource
from .printers import as_printed
from .python import check_names, python_source, python_stub, runtime_files, standalone_python_source, taken_names
from .python_loop_reader import python_procedures
from .readers import (
    Read,
    c_functions,
    c_procedures,
    c_programs,
    python_functions,
    python_programs,
)

__all__ = [
    "KernelSource",
    "ModuleSource",
    "Read",
    "as_printed",
    "body_is_intact",
    "build_extension",
    "build_libraries",
    "build_library",
    "build_module",
    "c_functions",
    "c_header",
    "c_procedures",
    "c_programs",
    "c_source",
    "check_names",
    "find_compiler",
    "library_name",
    "library_path",
    "no_compiler",
    "python_functions",
    "python_procedures",
    "python_programs",
    "python_source",
    "python_stub",
    "runtime_files",
    "standalone_c_source",
    "standalone_python_source",
    "taken_names",
]
