"""Calls of kernels with loops: results by every backend, arguments of every kind, and errors."""

from __future__ import annotations

import inspect
import pickle
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from backend_programs import extension_of, load_beside, write
from loop_examples import EXAMPLES, NAMES, arguments, backwards, interpreted, loop_module, sources, squares
from selection import some_slow

from gacompiler.backends.build import build_extension
from gacompiler.gac_runtime.build import find_compiler
from gacompiler.gac_runtime.names import library_label
from gacompiler.ir.procedure import Storage
from tests.support.all_cases import all_cases

BACKENDS = ("arrays", "numba", "extension")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A module of all examples; numba caches compiled code next to it."""
    folder = tmp_path_factory.mktemp("loops")
    write(loop_module("loops", *EXAMPLES), folder)
    return folder


@pytest.fixture(scope="module")
def module(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """The module with a runtime without the extension, which is built later."""
    # Use a different path, so that the runtime is loaded twice while numba's cache is shared.
    link = tmp_path_factory.mktemp("without_extension") / "loops"
    link.symlink_to(folder)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("GAC_CACHE", str(tmp_path_factory.mktemp("cache")))
        for name in [name for name in sys.modules if name.startswith("calls_")]:
            patch.delitem(sys.modules, name)
        found = load_beside(link / "loops.py", "loops")
    assert extension_of(found) is None
    return found


@pytest.fixture(scope="module")
def quick_module(folder: Path, module: ModuleType) -> ModuleType:
    """The module with a runtime with the extension; loaded second, as otherwise both would find the extension."""
    if build_extension(folder) is None:
        pytest.skip("no C compiler, or no headers of Python")
    found = load_beside(folder / "loops.py", "loops")
    assert extension_of(found) is not None
    return found


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(11)


@pytest.fixture(params=BACKENDS)
def loops(request: pytest.FixtureRequest) -> ModuleType:
    module: ModuleType = request.getfixturevalue("quick_module" if request.param == "extension" else "module")
    module.backend = "numba" if request.param == "extension" else request.param  # type: ignore[attr-defined]
    return module


QUICK = ("forward", "tree", "picked", "newton")
"""Examples that numba compiles in quick tests: a product of motors, a tree, an index table, an iteration."""
SOME = [name for name in NAMES[::3] if name not in QUICK]
"""Examples that numba compiles in slow tests; it takes about a second for each."""


def on_examples(names: Sequence[str], *quick: str, slow: Sequence[str] = SOME) -> pytest.MarkDecorator:
    """Examples on every backend; numba compiles those in `quick`, and in slow tests those in `slow`."""
    cases = [
        pytest.param(backend, name, marks=pytest.mark.slow if backend != "arrays" and name not in quick else ())
        for backend in BACKENDS
        for name in names
        if backend == "arrays" or name in (*quick, *slow)
    ]
    return pytest.mark.parametrize(("loops", "name"), cases, indirect=["loops"])


on_every_example = on_examples(NAMES, *QUICK)


def as_list(results: Any) -> list[Any]:
    return list(results) if isinstance(results, tuple) else [results]


def lengths_of(name: str, least: int) -> dict[str, int]:
    return {length: least + k for k, length in enumerate(sources()[name].procedure.lengths)}


@on_every_example
def test_results_are_those_of_the_interpreter(loops: ModuleType, name: str, rng: np.random.Generator) -> None:
    procedure = sources()[name].procedure
    for n in (1, 2, 5):
        lengths = lengths_of(name, n)
        given = arguments(procedure, lengths, rng)
        found = as_list(getattr(loops, name)(**given))
        for one, known in zip(found, interpreted(procedure, lengths, given), strict=True):
            np.testing.assert_allclose(one, known, rtol=1e-12, strict=isinstance(one, np.ndarray))


@on_every_example
def test_elements_of_a_batch(loops: ModuleType, name: str, rng: np.random.Generator) -> None:
    procedure = sources()[name].procedure
    lengths = lengths_of(name, 3)
    given = arguments(procedure, lengths, rng, (2, 3))
    found = as_list(getattr(loops, name)(*given.values()))
    for place in np.ndindex(2, 3):
        element = {
            table.name: given[table.name]
            if table.shared or table.storage is Storage.INDEX
            else given[table.name][place]
            for table in procedure.parameters
        }
        for one, known in zip(found, interpreted(procedure, lengths, element), strict=True):
            np.testing.assert_allclose(one[place], known, rtol=1e-12)


@on_examples(NAMES, "tree", slow=("forward", "picked", "matrix_products"))
def test_floats(loops: ModuleType, name: str, rng: np.random.Generator) -> None:
    procedure = sources()[name].procedure
    lengths = lengths_of(name, 4)
    given = arguments(procedure, lengths, rng, (3,))
    single = {key: value if value.dtype.kind == "i" else value.astype(np.float32) for key, value in given.items()}
    wide = {key: value if value.dtype.kind == "i" else value.astype(float) for key, value in single.items()}
    kernel = getattr(loops, name)
    for one, known in zip(as_list(kernel(**single)), as_list(kernel(**wide)), strict=True):
        assert one.dtype == np.float32
        # Iterations stop at a different step where differences are rounded to zero.
        if name not in ("newton", "scan_in_iteration"):
            np.testing.assert_allclose(one, known, rtol=3e-5)


def test_an_iteration_ends_separately_for_each_element(loops: ModuleType) -> None:
    x, a = np.ones((3, 1)), np.array([1.0, 4.0, 1e8])
    root, converged, steps = loops.newton(x, a)
    assert list(converged) == [1, 1, 0] and list(steps) == [1, 6, 6]
    np.testing.assert_allclose(root[:2], [1, 2], rtol=1e-12)


def test_without_rows(loops: ModuleType) -> None:
    tool = np.arange(8.0)
    np.testing.assert_array_equal(loops.forward(np.empty(0), np.empty((0, 6)), tool), tool)
    np.testing.assert_array_equal(loops.forward(np.empty((3, 0)), np.empty((0, 6)), tool), [tool] * 3)
    assert loops.squares(np.empty(0)) == 0
    up, down = loops.tree(np.empty((4, 0)), [], 1.0)
    assert up.shape == down.shape == (4, 0)
    summed, lowest, place = loops.picked([], [], np.ones(3))
    assert list(summed) == [0, 0, 0] and (lowest, place) == (0, -1)


def test_empty_batches(loops: ModuleType) -> None:
    found = loops.forward(np.empty((0, 5)), np.empty((5, 6)), np.empty(8))
    assert found.shape == (0, 8) and found.dtype == float
    up, down = loops.tree(np.empty((2, 0, 3)), [-1, 0, 0], 1.0)
    assert up.shape == down.shape == (2, 0, 3)


def test_scalars_are_returned_as_scalars(loops: ModuleType) -> None:
    assert isinstance(loops.squares([1, 2, 3]), np.float64) and loops.squares([1, 2, 3]) == 14
    assert loops.squares(np.array([1, 2, 3], np.int8)).dtype == np.float32
    assert loops.squares(np.array([True, False, True])).dtype == np.float32
    assert loops.squares(np.array([1, 2], ">f8")) == 5
    assert loops.squares(np.array([1, 2], ">f4")).dtype == np.dtype(np.float32)


def test_mixed_types_are_promoted(loops: ModuleType, rng: np.random.Generator) -> None:
    given = arguments(sources()["forward"].procedure, {"n": 3}, rng)
    q, axes, tool = given.values()
    single = loops.forward(q.astype(np.float32), axes, tool)
    assert single.dtype == float
    np.testing.assert_array_equal(single, loops.forward(q.astype(np.float32).astype(float), axes, tool))
    x = q.astype(np.float32)
    assert loops.tree(x, [-1, 0, 1], 2.0)[0].dtype == np.float32
    assert loops.tree(x, [-1, 0, 1], np.float64(2))[0].dtype == float


@on_examples(["forward", "matrix_products", "dense"], "forward")
def test_any_strides(loops: ModuleType, name: str, rng: np.random.Generator) -> None:
    procedure = sources()[name].procedure
    given = arguments(procedure, lengths_of(name, 4), rng, (5, 2))
    known = as_list(getattr(loops, name)(**given))
    orders = [
        {key: np.asfortranarray(value) for key, value in given.items()},
        {key: np.repeat(value, 2, -1)[..., ::2] if value.ndim else value for key, value in given.items()},
        {
            key: np.ascontiguousarray(value[..., ::-1])[..., ::-1] if value.ndim else value
            for key, value in given.items()
        },
    ]
    unaligned = {}
    for key, value in given.items():
        raw = np.empty(value.nbytes + 1, np.uint8)
        unaligned[key] = raw[1:].view(value.dtype).reshape(value.shape)
        unaligned[key][...] = value
        unaligned[key].flags.writeable = False
    for changed in (*orders, unaligned):
        for one, right in zip(as_list(getattr(loops, name)(**changed)), known, strict=True):
            np.testing.assert_array_equal(one, right)


def test_steps_between_elements(loops: ModuleType, rng: np.random.Generator) -> None:
    q, axes, tool = arguments(sources()["forward"].procedure, {"n": 3}, rng, (6, 4)).values()
    known = loops.forward(q, axes, tool)
    np.testing.assert_array_equal(loops.forward(q[::-2, 1:], axes, tool[::-2, 1:]), known[::-2, 1:])
    np.testing.assert_array_equal(loops.forward(q[:, :1], axes, tool[0]), loops.forward(q[:, :1], axes, tool[:1, :]))
    np.testing.assert_array_equal(loops.forward(q[:, 0].T.copy().T, axes, tool[:, 0]), known[:, 0])
    several = rng.uniform(-1, 1, (4, 3, 6))
    found = loops.forward(q, several, tool)
    for k in range(4):
        np.testing.assert_array_equal(found[:, k], loops.forward(q[:, k], several[k], tool[:, k]))


def test_out(loops: ModuleType, rng: np.random.Generator) -> None:
    q, axes, tool = arguments(sources()["forward"].procedure, {"n": 3}, rng, (5,)).values()
    known = loops.forward(q, axes, tool)
    out = np.full((5, 8), np.nan)
    assert loops.forward(q, axes, tool, out=out) is out
    np.testing.assert_array_equal(out, known)
    wide = np.full((5, 16), np.nan)
    loops.forward(q, axes, tool, out=wide[:, ::2])
    np.testing.assert_array_equal(wide[:, ::2], known)
    assert np.isnan(wide[:, 1::2]).all()
    pair = np.empty((5, 3)), np.empty((5, 3))
    assert loops.tree(q, [-1, 0, 0], 2.0, out=pair) is pair
    np.testing.assert_array_equal(pair, loops.tree(q, [-1, 0, 0], 2.0))


def test_out_may_overlap_arguments(loops: ModuleType, rng: np.random.Generator) -> None:
    q, axes, tool = arguments(sources()["forward"].procedure, {"n": 3}, rng, (5,)).values()
    known = loops.forward(q, axes, tool)
    assert loops.forward(q, axes, tool, out=tool) is tool
    np.testing.assert_array_equal(tool, known)
    x = rng.uniform(size=(4, 6))
    known = loops.backwards(x)
    buffer = np.concatenate([x.ravel(), np.zeros(1)])
    loops.backwards(buffer[:24].reshape(4, 6), out=buffer[1:].reshape(4, 6))
    np.testing.assert_array_equal(buffer[1:].reshape(4, 6), known)
    same = np.empty((2, 3))
    loops.tree(np.ones((2, 3)), [-1, 0, 1], 1.0, out=(same, same))
    np.testing.assert_array_equal(same, loops.tree(np.ones((2, 3)), [-1, 0, 1], 1.0)[1])


def test_nan_propagates(loops: ModuleType) -> None:
    x = np.ones((2, 4))
    x[0, 1] = np.nan
    up, down = loops.tree(x, [-1, 0, 0, 1], 1.0)
    assert list(np.isnan(up[0])) == [False, True, False, True] and list(np.isnan(down[0])) == [True, True, False, True]
    assert not np.isnan([up[1], down[1]]).any()


def test_threads(loops: ModuleType, rng: np.random.Generator) -> None:
    q, axes, tool = arguments(sources()["forward"].procedure, {"n": 6}, rng, (20_000,)).values()
    np.testing.assert_array_equal(loops.forward(q, axes, tool, num_threads=2), loops.forward(q, axes, tool))
    x = rng.uniform(size=(20_000, 20))
    parents = np.arange(20) - 1
    for one, known in zip(
        loops.tree(x, parents, 0.5, num_threads=3), loops.tree(x, parents, 0.5, num_threads=1), strict=True
    ):
        np.testing.assert_array_equal(one, known)


def test_index_tables_of_any_integers(loops: ModuleType) -> None:
    x = np.ones(70)
    parents = np.arange(70) // 2 - 1
    known = loops.tree(x, parents, 1.0)
    for table in (parents.tolist(), parents.astype(np.int8), np.repeat(parents, 2)[::2], parents.astype(">i4")):
        np.testing.assert_array_equal(loops.tree(x, table, 1.0), known)
    assert list(loops.picked([1.0], np.array([1], np.uint64), [5.0, 7.0])[0]) == [0, 7]


@all_cases(
    "name, given, message",
    [
        (
            "forward",
            (np.ones(7), np.ones((5, 6)), np.ones(8)),
            r"axes has shape \(5, 6\); expected \(..., n, 6\) with n = 7 as q has",
        ),
        ("forward", (np.ones(7), np.ones((7, 5)), np.ones(8)), r"axes has shape \(7, 5\); expected \(..., n, 6\)"),
        ("forward", (np.ones(7), np.ones(6), np.ones(8)), r"axes has shape \(6,\); expected \(..., n, 6\)"),
        ("forward", (1.0, np.ones((1, 6)), np.ones(8)), r"q has shape \(\); expected \(..., n\)"),
        ("forward", (np.ones(1), np.ones((1, 6)), np.ones(7)), r"tool has shape \(7,\); expected \(..., 8\) with last"),
        ("forward", (np.ones((2, 1)), np.ones((1, 6)), np.ones((3, 8))), "leading axes do not broadcast: q"),
        ("tree", (np.ones(3), [-1, 0], 1.0), r"parents has shape \(2,\); expected \(n,\) with n = 3 as x has"),
        ("tree", (np.ones(3), [[-1, 0, 0]], 1.0), "all elements of a batch share an index table"),
        ("tree", (np.ones(3), [-1, 0, 2], 1.0), "parents is 2 in row 2; expected an earlier row or -1 of n"),
        ("tree", (np.ones(3), [-1, -2, 0], 1.0), "parents is -2 in row 1"),
        ("tree", (np.ones(70), np.arange(70), 1.0), "parents is 0 in row 0"),
        ("picked", (np.ones(2), [0, 3], np.ones(3)), "which is 3 in row 1; expected a row of m, which has 3 rows"),
        ("picked", (np.ones(2), [0, -1], np.ones(3)), "which is -1 in row 1; expected a row of m"),
        ("picked", (np.ones(1), np.array([2**63], np.uint64), np.ones(3)), "which contains 9223372036854775808"),
        ("squares", ([[1.0], [1.0, 2.0]],), "not an array of numbers"),
    ],
)
def test_wrong_values(loops: ModuleType, name: str, given: tuple[Any, ...], message: str) -> None:
    with pytest.raises(ValueError, match=f"{name}: .*{message}"):
        getattr(loops, name)(*given)


@all_cases(
    "name, given, options, message",
    [
        ("squares", (np.ones(3) * 1j,), {}, "dtype complex128; expected float32 or float64$"),
        ("squares", (np.array(["a"]),), {}, "dtype <U1"),
        ("tree", (np.ones(2), [-1.0, 0.0], 1.0), {}, "parents has dtype float64; expected integers"),
        ("tree", (np.ones(2), [-1, 0]), {}, r"2 arguments; expected 3 \(x, parents, scale\)"),
        ("tree", (np.ones(2), [-1, 0]), {"size": 1.0}, "unknown argument size"),
        ("tree", (np.ones(2), [-1, 0]), {"x": 1.0}, "argument x is passed by position and by name"),
        ("tree", (np.ones(2),), {"scale": 1.0}, "missing argument parents"),
        ("squares", (np.ones(2),), {"out": [1.0]}, "out is float|out is list"),
        ("tree", (np.ones(2), [-1, 0], 1.0), {"out": np.ones(2)}, r"expected a tuple of 2 arrays \(out_0, out_1\)"),
        ("backwards", (np.ones(2),), {"out": np.ones(2, np.float32)}, "out has dtype float32; expected float64"),
    ],
)
def test_wrong_arguments(
    loops: ModuleType, name: str, given: tuple[Any, ...], options: dict[str, Any], message: str
) -> None:
    with pytest.raises(TypeError, match=f"{name}: .*({message})"):
        getattr(loops, name)(*given, **options)


def test_wrong_outs(loops: ModuleType) -> None:
    with pytest.raises(ValueError, match=r"out has shape \(3,\); expected \(2,\)"):
        loops.backwards(np.ones(2), out=np.ones(3))
    fixed = np.ones(2)
    fixed.flags.writeable = False
    with pytest.raises(ValueError, match="out is read-only"):
        loops.backwards(np.ones(2), out=fixed)
    with pytest.raises(ValueError, match="num_threads is 0; expected a positive integer"):
        loops.backwards(np.ones(2), num_threads=0)


def test_bound_arguments(loops: ModuleType, rng: np.random.Generator) -> None:
    q, axes, tool = arguments(sources()["forward"].procedure, {"n": 3}, rng, (5,)).values()
    known = loops.forward(q, axes, tool)
    bound = loops.forward.bind(axes=axes)
    assert bound.argument_names == ["q", "tool"] and str(inspect.signature(bound)).startswith("(q, tool, /, *, out=")
    np.testing.assert_array_equal(bound(q, tool), known)
    alone = loops.forward.bind(axes=axes, tool=tool[0])
    np.testing.assert_array_equal(alone(q[0]), known[0])
    out = np.empty(8)
    assert alone(q[0], out=out) is out
    np.testing.assert_array_equal(out, known[0])
    axes *= 2
    np.testing.assert_array_equal(alone(q[0]), known[0])
    assert alone(q[0].astype(np.float32)).dtype == float
    with pytest.raises(ValueError, match=r"q has shape \(2,\)|axes has shape \(3, 6\); expected .* n = 2 as q has"):
        alone(q[0, :2])
    with pytest.raises(TypeError, match=r"forward with fixed arguments: 2 arguments; expected 1 \(q\)"):
        alone(q, tool)
    with pytest.raises(TypeError, match="unknown argument joints"):
        loops.forward.bind(joints=1)
    assert "axes, tool" in repr(alone)


def test_bound_index_tables_are_checked_once_and_copied(loops: ModuleType) -> None:
    parents = np.array([-1, 0, 0, 1])
    bound = loops.tree.bind(parents=parents, scale=2.0)
    known = loops.tree(np.ones(4), parents, 2.0)
    parents[:] = 1000
    np.testing.assert_array_equal(bound(np.ones(4)), known)
    np.testing.assert_array_equal(bound(np.ones((2, 4)))[1][1], known[1])
    with pytest.raises(ValueError, match=r"parents has shape \(4,\); expected \(n,\) with n = 5 as x has"):
        bound(np.ones(5))
    which = loops.picked.bind(which=[0, 2])
    assert list(which(np.ones(2), np.ones(3))[0]) == [1, 0, 1]
    with pytest.raises(ValueError, match="which is 2 in row 1; expected a row of m, which has 2 rows"):
        which(np.ones(2), np.ones(2))


def test_attributes(loops: ModuleType) -> None:
    kernel = loops.forward
    assert (kernel.name, kernel.signature, kernel.lengths) == ("forward", "(n),(n,6),(8)->(8)", ("n",))
    assert kernel.layouts["axes"].blades == ("e12", "e13", "e23", "e01", "e02", "e03")
    assert kernel.cost["n"]["mul"] == 51 and kernel.cost["n"]["call"] == 2 and kernel.cost[""]["add"] == 40
    assert repr(kernel) == f"<kernel {kernel.__module__}.forward(n),(n,6),(8)->(8)>"
    assert str(inspect.signature(kernel)) == "(q, axes, tool, *, out=None, num_threads=None)"
    for line in (
        "Pose of the end effector by the product of exponentials.",
        "q : array_like, (..., n)",
        "axes : array_like, (..., n, 6)",
        "out : array, (..., 8)",
        "Assumes ``a = a``.",
        "Costs n * (51 mul, 36 add, 2 call) + 48 mul, 40 add.",
    ):
        assert line in kernel.__doc__.splitlines()
    assert "parents : array_like of int, (n,)" in loops.tree.__doc__
    assert "Each entry is the index of an earlier row or -1 of n." in loops.tree.__doc__
    assert "forward" in loops.kernels and "forward" in loops.__all__
    with pytest.raises(AttributeError, match=r"forward.jit: a kernel with loops cannot be called inside numba"):
        _ = kernel.jit


def test_pickling(module: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "loops", module)
    assert pickle.loads(pickle.dumps(module.forward)) is module.forward
    bound = module.squares.bind()
    assert pickle.loads(pickle.dumps(bound))([1.0, 2.0]) == 5
    tree = pickle.loads(pickle.dumps(module.tree.bind(parents=[-1, 0])))
    np.testing.assert_array_equal(tree(np.ones(2), 1.0), module.tree(np.ones(2), [-1, 0], 1.0))
    sums = pickle.loads(pickle.dumps(module.suffixes.bind({"n": 2}, n=2.0).returning("out_0", transposed=True)))
    assert sums(np.ones((2, 3))).shape == (4, 2)


def test_kernels_of_modules_that_cannot_be_imported_are_not_pickled(
    module: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delitem(sys.modules, module.__name__, raising=False)
    for found in (module.squares, module.squares.bind(), module.tree.bind(parents=[-1, 0]).returning("out_0")):
        with pytest.raises(pickle.PicklingError, match=r"module .* is not imported under that name"):
            pickle.dumps(found)


def test_numba_code_is_cached(module: ModuleType) -> None:
    module.backend = "numba"
    module.squares([1.0])
    kept = [path.name for path in (Path(str(module.__file__)).parent / "__pycache__").iterdir()]
    assert any(name.startswith("loops.squares_rows_float64") for name in kept)


C_TEXT = """// Two kernels with loops, by hand: the sum of squares, and one that finds no memory.
#include <stdint.h>

