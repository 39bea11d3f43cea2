"""Kernels compiled by numba: functions for loops of users, and batches at the speed of compiled C.

A batch is run as in the C files: arrays with unit stride are used in place, all others are copied through rows of a
block, and the loop over a block is vectorised. LLVM does not vectorise a loop generated from Python code, because it
would have to compare the address of every component of a result with every other. Therefore the loop is built from
LLVM instructions, with metadata which state that no element reads what another one writes. Callers make copies where
this does not hold.
"""

from __future__ import annotations

import functools
import math
import sys
import zlib
from collections.abc import Callable
from importlib.abc import InspectLoader
from types import FunctionType
from typing import Any, NamedTuple

import numba
import numpy as np

from ..arrays import address_of
from ..definition import Definition, Form
from ..foreign import LOCK, StridedLoop, foreign
from ..functions import OF_ANGLES, SCALAR_FUNCTIONS, bound
from . import batches, llvm
from .batches import DONE, FORM, N_FLAGS, lay_rows, move_block, move_part, move_rows, run_batch
from .elements import call_on_one
from .hoisting import hoisted
from .llvm import Element
from .loops import Loop, loop_over
from .movers import movers_of
from .transcendental import transcendental_functions

_run_rows: Any = None
_apply: Any = None


def _numba_rows(size: int, starts: int, cores: int) -> None:
    """Run the loop of a kernel over a block; copies of this function are named after the kernel."""
    _run_rows(size, starts, cores)


def _numba_jit(*values: Any) -> Any:
    """Run a kernel on one element."""
    return _apply(values)


_scalar_names: dict[str, Any] = {}


@functools.cache
def _mark() -> str:
    """Return a checksum of all sources of machine code: the text of this package and of module `functions`."""
    package = str(__package__)
    names = [name for name in sys.modules if name.startswith(f"{package}.")]
    texts = []
    for name in (*sorted(names), f"{package.rpartition('.')[0]}.functions"):
        spec = sys.modules[name].__spec__
        assert spec is not None and isinstance(spec.loader, InspectLoader)
        texts.append(spec.loader.get_source(name) or "")
    return f"{zlib.crc32(''.join(texts).encode()):08x}"


def kept(decorate: Callable[..., Any], function: Any, **options: Any) -> Any:
    """Compile `function` with numba, cached on disk next to its file or in the user's cache if either is writable.

    The key of numba's cache is the name of a function and the modification time of its file. Therefore the name must
    depend on everything else that affects the machine code: the text of this package.
    """
    function.__qualname__ += f"_{_mark()}"
    try:
        decorated = decorate(cache=True, **options)(function)
    except (RuntimeError, ImportError, AttributeError):
        return decorate(**options)(function)
    # Cached code refers to this module by name, and cannot be loaded if the same file is imported under another name.
    stored = decorated._cache
    load = stored.load_overload

    def load_or_compile(*wanted: Any) -> Any:
        try:
            return load(*wanted)
        except (ImportError, AttributeError):
            return None

    stored.load_overload = load_or_compile
    return decorated


_INNER = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
"""Options for functions that are called only by other compiled functions."""


def _parameters(function: Any) -> tuple[str, ...]:
    names: tuple[str, ...] = function.__code__.co_varnames
    return names[: function.__code__.co_argcount]


def _numba_element(function: Callable[..., Any], near: bool) -> Any:
    """Compile a kernel's function: strict rounding, inf and nan instead of exceptions, inlined into its callers."""
    options = {"error_model": "numpy", "forceinline": True}
    with LOCK:
        if not _scalar_names:
            for name, scalar in SCALAR_FUNCTIONS.items():
                plain = isinstance(scalar, FunctionType)
                copy = bound(scalar, {}) if plain else None
                compiled = kept(numba.njit, copy, pipeline_class=llvm.Compiler, **options) if plain else scalar
                _scalar_names[name] = compiled
    chosen = bound(function, {"__name__": __name__, **_scalar_names, **transcendental_functions(near)})
    if near:
        chosen.__qualname__ += "_near"
    compiler = llvm.NotingCompiler if near else llvm.Compiler
    return kept(numba.njit, chosen, pipeline_class=compiler, **_INNER, **options)


def scalar_kernel(definition: Definition) -> Any:
    """Return the kernel on one element for functions compiled by numba."""
    apply = call_on_one(definition, _element(definition, definition.function))
    chosen = bound(_numba_jit, {"__name__": __name__, "_apply": apply})
    chosen.__name__ = chosen.__qualname__ = definition.name
    return numba.njit(chosen, error_model="numpy", forceinline=True)


def _element(definition: Definition, function: Callable[..., Any]) -> Element:
    """Return a function of a kernel or of one of its forms, generated or not."""
    return (element_of if definition.is_generated else _element_of_user)(function)


_elements: dict[tuple[Callable[..., Any], bool], Element] = {}


def element_of(function: Callable[..., Any], near: bool = False) -> Element:
    """Return a kernel's function; if `near`, it only sets a flag for angles that are too large for vectorised code."""
    with LOCK:
        if (function, near) not in _elements:
            _elements[function, near] = Element(_numba_element(function, near), near)
        return _elements[function, near]


def _element_of_user(function: Any) -> Element:
    """Return a user's function, which is not cached on disk because another one may have the same name."""
    return Element(numba.njit(getattr(function, "py_func", function), error_model="numpy", forceinline=True))


def callback(function: Any, signature: Any, name: str, names: dict[str, Any], keep: bool = True, file: str = "") -> Any:
    """Compile a function that C can call; it is cached next to `file`, where its name is unique."""
    chosen = bound(function, {"__name__": __name__, "range": range, "min": min, "abs": abs, "np": np, **names})
    chosen.__qualname__ = name
    chosen.__code__ = chosen.__code__.replace(co_filename=file or chosen.__code__.co_filename)
    decorate = functools.partial(numba.cfunc, signature, error_model="numpy")
    return kept(decorate, chosen) if keep else decorate()(chosen)


