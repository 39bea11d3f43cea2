"""The command line: output, exit status, one-line errors."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from gacompiler.backends import find_compiler, library_path, runtime_files
from gacompiler.cli import COMMANDS, main, showing
from gacompiler.generation.checked_in import generated_folder, own_specs
from gacompiler.generation.spec_files import load_spec
from gacompiler.passes.pipeline import compile_kernel

SPEC = '''
from gacompiler import kernel, sandwich
from gacompiler.algebra.catalog import PGA3

@kernel(m=PGA3.MOTOR, p=PGA3.POINT)
def move_point(m, p):
    """Move the point `p` by the unit motor `m`: ``m p ~m``."""
    return sandwich(m, p)
'''


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my_kernels.py").write_text(SPEC)
    return tmp_path


def run(*words: str) -> Result:
    return CliRunner().invoke(main, list(words))


def test_generate_then_verify(here: Path) -> None:
    result = run("generate", "my_kernels.py", "-o", "out")
    assert result.exit_code == 0, result.output
    assert {"my_kernels.py", "my_kernels.c", "my_kernels.h"} <= {path.name for path in (here / "out").iterdir()}
    result = run("verify", "my_kernels.py")
    assert result.exit_code == 0 and "exactly" in result.output
    assert "unchanged" in run("generate", "my_kernels.py", "-o", "out").output


@pytest.mark.slow
def test_build_compiles_what_was_generated(here: Path) -> None:
    assert run("generate", "my_kernels.py", "-o", "out", "--no-build").exit_code == 0
    path = here / "out" / "my_kernels.c"
    doubles, floats = (library_path(path, only=only) for only in ("f64", "f32"))
    for arguments, libraries in (([], [doubles]), (["--floats"], [doubles, floats])):
        assert not libraries[-1].exists()
        result = run("build", "out", *arguments)
        assert result.exit_code == 0, result.output
        assert (libraries[-1].name in result.output) if find_compiler() else ("note: " in result.output)
        assert [each for each in (doubles, floats) if each.exists()] == (libraries if find_compiler() else [])
    empty = run("build", ".")
    assert empty.exit_code == 1 and "no generated C file" in empty.output


@pytest.mark.slow
def test_verify_finds_a_flipped_sign(here: Path) -> None:
    run("generate", "my_kernels.py", "--no-build")
    for name in ("my_kernels.py", "my_kernels.c"):
        path = here / "out" / name
        text = path.read_text()
        place = text.rindex("p_e032 + ") if "p_e032 + " in text else text.rindex(" + ", 0, text.rindex("out[0]"))
        path.write_text(text[:place] + text[place:].replace(" + ", " - ", 1))
        assert run("verify", "my_kernels.py").exit_code == 1
        path.write_text(text)
    assert run("verify", "my_kernels.py").exit_code == 0


@pytest.mark.slow
def test_check_compares_and_proves(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    n = 4 + len(runtime_files())
    result = run("check", "omnidirectional", "--prove")
    assert result.exit_code == 0 and f"{n} files are up to date\n6 kernels are proved" in result.output
    for path in generated_folder().glob("omnidirectional.*"):
        (tmp_path / path.name).write_text(path.read_text() + "\n")
    monkeypatch.setattr("gacompiler.cli.checking.generated_folder", lambda: tmp_path)
    result = run("check", "omnidirectional")
    assert result.exit_code == 1 and f"{n} files differ" in result.output and "make generated" in result.output


def test_cost_json(here: Path) -> None:
    counts = json.loads(run("cost", "my_kernels.py", "--json").output)["move_point"]
    assert json.loads(run("cost", "my_kernels.py:move_point", "--json").output) == {"move_point": counts}
    assert "no kernel mov;" in run("cost", "my_kernels.py:mov").output
    assert (counts["mul"], counts["add"], counts["div"], counts["sqrt"], counts["call"]) == (21, 18, 0, 0, 0)
    assert counts["fma"] <= 39


TANGENCY = """
from gacompiler import inner_product, kernel, norm_squared
from gacompiler.algebra.catalog import CGA3

@kernel(s=CGA3.VECTOR, t=CGA3.VECTOR)
def tangency(s, t):
    return norm_squared(s ^ t)

@kernel(s=CGA3.VECTOR, t=CGA3.VECTOR)
def by_products(s, t):
    return inner_product(s, s) * inner_product(t, t) - inner_product(s, t) ** 2
