"""A plugin of pytest that calls public functions of `algorithms` again, with elements in place of arrays.

The calls of the tests of a session are recorded, one for each function and types of its arguments. Once a case of a
test has no call of a new kind, its other cases are skipped. After the session each array or list of 2 to 10 numbers is
replaced by elements of every layout with as many coefficients. Such a call has to raise an error, or the element is of
a kind whose coefficients the function expects, and results are the same as for the array.

Arrays of every size are replaced by masked and complex ones, by texts, times and missing values, which have to raise an
error, and by the same numbers in arrays of other libraries, which have to raise one or give the same result. What was
found is written to the file ``$ELEMENTS_FOUND``.
"""

from __future__ import annotations

import contextlib
import copy
import dataclasses
import functools
import importlib
import importlib.util
import inspect
import json
import os
import pickle
import pkgutil
import re
import sys
import warnings
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
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
    *("a", "b", "apex", "at", "centre", "contacts", "directrix", "end", "ends", "entity", "first", "found"),
    *("images", "landmarks", "left", "measured", "model", "origins", "p", "pan", "partners", "pixels", "place"),
    *("places", "planes", "point", "points", "points_or_mask", "right", "samples", "second", "seen", "simplex"),
    *("source", "start", "starts", "target", "third", "tilt", "vertices", "viewpoint", "views", "walls"),
}  # fmt: skip
"""Parameters that may be points; points for all others, such as angles and colours, are wrong."""
OF_KINDS = {
    *("distance", "angle", "meet", "project", "versor_between", "similarity_between"),
    *("fit_circle", "fit_line", "fit_plane", "fit_sphere"),
}
"""Functions of `algorithms.geometry` that convert elements by their kind, which `tests/geometry` compares."""
INSIDE = {"pull"}
"""Methods of layers, which networks call with arrays, and which do not read all of their arguments."""
GIVEN_BY_USERS = re.compile(r"\b(ArrayLike|Samples|Targets)\b")
"""Annotations of parameters that are converted to arrays; others, such as ``Reals``, are arrays of numpy already."""
_LABELS = {"y", "labels", "truth", "predicted", "classes"}
OF_SOME = {
    "complex": {"shrink", "isphere_wavelet", "dirac_spinors", "transport", *_LABELS},
    "texts": _LABELS,
    "times": _LABELS,
    "missing": _LABELS,
}
"""Functions and parameters that may have numbers of this kind, or labels."""
XARRAY, TORCH, PANDAS = (
    importlib.import_module(name) if importlib.util.find_spec(name) else None for name in ("xarray", "torch", "pandas")
)
"""Other libraries with arrays, which only the peers need."""
MOST, LARGEST, KINDS = 10, 1_000_000, 4

Call = tuple[tuple[str, ...], Any]
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


def replaced() -> Iterator[tuple[str, str, str]]:
    """Return the module, name and method of public functions and of methods, each once, inherited ones included."""
    seen = set()
    for module, name, value in public():
        if inspect.isfunction(value):
            yield module.__name__, name, ""
        for base in value.__mro__ if inspect.isclass(value) else ():
            for word, method in list(vars(base).items()) if base.__module__.startswith("algorithms.") else ():
                is_method = inspect.isfunction(method) or isinstance(method, (classmethod, staticmethod))
                is_used = inspect.getattr_static(value, word) is method and (base, word) not in seen
                if is_method and is_used and not word.startswith("_"):
                    seen.add((base, word))
                    yield module.__name__, name, word


def record() -> None:
    """Replace public functions and methods by ones that record their calls."""
    for key in list(replaced()):
        module, name, word = key
        place = importlib.import_module(module)
        if not word:
            setattr(place, name, recorded(getattr(place, name), key))
            continue
        owner = next(base for base in getattr(place, name).__mro__ if word in vars(base))
        method = vars(owner)[word]
        if inspect.isfunction(method):
            setattr(owner, word, recorded(method, key))
        else:
            setattr(owner, word, type(method)(recorded(method.__func__, key)))


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


def array_of(value: Any) -> Any:
    """Return an argument as an array of real numbers, or None if it is not one."""
    try:
        array = np.asarray(value) if isinstance(value, (np.ndarray, list, tuple)) else None
    except ValueError:
        return None
    return array if array is not None and array.dtype.kind in "fiu" and array.size and array.ndim else None


def unusable(array: Any) -> Iterator[tuple[str, Any]]:
    """Return arrays that have no meaning as real numbers; the first number of some has none."""
    first = np.zeros(array.shape, bool)
    first.flat[0] = True
    yield "masked", np.ma.masked_array(array, first)
    yield "masked in a list", [np.ma.masked_array(array, first)[0], *array[1:]] if array.ndim > 1 else [np.ma.masked]
    yield "complex", array + first * 1j
    yield "texts", array.astype(str)
    yield "times", np.abs(array).astype(int).astype("m8[s]")
    yield "missing", np.where(first, None, array.astype(object))