_drivers: dict[str, tuple[Any, Any]] = {}


def _numba_driver(dtype: np.dtype[Any]) -> Any:
    """Return the driver of loops of all kernels over batches of one dtype, as a callable and as compiled function."""
    real = numba.from_dtype(dtype)
    with LOCK:
        if str(real) not in _drivers:
            kind = llvm.ll.DoubleType() if dtype.itemsize == 8 else llvm.ll.FloatType()
            names = {"_w": dtype.itemsize, "_real": real, "_call": llvm.call, "_place": llvm.place, "_at": llvm.at}
            names |= {name: getattr(batches, name) for name in batches.CONSTANTS} | movers_of(kind)
            plain = {"__name__": __name__, "range": range, "min": min, "abs": abs}
            integer, integers = numba.types.intp, numba.types.CPointer(numba.types.intp)
            types = dict.fromkeys(("table", "arrays", "steps", "strides"), integers)
            types |= dict.fromkeys(("starts", "rows", "kinds", "cores"), integer[::1])
            for function in (move_rows, move_part, lay_rows, move_block):
                chosen = bound(function, {**plain, **names})
                chosen.__qualname__ = f"{function.__name__}_{real}"
                # The signature is fixed; otherwise numba would compile a specialization for each literal integer.
                kinds = [types.get(part, integer) for part in _parameters(function)]
                decorate = functools.partial(numba.njit, numba.types.void(*kinds))
                names[f"_{function.__name__}"] = kept(decorate, chosen, error_model="numpy", **_INNER)
            batch = callback(run_batch, integer(*[integers] * 4), f"_batch_{real}", names)
            call = foreign().cast("intptr_t(*)(void *, void *, void *, void *)", batch.address)
            _drivers[str(real)] = call, batch
        return _drivers[str(real)]


class _Steps(NamedTuple):
    """A form of a kernel, or the kernel itself as a form without preparation."""

    same: tuple[str, ...]
    least: int
    n_prepared: int
    prepare: Callable[..., Any] | None
    apply: Callable[..., Any]

    @classmethod
    def of(cls, definition: Definition, form: Form) -> _Steps:
        """Return a form with its functions."""
        prepare, apply, n_prepared = form.prepare, form.apply, form.n_prepared
        if apply is None:
            inputs, outputs = tuple(definition.inputs), tuple(definition.out_shapes)
            prepare, apply, n_prepared = hoisted(definition.function, inputs, outputs, frozenset(form.same))
        return cls(form.same, form.least, n_prepared, prepare, apply)


class Loops(StridedLoop):
    """The loops of a kernel over batches of one dtype, which are compiled on first use.

    Attributes
    ----------
    addresses : tuple of int
        Addresses for the extension: 0 for no loop, the driver, and the table of this kernel.
    """

    def __init__(self, definition: Definition, dtype: np.dtype[Any]) -> None:
        names = [name for name, _ in definition.inputs]
        shapes = [*definition.shapes, *definition.out_shapes]
        table = [len(names), len(shapes), sum(map(len, shapes))]
        for shape in shapes:
            table += [math.prod(shape), len(shape), *shape]
        super().__init__(definition, self._run_batch)
        self._dtype, self._first_form = dtype, len(table)
        flagged = names[:N_FLAGS]
        forms = [form for form in definition.forms if all(name in flagged for name in form.same)]
        self._steps = [_Steps.of(definition, form) for form in forms]
        self._steps.append(_Steps((), 0, 0, None, definition.function))
        for step in self._steps:
            table += [sum(1 << names.index(name) for name in step.same), step.least, step.n_prepared, 0, 0]
        self._table = np.array(table, np.intp)
        self._driver, function = _numba_driver(dtype)
        self._compiled: list[Any] = [function]
        self.addresses = 0, function.address, address_of(self._table)

    def _run_batch(self, starts: Any, dimensions: Any, steps: Any) -> None:
        table = foreign().cast("void *", address_of(self._table))
        while (missing := self._driver(table, starts, dimensions, steps)) != DONE:
            if missing == 0:
                raise MemoryError(f"{self.definition.name}: cannot allocate memory for blocks of elements")
            self._compile(missing)

    def _compile(self, place: int) -> None:
        with LOCK:
            if self._table[place]:
                return
            definition, real = self.definition, numba.from_dtype(self._dtype)
            which, entry = divmod(place - self._first_form, FORM)
            step, dense = self._steps[which], entry == FORM - 1
            fixed = tuple(k for k, (name, _) in enumerate(definition.inputs) if name in step.same)
            exact = _element(definition, step.apply)
            near = element_of(step.apply, near=True) if definition.is_generated and _has_angles(step.apply) else None
            prepare = (element_of(step.prepare), step.n_prepared) if step.prepare else None
            loop = Loop(definition.shapes, definition.out_shapes, real, exact, near, fixed, prepare, dense)
            rows = loop_over(loop)
            name = f"{step.apply.__name__}_{'dense' if dense else 'rows'}_{real}"
            signature = numba.types.void(*[numba.types.intp] * 3)
            file = step.apply.__code__.co_filename
            function = callback(_numba_rows, signature, name, {"_run_rows": rows}, definition.is_generated, file)
            self._compiled.append(function)
            self._table[place] = function.address


def _has_angles(function: Callable[..., Any]) -> bool:
    """Whether a function has sines or cosines, which vectorised code computes for angles of limited size."""
    return not OF_ANGLES.isdisjoint(function.__code__.co_names)
