"""Files of objects: objects are read as they were written, and invalid files are rejected."""

from __future__ import annotations

import json
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gacompiler.algebra.algebra import Algebra
from gacompiler.errors import GacError
from gacompiler.objects import CGA3, PGA2, PGA3, Space, from_ganja, load, save, save_ganja, to_ganja
from gacompiler.objects.ganja import GENERATED_PGA3, ganja_basis

OBLIQUE = Algebra("OBLIQUE", "a b", [[Fraction(2), Fraction(1, 3)], [Fraction(1, 3), Fraction(-1)]])


@pytest.mark.parametrize("ending", ["json", "npz"])
def test_objects_round_trip(tmp_path: Path, ending: str) -> None:
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


def test_text_is_valid_json(tmp_path: Path) -> None:
    save(tmp_path / "line.json", line=PGA3.point(0, 0, 0) & PGA3.point(1, 0, 0))
    line = json.loads((tmp_path / "line.json").read_text())["line"]
    assert line["algebra"] == "PGA3" and len(line["blades"]) == len(line["values"]) == 6


@pytest.mark.parametrize(
    ("name", "text"),
    [("a.json", "{"), ("a.json", "[1]"), ("a.json", '{"x": 1}'), ("a.npz", "no archive"), ("a.txt", "")],
)
def test_invalid_files_are_rejected(tmp_path: Path, name: str, text: str) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(ValueError, match=r"save|json or \.npz|allow_pickle"):
        load(tmp_path / name)


def test_no_partial_file_is_written(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    save(path, p=PGA3.point(1, 2, 3))
    before = path.read_bytes()
    for wrong in ("text", 1j, [PGA3.point(1, 2, 3)]):
        with pytest.raises(GacError, match="save: q"):
            save(path, p=PGA3.point(0, 0, 0), q=wrong)
    with pytest.raises(ValueError, match="suffix"):
        save(tmp_path / "a.txt", p=PGA3.point(1, 2, 3))
    assert path.read_bytes() == before and len(list(tmp_path.iterdir())) == 1


def ganja_product(first: str, second: str) -> tuple[int, str]:
    """The product of blades by the digits of their names, sorted by swaps; vector 0 squares to 0 and 5 to -1."""
    numbers, sign = list((first + second).replace("e", "")), 1
    k = 0
    while k < len(numbers) - 1:
        a, b = numbers[k : k + 2]
        if a == b:
            sign *= {"0": 0, "5": -1}.get(a, 1)
            numbers[k : k + 2] = []
            k = max(k - 1, 0)
        elif a > b:
            numbers[k : k + 2], sign, k = [b, a], -sign, max(k - 1, 0)
        else:
            k += 1
    return sign, "e" + "".join(numbers) if numbers else "1"


@pytest.mark.parametrize(
    ("space", "basis"),
    [
        (PGA3, "1 e0 e1 e2 e3 e01 e02 e03 e12 e13 e23 e012 e013 e023 e123 e0123"),
        pytest.param(
            CGA3,
            "1 e1 e2 e3 e4 e5 e12 e13 e14 e15 e23 e24 e25 e34 e35 e45 e123 e124 e125 e134 e135 e145 e234 e235 e245 "
            "e345 e1234 e1235 e1245 e1345 e2345 e12345",
            marks=pytest.mark.slow,
        ),
    ],
)
def test_products_equal_those_of_ganja(space: Space, basis: str) -> None:
    names = basis.split()
    assert ganja_basis(space) == tuple(names)
    table = np.zeros((len(names),) * 3)
    for i, first in enumerate(names):
        for j, second in enumerate(names):
            sign, name = ganja_product(first.removeprefix("1"), second.removeprefix("1"))
            table[i, j, names.index(name)] = sign
    x, y = (space.of(space.full, np.random.default_rng(k).normal(size=(3, len(names)))) for k in (0, 1))
    wanted = np.einsum("...i,...j,ijk", to_ganja(x), to_ganja(y), table)
    np.testing.assert_allclose(to_ganja(x * y), wanted, atol=1e-13)
    assert np.all(from_ganja(space, to_ganja(x)).isclose(x))


def test_points_of_ganja() -> None:
    """A point of the example scene of ganja.js, and of the modules that it generates."""
    assert to_ganja(CGA3.point(-1, 0, 1)).tolist() == [0, -1, 0, 1, 0.5, 1.5] + [0] * 26
    point = PGA3.point([[1, 2, 3], [4, 5, 6]])
    there = to_ganja(point, GENERATED_PGA3)
    assert there[:, 11:].tolist() == [[3, 2, 1, 1, 0], [6, 5, 4, 1, 0]] and not there[:, :11].any()
    assert np.all(from_ganja(PGA3, there, GENERATED_PGA3).isclose(point))
    assert to_ganja(PGA2.point(1, 2)).tolist() == [0, 0, 0, 0, 2, -1, 1, 0]


def test_scenes_of_ganja(tmp_path: Path) -> None:
    file = tmp_path / "new" / "scene.json"
    points, sphere = CGA3.point(np.eye(3)), CGA3.sphere([0, 0, 0], 1)
    save_ganja(file, points, sphere, sphere.polarity(), labels=["p", "", "s"], colours=["red", "#00ff01", "blue"])
    colour, *rest = json.loads(file.read_text())
    assert colour == 0xFF0000 and rest[:3] == to_ganja(points).tolist()
    assert rest[3:6] == ["p", 0x00FF01, to_ganja(sphere).tolist()] and rest[6] == 0x0000FF and rest[8] == "s"
    assert np.linalg.matrix_rank(np.array([rest[5], rest[7]])) == 1
    # Each element separately: a point, and spheres of small radius and weight, as vectors.
    light = 1e-5 * CGA3.sphere([4, 0, 0], 1e-3).polarity()
    vectors = [x.as_layout(CGA3.VECTOR).values for x in (points[0], light)]
    mixed = CGA3.of(CGA3.VECTOR, vectors)
    save_ganja(file, mixed)
    first, second = json.loads(file.read_text())[1:3]
    assert first == to_ganja(points[0]).tolist() and second == to_ganja(light.polarity()).tolist()
    save_ganja(file, PGA3.plane(0, 0, 1, -1))
    assert [type(each) for each in json.loads(file.read_text())] == [int, list]


def test_objects_that_ganja_does_not_support_are_rejected(tmp_path: Path) -> None:
    p = PGA3.point(1, 2, 3)
    for call, words in (
        (lambda: to_ganja(p, "1 e0 e1"), "3 different blades; expected all 16"),
        (lambda: to_ganja(Space(OBLIQUE).a), "squares 2 -1; expected squares 0, 1, -1"),
        (lambda: from_ganja(PGA3, np.ones(8)), r"shape \(8,\); expected .* 16"),
        (lambda: save_ganja(tmp_path / "a.json"), "no object"),
        (lambda: save_ganja(tmp_path / "a.json", p, labels=["a", "b"]), "2 labels; expected 1"),
        (lambda: save_ganja(tmp_path / "a.json", p, colours=["reddish"]), "the colour 'reddish'"),
        (lambda: save_ganja(tmp_path / "a.json", p, CGA3.point(1, 2, 3)), "PGA3 and CGA3; expected one algebra"),
        (lambda: save_ganja(tmp_path / "a.json", PGA3.motor([0, 0, 1], 0.5)), "a motor; expected blades"),
    ):
        with pytest.raises(GacError, match=words):
            call()
    assert not list(tmp_path.iterdir())
