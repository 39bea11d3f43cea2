"""Kernels have the same description exactly if they compile to the same result."""

from __future__ import annotations

import hashlib
import os
import pickle
import subprocess
import sys
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

from gacompiler import SCALAR, Algebra, Kernel, Layout, Multivector, array, jacobian, kernel, sandwich
from gacompiler.algebra.catalog import PGA3, VGA3
from gacompiler.generation import kernel_key
from gacompiler.generation.checked_in import own_specs
from gacompiler.generation.kernel_key import NotDescribed, description_of
from gacompiler.generation.spec_files import load_spec
from tests.support.all_cases import all_cases

ROOT = Path(__file__).parents[2]


def described(definition: Kernel) -> str:
    return description_of(definition)


def moved(
    summary: str = "Move.",
    name: str = "moved",
    motor: Layout = PGA3.MOTOR,
    argument: str = "p",
    factor: Any = 2,
    returns: Any = None,
    body: Callable[..., Any] = sandwich,
) -> Kernel:
    """Create a kernel of a function with a closure, a new one at every call."""

    def function(*arguments: Any) -> Any:
        return factor * body(*arguments)

    function.__name__, function.__doc__ = name, summary
    function.__signature__ = signature("m", argument)  # type: ignore[attr-defined]
    return kernel(returns=returns, m=motor, **{argument: PGA3.PLANE})(function)


def signature(*names: str) -> Any:
    from inspect import Parameter, Signature

    return Signature([Parameter(name, Parameter.POSITIONAL_OR_KEYWORD) for name in names])


def test_a_recreated_kernel_has_the_same_description() -> None:
    assert described(moved()) == described(moved())
    assert described(moved()) == described(pickle.loads(pickle.dumps(moved()))), (
        "traced expressions instead of a function"
    )
    assert described(moved(factor=0.1)) == described(moved(factor=Fraction(1, 10)))


@all_cases(
    "change",
    [
        {"summary": "Move it."},
        {"name": "other"},
        {"motor": PGA3.ROTOR},
        {"argument": "q"},
        {"factor": 3},
        {"factor": Fraction(2, 3)},
        {"returns": PGA3.full},
        {"body": lambda m, p: m * p * ~m},
    ],
)
def test_every_change_of_a_definition_is_detected(change: dict[str, Any]) -> None:
    assert described(moved(**change)) != described(moved())


def test_a_changed_function_that_the_kernel_calls_is_detected(monkeypatch: pytest.MonkeyPatch) -> None:
    uses_another = moved(body=lambda m, p: helper(m, p))
    before = described(uses_another)
    assert described(uses_another) == before
    monkeypatch.setitem(globals(), "helper", lambda m, p: m * p + p * m)
    assert described(uses_another) != before


def helper(m: Any, p: Any) -> Any:
    return m * p


def test_shapes_and_names_of_results_are_distinguished() -> None:
    def first(x: Any) -> Any:
        return x[0]

    texts = {described(kernel(x=array(SCALAR, n))(first)) for n in (2, 3)}
    definition = kernel(x=array(SCALAR, 2))(first)
    whole = Kernel("first", first, definition.parameters, None, "", ("result",))
    assert len(texts | {described(whole)}) == 3


def own(algebra: Algebra, **more: Any) -> str:
    layout = algebra.layout(more.pop("name", "OWN"), more.pop("blades", "e1 e2"), **more)
    return described(kernel(x=layout)(doubled))


def doubled(x: Any) -> Any:
    return x + x


def conic(factor: int) -> Callable[[Multivector], Multivector]:
    return lambda x: x * x - factor


def test_all_attributes_of_layouts_are_distinguished() -> None:
    """Functions are described by their results: two objects with the same source have the same description."""
    texts = [
        own(VGA3),
        own(VGA3, name="OTHER"),
        own(VGA3, blades="e2 e1"),
        own(VGA3, blades="e1 e3"),
        own(VGA3, fixed={"e3": 1}),
        own(VGA3, fixed={"e3": 2}),
        own(VGA3, implied={"e3": lambda x: x["e1"] * x["e2"]}),
        own(VGA3, implied={"e3": lambda x: x["e1"] * x["e1"]}),
        own(VGA3, unit=True),
        own(VGA3, relations=conic(1)),
        own(VGA3, relations=conic(2)),
    ]
    assert len(set(texts)) == len(texts)
    assert own(VGA3, relations=conic(2)) == texts[-1] and own(VGA3) == texts[0]
    assert own(VGA3, implied={"e3": lambda x: x["e2"] * x["e1"]}) == texts[6]


