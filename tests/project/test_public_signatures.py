"""What editors and type checkers see of the public names: no unknown types in signatures, and no private names."""

from __future__ import annotations

import importlib
import inspect
import pkgutil
import re
from collections.abc import Iterator
from typing import Any, get_overloads

import pytest

import algorithms
import gacompiler
from gacompiler import objects

CHAPTERS = [f"algorithms.{each.name}" for each in pkgutil.iter_modules(algorithms.__path__) if each.ispkg]
UNKNOWN = {
    "gacompiler.objects.load": "the objects of a file have any type",
    "algorithms.vision.BundleProblem.adjust": "options of bundle_adjust",
}
"""Functions that take or return objects of any type."""
OPERATIONS = ("gacompiler.objects.methods", "gacompiler.algebra.methods")
"""The types of operations of all multivectors are in `signatures.pyi`."""


def functions(module: str) -> Iterator[tuple[str, Any]]:
    """Yield the public functions of a module, and the methods of its public classes."""
    loaded = importlib.import_module(module)
    for name in getattr(loaded, "__all__", ()):
        value = getattr(loaded, name)
        kind = value if inspect.isclass(value) else type(value)
        if inspect.isroutine(value):
            yield f"{module}.{name}", value
        elif kind.__module__.startswith(("gacompiler", "algorithms")):
            for each in dir(kind):
                found = inspect.getattr_static(kind, each)
                found = getattr(found, "fget", None) or getattr(found, "func", None) or found
                if not each.startswith("_") and callable(getattr(found, "__func__", found)):
                    yield f"{module}.{kind.__name__}.{each}", getattr(found, "__func__", found)


def unknown_types(function: Any) -> list[str]:
    """Return the annotations with `Any`, except arrays of any type of numbers; of overloads if there are any."""
    function = inspect.unwrap(function)
    if getattr(function, "__module__", None) in (None, *OPERATIONS):
        return []
    return [
        f"{name}: {kind}"
        for each in get_overloads(function) or [function]
        for name, kind in getattr(each, "__annotations__", {}).items()
        if name != "self" and re.search(r"\bAny\b", str(kind).replace("NDArray[Any]", ""))
    ]


@pytest.mark.parametrize("module", ["gacompiler.objects", *CHAPTERS])
def test_signatures_name_types(module: str) -> None:
    found = {name: kinds for name, function in functions(module) if (kinds := unknown_types(function))}
    assert found.keys() == {name for name in UNKNOWN if name.startswith(f"{module}.")}, found


def test_packages_show_public_names() -> None:
    assert {each for each in dir(objects) if not each.startswith("__")} == set(objects.__all__)
    others = {each for each in dir(gacompiler) if not each.startswith("__")} - {*gacompiler.__all__}
    assert others and all(inspect.ismodule(getattr(gacompiler, each)) for each in others)


def test_elements_show_public_names() -> None:
    """What is shown is documented."""
    point = objects.PGA3.point(1, 2, 3)
    for element in (point, point[None] if point.shape else objects.PGA3.point([[1, 2, 3]])):
        shown = [each for each in dir(element) if not each.startswith("_")]
        methods = [each for each in shown if callable(getattr(type(element), each, None))]
        assert len(methods) > 50 and all(inspect.getdoc(getattr(type(element), each)) for each in methods)
