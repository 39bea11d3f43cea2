"""Kernels without arguments: a call returns the constant, without batch axes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import gacompiler as ga
from gacompiler import SCALAR, array, kernel
from gacompiler.algebra.catalog import PGA3
from gacompiler.cli import main
from gacompiler.errors import BackendError
from generated import pga3

SPEC = '''"""Constants."""
from gacompiler import SCALAR, array, kernel
from gacompiler.algebra.catalog import PGA3


@kernel(returns=(array(PGA3.POINT, 2), SCALAR))
def corners():
    """Two points and a number."""
    one, two = (PGA3.multivector({"e123": 1, "e032": k}) for k in (1, 3))
    return (one, two), 2
'''


@kernel(returns=PGA3.MOTOR)
def shift():
    return PGA3.multivector({"1": 1, "e01": 2})


@kernel(returns=SCALAR)
def two():
    return 2


@kernel(returns=array(SCALAR, 2, 3))
def table():
    return ((1, 2, 3), (4, 5, 6))


@pytest.mark.parametrize(
    ("definition", "expected"), [(shift, [1, 0, 0, 0, 2, 0, 0, 0]), (two, 2), (table, [[1, 2, 3], [4, 5, 6]])]
)
@pytest.mark.parametrize("backend", ["c", "numba", "arrays"])
def test_a_call_returns_the_constant(definition: Any, expected: Any, backend: Any) -> None:
    try:
        run = ga.compile(definition, backend=backend)
    except BackendError:
        pytest.skip("no C compiler")
    out = np.full(np.shape(expected), np.nan)
    assert run(out=out) is out
    for found in (run(), run(num_threads=2), *([run.jit()] if backend == "numba" else []), out):
        np.testing.assert_array_equal(found, expected)
    assert type(run()) is (np.float64 if definition is two else np.ndarray)
    with pytest.raises(TypeError, match="1 arguments; expected 0"):
        run(1.0)


def test_a_jit_function_needs_arguments() -> None:
    run = pga3.Kernel.of(lambda: ((1.0, 2.0), 3.0), "->(2),()")
    first, second = run()
    assert first.tolist() == [1, 2] and second == 3 and run.jit() == ((1.0, 2.0), 3.0)
    with pytest.raises(ValueError, match="expected the shapes of its 0 arguments"):
        pga3.Kernel.of(lambda: 1.0, "()->()")


def test_generated_files_are_verified(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("constants.py").write_text(SPEC)
    for command in (("generate", "constants.py", "--no-build"), ("verify", "constants.py")):
        ran = CliRunner().invoke(main, command)
        assert ran.exit_code == 0, ran.output
    text = Path("out/constants.py").read_text()
    Path("out/constants.py").write_text(text.replace("3.0", "4.0") if "3.0" in text else text.replace("3", "4"))
    assert CliRunner().invoke(main, ("verify", "constants.py")).exit_code == 1
