"""Compilation of an operation as one small C function, which takes about 30 ms and is cached.

A generated module has vectorised loops in two precisions, which take about a second to compile. Interactive use needs
the first result sooner, so an operation starts as a plain function and a plain loop; `operators.py` decides when it is
compiled as a generated module.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import sys
import tempfile
import warnings
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple

from ..backends import find_compiler
from ..backends.c import kernel_text
from ..cache_folder import cache_folder, cache_part
from ..gac_runtime.extension_file import load
from ..gac_runtime.names import extension_path
from ..generation.checked_in import generated_folder
from ..ir.program import Program
from .background import QUEUE, Job

FLAGS = ("-std=c17", "-O1", "-fPIC", "-shared", "-ffp-contract=off", "-fno-math-errno")

_HEAD = """\
#include <math.h>
#include <stddef.h>
#define REAL double
#define WORD int
#define INLINE inline __attribute__((always_inline))
#define NAME(name) kernel_##name
#define FUSED(name, parameters, within)
#define RUN(name, arguments, within) NAME(name##_within) within
#define SQRT(x) sqrt(x)
#define SIN(x) sin(x)
#define COS(x) cos(x)
#define ATAN2(y, x) atan2(y, x)
#define ACOS(x) acos(x)
#define EXP(x) exp(x)
#define LOG(x) log(x)
#define ABS(x) fabs(x)
#define FLOOR(x) floor(x)
#define MINIMUM(a, b) ((a) < (b) || (a) != (a) ? (a) : (b))
#define MAXIMUM(a, b) ((a) > (b) || (a) != (a) ? (a) : (b))
#define LESS(a, b) ((double)((a) < (b)))
#define LESS_EQUAL(a, b) ((double)((a) <= (b)))
#define EQUAL(a, b) ((double)((a) == (b)))
#define SELECT(condition, a, b) ((condition) != 0 ? (a) : (b))

/* The coefficients of an element, which are copied if they do not follow each other in memory. */
static const double *dense(const char *start, ptrdiff_t step, int n, double *copy)
{
    if (step == (ptrdiff_t)sizeof(double))
        return (const double *)start;
    for (int k = 0; k < n; k++)
        copy[k] = *(const double *)(start + k * step);
    return copy;
}
"""


class Native(NamedTuple):
    """Addresses of an operation's functions."""

    element: int
    """Function on one element; takes a pointer for each argument and for the result."""
    marked: int
    """As `element`, with an unused pointer as additional first parameter."""
    left: int
    """Function that copies the first operand; its first parameter is an unused pointer."""
    packed: int
    """Function on one element whose operands follow each other in memory; its first parameter is an unused pointer."""
    loop: int
    """Loop over elements, with the parameters of the loops of generated modules; results are in C order."""
    library: Any


def is_wanted() -> bool:
    """Whether operations may be compiled by C: a compiler exists, and GAC_BACKEND selects no other backend."""
    return os.environ.get("GAC_BACKEND", "") in ("", "c") and find_compiler() is not None


class Build:
    """The build of a program's functions, which are taken from the cache or compiled in the background.

    Attributes
    ----------
    job : Job
        The job of the compiler; `QUEUE` has the waiting and running jobs.
    """

    def __init__(self, program: Program) -> None:
        text, command = c_text(program), (*(find_compiler() or ("cc",)), *FLAGS)
        target = _target(text, command)
        self.job = Job(target, partial(_prepared, target, text, command))
        self._was_reported = False
        if not self.job.is_done:
            QUEUE.add(self.job)

    @property
    def state(self) -> str:
        """``"ready"``, ``"failed"``, ``"waiting"`` or ``"running"``."""
        if self.job.is_done:
            return "ready"
        if self.job.failure:
            return "failed"
        return "waiting" if self.job in QUEUE.waiting else "running"

    def poll(self) -> Native | None:
        """Return the functions if they are ready; None if they are not, or if the compiler has failed.

        Warns
        -----
        RuntimeWarning
            If the compiler has failed.
        """
        if self.job.is_done:
            return _loaded(self.job.target)
        QUEUE.start()
        if self.job.failure and not self._was_reported:
            self._was_reported = True
            warnings.warn(
                f"the C compiler failed: {self.job.failure}; operations run in Python, see gacompiler.objects.builds()",
                RuntimeWarning, stacklevel=2,
            )  # fmt: skip
        return None

    def wait(self) -> Native:
        """Wait for the functions and return them.

        Raises
        ------
        BackendError
            If the compiler fails.
        """
        if not self.job.is_done:
            QUEUE.finish(self.job)
        return _loaded(self.job.target)


_COMPILE = """\
library=$1 scratch=$2; shift 2
if "$@" "$scratch.c" -o "$scratch.so" -lm; then mv -f "$scratch.so" "$library"; status=$?; else status=$?; fi
rm -f "$scratch.c" "$scratch.so"
exit $status
"""
"""A shell script moves the library to its destination, so that this happens even if the program has ended meanwhile."""


