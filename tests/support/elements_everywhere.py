"""A plugin of pytest that calls public functions of `algorithms` again, with elements in place of arrays.

The calls of the tests of a session are recorded, one for each function and types of its arguments. Once a case of a
test has no call of a new kind, its other cases are skipped. After the session each array or list of 2 to 10 numbers is
replaced by elements of every layout with as many coefficients. Such a call has to raise an error, or the element is of
a kind whose coefficients the function expects, and results are the same as for the array. What was found is written to
the file ``$ELEMENTS_FOUND``.
"""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import importlib
import inspect
import json
import os
import pickle
import pkgutil
import sys
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import algorithms
from algorithms import elements
from gacompiler.objects import CGA2, CGA3, PGA2, PGA3, QUATERNIONS, STA, VGA2, VGA3, Space

SPACES: list[Any] = [PGA2, PGA3, CGA2, CGA3, VGA2, VGA3, STA, QUATERNIONS]
SAME = {(each.algebra, *each.blades) for each in (
    *elements.MOTOR, *elements.ROTOR, *elements.LINE, *elements.PLANE, *elements.VERSOR, *elements.POINT,
    *elements.DIRECTION,
)} | {
    (space.algebra.name, *layout.blades)
    for space, layout in (
        (PGA2, PGA2.POINT), (PGA2, PGA2.DIRECTION), (PGA2, PGA2.MOTOR), (CGA2, CGA2.POINT), (VGA2, VGA2.VECTOR),
        (PGA2, PGA2.ROTOR), (CGA2, CGA2.ROTOR), (VGA2, VGA2.ROTOR),
        (CGA3, CGA3.CIRCLE), (QUATERNIONS, QUATERNIONS.QUATERNION),
    )
}  # fmt: skip
"""Algebras and blades of the elements whose coefficients are the numbers that functions of arrays take."""
POINTS = {
    *(
        "a",
        "b",
        "apex",
        "at",
        "centre",
        "contacts",
        "directrix",
        "end",
        "ends",
        "entity",
        "first",
        "found",
        "images",
        "measured",
    ),
    *("model", "origins", "p", "pan", "partners", "pixels", "place", "places", "planes", "point", "points"),
    *("points_or_mask", "samples", "second", "seen", "simplex", "source", "start", "starts", "target", "third", "tilt"),
    *("vertices", "viewpoint", "views", "walls"),
}
"""Parameters that may be points; points for all others, such as angles and colours, are wrong."""
OF_KINDS = {
    *("distance", "angle", "meet", "project", "versor_between", "similarity_between"),
    *("fit_circle", "fit_line", "fit_plane", "fit_sphere"),
}
"""Functions of `algorithms.geometry` that convert elements by their kind, which `tests/geometry` compares."""
INSIDE = {"pull"}
"""Methods of layers, which networks call with arrays, and which do not read all of their arguments."""
MOST, LARGEST, KINDS = 10, 1_000_000, 4

Call = tuple[tuple[str, ...], bytes]
RECORDED: dict[tuple[str, str, str], list[Call]] = {}
ORIGINAL: dict[Any, Callable[..., Any]] = {}
"""What functions that record their calls run, which converts elements."""
KNOWN: set[str] = set()
"""Tests whose further cases are skipped."""


def recorded(function: Callable[..., Any], key: tuple[str, str, str]) -> Callable[..., Any]:
    """Return a function that records its calls from tests before it runs."""

    @functools.wraps(function)
    def run(*args: Any, **kwargs: Any) -> Any:
        calls = RECORDED.setdefault(key, [])
        data = b""
        kinds = tuple(f"{name}{type(x).__name__}" for name, x in [*enumerate(args), *sorted(kwargs.items())])
        is_new = len(calls) < KINDS and all(kinds != known for known, _ in calls)
        if is_new and "tests" in Path(sys._getframe(1).f_code.co_filename).parts:
            with contextlib.suppress(Exception):  # of functions that are defined in tests
                data = pickle.dumps((args, kwargs))
        result = function(*args, **kwargs)
        if 0 < len(data) < LARGEST:
            calls.append((kinds, data))
        return result

    ORIGINAL[run] = function
    return run


def public() -> Iterator[tuple[Any, str, Any]]:
    """Return the public names of all chapters with their packages."""
    for chapter in pkgutil.iter_modules(algorithms.__path__, "algorithms."):
        if chapter.ispkg and chapter.name != "algorithms.demo":
            package = importlib.import_module(chapter.name)
            parts = [each.name for each in pkgutil.iter_modules(package.__path__, chapter.name + ".") if each.ispkg]
            for module in (package, *map(importlib.import_module, parts)):
                yield from ((module, name, getattr(module, name)) for name in getattr(module, "__all__", ()))


