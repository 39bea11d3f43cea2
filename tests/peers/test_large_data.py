"""Kernels under dask and xarray, as docs/scaling.md shows: in chunks, lazily, and in processes."""

from __future__ import annotations

import pickle
import re
import tracemalloc
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gacompiler as ga
from gacompiler.algebra.catalog import PGA3
from gacompiler.objects import PGA3 as SPACE
from generated import pga3

pytestmark = pytest.mark.peers

dask = pytest.importorskip("dask")
da = pytest.importorskip("dask.array")
xr = pytest.importorskip("xarray")
distributed = pytest.importorskip("distributed")

PAGE = Path(__file__).parents[2] / "docs" / "scaling.md"
BLOCKS = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
N = 1000


@pytest.fixture(scope="module")
def motors() -> np.ndarray[Any, Any]:
    lines = np.random.default_rng(1).normal(size=(N, 6))
    found: np.ndarray[Any, Any] = pga3.motor_exponential(lines)
    return found


@pytest.fixture(scope="module")
def points() -> np.ndarray[Any, Any]:
    return np.random.default_rng(2).normal(size=(N, 3))


def rigid(m: Any, p: Any) -> Any:
    """Points moved by matrices: the expected result of every call."""
    matrix = pga3.motor_to_matrix(m)
    return (matrix[..., :3, :3] @ p[..., None])[..., 0] + matrix[..., :3, 3]


def apply(kernel: Any, *arrays: Any, **options: Any) -> Any:
    """`apply_gufunc` with only the attributes of a kernel."""
    dtype = np.result_type(*arrays)
    options = {"output_dtypes": [dtype] * len(kernel.definition.outputs), "output_sizes": kernel.output_sizes} | options
    if len(kernel.definition.outputs) == 1:
        options["output_dtypes"] = dtype
    return da.apply_gufunc(kernel, kernel.signature, *arrays, vectorize=False, **options)


@pytest.mark.parametrize(("dtype", "tolerance"), [(np.float64, 1e-14), (np.float32, 1e-5)])
def test_apply_gufunc(motors: Any, points: Any, dtype: Any, tolerance: float) -> None:
    m, p = da.from_array(motors.astype(dtype), chunks=(300, -1)), da.from_array(points.astype(dtype), chunks=(300, -1))
    moved = apply(pga3.move_point, m, p)
    assert (moved.shape, moved.dtype, moved._meta.dtype) == ((N, 3), dtype, dtype)
    found = moved.compute()
    assert found.dtype == dtype
    np.testing.assert_allclose(found, rigid(motors, points), 0, 10 * tolerance)


def test_loop_dimensions_broadcast(motors: Any, points: Any) -> None:
    m, p = da.from_array(motors[:20], chunks=(7, -1)), da.from_array(points, chunks=(400, -1))
    found = apply(pga3.move_point, m[:, None], p)
    assert found.chunks == ((7, 7, 6), (400, 400, 200), (3,))
    np.testing.assert_allclose(found, rigid(motors[:20, None], points), 0, 1e-13)


def test_one_motor_for_all_and_numbers(motors: Any, points: Any) -> None:
    p = da.from_array(points, chunks=(300, -1))
    np.testing.assert_allclose(apply(pga3.move_point, motors[0], p), rigid(motors[0], points), 0, 1e-13)
    line = da.from_array(np.tile(np.eye(6)[2], (N, 1)), chunks=(300, -1))
    turned = apply(pga3.move_point, apply(pga3.motor_from_line, line, 0.5), p)
    axis = pga3.motor_from_line(np.eye(6)[2], 0.5)
    np.testing.assert_allclose(turned, rigid(axis, points), 0, 1e-13)


def test_several_results_and_a_number_as_result(motors: Any, points: Any) -> None:
    m, p = da.from_array(motors, chunks=(300, -1)), da.from_array(points, chunks=(300, -1))
    rotor, translation = dask.compute(*apply(pga3.motor_to_rotor_translation, m))
    again = pga3.motor_from_rotor_translation(rotor, translation)
    np.testing.assert_allclose(again, motors, 0, 1e-14)
    distance = apply(pga3.distance_points, p, points[0])
    assert distance.shape == (N,)
    np.testing.assert_allclose(distance, np.linalg.norm(points - points[0], axis=-1), 1e-14)


def test_core_dimensions_first_and_matrices(motors: Any, points: Any) -> None:
    m, p = da.from_array(motors.T, chunks=(-1, 300)), da.from_array(points.T, chunks=(-1, 300))
    found = apply(pga3.move_point, m, p, axes=[(0,), (0,), (0,)])
    np.testing.assert_allclose(found.T, rigid(motors, points), 0, 1e-13)
    assert apply(pga3.motor_to_matrix, da.from_array(motors, chunks=(300, -1))).shape == (N, 4, 4)


