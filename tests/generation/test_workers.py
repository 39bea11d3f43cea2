"""Specs in separate processes: the same results, in order, and the same errors as in one process."""

from __future__ import annotations

import multiprocessing
import os
import pickle
from multiprocessing.process import BaseProcess
from pathlib import Path

import pytest
from worker_tasks import ending, failing, named, printed, slow_but_for_planes

from gacompiler.errors import BackendError, GacError, KernelError, SpecError
from gacompiler.generation.compiling import render_spec
from gacompiler.generation.spec_files import Spec, load_spec
from gacompiler.generation.workers import each_spec
from tests.support.all_cases import all_cases

SPEC = '''
from gacompiler import kernel, {operation}
from gacompiler.algebra.catalog import PGA3

@kernel(a=PGA3.{layout}, b=PGA3.{layout})
def combined(a, b):
    """The {operation} of `a` and `b`."""
    return {operation}(a, b)
'''


@pytest.fixture
def specs(tmp_path: Path) -> list[Spec]:
    texts = {
        "points": ("regressive_product", "POINT"),
        "planes": ("outer_product", "PLANE"),
        "motors": ("geometric_product", "MOTOR"),
    }
    for name, (operation, layout) in texts.items():
        (tmp_path / f"{name}.py").write_text(SPEC.format(operation=operation, layout=layout))
    return [load_spec(tmp_path / f"{name}.py") for name in texts]


@pytest.mark.slow
def test_every_spec_has_a_process_which_prints_the_same_text(specs: list[Spec]) -> None:
    reported: list[str] = []
    results = each_spec(printed, specs, reported.append, jobs=2)
    assert sorted(reported) == ["motors.combined", "planes.combined", "points.combined"]
    assert os.getpid() not in {process for process, _ in results}
    assert [text for _, text in results] == [render_spec(spec) for spec in specs]


@pytest.mark.parametrize("jobs, n_specs", [(1, 3), (8, 1)])
def test_one_spec_needs_no_other_process(specs: list[Spec], jobs: int, n_specs: int) -> None:
    results = each_spec(named, specs[:n_specs], lambda name: None, jobs)
    assert {process for _, process in results} == {os.getpid()}


@pytest.mark.slow
def test_errors_are_returned_completely(specs: list[Spec], tmp_path: Path) -> None:
    with pytest.raises(KernelError, match="planes: a reason; expected another; a remedy") as caught:
        each_spec(failing, specs, lambda name: None, jobs=2)
    assert caught.value.remedy == "a remedy"
    with pytest.raises(BackendError, match="ended before its work was done; retry with --jobs 1"):
        each_spec(ending, specs, lambda name: None, jobs=2)
    (tmp_path / "planes.py").write_text("no Python")
    with pytest.raises(SpecError, match="syntax error"):
        each_spec(named, specs, lambda name: None, jobs=2)


@pytest.mark.slow
def test_an_error_terminates_the_other_processes(specs: list[Spec]) -> None:
    with pytest.raises(KernelError, match="a reason"):
        each_spec(slow_but_for_planes, specs[:2], lambda name: None, jobs=2)
    assert not any(process.name.startswith("SpawnProcess") and process.is_alive() for process in left_behind())


def left_behind() -> list[BaseProcess]:
    for process in multiprocessing.active_children():
        process.join(10)
    return list(multiprocessing.active_children())


def test_an_error_of_progress_is_raised(specs: list[Spec]) -> None:
    def refuse(name: str) -> None:
        raise OSError(f"no place for {name}")

    for jobs in (1, 2):
        with pytest.raises(OSError, match="no place for"):
            each_spec(named, specs[:2], refuse, jobs)


@all_cases("kind", [GacError, *GacError.__subclasses__()])
def test_errors_are_pickled(kind: type[GacError]) -> None:
    error = kind("here", "this", "that", "do so")
    copy = pickle.loads(pickle.dumps(error))
    assert type(copy) is kind and str(copy) == str(error) and copy.expected == "that"