#define ROWS(NAME, REAL)                                                                                   \\
    int NAME(const intptr_t *lengths, char **args, const intptr_t *steps, intptr_t count)                  \\
    {                                                                                                      \\
        for (intptr_t k = 0; k < count; k++) {                                                             \\
            const REAL *x = (const REAL *)(args[0] + k * steps[0]);                                        \\
            REAL sum = 0;                                                                                  \\
            for (intptr_t i = 0; i < lengths[0]; i++)                                                      \\
                sum += x[i] * x[i];                                                                        \\
            *(REAL *)(args[1] + k * steps[1]) = sum;                                                       \\
        }                                                                                                  \\
        return 0;                                                                                          \\
    }
ROWS(by_hand_squares_rows_f64, double)
ROWS(by_hand_squares_rows_f32, float)

int by_hand_backwards_rows_f64(const intptr_t *lengths, char **args, const intptr_t *steps, intptr_t count)
{
    return 1;
}
"""


@pytest.fixture(scope="module")
def by_hand(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """A module with a library written by hand."""
    folder = tmp_path_factory.mktemp("by_hand")
    write(loop_module("by_hand", squares, backwards), folder)
    text = (folder / "by_hand.py").read_text()
    text = re.sub(r'library="[^"]*"', f'library="{library_label("by_hand", C_TEXT)}"', text)
    (folder / "by_hand.py").write_text(text)
    (folder / "by_hand.c").write_text(C_TEXT)
    if find_compiler() is None:
        pytest.skip("no C compiler")
    return load_beside(folder / "by_hand.py", "by_hand")


@pytest.mark.slow
def test_a_library_is_called(by_hand: ModuleType, rng: np.random.Generator) -> None:
    assert by_hand.backend == "c"
    for _ in range(2):  # by Python, and then by the extension if it is built
        for x in (rng.uniform(size=7), rng.uniform(size=(3, 2, 7)), rng.uniform(size=(7, 9)).T):
            np.testing.assert_allclose(by_hand.squares(x), (x * x).sum(-1), rtol=1e-14)
            single = x.astype(np.float32)
            found = by_hand.squares(single)
            assert found.dtype == np.float32
            np.testing.assert_allclose(found, (x * x).sum(-1), rtol=1e-5)
    many = rng.uniform(size=(100_000, 20))
    np.testing.assert_allclose(by_hand.squares(many, num_threads=2), (many * many).sum(-1), rtol=1e-14)


@pytest.mark.slow
def test_out_of_memory_is_an_error(by_hand: ModuleType) -> None:
    for _ in range(2):
        with pytest.raises(MemoryError, match="backwards: cannot allocate memory for intermediate results"):
            by_hand.backwards(np.ones(3))
    with pytest.raises(MemoryError):
        by_hand.backwards.bind()(np.ones(3))


def test_calls_after_a_change_of_the_backend(quick_module: ModuleType) -> None:
    x = np.array([1.0, 2.0])
    bound = quick_module.squares.bind()
    for backend in ("numba", "arrays", "numba"):
        quick_module.backend = backend  # type: ignore[attr-defined]
        for _ in range(2):
            assert quick_module.squares(x) == bound(x) == 5


def test_quick_calls_raise_the_same_errors(quick_module: ModuleType) -> None:
    """Calls that the extension does not support are passed to Python, which executes them or raises an error."""
    quick_module.backend = "numba"  # type: ignore[attr-defined]
    x, parents = np.ones(3), np.array([-1, 0, 1])
    known = quick_module.tree(x, parents, 1.0)
    for wrong in ([-1, 0, 2], [-1, 1, 0], [-2, 0, 0]):
        with pytest.raises(ValueError, match="expected an earlier row or -1 of n"):
            quick_module.tree(x, np.array(wrong), 1.0)
    with pytest.raises(ValueError, match=r"with n = 3 as x has"):
        quick_module.tree(x, parents[:2], 1.0)
    for same in (parents.astype(np.int32), parents.tolist(), np.repeat(parents, 2)[::2]):
        np.testing.assert_array_equal(quick_module.tree(x, same, 1), known)
    with pytest.raises(TypeError, match="expected integers"):
        quick_module.tree(x, x, 1.0)
    which = quick_module.picked.bind(which=[0, 2])
    assert list(which(np.ones(2), np.ones(3))[0]) == [1, 0, 1]
    for _ in range(2):
        with pytest.raises(ValueError, match="which is 2 in row 1"):
            which(np.ones(2), np.ones(2))
    buffer = np.arange(9.0)
    known = quick_module.backwards(buffer[:8].copy())
    quick_module.backwards(buffer[:8], out=buffer[1:])
    np.testing.assert_array_equal(buffer[1:], known)
    large = np.ones(20_000)
    assert quick_module.squares(large) == 20_000 and quick_module.squares(large[:10_000]) == 10_000


def in_python(bound: Any, *arrays: Any, **named: Any) -> Any:
    """The results of the general Python implementation, which handles calls with a number of threads."""
    return type(bound).call(bound, *arrays, **({"num_threads": 1} | named))


@pytest.mark.parametrize("leading", [(), (1,), (2,), (7,), (2, 3)])
@pytest.mark.parametrize("name", some_slow([*QUICK, *SOME], *SOME))
def test_the_extension_runs_batches(
    quick_module: ModuleType, name: str, leading: tuple[int, ...], rng: np.random.Generator
) -> None:
    quick_module.backend = "numba"  # type: ignore[attr-defined]
    bound = getattr(quick_module, name).bind()
    given = list(arguments(sources()[name].procedure, lengths_of(name, 3), rng, leading).values())
    known = as_list(in_python(bound, *given))
    found = bound.attempt(*given)
    assert found is not None
    for one, other in zip(as_list(found), known, strict=True):
        np.testing.assert_array_equal(one, other, strict=True)
        assert type(one) is type(other)


@pytest.mark.parametrize("leading", [(), (3,)])
@pytest.mark.parametrize("name", some_slow([*QUICK, *SOME], *SOME))
def test_the_extension_runs_single_precision(
    quick_module: ModuleType, name: str, leading: tuple[int, ...], rng: np.random.Generator
) -> None:
    quick_module.backend = "numba"  # type: ignore[attr-defined]
    bound = getattr(quick_module, name).bind()
    given = [
        array if array.dtype.kind == "i" else np.asarray(array, np.float32)
        for array in map(np.asarray, arguments(sources()[name].procedure, lengths_of(name, 3), rng, leading).values())
    ]
    known = as_list(in_python(bound, *given))
    found = bound.attempt(*given)
    assert found is not None
    for one, other in zip(as_list(found), known, strict=True):
        np.testing.assert_array_equal(one, other, strict=True)
        assert type(one) is type(other)
    outs = tuple(np.empty_like(one) for one in known)
    if all(out.ndim for out in outs):
        assert bound(*given, out=outs if len(outs) > 1 else outs[0]) is (outs if len(outs) > 1 else outs[0])
        for one, other in zip(outs, known, strict=True):
            np.testing.assert_array_equal(one, other, strict=True)


def test_numbers_beside_arrays_in_single_precision(quick_module: ModuleType) -> None:
    """Python's numbers follow the arrays; numpy's have a precision of their own."""
    quick_module.backend = "numba"  # type: ignore[attr-defined]
    newton = quick_module.newton
    x = np.float32([1, 2])
    for _ in range(2):
        assert all(result.dtype == np.float32 for a in (2.0, 2, np.float32(2)) for result in as_list(newton(x, a)))
        assert all(result.dtype == np.float64 for result in as_list(newton(x, np.float64(2))))
        assert all(result.dtype == np.float64 for result in as_list(newton(x.astype(float), np.float32(2))))
        assert all(result.dtype == np.float64 for result in as_list(newton(x.astype(float), 2)))


def test_the_extension_leaves_other_batches_to_python(quick_module: ModuleType, rng: np.random.Generator) -> None:
    quick_module.backend = "numba"  # type: ignore[attr-defined]
    q, axes, tool = arguments(sources()["forward"].procedure, {"n": 3}, rng, (4,)).values()
    forward = quick_module.forward.bind(axes=axes)
    known = forward(q, tool)
    assert forward.attempt(q, tool) is not None
    fixed = q.copy()
    fixed.flags.writeable = False
    np.testing.assert_array_equal(forward.attempt(fixed, tool), known)
    others = (
        (np.asfortranarray(q), tool),
        (np.repeat(q, 2, axis=0)[::2], tool),
        (q[::-1][:, ::-1], tool),
        (q.astype(np.float32), tool),
        (q.astype(">f8"), tool),
        (q.tolist(), tool),
        (q[:1], tool),
        (q[:, None], tool),
        (q[:0], tool[:0]),
    )
    for arrays in others:
        assert forward.attempt(*arrays) is None
        wide = [np.array(array, float) for array in np.broadcast_arrays(*(np.zeros(np.shape(a)[:-1]) for a in arrays))]
        found = forward(*arrays)
        assert found.shape == (*wide[0].shape, 8)
        for place in np.ndindex(wide[0].shape):
            element = [np.broadcast_to(a, (*wide[0].shape, np.shape(a)[-1]))[place] for a in arrays]
            np.testing.assert_allclose(found[place], forward(*map(np.array, element)), rtol=1e-6)
    assert forward.attempt(q) is None and forward.attempt(q, tool, tool) is None
    with pytest.raises(ValueError, match=r"q has shape \(4, 2\); expected \(..., n\)|axes has shape \(3, 6\)"):
        forward(q[:, :2].copy(), tool)
    with pytest.raises(ValueError, match="leading axes do not broadcast"):
        forward(q[:3], tool)
    with pytest.raises(TypeError, match="q has dtype complex128"):
        forward(q + 0j, tool)
    q[1] = np.nan
    np.testing.assert_array_equal(np.isnan(forward(q, tool)).all(-1), [False, True, False, False])


def test_converted_elements_are_passed_back_to_the_extension(
    quick_module: ModuleType, rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Lists and other orders of axes are converted, and do not take the way of batches."""
    quick_module.backend = "numba"  # type: ignore[attr-defined]
    q, axes, tool = arguments(sources()["forward"].procedure, {"n": 3}, rng).values()
    calls = quick_module.forward, quick_module.forward.bind(axes=axes)
    known = [calls[0](q, axes, tool), calls[1](q, tool)]

    def run(*_: Any, **__: Any) -> None:
        raise AssertionError("the extension was not asked")

    monkeypatch.setattr(type(quick_module.forward), "run", run)
    for same in (q.tolist(), tuple(q), np.repeat(q, 2)[::2]):
        np.testing.assert_array_equal(calls[0](same, np.asfortranarray(axes), tool.tolist()), known[0])
        np.testing.assert_array_equal(calls[1](same, tool), known[1])
    with pytest.raises(AssertionError, match="the extension was not asked"):
        calls[1](q.astype(np.float32), tool.astype(np.float32))
    with pytest.raises(TypeError, match="q has dtype complex128"):
        calls[1](q + 0j, tool)