def test_all_attributes_of_algebras_are_distinguished() -> None:
    """Includes its name and its named layouts, which results use although they do not affect equality of algebras."""

    def layouts(blades: str) -> Callable[[Algebra], list[Layout]]:
        return lambda algebra: [Layout.of(algebra, "NAMED", blades)]

    texts = [
        own(Algebra("A", "e1 e2", [1, 1])),
        own(Algebra("B", "e1 e2", [1, 1])),
        own(Algebra("A", "e1 e2", [1, -1])),
        own(Algebra("A", "e1 e2", [[1, 2], [2, 1]])),
        own(Algebra("A", "e1 e2 e3", [1, 1, 1])),
        own(Algebra("A", "e1 e2", [1, 1], "e21")),
        own(Algebra("A", "e1 e2", [1, 1], layouts=layouts("e1"))),
        own(Algebra("A", "e1 e2", [1, 1], layouts=layouts("e2"))),
    ]
    assert len(set(texts)) == len(texts)
    assert own(Algebra("A", "e1 e2", [1, 1], layouts=layouts("e2"))) == texts[-1]


def test_values_without_exact_text_have_no_description() -> None:
    def fails(x: Any) -> Any:
        raise ValueError("no polynomial")

    class Odd:
        """A user-defined type of number."""

        def __mul__(self, other: Any) -> Any:
            return self

        __rmul__ = __add__ = __radd__ = __neg__ = __mul__

    with pytest.raises(NotDescribed, match=r"functions of VGA3\.OWN"):
        own(VGA3, implied={"e3": fails})
    with pytest.raises(NotDescribed, match=r"functions of VGA3\.OWN"):
        own(VGA3, relations=lambda x: x * 0.5)
    constant = Multivector(VGA3, {1: Odd()})
    with pytest.raises(NotDescribed, match="a constant of type Odd"):
        described(kernel(x=VGA3.VECTOR)(named_product(constant)))


def named_product(constant: Multivector) -> Callable[[Any], Any]:
    def product(x: Any) -> Any:
        return x ^ constant

    return product


def test_slopes_by_different_arguments_have_distinct_descriptions() -> None:
    first, second = (jacobian(moved(), argument) for argument in "mp")
    assert described(first) != described(second)


DIGEST = """
import hashlib
from gacompiler.generation.checked_in import own_specs
from gacompiler.generation.kernel_key import description_of
from gacompiler.generation.spec_files import load_spec
texts = [description_of(each) for path in own_specs()[2::12] for each in load_spec(path).kernels]
print(hashlib.sha256("".join(texts).encode()).hexdigest())
"""


@pytest.mark.slow
def test_descriptions_do_not_depend_on_the_process() -> None:
    """Descriptions are independent of the hash seed and of kernels traced earlier, so that entries are found again."""
    seed = "1" if os.environ.get("PYTHONHASHSEED") != "1" else "2"
    run = subprocess.run(
        [sys.executable, "-c", DIGEST], env={**os.environ, "PYTHONHASHSEED": seed}, cwd=ROOT,
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    texts = [described(each) for path in reversed(own_specs()[2::12]) for each in reversed(load_spec(path).kernels)]
    assert len(texts) > 50
    assert run.stdout == hashlib.sha256("".join(reversed(texts)).encode()).hexdigest() + "\n"


def test_layouts_are_described_in_full_and_once() -> None:
    text = described(moved())
    assert kernel_key._layout_text(PGA3.MOTOR) in eval(next(r for r in text.splitlines() if "'layout'" in r))
    assert sum("'algebra'" in row for row in text.splitlines()) == 2, "PGA3, and the algebra of numbers"
