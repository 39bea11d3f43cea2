"""Every script is read or rejected with an error of one line that names the place, never with another exception."""

from __future__ import annotations

from collections import Counter
from fractions import Fraction
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from random_scripts import scripts
from selection import some_slow

from gacompiler import read_cluscript
from gacompiler.cli import main
from gacompiler.errors import GacError, KernelError
from gacompiler.frontend.kernel import trace
from gacompiler.passes.lower import scalars_of
from gacompiler.passes.pipeline import compile_kernel

SEED, FEW, N, N_COMPILED = 20, 400, 3000, 80


@pytest.mark.parametrize("n", some_slow([FEW, N], N))
def test_random_scripts_are_read_or_rejected(n: int) -> None:
    """Read, traced and lowered, evaluated on exact and on floating-point numbers, and drawn."""
    found: Counter[str] = Counter()
    for k, (algebra, text) in enumerate(scripts(SEED, n)):
        random = Random(k)
        try:
            script = read_cluscript(text, algebra)
            scalars_of(script, trace(script).expressions)
        except GacError as error:
            found["refused"] += 1
            assert str(error).count("\n") == 0 and len(str(error)) < 4000, text
            continue
        found["read"] += 1
        exact = {name: random.choice((0, 1, -2, Fraction(3, 2))) for name in script.inputs}
        for values in (exact, {name: random.uniform(-3, 3) for name in script.inputs}):
            for function in (script.multivectors, script.draw):
                try:
                    function(**values)
                except GacError:
                    found["undefined"] += 1
    assert found["read"] > n / 5 and found["refused"] > n / 5 and found["undefined"], found


@pytest.mark.slow
def test_random_scripts_are_compiled_or_rejected() -> None:
    compiled = 0
    for algebra, text in scripts(SEED + 1, N_COMPILED):
        try:
            compiled += compile_kernel(read_cluscript(text, algebra)).cost.total >= 0
        except GacError as error:
            assert str(error).count("\n") == 0, text
    assert compiled > N_COMPILED / 6


