"""Kernels on tensors of a device: Triton for kernels without loops, and CUDA, compiled by NVRTC, for those with loops.

Without Triton, CUDA is used for all. The text is that of ``gac generate --target triton`` and ``--target cuda``.
"""

from __future__ import annotations

import ctypes
import hashlib
import importlib.util
import math
import sys
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import torch

from .backends.module import ModuleSource
from .cache_folder import cache_part
from .errors import BackendError
from .frontend.kernel import Kernel
from .gac_runtime.loop_arguments import as_index, check_rows, resolved
from .generation.cache import open_cache
from .generation.compiling import compile_spec
from .generation.files import write
from .generation.rendering import render_targets
from .generation.spec_files import Spec
from .ir.procedure import Procedure, Storage
from .runtime import load_module

_BLOCK = 128
"""Threads of a block: four warps, so that each part of a multiprocessor has one."""
_BLOCKS = 16
"""Blocks for each multiprocessor, whose 2,048 threads are all it can hold."""
_WORK = 1 << 28
"""The largest number of numbers in the work space of all threads, 2 GiB of doubles."""

Function = Callable[[Sequence[Any]], Sequence[Any]]


def on_device(kernel: Kernel, compiled: Any) -> Function:
    """Return a kernel as a function of tensors of one type on a device.

    Parameters
    ----------
    kernel : Kernel
    compiled : callable
        The same kernel as `gacompiler.compile` returns it, which has the shapes of its arguments.

    Returns
    -------
    callable
        A function of a list of tensors, float32 or float64, whose leading axes broadcast, to a list of tensors.
    """
    spec = Spec("gac", "gacompiler.torch.operator", kernel.summary or kernel.name, "", (kernel,), Path())
    source = compile_spec(spec, cache=open_cache())
    if source.loops:
        return _by_loops(source, source.loops[0].procedure, compiled.definition)
    return _by_triton(source) if importlib.util.find_spec("triton") else _by_cuda(source)


def _by_triton(source: ModuleSource) -> Function:
    name, ((file, text),) = source.kernels[0].program.name, render_targets(source, ["triton"]).items()
    folder = cache_part("modules") / f"{name}-{_digest(text)}"
    write({file: text}, folder)
    module = load_module(folder / file, f"_gac_{folder.name.replace('-', '_')}_triton")
    function = getattr(module, name, None) or getattr(module, f"{name}_")  # names reserved in the language

    def call(tensors: Sequence[Any]) -> Sequence[Any]:
        with torch.cuda.device_of(tensors[0]):
            found = function(*tensors)
        return found if isinstance(found, tuple) else (found,)

    return call


def _by_cuda(source: ModuleSource) -> Function:
    program = source.kernels[0].program
    text, name = _cuda_text(source), f"gac_{program.name}"
    shapes = [*(each.shape for each in program.arguments), *(each.shape for each in program.results)]

    def call(tensors: Sequence[Any]) -> Sequence[Any]:
        leading = torch.broadcast_shapes(
            *(x.shape[: x.ndim - len(shape)] for x, shape in zip(tensors, shapes, strict=False))
        )
        return _launched(text, name, tensors, shapes, leading)

    return call


def _by_loops(source: ModuleSource, procedure: Procedure, definition: Any) -> Function:
    text, name = _cuda_text(source), f"gac_{procedure.name}"
    is_index = [table.storage is Storage.INDEX for table in procedure.parameters]
    real = is_index.index(False)
    work = [table for table in procedure.of(Storage.WORK) if table.lengths]

    def call(tensors: Sequence[Any]) -> Sequence[Any]:
        lengths, leading = resolved(definition, [SimpleNamespace(shape=tuple(x.shape)) for x in tensors])
        for table, x in zip(definition.parameters, tensors, strict=True):
            if table.is_index:
                check_rows(definition, table, as_index(definition, table, x.cpu().numpy()), None, lengths)
        dtype = torch.float64 if definition.in_doubles else tensors[real].dtype
        ready = [x.long().contiguous() if own else x.to(dtype) for x, own in zip(tensors, is_index, strict=True)]
        shapes = [table.core(lengths) for table in (*definition.parameters, *definition.results)]
        sizes = [lengths[each] for each in procedure.lengths]
        numbers = sum(table.size * math.prod(lengths[each] for each in table.lengths) for table in work)
        return _launched(text, name, ready, shapes, leading, sizes, numbers)

    return call