def of_others(array: Any) -> Iterator[tuple[str, Any]]:
    """Return the same numbers in arrays of other libraries, and in arrays that cannot be changed."""
    if XARRAY:
        yield "xarray", XARRAY.DataArray(array)
    if TORCH:
        yield "torch", TORCH.tensor(np.ascontiguousarray(array))
    if PANDAS and array.ndim < 3:
        yield "pandas", (PANDAS.Series, PANDAS.DataFrame)[array.ndim - 1](array)
    fixed = np.asfortranarray(array).copy("K")
    fixed.setflags(write=False)
    yield "read-only", fixed
    yield "other bytes", array.astype(array.dtype.newbyteorder(">"))


def flat(result: Any) -> list[Any]:
    """Return all numbers of a result."""
    if hasattr(result, "stored"):
        return [np.asarray(result.stored[0])]
    if dataclasses.is_dataclass(result) and not isinstance(result, type):
        result = [getattr(result, each.name) for each in dataclasses.fields(result) if each.repr]
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


class Again:
    """A recorded call of a function, which can be repeated with another value of one argument."""

    def __init__(self, key: tuple[str, str, str], data: Any) -> None:
        self.name = ".".join(key).rstrip(".")
        self.function = original(*key)
        self.parameters = list(inspect.signature(self.function).parameters.values())
        self.data = data
        self.result = self()
        self.is_repeatable = equal(self(), self.result)

    def given(self) -> Any:
        """Return new copies of the arguments, of which some calls change what they contain."""
        return pickle.loads(self.data) if isinstance(self.data, bytes) else copy.deepcopy(self.data)

    def __call__(self, place: Any = None, value: Any = None) -> Any:
        args, named = self.given()
        args = list(args)
        if place is not None:
            (args if isinstance(place, int) else named)[place] = value
        return self.function(*args, **named)

    def arguments(self) -> Iterator[tuple[Any, inspect.Parameter, Any]]:
        """Return the places, parameters and values of all arguments."""
        args, named = self.given()
        kinds = [each.kind for each in self.parameters]
        last = kinds.index(inspect.Parameter.VAR_POSITIONAL) if inspect.Parameter.VAR_POSITIONAL in kinds else None
        for k, value in enumerate(args):
            yield k, self.parameters[k if last is None else min(k, last)], value
        by_name = {each.name: each for each in self.parameters}
        for name, value in named.items():
            yield name, by_name.get(name, self.parameters[-1]), value

    def gives(self, place: Any, value: Any) -> str:
        """Return "error", "same" or "other", which is the result with this value."""
        try:
            found = self(place, value)
        except Exception:
            return "error"
        return "same" if equal(found, self.result) or not self.is_repeatable else "other"


def original(module: str, name: str, method: str) -> Callable[..., Any]:
    """Return a function before it was replaced by one that records its calls."""
    owner = getattr(importlib.import_module(module), name)
    function = inspect.getattr_static(owner, method) if method else owner
    plain: Callable[..., Any] = getattr(function, "__func__", function)
    return ORIGINAL.get(plain, plain)


def calls() -> Iterator[tuple[tuple[str, str, str], Again]]:
    """Return the recorded calls that succeed again."""
    for key, found in RECORDED.items():
        for _, data in found:
            with contextlib.suppress(Exception):
                yield key, Again(key, data)


def examined() -> dict[str, Any]:
    """Call the recorded functions with elements and with other arrays, and return what was accepted wrongly."""
    pairs, arrays, wrong = set(), set(), []
    for key, call in calls():
        _, name, method = key
        for place, parameter, value in call.arguments():
            array = numbers(value)
            if array is not None and name not in OF_KINDS and method not in INSIDE:
                pairs.add((*key, parameter.name))
                for element in strangers(array):
                    layout, found = element.layout, call.gives(place, element)
                    is_meant = layout.name != "POINT" or parameter.name in POINTS
                    is_meant &= (layout.algebra.name, *layout.blades) in SAME
                    if found != "error" and not (is_meant and found == "same"):
                        wrong.append([call.name, parameter.name, str(layout)])
            array = array_of(value)
            which = (*key, parameter.name)
            if array is None or which in arrays or not GIVEN_BY_USERS.search(str(parameter.annotation)):
                continue
            arrays.add(which)
            for kind, other in unusable(array):
                is_known = kind in OF_SOME and {name, method, parameter.name} & OF_SOME[kind]
                if not is_known and call.gives(place, other) != "error":
                    wrong.append([call.name, parameter.name, kind])
            for kind, other in of_others(array):
                if call.gives(place, other) == "other":
                    wrong.append([call.name, parameter.name, kind])
    return {
        "pairs": Counter(module.split(".")[1] for module, *_ in pairs),
        "wrong": wrong,
        "arrays": [list(each[:3]) for each in arrays],
    }


def missed(examined_ones: Iterable[Sequence[str]]) -> list[str]:
    """Return the public functions and methods with parameters that are converted to arrays, but for the given ones."""
    known = {original(*key) for key in examined_ones}
    found = []
    for key in replaced():
        function = original(*key)
        parameters = inspect.signature(function).parameters.values()
        if function not in known and any(GIVEN_BY_USERS.search(str(each.annotation)) for each in parameters):
            found.append(".".join(key).rstrip("."))
    return found


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
    found = examined()
    found["missed"] = missed([tuple(key) for key in found["arrays"]])
    Path(os.environ["ELEMENTS_FOUND"]).write_text(json.dumps(found))


def pytest_configure() -> None:
    """Record calls from the beginning."""
    record()
