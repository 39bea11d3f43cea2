"""Selection of kernels: ``gac generate --only`` and ``gac verify --only``."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from gacompiler.cli import main
from gacompiler.errors import SpecError
from gacompiler.generation.selection import select
from gacompiler.generation.spec_files import Spec, load_spec

SPEC = '''
from gacompiler import join, kernel, sandwich
from gacompiler.algebra.catalog import PGA3

@kernel(m=PGA3.MOTOR, p=PGA3.POINT)
def move_point(m, p):
    """Move a point."""
    return sandwich(m, p)

@kernel(a=PGA3.POINT, b=PGA3.POINT)
def join_points(a, b):
    """Join two points."""
    return join(a, b)

@kernel(a=PGA3.DIRECTION, b=PGA3.DIRECTION)
def add_directions(a, b):
    """Add two directions."""
    return a + b
'''


@pytest.fixture
def spec(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Spec:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("GAC_BACKEND", "arrays")  # avoid the start-up time of numba
    (tmp_path / "my_kernels.py").write_text(SPEC)
    return load_spec(tmp_path / "my_kernels.py")


def run(*words: str) -> Result:
    return CliRunner().invoke(main, list(words))


def test_only_these_kernels_are_written(spec: Spec) -> None:
    result = run(
        *("generate", "my_kernels.py", "--no-build"),
        *("--only", "add_directions, join_points"),
    )
    assert result.exit_code == 0 and "2 kernels" in result.output
    text = Path("out/my_kernels.py").read_text()
    assert "# command: gac generate my_kernels.py --only join_points,add_directions\n" in text
    assert "def join_points(" in text and "def add_directions(" in text
    assert "def move_point(" not in text
    assert run("verify", "my_kernels.py").exit_code == 1, "move_point is missing"
    verified = run("verify", "my_kernels.py", "--only", "join_points", "--only", "add_directions")
    assert verified.exit_code == 0 and "move_point" not in verified.output


@pytest.mark.parametrize(
    ("names", "expected"),
    [("move_pont", "one of move_point"), ("jion_points,move_point", "one of join_points"), ("x", "one of move_point")],
)
def test_an_unknown_name_is_an_error_that_lists_similar_names(spec: Spec, names: str, expected: str) -> None:
    result = run("generate", "my_kernels.py", "--only", names)
    assert result.exit_code == 1 and not Path("out").exists()
    wrong = names.partition(",")[0]
    assert f"it defines no kernel '{wrong}'; expected {expected}" in " ".join(result.output.split())


def test_specs_without_a_selected_kernel_are_omitted(spec: Spec) -> None:
    (one,) = select([spec], ("move_point",))
    assert [kernel.name for kernel in one.kernels] == ["move_point"]
    assert select([spec], ()) == [spec]
    Path("others.py").write_text(SPEC.replace("move_point", "transform_point"))
    others = load_spec(Path("others.py"))
    assert [each.name for each in select([spec, others], ("move_point",))] == ["my_kernels"]
    assert [each.name for each in select([spec, others], ("join_points",))] == ["my_kernels", "others"]
    with pytest.raises(SpecError, match=r"my_kernels.py, .*others.py: it defines no kernel 'move_pint'"):
        select([spec, others], ("move_pint",))


def test_checked_in_modules_are_not_replaced_by_parts(spec: Spec) -> None:
    result = run("generate", "--all", "vga2", "--only", "norm")
    assert result.exit_code == 2 and "choose their folder with -o" in result.output
