"""Files of objects: what is read is what was written, and what is no such file is refused."""

from __future__ import annotations

import json
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gacompiler.algebra.algebra import Algebra
from gacompiler.errors import GacError
from gacompiler.objects import CGA3, PGA3, Space, load, save

OBLIQUE = Algebra("OBLIQUE", "a b", [[Fraction(2), Fraction(1, 3)], [Fraction(1, 3), Fraction(-1)]])


@pytest.mark.parametrize("ending", ["json", "npz"])
def test_objects_come_back_as_they_were(tmp_path: Path, ending: str) -> None:
    random = np.random.default_rng(0)
    plain = Space(OBLIQUE)
    written: dict[str, Any] = {
        "sphere": CGA3.sphere([1, 2, 3], 0.1),
        "points": PGA3.point(random.normal(size=(2, 5, 3))),
        "screw": PGA3.motor([0, 0, 1], 0.5, 2),
        "none": PGA3.point(np.zeros((0, 3))),
        "own": plain.multivector({"a": 1.5, "ab": -2.0}),
        "single": PGA3.point(random.normal(size=(4, 3)).astype("f4")),
        "number": 2.5,
        "weights": np.array([1, 2, 3]),
    }
    path = tmp_path / f"scene.{ending}"
    save(path, **written)
    found = load(path)
    assert list(found) == list(written)
    for name, value in written.items():
        values = value.values if hasattr(value, "layout") else value
        again = found[name].values if hasattr(value, "layout") else found[name]
        assert getattr(found[name], "layout", None) == getattr(value, "layout", None)
        np.testing.assert_array_equal(again, values)
        assert np.shape(again) == np.shape(values)
    assert [each.name for each in tmp_path.iterdir()] == [path.name]
    assert np.all((found["screw"] >> found["points"]).isclose(written["screw"] >> written["points"]))


def test_text_is_for_others_too(tmp_path: Path) -> None:
    save(tmp_path / "line.json", line=PGA3.point(0, 0, 0) & PGA3.point(1, 0, 0))
    line = json.loads((tmp_path / "line.json").read_text())["line"]
    assert line["algebra"] == "PGA3" and len(line["blades"]) == len(line["values"]) == 6


@pytest.mark.parametrize(
    ("name", "text"),
    [("a.json", "{"), ("a.json", "[1]"), ("a.json", '{"x": 1}'), ("a.npz", "no archive"), ("a.txt", "")],
)
def test_what_is_no_file_of_objects_is_refused(tmp_path: Path, name: str, text: str) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(ValueError, match=r"save|json or \.npz|allow_pickle"):
        load(tmp_path / name)


def test_nothing_is_half_written(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    save(path, p=PGA3.point(1, 2, 3))
    before = path.read_bytes()
    for wrong in ("text", 1j, [PGA3.point(1, 2, 3)]):
        with pytest.raises(GacError, match="save: q"):
            save(path, p=PGA3.point(0, 0, 0), q=wrong)
    with pytest.raises(ValueError, match="ends in"):
        save(tmp_path / "a.txt", p=PGA3.point(1, 2, 3))
    assert path.read_bytes() == before and len(list(tmp_path.iterdir())) == 1
