"""Generated text is reproducible to the byte, and generation never leaves partially written files."""

from __future__ import annotations

import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from gacompiler.errors import BackendError, SpecError
from gacompiler.generation.compiling import compile_spec
from gacompiler.generation.files import compare, write
from gacompiler.generation.rendering import render
from gacompiler.generation.spec_files import load_spec

SPEC = '''
"""Two kernels."""
from gacompiler import kernel, sandwich
from gacompiler.algebra.catalog import PGA3

@kernel(m=PGA3.MOTOR, p=PGA3.POINT)
def move_point(m, p):
    """Move the point `p` by the unit motor `m`: ``m p ~m``."""
    return sandwich(m, p)

@kernel(a=PGA3.POINT, b=PGA3.POINT)
def line(a, b):
    """Join."""
    return a & b
'''


@pytest.fixture
def spec_file(tmp_path: Path) -> Path:
    path = tmp_path / "two.py"
    path.write_text(SPEC)
    return path


@pytest.mark.slow
def test_text_does_not_depend_on_hash_seed(spec_file: Path) -> None:
    program = (
        "import sys; from pathlib import Path; from gacompiler.generation.compiling import compile_spec; "
        "from gacompiler.generation.rendering import render; from gacompiler.generation.spec_files import load_spec; "
        "print(sorted(render(compile_spec(load_spec(Path(sys.argv[1])))).items()))"
    )
    seed = "1" if os.environ.get("PYTHONHASHSEED") != "1" else "2"
    run = subprocess.run(
        [sys.executable, "-c", program, str(spec_file)],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONHASHSEED": seed},
        check=True,
    )
    assert run.stdout == f"{sorted(render(compile_spec(load_spec(spec_file))).items())}\n"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("def f(:\n", ["1:", "syntax error"]),
        ("import nothing_of_this_name\n", ["1", "ModuleNotFoundError"]),
        ("x = 1\n", ["no kernel"]),
        (SPEC + SPEC.replace('"""Two kernels."""', "").replace("def line", "def other"), ["move_point", "twice"]),
    ],
)
def test_bad_specs_name_the_place(tmp_path: Path, text: str, words: list[str]) -> None:
    path = tmp_path / "bad.py"
    path.write_text(text)
    with pytest.raises(SpecError) as caught:
        load_spec(path)
    assert all(word in str(caught.value) for word in ["bad.py", *words]), caught.value
    assert "\n" not in str(caught.value)


def test_error_of_a_missing_spec(tmp_path: Path) -> None:
    with pytest.raises(SpecError, match="gac new"):
        load_spec(tmp_path / "absent.py")


def test_write_reports_changes_and_keeps_other_files(tmp_path: Path, spec_file: Path) -> None:
    files = render(compile_spec(load_spec(spec_file)))
    folder = tmp_path / "out"
    assert {path.name for path in write(files, folder)} == {"two.py", "two.pyi", "two.c", "two.h"}
    assert write(files, folder) == []
    changed = {**files, "two.h": files["two.h"] + "\n"}
    assert [path.name for path in write(changed, folder)] == ["two.h"]
    assert compare(files, folder)
    assert sorted(path.name for path in folder.iterdir()) == ["two.c", "two.h", "two.py", "two.pyi"]


def test_a_failed_write_changes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a.py").write_text("old a")
    (tmp_path / "b.py").write_text("old b")
    opened = os.fdopen

    def fails_at_second(handle: int, mode: str) -> object:
        fails_at_second.calls += 1  # type: ignore[attr-defined]
        if fails_at_second.calls == 2:  # type: ignore[attr-defined]
            os.close(handle)
            raise OSError(28, "No space left on device")
        return opened(handle, mode)

    fails_at_second.calls = 0  # type: ignore[attr-defined]
    monkeypatch.setattr(os, "fdopen", fails_at_second)
    with pytest.raises(BackendError, match="No space left"):
        write({"a.py": "new a", "b.py": "new b"}, tmp_path)
    assert (tmp_path / "a.py").read_text() == "old a"
    assert (tmp_path / "b.py").read_text() == "old b"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.py", "b.py"]


def test_a_folder_that_is_a_file_is_named(tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("")
    with pytest.raises(BackendError, match="taken"):
        write({"a.py": ""}, tmp_path / "taken")


def test_generated_files_are_readable_by_all(tmp_path: Path) -> None:
    write({"a.py": "x"}, tmp_path)
    assert stat.S_IMODE((tmp_path / "a.py").stat().st_mode) == 0o644
