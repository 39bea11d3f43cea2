"""The extension module that passes calls from the Python interpreter directly to compiled kernels, if it is built."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .extension_file import find_extension

extension: Any = find_extension()
"""The extension; None if it is not built."""
if TYPE_CHECKING:

    class Call:
        """Base class of kernels, of which the stubs of modules declare calls with their arguments."""

        _bind: Any
        _bind_results: Any

        def __call__(self, *arguments: Any, **options: Any) -> Any: ...
        def attempt(self, *arrays: Any) -> Any:
            """Return the results for arrays that the extension reads directly, and None for all other arguments."""

        @classmethod
        def _adopt(cls) -> None: ...

    LoopCall = Call
else:
    Call = object if extension is None else extension.Call
    LoopCall = object if extension is None else extension.LoopCall


class Signature:
    """Descriptor for the signature of a kernel, as `inspect` reads it; `inspect` cannot derive it from C."""

    def __get__(self, kernel: Any, owner: type) -> Any:
        if kernel is None:
            raise AttributeError("__signature__ is defined for kernels only, not for their class")
        import inspect
        import keyword

        kinds = inspect.Parameter
        names = kernel.argument_names
        reserved = any(map(keyword.iskeyword, names))
        kind = kinds.POSITIONAL_ONLY if reserved else kinds.POSITIONAL_OR_KEYWORD
        parameters = [kinds(name, kind) for name in names]
        named = [kinds(name, kinds.KEYWORD_ONLY, default=None) for name in ("out", "num_threads")]
        return inspect.Signature([*parameters, *named])