def test_what_the_extension_does_not_take_is_not_passed_to_it_again(quick_module: ModuleType) -> None:
    """Empty index tables were converted and passed back without end; dtypes depended on earlier calls."""
    quick_module.backend = "numba"  # type: ignore[attr-defined]
    quick_module.tree([1, 2], [-1, 0], 2)
    with pytest.raises(ValueError, match=r"parents has shape \(0,\); expected \(n,\) with n = 2"):
        quick_module.tree([1, 2], [], 2)
    bound = quick_module.newton.bind(x=np.float32([1, 2]))
    dtypes = [[result.dtype for result in bound(a)] for a in (2.0, 2.0, np.float64(2), np.float64(2), 2.0)]
    assert dtypes[0] == dtypes[1] == dtypes[4] == [np.float32] * 3 and dtypes[2] == dtypes[3] == [np.float64] * 3


def test_batches_in_the_extension_write_to_out(quick_module: ModuleType) -> None:
    quick_module.backend = "numba"  # type: ignore[attr-defined]
    buffer = np.arange(33.0)
    x = buffer[:32].reshape(4, 8)
    known = quick_module.backwards(x)
    out = np.empty((4, 8))
    assert quick_module.backwards(x, out=out) is out
    np.testing.assert_array_equal(out, known)
    sums = np.empty(4)
    assert quick_module.squares(x, out=sums) is sums
    np.testing.assert_array_equal(sums, quick_module.squares(x))
    quick_module.backwards(x, out=buffer[1:].reshape(4, 8))  # which overlaps the argument
    np.testing.assert_array_equal(buffer[1:].reshape(4, 8), known)
    for wrong in (np.empty((3, 8)), np.empty((2, 4, 8)), np.empty(8)):
        with pytest.raises(ValueError, match=r"out has shape"):
            quick_module.backwards(known, out=wrong)


