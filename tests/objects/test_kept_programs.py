"""Programs of operations on disk: a second process traces nothing, and finds only what is its own."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gacompiler import Algebra
from gacompiler.algebra.catalog import CGA3, PGA3, VGA3
from gacompiler.algebra.layout import SCALAR, Layout
from gacompiler.objects import operators
from gacompiler.objects.definitions import BINARY, UNARY, Definition
from gacompiler.objects.kept_programs import place_of

OWN = Algebra("G", "a b c", [1, 1, -1])
CALLS: list[tuple[Definition, tuple[Layout, ...]]] = [
    (BINARY["regressive_product"], (PGA3.POINT, PGA3.POINT)),
    (BINARY["sandwich"], (CGA3.MOTOR, CGA3.POINT)),
    (BINARY["inner_product"], (VGA3.VECTOR, VGA3.VECTOR)),
    (UNARY["log"], (PGA3.MOTOR,)),
    (BINARY["geometric_product"], (OWN.full, OWN.even)),
    (BINARY["add"], (SCALAR, VGA3.full)),
]


@pytest.fixture
def process(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Begin a process with an empty cache folder; call it to begin another one with the same folder."""
    monkeypatch.setenv("GAC_CACHE", str(tmp_path))
    tmp_path.chmod(0o700)

    def begin() -> None:
        monkeypatch.setattr(operators, "_OPERATORS", {})
        monkeypatch.setattr(operators, "_BY_IDENTITY", {})

    begin()
    return begin


def refused(*arguments: Any) -> Any:
    raise AssertionError("traced again")


def test_a_second_process_traces_nothing(process: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    first = [operators.operator_of(*call) for call in CALLS]
    process()
    monkeypatch.setattr(operators, "compiled", refused)
    random = np.random.default_rng(0)
    for one, call in zip(first, CALLS, strict=True):
        found = operators.operator_of(*call)
        assert found is not one and found.result is one.result and found.program == one.program
        assert found.kernel.returns == one.kernel.returns and found.kernel.name == one.kernel.name
        arrays = [random.normal(size=() if each.is_scalar else each.size) for each in call[1]]
        np.testing.assert_array_equal(found(arrays), one(arrays))


def test_entries_differ_with_everything_that_a_program_depends_on() -> None:
    product, vector = BINARY["geometric_product"], OWN.layout("V", "a b c")
    other = Algebra("G", "a b c", [1, 1, 1])
    named = Algebra("G", "a b c", [1, 1, -1], layouts=lambda algebra: (algebra.layout("BIVECTOR", "ab ac bc"),))
    calls = [
        (product, (vector, vector)),
        (replace(product, text="b * a"), (vector, vector)),
        (replace(product, keeps=0), (vector, vector)),
        (replace(product, algebra=OWN), (SCALAR, SCALAR)),
        (replace(product, unit=lambda layouts: True), (vector, vector)),
        (product, (OWN.layout("V", "b a c"), vector)),
        (product, (OWN.layout("V", "a b c", unit=True), vector)),
        (product, (other.layout("V", "a b c"), other.layout("V", "a b c"))),
        (product, (named.layout("V", "a b c"), named.layout("V", "a b c"))),
    ]
    keys = [place.key for call in calls if (place := place_of(*call)) is not None]
    assert len(set(keys)) == len(calls)


def test_layouts_with_functions_are_traced_in_each_process(process: Any) -> None:
    point = OWN.layout("P", "a b", implied={"c": lambda x: x["a"] * x["b"]})
    assert place_of(BINARY["add"], (point, point)) is None
    assert operators.operator_of(BINARY["add"], (point, point)).result.size == 3


def test_operations_need_no_cache(process: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    for size in ("0", "many"):
        monkeypatch.setenv("GAC_CACHE_SIZE", size)
        process()
        assert place_of(*CALLS[0]) is None and operators.operator_of(*CALLS[0]).result == PGA3.LINE


def test_the_cache_is_kept_within_its_limit(process: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    folder = tmp_path / "compilations"
    folder.mkdir(mode=0o700)
    (folder / "old").write_bytes(bytes(2_000_000))
    monkeypatch.setenv("GAC_CACHE_SIZE", "1")
    operators.operator_of(*CALLS[0])
    assert [path.name for path in folder.iterdir()] == [place.key for place in [place_of(*CALLS[0])] if place]


@pytest.mark.parametrize("damage", [None, [1, 2, 3], [[], None, True], {"program": 1}])
def test_damaged_entries_are_traced_again(process: Any, damage: Any) -> None:
    call = CALLS[0]
    program = operators.operator_of(*call).program
    place = place_of(*call)
    assert place is not None and place.get() is not None
    place.cache.put(place.key, damage)
    process()
    assert place.get() is None and operators.operator_of(*call).program == program
    assert place.get() is not None