def _prepared(target: Path, text: str, command: tuple[str, ...]) -> list[str]:
    """Write the source file next to the future library, and return the command that compiles it."""
    handle, source = tempfile.mkstemp(dir=target.parent, prefix=f".{target.stem}.", suffix=".c")
    with os.fdopen(handle, "w") as stream:
        stream.write(text)
    return ["sh", "-c", _COMPILE, "sh", str(target), source.removesuffix(".c"), *command]


def _target(text: str, command: tuple[str, ...]) -> Path:
    """Return the path of the library for a text."""
    digest = hashlib.sha256("\0".join([text, *command]).encode()).hexdigest()[:24]
    return own_folder() / f"{digest}.so"


def _loaded(path: Path) -> Native:
    library = ctypes.CDLL(str(path))
    names = Native._fields[:-1]
    addresses = {name: ctypes.cast(getattr(library, name), ctypes.c_void_p).value or 0 for name in names}
    return Native(**addresses, library=library)


def c_text(program: Program) -> str:
    """Return the C code of an operation: its function as in generated modules, and functions that call it."""
    n = len(program.arguments)
    pointers = ", ".join(f"const double *a{k}" for k in range(n))
    call = ", ".join(f"{'' if argument.shape else '*'}a{k}" for k, argument in enumerate(program.arguments))
    sizes = [len(argument.components) for argument in program.arguments]
    places = ", ".join(f"all + {sum(sizes[:k])}" for k in range(n))
    axes = [len(argument.shape) for argument in program.arguments]
    starts = [f"starts[{k}] + i * steps[{k}]" for k in range(n)]
    read = [
        f"dense({start}, steps[{n + 1 + sum(axes[:k])}], {size}, a{k})" if axis else f"(const double *)({start})"
        for k, (start, size, axis) in enumerate(zip(starts, sizes, axes, strict=True))
    ]
    rooms = ", ".join(f"a{k}[{size}]" for k, (size, axis) in enumerate(zip(sizes, axes, strict=True)) if axis)
    lines = [
        _HEAD,
        *kernel_text(program),
        "",
        f"static INLINE void one({pointers}, double *out) {{ kernel_{program.name}({call}, out); }}",
        f"void element({pointers}, double *out) {{ one({', '.join(f'a{k}' for k in range(n))}, out); }}",
        f"void marked(const double *unused, {pointers}, double *out)",
        f"{{ (void)unused; one({', '.join(f'a{k}' for k in range(n))}, out); }}",
        "void left(const double *unused, const double *a, double *out)",
        f"{{ (void)unused; for (int k = 0; k < {sizes[0]}; k++) out[k] = a[k]; }}",
        f"void packed(const double *unused, const double *all, double *out) {{ (void)unused; one({places}, out); }}",
        "",
        "void loop(char **starts, const ptrdiff_t *dimensions, const ptrdiff_t *steps)",
        "{",
        f"    double {rooms};" if rooms else "",
        "    for (ptrdiff_t i = 0; i < dimensions[0]; i++)",
        f"        one({', '.join(read)}, (double *)(starts[{n}] + i * steps[{n}]));",
        "}",
        "",
    ]
    return "\n".join(lines)


@cache
def own_folder() -> Path:
    """Return the cache folder of operations."""
    return cache_part("objects")


_BUILD_EXTENSION = """\
import sys
sys.path[:] = sys.argv[2:]
from pathlib import Path
from gacompiler.backends.build import build_extension
if build_extension(Path(sys.argv[1])) is None:
    sys.exit("the Python headers are not installed")
"""


class _Extension:
    """The extension that runs functions on the coefficients of single objects, shared with generated modules.

    Attributes
    ----------
    found : module or None
        The extension; None if it is not available (yet).
    is_settled : bool
        Whether `found` is final.
    """

    def __init__(self) -> None:
        self.found: Any = None
        self.is_settled = False
        self._job: Job | None = None

    def look(self) -> None:
        """Load the extension from the folder of generated modules or from the cache, or start building it."""
        if self._job is None:
            beside = extension_path(generated_folder())
            if not is_wanted() or beside.exists():
                self._settle(beside)
                return
            folder = cache_folder()
            command = (sys.executable or "python3", "-c", _BUILD_EXTENSION, str(folder), *sys.path)
            self._job = Job(extension_path(folder), lambda: command)
            if not self._job.is_done:
                QUEUE.add(self._job)
        if self._job.is_done or self._job.failure:
            self._settle(self._job.target)
        else:
            QUEUE.start()

    def _settle(self, place: Path) -> None:
        self.found = load(place) if is_wanted() else None
        self.is_settled = True


_EXTENSION = _Extension()


def extension() -> Any:
    """Return the extension that runs functions on the coefficients of single objects; None if not available (yet).

    If no module has built it, it is built once, in the background, which takes a second. Until then objects are arrays.
    """
    if not _EXTENSION.is_settled:
        _EXTENSION.look()
    return _EXTENSION.found


def extension_is_settled() -> bool:
    """Whether the result of `extension` is final."""
    extension()
    return _EXTENSION.is_settled