REFUSED = {
    "acos of what has none": ("?z = acos(2.5);", "cga", "1:6: acos(5/2), which is not a real number"),
    "a root of less than zero": ("?z = sqrt(1 - 2);", "cga", "1:6: sqrt(-1)"),
    "an arc sine": ("?z = asin(3);", "cga", "not a real number"),
    "a logarithm of nothing": ("?z = log(0);", "cga", "1:6: log(0)"),
    "a number for a line": ("?z = normalizeLineE(4.5);", "3dpga", "zero"),
    "a division by a coefficient that is none": (
        "?z = 1/coefficient(exp(cos(x)),e2);",
        "sta",
        "1:7: a division by zero",
    ),
    "a factorial": ("?z = fact(1000);", "cga", "1:6: fact(1000); expected a natural number up to 170"),
    "a factorial of no small number": ("?z = fact(1e300);", "cga", "up to 170"),
    "a literal": ("?z = 1e99999;", "cga", "1:6: 1e99999, which is out of the range of doubles"),
    "a long literal": ("?z = " + "9" * 5000 + ";", "cga", "out of the range of doubles"),
    "a product": ("r = 1e300 * 1e300;\n?z = x * r;", "cga", "1:11: a number out of the range of doubles"),
    "squares of squares": ("\n".join([f"r{k + 1} = r{k} * r{k};" for k in range(40)]) + "?z = r40 * x;", "cga", ""),
    "brackets": ("?z = " + "(" * 5000 + "x" + ")" * 5000 + ";", "cga", "nested"),
    "signs": ("?z = " + "-" * 5000 + "x;", "cga", "nested"),
    "macros": (
        "\n".join(f"m{k} = {{ m{k + 1}(_P(1)) + 1 }}" for k in range(1500)) + "\nm1500 = { _P(1) }\n?z = m0(x);",
        "cga",
        "nested",
    ),
    "a vector for a length": ("?z = createCylinder(e1 + e2 ^ e3, x, 1, 3);", "qga", "a scalar"),
    "what no number satisfies": ("?z = acos(2 + x * x);", "cga", "undefined"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_one_line(case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text, algebra, words = REFUSED[case]
    monkeypatch.chdir(tmp_path)
    text = f"r0 = 1e200;\n{text}" if "squares" in case else text
    Path("wrong.clu").write_text(text)
    result = CliRunner().invoke(main, ["cost", "wrong.clu", "--algebra", algebra])
    assert result.exit_code == 1 and isinstance(result.exception, SystemExit)
    (line,) = result.output.strip().splitlines()  # one
    assert line.startswith("gac: error: wrong.clu:") and words in line


def test_small_numbers_are_numbers() -> None:
    """Numbers outside of the range of doubles are rejected, others are not."""
    script = read_cluscript("?a = 1e-300 * 1e-20 * x; ?b = 1e308 * x; ?c = fact(170) / fact(169) * x;", "cga")
    found = script.multivectors(x=1)
    assert float(found.a.scalar) == 1e-320 and float(found.b.scalar) == 1e308 and found.c.scalar == 170


def test_output_pragma_on_a_scalar() -> None:
    """Regression test: the script was rejected with "True of type bool"."""
    for pragma, blades in (("1", ()), ("1.0", ()), ("1 e1", ("1", "e1")), ("e1", ("e1",))):
        script = read_cluscript(f"#pragma output z {pragma}\n?z = x - d;", "cga")
        (found,) = script.function(*(p.symbols() for p in script.parameters))
        assert len(found.blades | {0}) >= 1 and len(blades) in (0, 1, 2)
        record = compile_kernel(script)
        result = record.program.results[0]
        assert result.shape == ((len(blades),) if blades else ())
    assert script.multivectors(x=5, d=3).z.terms == {}


def test_a_semicolon_may_be_missing_before_the_result_of_a_macro() -> None:
    """The tests of Gaalop contain such macros."""
    for body in ("k = _P(1) + _P(2)\n k", "k = _P(1) + _P(2); k", "k = _P(1); j = k + _P(2) j", "k = _P(2) _P(1) + k"):
        script = read_cluscript(f"m = {{ {body} }}\n?z = m(x, y);", "3d")
        assert script.multivectors(x=2, y=5).z.scalar == 7
    for wrong in ("k = _P(1) j = k; j", "k = _P(1) k = 2", "k = _P(1) ?k; k"):
        with pytest.raises(GacError, match="expected ';'"):
            read_cluscript(f"m = {{ {wrong} }}\n?z = m(x, y);", "3d")
    with pytest.raises(GacError, match="expected ';'"):
        read_cluscript("?z = x\n?y = x;", "3d")


def test_a_script_that_only_draws() -> None:
    script = read_cluscript(":S = x * e1;\n:T = e2;", "3d", "scene")
    assert script.outputs == () and [each.name for each in script.draw(x=2)] == ["S", "T"]
    for call in (lambda: script(x=2.0), lambda: compile_kernel(script), lambda: script.layouts):
        with pytest.raises(
            KernelError, match=r"script scene: it draws S and T and has no results; .*draw\(\)"
        ) as caught:
            call()
        assert "\n" not in str(caught.value)


def test_values_where_a_script_has_none() -> None:
    script = read_cluscript("?z = acos(x) + log(x) / y;", "3d", "angles")
    for values in ({"x": 2.0, "y": 1.0}, {"x": 0.5, "y": 0.0}, {"x": -1.0, "y": 1.0}):
        with pytest.raises(GacError, match="angles"):
            script.multivectors(**values)
    value: Any = script.multivectors(x=0.5, y=2.0).z.scalar
    assert np.isclose(value, np.arccos(0.5) + np.log(0.5) / 2)