def test_long_batches_in_the_extension(quick_module: ModuleType, rng: np.random.Generator) -> None:
    """Other threads of Python run concurrently, and batches are divided between threads if the module allows it."""
    quick_module.backend = "numba"  # type: ignore[attr-defined]
    chain = quick_module.backwards.bind()
    chain(np.ones(3))
    for count in (3_000, 60_000):
        x = rng.uniform(size=(count, 10))
        known = in_python(chain, x)
        np.testing.assert_array_equal(chain.attempt(x), known)
        quick_module.num_threads = 2  # type: ignore[attr-defined]
        try:
            assert (chain.attempt(x) is None) == (count == 60_000)
            np.testing.assert_array_equal(chain(x), known)
        finally:
            quick_module.num_threads = 1  # type: ignore[attr-defined]


@all_cases("leading", [(), (1,), (3,), (2, 2)])
def test_one_result_is_returned(loops: ModuleType, leading: tuple[int, ...], rng: np.random.Generator) -> None:
    points, n = rng.uniform(size=(*leading, 5, 3)), 2.0
    both = loops.suffixes.bind(n=n)
    sums, last = both(points)
    for _ in range(2):  # by Python, and then by the extension if it exists
        np.testing.assert_array_equal(both.returning("out_0")(points), sums)
        np.testing.assert_array_equal(both.returning("out_1")(points), last)
        columns = both.returning("out_0", transposed=True)(points)
        np.testing.assert_array_equal(columns, np.swapaxes(sums, -1, -2), strict=True)
        assert columns.flags.writeable
        columns[...] = 0
    with pytest.raises(TypeError, match=r"suffixes.returning: unknown result out; expected one of out_0, out_1"):
        both.returning("out")
    with pytest.raises(TypeError, match=r"returning: lowest|expected two axes to swap"):
        loops.squares.bind().returning("out", transposed=True)
    with pytest.raises(TypeError, match="returning one result does not accept out"):
        both.returning("out_0")(points, out=sums)
