"""Operators of torch on a device, without one: Triton by its interpreter, CUDA as C++ with a loop over the threads.

Both have the tensors on the CPU, where operators would otherwise call the C library.
"""

from __future__ import annotations

import ctypes
import functools
import importlib.util
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from operator_kernels import SHAPES, arm, compile_quickly, move_point, picked, polynomial, two_results
from programs import needs

import gacompiler
from gacompiler.errors import BackendError, KernelError

pytestmark = pytest.mark.peers

torch = pytest.importorskip("torch")

from gacompiler import torch_devices  # noqa: E402
from gacompiler.torch import _Operator  # noqa: E402

ON_A_PROCESSOR = """
#include <cmath>
using std::sqrt; using std::sin; using std::cos; using std::fabs; using std::floor; using std::exp; using std::log;
#define __host__
#define __device__
#define __global__
static struct { unsigned x; } threadIdx, blockIdx, blockDim, gridDim;
extern "C" void thread(unsigned block, unsigned each, unsigned blocks, unsigned threads)
{ blockIdx.x = block; threadIdx.x = each; gridDim.x = blocks; blockDim.x = threads; }
"""


class OnAProcessor:
    """What `torch_devices.Cuda` does, for memory of the processor."""

    folder = Path()
    launched: list[str] = []  # noqa: RUF012

    def __init__(self, text: str, device: Any) -> None:
        self.processors = 1
        source = self.folder / f"{abs(hash(text))}.cpp"
        if not source.with_suffix(".so").exists():
            source.write_text(ON_A_PROCESSOR + text)
            flags = ("-std=c++17", "-O1", "-ffp-contract=off", "-shared", "-fPIC")
            subprocess.run(["g++", *flags, source, "-o", source.with_suffix(".so")], check=True)
        self.library = ctypes.CDLL(str(source.with_suffix(".so")))

    def launch(self, name: str, blocks: int, threads: int, arguments: Sequence[int]) -> None:
        """Run the threads one after the other."""
        self.launched.append(name)
        for block in range(blocks):
            for thread in range(threads):
                self.library.thread(block, thread, blocks, threads)
                getattr(self.library, name)(*map(ctypes.c_longlong, arguments))