"""


def test_cost_lists_cheaper_forms_that_lose_digits_unless_they_are_written(here: Path) -> None:
    (here / "tangency.py").write_text(TANGENCY)
    counts = json.loads(run("cost", "tangency.py", "--json").output)
    assert [(row["mul"], row["add"]) for row in counts.values()] == [(15, 18), (15, 13)]
    refused = counts["tangency"]["refused"]
    assert refused.startswith("15 mul, 13 add: ") and "arguments that nearly coincide" in refused
    assert "refused" not in counts["by_products"]
    assert refused in run("cost", "tangency.py").output  # from the cache


def test_every_stage_is_shown(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    record = compile_kernel(load_spec(here / "my_kernels.py").kernels[0])
    monkeypatch.setattr(showing, "compile_kernel", lambda *_, **__: record)
    for stage in ("trace", "rewrite", "decide", "lower", "candidates", "program", "c", "python"):
        result = run("show", "my_kernels.py:move_point", "--stage", stage)
        assert result.exit_code == 0 and len(result.output) > 20, stage
    text = run("show", "my_kernels.py:move_point", "--latex").output
    assert text.startswith("\\begin{align*}") and r"\widetilde{m}" in text


def test_new_writes_a_spec_that_compiles(here: Path) -> None:
    for algebra in ("PGA3", "CGA2", "VGA3", "STA"):
        name = f"fresh_{algebra.lower()}"
        assert run("new", name, "--algebra", algebra).exit_code == 0
        result = run("cost", f"{name}.py", "--effort", "0")
        assert result.exit_code == 0, result.output
    again = run("new", "fresh_pga3")
    assert again.exit_code == 1 and "exists" in again.output


@pytest.mark.parametrize(
    ("name", "found"),
    [("class", "keyword of Python"), ("numpy", "hide the module"), ("a b", "not a valid module name")],
)
def test_names_that_cannot_be_imported_are_refused(here: Path, name: str, found: str) -> None:
    assert found in run("new", name).output
    (here / f"{name}.py").write_text(SPEC)
    assert found in run("cost", f"{name}.py").output


@pytest.mark.parametrize(
    ("content", "found"),
    [
        (b"\xff\xfe", "0xff at 0 is no text; expected a text in UTF-8"),
        (b"x = 1\nraise SystemExit(3)", "wrong.py:2: SystemExit: 3"),
        ("# ü\n".encode() + SPEC.encode().replace(b"move_point", b"moved"), ""),
    ],
)
def test_specs_that_cannot_be_read(here: Path, content: bytes, found: str) -> None:
    (here / "wrong.py").write_bytes(content)
    result = run("cost", "wrong.py", "--effort", "0")
    assert result.exit_code == bool(found) and found in result.output and "Traceback" not in result.output


def test_files_are_named_once(here: Path) -> None:
    (here / "one.urdf").write_text('<robot name="a"><link name="x"/></robot>')
    assert run("robot", "one.urdf").output == "gac: error: one.urdf: no moving joint; expected at least one\n"


def test_specs_of_one_name_are_not_written_over_each_other(here: Path) -> None:
    (here / "sub").mkdir()
    (here / "sub" / "my_kernels.py").write_text(SPEC.replace("move_point", "other"))
    result = run("generate", "my_kernels.py", "sub/my_kernels.py", "--no-build")
    assert (
        result.exit_code == 1 and "has the module name of my_kernels.py" in result.output and not list(here.glob("out"))
    )


@pytest.mark.parametrize("what", [(), ("PGA3",), ("my_kernels.py",)])
def test_list(here: Path, what: tuple[str, ...], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(showing, "own_specs", lambda: own_specs()[:2])
    assert run("list", *what).exit_code == 0
    assert json.loads(run("list", *what, "--json").output)


def test_every_command_has_help_with_examples() -> None:
    for command in COMMANDS:
        text = run(command, "--help").output
        assert "Examples:" in text and f"gac {command}" in text


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ("@kernel(m=PGA3.MOTR)\ndef f(m):\n    return m", ["PGA3", "MOTR", "MOTOR"]),
        ("@kernel(m=PGA3.MOTOR)\ndef f(m):\n    return m['e7']", ["e7", "PGA3"]),
        ("@kernel(m=PGA3.MOTOR, returns=PGA3.POINT)\ndef f(m):\n    return m", ["f", "blade", "POINT"]),
        ("@kernel(m=PGA3.LINE)\ndef f(m):\n    return 1 / (m ^ m ^ m)['1']", ["f", "zero"]),
        ("@kernel(m=PGA3.MOTOR, v=VGA3.VECTOR)\ndef f(m, v):\n    return m * v", ["f", "PGA3", "VGA3"]),
    ],
)
def test_bad_kernels_are_errors_of_one_line(here: Path, body: str, words: list[str]) -> None:
    (here / "bad.py").write_text(
        f"from gacompiler import kernel\nfrom gacompiler.algebra.catalog import PGA3, VGA3\n\n{body}\n"
    )
    before = sorted(path.name for path in here.iterdir())
    result = run("generate", "bad.py")
    assert result.exit_code == 1
    message = result.output.strip()
    assert message.startswith("gac: error:") and message.count("\n") == 0, message
    assert all(word in message for word in words), message
    assert sorted(path.name for path in here.iterdir()) == before


def test_unwritable_folder(here: Path) -> None:
    (here / "taken").write_text("a file")
    result = run("generate", "my_kernels.py", "-o", "taken")
    assert result.exit_code == 1 and "taken" in result.output


def test_no_compiler_is_a_note(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("CC", raising=False)
    result = run("generate", "my_kernels.py")
    assert result.exit_code == 0 and "compiler" in result.output


def test_names_between_colons_are_not_replaced_by_pictures() -> None:
    """Regression test: ``:one:`` in a message was printed as an emoji."""
    result = run("verify", "missing.py:one")
    assert result.exit_code and "missing.py:one: no such file" in result.output + result.stderr


def test_a_misspelt_command_is_answered_with_its_name() -> None:
    found = CliRunner().invoke(main, ["generat", "my_kernels.py"])
    assert found.exit_code == 2 and "No such command 'generat'" in found.output
    assert found.output.count("Did you mean 'generate'?") == 1
    assert "Did you mean" not in CliRunner().invoke(main, ["quaternion"]).output
