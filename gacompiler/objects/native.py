"""An operation as machine code, at once: one small C function, compiled in some 30 ms and kept in the cache.

A generated module has vectorised loops in two precisions, which take a compiler a second. Interactive use wants the
first result soon, so an operation starts as its plain function and a plain loop; `operators.py` says when it becomes
more.
"""

from __future__ import annotations

import ctypes
import hashlib
import importlib.machinery
import importlib.util
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..backends import find_compiler
from ..backends.build import build_extension, extension_name, extension_path
from ..backends.c import kernel_text
from ..errors import BackendError
from ..generate import generated_folder
from ..ir.program import Program
from ..runtime import cache_folder

FLAGS = ("-std=c17", "-O1", "-fPIC", "-shared", "-ffp-contract=off", "-fno-math-errno")

_HEAD = """\
#include <math.h>
#include <stddef.h>
#define REAL double
#define WORD int
#define INLINE __attribute__((unused))
#define NAME(name) kernel_##name
#define SQRT(x) sqrt(x)
#define SIN(x) sin(x)
#define COS(x) cos(x)
#define ATAN2(y, x) atan2(y, x)
#define ACOS(x) acos(x)
#define EXP(x) exp(x)
#define LOG(x) log(x)
#define ABS(x) fabs(x)
#define MINIMUM(a, b) ((a) < (b) || (a) != (a) ? (a) : (b))
#define MAXIMUM(a, b) ((a) > (b) || (a) != (a) ? (a) : (b))
#define LESS(a, b) ((double)((a) < (b)))
#define LESS_EQUAL(a, b) ((double)((a) <= (b)))
#define EQUAL(a, b) ((double)((a) == (b)))
#define SELECT(condition, a, b) ((condition) != 0 ? (a) : (b))
"""


class Native(NamedTuple):
    """Addresses of an operation's functions."""

    element: int
    """A pointer for each argument and the result."""
    marked: int
    """Of one operand: as `element`, behind a pointer that is not used."""
    left: int
    """A copy of the first operand, behind a pointer that is not used."""
    loop: Callable[..., None]
    """A number of elements, then a pointer and a step in bytes for each argument and the result."""
    library: Any


def is_wanted() -> bool:
    """Whether C may run operations: not where GAC_BACKEND asks for something else."""
    return os.environ.get("GAC_BACKEND", "") in ("", "c") and find_compiler() is not None


def native(program: Program) -> Native | None:
    """The functions of a program; None where there is no compiler."""
    if not is_wanted():
        return None
    library = ctypes.CDLL(str(_built(c_text(program))))
    loop = library.loop
    pair: list[Any] = [ctypes.c_void_p, ctypes.c_ssize_t]
    loop.argtypes = [ctypes.c_ssize_t, *(pair * (len(program.arguments) + 1))]
    loop.restype = None
    element, marked, left = (_address(library, name) for name in ("element", "marked", "left"))
    return Native(element, marked, left, loop, library)


def _address(library: Any, name: str) -> int:
    return ctypes.cast(getattr(library, name), ctypes.c_void_p).value or 0


def c_text(program: Program) -> str:
    """The C of an operation: its function as in generated modules, and ways to call it."""
    n = len(program.arguments)
    pointers = ", ".join(f"const double *a{k}" for k in range(n))
    call = ", ".join(f"{'' if argument.shape else '*'}a{k}" for k, argument in enumerate(program.arguments))
    steps = ", ".join(f"const char *p{k}, ptrdiff_t s{k}" for k in range(n))
    reads = ", ".join(f"(const double *)p{k}" for k in range(n))
    moves = ", ".join(f"p{k} += s{k}" for k in range(n))
    size = len(program.arguments[0].components)
    lines = [
        _HEAD,
        *kernel_text(program),
        "",
        f"void element({pointers}, double *out) {{ kernel_{program.name}({call}, out); }}",
        f"void marked(const double *unused, {pointers}, double *out)",
        f"{{ (void)unused; element({', '.join(f'a{k}' for k in range(n))}, out); }}",
        "void left(const double *unused, const double *a, double *out)",
        f"{{ (void)unused; for (int k = 0; k < {size}; k++) out[k] = a[k]; }}",
        "",
        f"void loop(ptrdiff_t n, {steps}, char *out, ptrdiff_t step)",
        "{",
        f"    for (; n > 0; n--, {moves}, out += step)",
        f"        element({reads}, (double *)out);",
        "}",
        "",
    ]
    return "\n".join(lines)


def _built(text: str) -> Path:
    """The library of a text, from the cache or compiled into it."""
    compiler = find_compiler()
    assert compiler is not None
    digest = hashlib.sha256("\0".join([text, *FLAGS, *compiler]).encode()).hexdigest()[:24]
    target = _folder() / f"{digest}.so"
    if target.exists():
        return target
    handle, scratch = tempfile.mkstemp(dir=target.parent, prefix=f".{digest}.")
    os.close(handle)
    command = [*compiler, *FLAGS, "-x", "c", "-", "-o", scratch, "-lm"]
    run = subprocess.run(command, input=text, capture_output=True, text=True, errors="replace")
    if run.returncode:
        Path(scratch).unlink(missing_ok=True)
        first = next(iter(run.stderr.splitlines()), f"status {run.returncode}")
        raise BackendError(compiler[0], f"it failed: {first}", "a C compiler", "set GAC_BACKEND=arrays to do without")
    os.replace(scratch, target)
    return target


@cache
def _folder() -> Path:
    folder = cache_folder() / "objects"
    folder.mkdir(parents=True, exist_ok=True)
    return folder


@cache
def extension() -> Any:
    """The extension that runs functions on the coefficients of single objects, shared with generated modules.

    None where it cannot be built; objects then are arrays. It is built once, in about a second, where no module has it.
    """
    compiler = find_compiler()
    if not is_wanted() or compiler is None:
        return None
    place = extension_path(generated_folder())
    if not place.exists():
        built = build_extension(compiler, cache_folder())
        if built is None:
            return None
        place = built
    name = extension_name()
    if name not in sys.modules:
        loader = importlib.machinery.ExtensionFileLoader(name, str(place))
        try:
            importlib.util.module_from_spec(importlib.machinery.ModuleSpec(name, loader, origin=str(place)))
        except ImportError:
            return None
    found = sys.modules[name]
    probe = np.zeros((2, 3))
    functions = (sys.modules.get("numpy._core.multiarray") or sys.modules["numpy.core.multiarray"])._ARRAY_API
    where = probe.__array_interface__["data"][0]
    known = found.prepare(probe, where, probe.shape, probe.strides, probe.flags.num, np.float64(0), functions)
    return found if known else None
