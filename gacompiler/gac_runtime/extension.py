"""The extension module through which calls go from Python's interpreter to a kernel, where it is built."""

from __future__ import annotations

from typing import Any

from .extension_file import find_extension

extension: Any = find_extension()
"""The extension; None where it is not built."""
Call: Any = object if extension is None else extension.Call
"""What kernels inherit."""
LoopCall: Any = object if extension is None else extension.LoopCall
"""What kernels with loops inherit."""


class Signature:
    """The signature of a kernel for `inspect`, which cannot see it in C."""

    def __get__(self, kernel: Any, owner: type) -> Any:
        if kernel is None:
            raise AttributeError("a class has none")
        import inspect
        import keyword

        kinds = inspect.Parameter
        names = kernel.argument_names
        reserved = any(map(keyword.iskeyword, names))
        kind = kinds.POSITIONAL_ONLY if reserved else kinds.POSITIONAL_OR_KEYWORD
        parameters = [kinds(name, kind) for name in names]
        named = [kinds(name, kinds.KEYWORD_ONLY, default=None) for name in ("out", "num_threads")]
        return inspect.Signature([*parameters, *named])
