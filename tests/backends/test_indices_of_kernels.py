"""Straight-line kernels read and write components that the arrays have, and write each component of the results.

Parts of kernels with loops do so too, but for results, of which they may write a few.
"""

from __future__ import annotations

import re
from collections import defaultdict

import pytest

from gacompiler.generation.checked_in import generated_folder
from tests.support.all_cases import all_cases

MODULES = sorted(path.stem for path in generated_folder().glob("*.c"))
BODY = re.compile(
    r"^(?:static )?INLINE void NAME\((\w+?)(?:_within)?\)\(([^)]*)\)\n\{\n(.*?)^\}$", re.MULTILINE | re.DOTALL
)
INDEX = re.compile(r"\b(\w+)\[(?:(\d+)\])?")
"""An array, and its index if that is a number."""
PARTS = re.compile(r"^#define PARTS_(\w+)\(IN, (?:SAME, )?NUMBER, OUT, AND\) (.*)$", re.MULTILINE)


def wrong_indices(text: str) -> tuple[int, list[str]]:
    """Return the number of kernels, and what each of them does wrong."""
    joined = re.sub(r"\s*\\\n\s*", " ", text)
    shapes = dict(PARTS.findall(joined))
    wrong, count = [], 0
    for name, parameters, body in BODY.findall(joined):
        if name not in shapes:
            continue
        count += 1
        names = [each.split()[-1].lstrip("*") for each in parameters.split(",") if each.split() != ["WORD", "*far"]]
        arguments = re.findall(r"(IN|SAME|NUMBER|OUT)\(([^)]*)\)", shapes[name])
        indices = defaultdict(set)
        for parameter, index in INDEX.findall(body):
            indices[parameter].add(index)
        for parameter, (kind, numbers) in zip(names, arguments, strict=True):
            if kind == "NUMBER":
                continue
            of_kernel = numbers.count(",") > 1
            size = int(numbers.split(",")[3 if of_kernel else 1])
            computed = "" in indices[parameter]
            read = {int(index) for index in indices[parameter] if index}
            if computed or not read <= set(range(size)) or (of_kernel and kind == "OUT" and len(read) < size):
                wrong.append(f"{name}: {parameter} has {size} components, the body uses {sorted(read)}")
    return count, wrong


@all_cases("name", MODULES)
def test_indices_are_within_the_arrays(name: str) -> None:
    text = (generated_folder() / f"{name}.c").read_text()
    count, wrong = wrong_indices(text)
    assert not wrong
    assert count >= len(re.findall(r"^GAC_KERNEL\(|^GAC_IN_LANES\w*\(", text, re.MULTILINE))


@pytest.mark.parametrize("module", ["vga2", "fuzzy"])
def test_a_wrong_index_is_found(module: str) -> None:
    """In a kernel without loops, and in a part of one with loops."""
    text = (generated_folder() / f"{module}.c").read_text()
    assert not wrong_indices(text)[1]
    changed, n = re.subn(r"\b(out|row)\[1\] = ", r"\1[7] = ", text, count=1)
    assert n == 1 and " has " in wrong_indices(changed)[1][0]
