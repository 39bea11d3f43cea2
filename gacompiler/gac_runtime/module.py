"""The part of a generated module that its kernels share: library, settings, and the functions that declare kernels."""

from __future__ import annotations

import inspect
import os
import warnings
from collections import namedtuple
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from .cache import RuntimeProblem
from .definition import INTERFACE, Definition, Form, counted, result_names, shapes_in
from .documentation import Facts
from .kernel import Kernel
from .layout import SCALAR, Layout, layout
from .library import Library, chosen_backend, without_library
from .loop_definition import cost_text, loop_definition
from .loop_kernel import LoopKernel
from .operators import Family
from .threads import default_threads
from .value import Value, families

__all__ = ["SCALAR", "GeneratedModule", "Kernel", "Layout", "Value", "layout"]

Function = Callable[..., Any]


class GeneratedModule:
    """The runtime object of a generated module, through which the module declares its contents.

    Parameters
    ----------
    namespace : dict
        The global variables of the module. `backend` and `num_threads` are read from them in each call of a kernel.
    interface : int
        The `INTERFACE` for which the module was generated.
    library : str
        The label of its compiled library.

    Raises
    ------
    ImportError
        If the module needs another version of the runtime, if GAC_BACKEND selects a backend that is not available, or
        if GAC_NUM_THREADS is invalid.
    """

    def __init__(self, namespace: dict[str, Any], interface: int, library: str) -> None:
        name = namespace["__name__"]
        if interface != INTERFACE:
            raise ImportError(
                f"{name}: {os.path.dirname(__file__)} is version {INTERFACE} of gac_runtime; expected version "
                f"{interface}; regenerate the modules of that folder with `gac generate`"
            )
        self.namespace = namespace
        self.kernels: list[str] = []
        families[name] = self._family = Family()
        file = Path(os.path.abspath(namespace["__file__"]))
        self.library = Library(library, file.with_name(f"{library.rpartition('-')[0]}.c"))
        namespace["backend"] = chosen_backend(self.library)
        namespace["num_threads"] = default_threads()

    @property
    def backend(self) -> str:
        """The backend that runs the kernels: ``c``, ``numba`` or ``arrays``."""
        return str(self.namespace["backend"])

    @property
    def num_threads(self) -> int:
        """The default number of threads for a large batch."""
        return self.namespace["num_threads"]  # type: ignore[no-any-return]

    def ready_backend(self) -> str:
        """Return `backend`, after building and opening the library if the backend is ``c``.

        If that fails, a warning gives the reason, and numba or array expressions run the kernels from then on.
        """
        if self.backend == "c":
            try:
                self.library.open()
            except RuntimeProblem as error:
                if os.environ.get("GAC_BACKEND", "") == "c":
                    raise ImportError(str(error)) from None
                backend = self.namespace["backend"] = without_library()
                warnings.warn(f"{error}; kernels run on {backend}", RuntimeWarning, stacklevel=4)
        return self.backend

    def kernel(
        self,
        signature: str,
        *layouts: Layout | None,
        cost: str,
        names: str = "",
        results: str = "",
        assumes: Sequence[str] = (),
        error: str = "",
    ) -> Callable[[Function], Kernel]:
        """Return a decorator that declares a kernel from its function on one element.

        Parameters
        ----------
        signature : str
            Shapes of arguments and results, ``(8),(3)->(3)``.
        *layouts : Layout or None
            The layout of each argument, then of each result.
        cost : str
            Operations of one element, ``21 mul, 18 add, 24 fma``.
        names, results : str, optional
            Names of the arguments, if they differ from the function's parameters, and names of the results.
        assumes, error
            See `Facts`.
        """

        def declared(function: Function) -> Kernel:
            shapes, out_shapes = shapes_in(signature)
            code = function.__code__
            inputs = list(zip(names.split() or code.co_varnames[: len(shapes)], shapes, strict=True))
            outputs = list(zip(results.split() or result_names(len(out_shapes)), out_shapes, strict=True))
            parts = {name: layout for (name, _), layout in zip((*inputs, *outputs), layouts, strict=True) if layout}
            definition = Definition(function.__name__, function, inputs, outputs, parts, counted(cost))
            self.kernels.append(definition.name)
            shown = ", ".join(item for item in cost.split(", ") if not item.endswith(" fma"))
            return Kernel(definition, Facts(shown, tuple(assumes), error), self)

        return declared

    def form(self, kernel: Kernel, same: str, *, least: int, n_prepared: int = 0, once: str, each: str) -> None:
        """Declare a form of a kernel; see `Form`. Its functions are in the module if it prepares values."""
        definition, chosen = kernel.definition, same.split()
        own = definition.function.__code__.co_varnames[: len(definition.inputs)]
        labels = [*map(str, range(len(own)))] if any("_" in name for name in own) else own
        label = "_".join(label for label, (name, _) in zip(labels, definition.inputs, strict=True) if name in chosen)
        names = [f"_{definition.name}_{what}_{label}" for what in ("prepare", "apply")]
        prepare, apply = (self.namespace[name] if n_prepared else None for name in names)
        definition.forms.append(Form(tuple(chosen), least, n_prepared, prepare, apply, once, each))

    def loops(
        self,
        signature: str,
        *layouts: Layout | None,
        cost: str,
        names: str = "",
        shared: str = "",
        indices: Mapping[str, str] | None = None,
        work: str = "",
        repeats: bool = False,
        assumes: Sequence[str] = (),
        error: str = "",
    ) -> Callable[[Function], LoopKernel]:
        """Return a decorator that declares a kernel with loops from its function on one element.

        That function takes the lengths, the arguments, the results, and the intermediate tables over lengths.

        Parameters
        ----------
        signature : str
            Shapes of arguments and results, ``(n),(n,6),(8)->(8)``.
        *layouts : Layout or None
            The layout of each argument, then of each result.
        cost : str
            Operations of one element, ``n * (51 mul, 36 add, 51 fma) + 48 mul, 40 add, 48 fma``.
        names : str, optional
            Names of the arguments and results, if they differ from the function's parameters.
        shared : str, optional
            Names of the arguments that are usually the same for all elements of a batch.
        indices : mapping of str to str, optional
            Index tables, with the rule that each of their rows must satisfy: ``an earlier row or -1 of n``.
        work : str, optional
            The intermediate tables, ``carry(8) sums(n,6)``.
        repeats : bool, optional
            Whether the number of iterations depends on the numbers of an element.
        assumes, error
            See `Facts`.
        """

        def declared(function: Function) -> LoopKernel:
            definition = loop_definition(
                function, signature, layouts, self.namespace,
                cost=cost, names=names, shared=shared, indices=indices, work=work, repeats=repeats,
            )  # fmt: skip
            self.kernels.append(definition.name)
            return LoopKernel(definition, Facts(cost_text(definition.cost), tuple(assumes), error), self)

        return declared

    def operators(self, *rows: tuple[str, tuple[type, ...], Any, Kernel, bool]) -> None:
        """Declare operators of the module's types as (symbol, operand types, result type, kernel, reversed) rows."""
        for symbol, types, result, kernel, is_reversed in rows:
            self._family.operators[symbol, types] = kernel, result, is_reversed

    def sums(self, *types: type) -> None:
        """Declare the types of sums and multiples, those with fewer coefficients first."""
        self._family.sums[:] = types

    def named(self, kernel: Kernel, results: str) -> Any:
        """Return a function that returns the results of a kernel as a named tuple.

        A kernel without arguments has one dummy argument, which the function supplies.
        """
        fields = results.split()
        definition = kernel.definition
        words = definition.name.split("_")
        title = "".join(word.capitalize() if word.islower() else word for word in words) + "Results"
        record = namedtuple(title, fields, module=self.namespace["__name__"])  # type: ignore[misc]
        self.namespace[title] = record
        constant = kernel.argument_names == ["nothing"]

        def function(*arguments: Any, **named: Any) -> Any:
            found = kernel(*((0.0,) if constant else arguments), **named)
            return record._make(found if len(fields) > 1 else [found])

        function.__name__ = function.__qualname__ = definition.name
        function.__module__ = self.namespace["__name__"]
        function.__doc__ = (kernel.__doc__ or "").replace(f"``{definition.name}.jit", f"``{definition.name}.kernel.jit")
        signature = inspect.signature(kernel)
        parameters = [each for each in signature.parameters.values() if not (constant and each.name == "nothing")]
        function.__signature__ = signature.replace(parameters=parameters)  # type: ignore[attr-defined]
        layouts = [kernel.layouts[name] for name, _ in definition.outputs]
        for name, value in (
            ("kernel", kernel),
            ("cost", kernel.cost),
            ("layouts", dict(zip(fields, layouts, strict=True))),
        ):
            setattr(function, name, value)
        return function
