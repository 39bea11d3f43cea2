"""Tiles turn elements into components and back: their C text, run on numbers that say where they lie."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from gacompiler.backends.c_tiles import tile_helpers

Vector = np.ndarray[Any, Any]
WIDTHS = {"doubles": 4, "floats": 8}


class Machine:
    """Vectors by name, and the memory in which elements lie: what the macros of the template do with them."""

    def __init__(self, memory: Vector, size: int, width: int) -> None:
        self.memory, self.half = memory, width // 2
        self.upper = self.half * size
        self.vectors: dict[str, Vector] = {}

    def run(self, lines: list[str]) -> None:
        for line in lines:
            target, equals, right = line.removeprefix("const NAME(tile) ").removesuffix(";").partition(" = ")
            if not equals:
                self.write(*re.findall(r"\w+", target))
            elif target.startswith("WHOLE"):
                self.memory[: 2 * self.half] = self.value(right)
            else:
                self.vectors[target] = self.value(right)

    def value(self, text: str) -> Vector:
        turn = re.fullmatch(r"SHUFFLE\((\w+(?:\(\d+\))?), (\w+(?:\(\d+\))?), ([\d, ]+)\)", text)
        if turn:
            both = np.concatenate([self.value(turn[1]), self.value(turn[2])])
            return both[[int(place) for place in turn[3].split(",")]]
        read = re.fullmatch(r"(READ|WHOLE)\((\d+).*\)", text)
        if read is None:
            return self.vectors[text]
        places = np.arange(int(read[2]), int(read[2]) + 2 * self.half)
        if read[1] == "READ":
            places[self.half :] += self.upper - self.half
        return self.memory[places]

    def write(self, macro: str, offset: str, _: str, *names: str) -> None:
        vectors = [self.vectors[name] for name in names]
        assert len(names) == {"WRITE": 1, "WRITE_BOTH": 2}[macro]
        for start, half in ((int(offset), slice(None, self.half)), (int(offset) + self.upper, slice(self.half, None))):
            numbers = np.concatenate([vector[half] for vector in vectors])
            self.memory[start : start + len(numbers)] = numbers


@pytest.mark.parametrize("size", range(1, 33))
@pytest.mark.parametrize("precision", WIDTHS)
def test_a_tile_holds_components(size: int, precision: str) -> None:
    (helper,) = tile_helpers([size])
    width = WIDTHS[precision]
    elements = np.arange(width * size).reshape(width, size)
    machine = Machine(elements.ravel(), size, width)
    machine.run(helper["load"][precision])
    columns = {f"COLUMN({k})": elements[:, k] for k in range(size)}
    for name, column in columns.items():
        np.testing.assert_array_equal(machine.vectors[name], column)
    back = Machine(np.full(width * size, -1), size, width)
    back.vectors |= columns
    back.run(helper["store"][precision])
    np.testing.assert_array_equal(back.memory, elements.ravel())