def test_chunks_that_do_not_fit(motors: Any, points: Any) -> None:
    """Coefficients of one element in several chunks, and loop dimensions with other chunks, as in docs/scaling.md."""
    m, p = da.from_array(motors, chunks=(300, 4)), da.from_array(points, chunks=(300, -1))
    with pytest.raises(ValueError, match="Core dimension `'8'`"):
        apply(pga3.move_point, m, p)
    with pytest.raises(ValueError, match="different chunksize"):
        apply(pga3.move_point, m.rechunk((200, -1)), p)
    right = rigid(motors, points)
    np.testing.assert_allclose(apply(pga3.move_point, m, p, allow_rechunk=True), right, 0, 1e-13)
    np.testing.assert_allclose(apply(pga3.move_point, m.rechunk((*p.chunks[:1], -1)), p), right, 0, 1e-13)


def test_map_blocks(motors: Any, points: Any) -> None:
    m, p = da.from_array(motors, chunks=(300, -1)), da.from_array(points, chunks=(300, -1))
    for given in ({"dtype": p.dtype}, {"meta": np.empty((0, 3))}):
        moved = da.map_blocks(pga3.move_point, m, p, chunks=p.chunks, **given)
        assert (moved.shape, moved._meta.dtype) == ((N, 3), np.float64)
        np.testing.assert_allclose(moved, rigid(motors, points), 0, 1e-13)


def test_the_type_cannot_be_guessed(motors: Any, points: Any) -> None:
    """dask tries arrays of shape (1, 1); no motor has one coefficient, so dask reports that it needs the types."""
    with pytest.raises(
        ValueError, match=r"(?s)specify the dtype explicitly.*m has shape \(1, 1\); expected \(..., 8\)"
    ):
        da.apply_gufunc(pga3.move_point, pga3.move_point.signature, da.from_array(motors), points)


def test_names_are_those_of_the_computation(motors: Any, points: Any) -> None:
    """The same call has the same name, here and in another process, so that dask shares and caches it."""
    first, second = (apply(pga3.move_point, da.from_array(motors), da.from_array(points)) for _ in range(2))
    assert first.name == second.name != apply(pga3.move_point_back, da.from_array(motors), da.from_array(points)).name
    with dask.config.set({"tokenize.ensure-deterministic": True}):
        assert dask.base.tokenize(pga3.move_point) == dask.base.tokenize(pickle.loads(pickle.dumps(pga3.move_point)))


def test_compiled_kernels_in_processes(motors: Any, points: Any) -> None:
    """A kernel that no module has goes to processes with its definition."""

    @ga.kernel(m=PGA3.MOTOR, p=PGA3.POINT)
    def moved(m: Any, p: Any) -> Any:
        return ga.sandwich(m, p)

    kernel = ga.compile(moved)
    lazy = apply(kernel, da.from_array(motors, chunks=(300, -1)), da.from_array(points, chunks=(300, -1)))
    found = lazy.compute(scheduler="processes", num_workers=2)
    np.testing.assert_array_equal(found, kernel(motors, points))
    np.testing.assert_allclose(found, rigid(motors, points), 0, 1e-13)


@pytest.mark.parametrize("lazy", [False, True], ids=["numpy", "dask"])
def test_xarray(motors: Any, points: Any, lazy: bool) -> None:
    times = np.arange(20)
    m = xr.DataArray(motors[:20], dims=("time", "motor"), coords={"time": times})
    p = xr.Dataset({"left": (("point", "xyz"), points), "right": (("point", "xyz"), -points)})
    if lazy:
        m, p = m.chunk(time=7), p.chunk(point=400)
    moved = xr.apply_ufunc(
        pga3.move_point,
        m,
        p,
        input_core_dims=[["motor"], ["xyz"]],
        output_core_dims=[["xyz"]],
        dask="parallelized",
        output_dtypes=[float],
    )
    assert moved.left.dims == ("time", "point", "xyz") and (moved.left.chunks is not None) == lazy
    np.testing.assert_array_equal(moved.time, times)
    np.testing.assert_allclose(moved.right, rigid(motors[:20, None], -points), 0, 1e-13)


@pytest.fixture(scope="module")
def client() -> Iterator[Any]:
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, memory_limit="384MiB", dashboard_address=":0"
        ) as cluster,
        distributed.Client(cluster) as found,
    ):
        yield found