def record() -> None:
    """Replace public functions and methods, inherited ones included, by ones that record their calls."""
    seen = set()
    for module, name, value in list(public()):
        if inspect.isfunction(value):
            setattr(module, name, recorded(value, (module.__name__, name, "")))
        elif inspect.isclass(value):
            for base in value.__mro__:
                if base in seen or not base.__module__.startswith("algorithms."):
                    continue
                seen.add(base)
                for word, method in list(vars(base).items()):
                    if inspect.isfunction(method) and not word.startswith("_"):
                        setattr(base, word, recorded(method, (module.__name__, name, word)))


def strangers(array: Any) -> Iterator[Any]:
    """Return elements of all layouts whose coefficients have the shape of an array."""
    size = array.shape[-1]
    layouts = [(space, each) for space in SPACES for each in space.algebra.layouts.values() if each.size == size]
    if not layouts:
        space = Space(size)
        layouts = [(space, space.vector(*np.zeros(size)).layout)]
    for space, layout in layouts:
        try:
            yield space.of(layout, array)
        except Exception:  # not unit elements
            continue


def numbers(value: Any) -> Any:
    """Return an argument as an array of numbers if elements may stand for it; else None."""
    try:
        array = np.asarray(value) if isinstance(value, (np.ndarray, list, tuple)) else None
    except ValueError:
        return None
    if array is None or array.dtype.kind not in "fiu" or not array.size or not array.ndim:
        return None
    return array.astype(float) if 2 <= array.shape[-1] <= MOST else None


def flat(result: Any) -> list[Any]:
    """Return all numbers of a result."""
    if hasattr(result, "stored"):
        return [np.asarray(result.stored[0])]
    if dataclasses.is_dataclass(result) and not isinstance(result, type):
        result = [getattr(result, each.name) for each in dataclasses.fields(result)]
    if isinstance(result, (list, tuple)):
        return [number for each in result for number in flat(each)]
    return [result] if isinstance(result, (np.ndarray, float, int, np.generic)) else []


def equal(one: Any, other: Any) -> bool:
    """Whether two results are the same up to rounding."""
    a, b = flat(one), flat(other)
    return len(a) == len(b) and all(
        np.shape(x) == np.shape(y) and np.allclose(x, y, rtol=1e-9, atol=1e-9, equal_nan=True)
        for x, y in zip(a, b, strict=True)
        if np.asarray(x).dtype.kind in "fiub"
    )


def examined() -> dict[str, Any]:
    """Call the recorded functions with elements, and return what was accepted wrongly."""
    pairs, wrong = set(), []
    for (module, name, method), calls in RECORDED.items():
        if name in OF_KINDS or method in INSIDE:
            continue
        owner = getattr(importlib.import_module(module), name)
        function = getattr(owner, method) if method else owner
        function = ORIGINAL.get(function, function)
        parameters = list(inspect.signature(function).parameters.values())
        several = next((k for k, each in enumerate(parameters) if each.kind is each.VAR_POSITIONAL), len(parameters))
        for _, data in calls:
            args, kwargs = pickle.loads(data)
            try:
                expected = function(*args, **kwargs)
                again = function(*pickle.loads(data)[0], **pickle.loads(data)[1])
            except Exception:
                continue
            for place, value in [*enumerate(args), *kwargs.items()]:
                array = numbers(value)
                if array is None:
                    continue
                parameter = parameters[min(place, several)].name if isinstance(place, int) else place
                pairs.add((module, name, method, parameter))
                for element in strangers(array):
                    given, named = pickle.loads(data)
                    given = list(given)
                    (given if isinstance(place, int) else named)[place] = element
                    try:
                        found = function(*given, **named)
                    except Exception:
                        continue
                    layout = element.layout
                    is_meant = layout.name != "POINT" or parameter in POINTS
                    same = (
                        is_meant
                        and (layout.algebra.name, *layout.blades) in SAME
                        and (equal(found, expected) or not equal(again, expected))
                    )
                    if not same:
                        wrong.append([f"{module}.{name}.{method}".rstrip("."), parameter, str(layout)])
    return {"pairs": Counter(module.split(".")[1] for module, *_ in pairs), "wrong": wrong}


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    """Note tests of which a case has no call that is new."""
    before = sum(map(len, RECORDED.values()))
    yield
    if sum(map(len, RECORDED.values())) == before:
        KNOWN.add(item.nodeid.partition("[")[0])


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skip further cases of such tests."""
    if item.nodeid.partition("[")[0] in KNOWN:
        pytest.skip("its calls are known")


def pytest_sessionfinish() -> None:
    """Write what was found."""
    warnings.simplefilter("ignore")
    Path(os.environ["ELEMENTS_FOUND"]).write_text(json.dumps(examined()))


def pytest_configure() -> None:
    """Record calls from the beginning."""
    record()