@pytest.fixture
def by_triton(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("triton", reason="no Triton; pip install 'gacompiler[peers]' installs it on Linux")
    monkeypatch.setenv("TRITON_INTERPRET", "1")
    _on_device(monkeypatch)


@pytest.fixture
def by_cuda(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> type[OnAProcessor]:
    """Kernels without loops are compiled by NVRTC, too, where Triton is missing."""
    OnAProcessor.folder, OnAProcessor.launched = tmp_path, []
    monkeypatch.setattr(torch_devices, "Cuda", OnAProcessor)
    monkeypatch.setattr(torch_devices.importlib.util, "find_spec", lambda name: None)
    _on_device(monkeypatch)
    return OnAProcessor


def _on_device(monkeypatch: pytest.MonkeyPatch) -> None:
    compile_quickly(monkeypatch)
    compiled = functools.partial(torch_devices.compile_spec, effort=0)
    monkeypatch.setattr(torch_devices, "compile_spec", compiled)
    monkeypatch.setattr(_Operator, "on_processor", _Operator.on_device)


def operator(kernel: Any) -> Any:
    """Return an operator that was not made by another test, whose device was another one."""
    return gacompiler.torch.operator.__wrapped__(kernel)  # type: ignore[attr-defined]


def tensors(*shapes: tuple[int, ...], dtype: Any = None) -> list[Any]:
    torch.manual_seed(0)
    return [torch.randn(shape, dtype=dtype or torch.float64, requires_grad=True) for shape in shapes]


@pytest.mark.parametrize("path", ["by_triton", pytest.param("by_cuda", marks=needs("g++"))])
@pytest.mark.parametrize(("definition", "shapes"), SHAPES[:2], ids=lambda x: getattr(x, "name", None))
def test_kernels_without_loops(definition: Any, shapes: Any, path: str, request: pytest.FixtureRequest) -> None:
    """Values are those of the C library; derivatives of both orders are those of differences."""
    expected = gacompiler.torch.operator(definition)(*tensors(*shapes))
    request.getfixturevalue(path)
    run, given = operator(definition), tensors(*shapes)
    found = run(*given)
    for one, other in zip(*((each if isinstance(each, tuple) else (each,)) for each in (found, expected)), strict=True):
        assert torch.allclose(one, other, rtol=1e-14, atol=1e-14)
    assert torch.autograd.gradcheck(run, given)
    assert torch.autograd.gradgradcheck(run, given, fast_mode=True)


@pytest.mark.parametrize("path", ["by_triton", pytest.param("by_cuda", marks=needs("g++"))])
def test_batches_types_and_graphs(path: str, request: pytest.FixtureRequest) -> None:
    request.getfixturevalue(path)
    run, (m, p) = operator(move_point), tensors((300, 8), (300, 3))
    wanted = run(m, p)
    apart = torch.cat([p, p], 1)[:, :3], m.T.contiguous().T, m[::2].repeat_interleave(2, 0)
    assert torch.equal(run(apart[1], apart[0]), wanted)
    assert torch.equal(run(apart[2][::2], p[::2]), wanted[::2])
    assert torch.equal(run(m[0].expand(300, 8), p), run(m[0], p))
    assert torch.equal(torch.vmap(run, in_dims=(0, None))(m[:3], p), torch.stack([run(one, p) for one in m[:3]]))
    empty = run(m[:0], p[:0])
    assert empty.shape == (0, 3)
    empty.sum().backward()
    assert not m.grad.any()
    for kind, error in (("bfloat16", 0.1), ("float16", 0.02), ("float32", 1e-5)):
        given = [x.detach().to(getattr(torch, kind)) for x in (m, p)]
        found, exact = run(*given), run(*(x.double() for x in given))
        assert found.dtype == getattr(torch, kind)
        assert (found.double() - exact).abs().max() < error * exact.abs().max()
    compiled = torch.compile(lambda m, p: run(m.sin(), p).square().sum(), fullgraph=True, backend="aot_eager")
    (in_graph,), (eager,) = (
        torch.autograd.grad(cost(m, p), [m])
        for cost in (compiled, lambda m, p: run(m.sin(), p).square().sum())
    )  # fmt: skip
    assert torch.allclose(in_graph, eager, rtol=1e-13)


@needs("g++")
def test_loops(by_cuda: type[OnAProcessor]) -> None:
    """Kernels with a work space, with numbers for each element, and with a table of rows; batches, and one element."""
    q, axes, tool = tensors((2, 3), (3, 3), (4,))
    run = operator(arm)
    assert torch.autograd.gradcheck(run, (q, axes, tool))
    in_c = gacompiler.compile(arm, effort=0)(*(x.detach().numpy() for x in (q, axes, tool)))
    assert torch.allclose(run(q, axes, tool), torch.from_numpy(in_c), rtol=1e-14, atol=1e-14)
    c, x = tensors((500, 4), (500,))
    assert torch.autograd.gradcheck(operator(polynomial), (c[:5].detach().requires_grad_(), x[:5].detach()))
    assert torch.allclose(operator(polynomial)(c, x), sum(c[:, k] * x ** (3 - k) for k in range(4)), rtol=1e-12)
    assert operator(polynomial)(c[:, :0], x).eq(0).all() and operator(polynomial)(c[:0], x[:0]).shape == (0,)
    table, rows = tensors((2, 6, 2))[0], torch.tensor([5, 0, 0, 3])
    operator(picked)(table, rows.int()).sum().backward()
    assert torch.allclose(table.grad[:, 0], 2 * table.detach()[:, 0].flip(-1))
    for wrong in (6, -1):
        with pytest.raises(
            ValueError, match=rf"argument rows is {wrong} in row 1; expected a row of n, which has 6 rows"
        ):
            operator(picked)(table, torch.tensor([0, wrong]))
    with pytest.raises(ValueError, match=r"all elements of a batch share an index table"):
        operator(picked)(table, rows.expand(2, 4))
    with pytest.raises(ValueError, match=r"argument axes has shape \(4, 3\); expected .*n = 3 as q has"):
        run(q, torch.zeros(4, 3, dtype=torch.float64), tool)
    assert {"gac_arm_f64", "gac_arm_vjp_q_f64", "gac_picked_vjp_x_f64"} <= set(by_cuda.launched)
    narrow = operator(polynomial)(c.bfloat16(), x.bfloat16())
    assert narrow.dtype == torch.bfloat16 and by_cuda.launched[-1] == "gac_polynomial_f32"


@needs("g++")
def test_work_space_is_limited(by_cuda: type[OnAProcessor], monkeypatch: pytest.MonkeyPatch) -> None:
    """With fewer threads, each processes more elements; every thread has its own part of the work space."""
    q, axes, tool = (x.detach() for x in tensors((700, 3), (3, 3), (4,)))
    cotangent = torch.ones(700, 4, dtype=torch.float64)
    pull = operator(arm).pull(0)
    expected = pull(q, axes, tool, cotangent)
    monkeypatch.setattr(torch_devices, "_WORK", 1)
    assert all(torch.equal(a, b) for a, b in zip(pull(q, axes, tool, cotangent), expected, strict=True))


@pytest.mark.parametrize("definition", [arm, polynomial, picked, two_results], ids=lambda x: x.name)
def test_text_compiles_by_nvrtc(definition: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    nvidia = importlib.util.find_spec("nvidia")
    folders = nvidia.submodule_search_locations if nvidia else None
    found = sorted(file for folder in folders or () for file in Path(folder).glob("*/lib/libnvrtc*.so.*"))
    if not found:
        pytest.skip("no NVRTC; pip install nvidia-cuda-nvrtc installs it")
    *_, library = [ctypes.CDLL(str(file), ctypes.RTLD_GLOBAL) for file in found]  # the last is libnvrtc.so
    monkeypatch.setattr(torch_devices, "nvrtc", lambda: library)
    spec = torch_devices.Spec("gac", "test", "", "", (definition,), Path())
    text = torch_devices._cuda_text(torch_devices.compile_spec(spec, effort=0))
    for architecture in ("sm_80", "sm_90"):
        program = torch_devices.cubin(text, architecture)
        assert all(f"gac_{definition.name}_{real}".encode() in program for real in ("f64", "f32"))
    with pytest.raises(BackendError, match=r'(?s)NVRTC: gac.cu.*identifier "y" is undefined.*compiles for sm_80'):
        torch_devices.cubin("__device__ int x = y;", "sm_80")


def test_devices_are_named() -> None:
    (m, p) = (x.to("meta") for x in tensors((8,), (3,)))
    run = gacompiler.torch.operator(move_point)
    with pytest.raises(KernelError, match="move_point: tensors on meta; expected tensors on the CPU or on CUDA"):
        run.value(m, p)
    if not torch.version.cuda:
        with pytest.raises(BackendError, match="torch without CUDA; expected torch for CUDA"):
            torch_devices.nvrtc()