def test_more_data_than_memory(client: Any) -> None:
    """0.7 GB of points, made, moved and reduced by two processes that may hold 0.4 GB each; their mean is known."""
    n = 30_000_000
    before = client.scheduler_info(n_workers=-1)["workers"]
    assert 2 * 8 * 3 * n > 1.7 * 2 * 384 * 2**20  # points and moved points, beside what both processes may hold
    m = pga3.motor_from_line(pga3.join_points([1.0, 2.0, 0.0], [1.0, 2.0, 1.0]), np.pi / 2)
    t = da.arange(n, chunks=n // 80, dtype=float) / (n - 1)
    p = da.stack([t, 2 * t, 1 - t], axis=-1).rechunk({1: -1})
    mean = apply(pga3.move_point, m, p).mean(axis=0).compute()
    np.testing.assert_allclose(mean, rigid(m, np.array([0.5, 1.0, 0.5])), 0, 1e-12)
    workers = client.scheduler_info(n_workers=-1)["workers"]
    assert workers.keys() == before.keys()  # no worker died and was replaced
    assert [worker["memory_limit"] for worker in workers.values()] == [384 * 2**20] * 2


def test_kernels_in_processes(client: Any, motors: Any, points: Any) -> None:
    """A kernel is pickled by name and gives the same result in another process."""
    found = client.submit(pga3.move_point, motors, points, pure=False).result()
    np.testing.assert_array_equal(found, pga3.move_point(motors, points))
    assert client.submit(lambda kernel: kernel.name, pga3.move_point).result() == "move_point"
    assert client.run(lambda: __import__("generated.pga3").pga3.backend).popitem()[1] == pga3.backend


def test_the_page(monkeypatch: pytest.MonkeyPatch) -> None:
    """Execute every block of the page in order, except the one for Ray, which need not be installed.

    Points are fewer, and the cluster consists of threads; `test_kernels_in_processes` has one of processes.
    """
    here = {"processes": False, "memory_limit": 0}  # beside all that this process holds already
    whole = distributed.LocalCluster
    monkeypatch.setattr(distributed, "LocalCluster", lambda **options: whole(**options | here))
    names: dict[str, Any] = {"__name__": "page"}
    for block in BLOCKS:
        code = compile(block.replace("00_000, ", "0_000, "), PAGE.name, "exec")
        if "import ray" not in block:
            exec(code, names)
    m, p = names["m"], names["p"].compute()
    right = rigid(m, p)
    np.testing.assert_allclose(names["q"], right, 0, 1e-13)
    np.testing.assert_allclose(names["main"](), right.mean(axis=0), 0, 1e-13)
    np.testing.assert_allclose(
        pga3.motor_from_rotor_translation(names["rotors"], names["translations"])[9], m, 0, 1e-15
    )
    moved = names["moved"]
    assert moved.dims == ("time", "point", "xyz") and moved.chunks is not None
    np.testing.assert_allclose(moved[3], right, 0, 1e-13)
    to_mean = p.mean(axis=0) - p  # the direction of each line, e23 e31 e12 of the join
    directions = names["lines"].values[:, :3]
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), np.linalg.norm(to_mean, axis=1), 1e-12)


def test_a_spacetime_transform_in_blocks_needs_memory_for_blocks(tmp_path: Path) -> None:
    """The function of the page, from files to files. tracemalloc counts the memory of numpy, but not that of files."""
    names: dict[str, Any] = {"np": np, "da": da}
    exec(next(block for block in BLOCKS if "def spacetime_in_blocks" in block).split("field = ")[0], names)
    given = np.random.default_rng(3).normal(size=(64, 16, 9, 8, 16))
    np.save(tmp_path / "in.npy", given)
    expected = names["spacetime_fft"](given)

    def read(block_info: Any = None) -> Any:
        place = tuple(slice(*ends) for ends in block_info[None]["array-location"])
        return np.load(tmp_path / "in.npy", mmap_mode="r")[place]

    chunks = da.core.normalize_chunks((4, -1, -1, -1, -1), given.shape)
    tracemalloc.start()
    with dask.config.set(scheduler="synchronous"):
        field = da.map_blocks(read, chunks=chunks, meta=np.empty((0,) * 5))
        da.to_npy_stack(tmp_path / "out", names["spacetime_in_blocks"](field, 1, tmp_path / "between"), axis=1)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < given.nbytes / 2
    assert np.abs(da.from_npy_stack(tmp_path / "out").compute() - expected).max() < 1e-14 * np.abs(expected).max()


def test_xarray_holds_elements() -> None:
    points = SPACE.point(np.eye(3))
    weights = xr.DataArray([1.0, 2, 3], dims="t", coords={"t": [10, 20, 30]})
    for found in (points * weights, weights * points):
        assert found.dims == ("t",) and "TRIVECTOR" in repr(found)
        assert (found.sel(t=20).data == 2 * points[1]) and (found + found).data.isclose(2 * found.data).all()