def _launched(
    text: str,
    name: str,
    tensors: Sequence[Any],
    shapes: Sequence[tuple[int, ...]],
    leading: Sequence[int],
    lengths: Sequence[int] | None = None,
    work: int = 0,
) -> list[Any]:
    """Run a kernel of CUDA on a batch; kernels with loops have lengths and take a work space."""
    n, first = math.prod(leading), next(x for x in tensors if x.is_floating_point())
    like: Any = {"dtype": first.dtype, "device": first.device}
    arrays = [
        x.expand((*leading, *shape)).reshape(n, math.prod(shape)) if x.is_floating_point() else x
        for x, shape in zip(tensors, shapes, strict=False)
    ]
    results = [torch.empty((n, math.prod(shape)), **like) for shape in shapes[len(tensors) :]]
    if n:
        with torch.cuda.device_of(first):
            program = Cuda(text, first.device)
            blocks = min(-(-n // _BLOCK), _BLOCKS * program.processors, max(1, _WORK // (_BLOCK * max(work, 1))))
            threads = blocks * _BLOCK
            passed = [n, *(lengths or ())]
            for x in (*arrays, *results):
                passed += [x.data_ptr(), *(x.stride() if x.is_floating_point() else ())]
            if lengths is not None:
                space = torch.empty((work, threads), **like)
                passed += [space.data_ptr(), 1, threads]
            suffix = "f64" if first.dtype == torch.float64 else "f32"
            program.launch(f"{name}_{suffix}", blocks, _BLOCK, passed)
    return [x.reshape((*leading, *shape)) for x, shape in zip(results, shapes[len(tensors) :], strict=True)]


def _cuda_text(source: ModuleSource) -> str:
    ((_, text),) = render_targets(source, ["cuda"]).items()
    return text


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:16]


@cache
class Cuda:
    """Text of CUDA, compiled and loaded for a device.

    Parameters
    ----------
    text : str
        Kernels whose parameters are 64-bit integers and addresses.
    device : torch.device

    Attributes
    ----------
    processors : int
        The number of multiprocessors of the device.
    """

    def __init__(self, text: str, device: Any) -> None:
        facts = torch.cuda.get_device_properties(device)
        self.processors: int = facts.multi_processor_count
        self._driver = ctypes.CDLL("nvcuda.dll" if sys.platform == "win32" else "libcuda.so.1")
        self._module, self._functions = ctypes.c_void_p(), dict[str, ctypes.c_void_p]()
        self._checked("cuModuleLoadData", ctypes.byref(self._module), cubin(text, f"sm_{facts.major}{facts.minor}"))

    def launch(self, name: str, blocks: int, threads: int, arguments: Sequence[int]) -> None:
        """Run a kernel in the current stream of torch."""
        if name not in self._functions:
            function = ctypes.c_void_p()
            self._checked("cuModuleGetFunction", ctypes.byref(function), self._module, name.encode())
            self._functions[name] = function
        numbers = [ctypes.c_longlong(each) for each in arguments]
        places = (ctypes.c_void_p * len(numbers))(*(ctypes.addressof(each) for each in numbers))
        stream = ctypes.c_void_p(torch.cuda.current_stream().cuda_stream)
        grid = [ctypes.c_uint(size) for size in (blocks, 1, 1, threads, 1, 1, 0)]
        self._checked("cuLaunchKernel", self._functions[name], *grid, stream, places, None)

    def _checked(self, function: str, *arguments: Any) -> None:
        code = getattr(self._driver, function)(*arguments)
        if code:
            text = ctypes.c_char_p()
            self._driver.cuGetErrorString(code, ctypes.byref(text))
            raise BackendError(function, (text.value or str(code).encode()).decode(), "a device that runs kernels")


def cubin(text: str, architecture: str) -> bytes:
    """Compile text of CUDA by NVRTC, which comes with torch; products and sums are not contracted.

    Parameters
    ----------
    text : str
    architecture : str
        The device, such as "sm_90".

    Returns
    -------
    bytes
        The program of the device.

    Raises
    ------
    BackendError
        If there is no NVRTC, or it refuses the text.
    """
    library, program, size = nvrtc(), ctypes.c_void_p(), ctypes.c_size_t()
    options = [f"--gpu-architecture={architecture}".encode(), b"--std=c++17", b"-fmad=false"]
    library.nvrtcCreateProgram(ctypes.byref(program), text.encode(), b"gac.cu", 0, None, None)
    try:
        if library.nvrtcCompileProgram(program, len(options), (ctypes.c_char_p * len(options))(*options)):
            library.nvrtcGetProgramLogSize(program, ctypes.byref(size))
            log = ctypes.create_string_buffer(size.value)
            library.nvrtcGetProgramLog(program, log)
            raise BackendError("NVRTC", log.value.decode(errors="replace"), f"text that compiles for {architecture}")
        library.nvrtcGetCUBINSize(program, ctypes.byref(size))
        found = ctypes.create_string_buffer(size.value)
        library.nvrtcGetCUBIN(program, found)
        return found.raw
    finally:
        library.nvrtcDestroyProgram(ctypes.byref(program))


@cache
def nvrtc() -> Any:
    """Return the library NVRTC of the version of CUDA for which torch was built."""
    if not torch.version.cuda:
        raise BackendError("gacompiler.torch", "torch without CUDA", "torch for CUDA, for kernels with loops")
    major = torch.version.cuda.split(".")[0]
    name = f"nvrtc64_{major}0_0.dll" if sys.platform == "win32" else f"libnvrtc.so.{major}"
    try:
        return ctypes.CDLL(name)
    except OSError as error:
        raise BackendError("gacompiler.torch", str(error), name, "install CUDA for torch") from None
