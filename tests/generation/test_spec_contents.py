"""Files of definitions that a spec imports: a change of one of them is a change of the spec."""

from __future__ import annotations

from pathlib import Path

import pytest

from gacompiler.generation.spec_contents import digest_of, imports_beside, place_of_failure

FILES = {
    "spec.py": "from gacompiler import kernel\nimport parts, math\nfrom folder import inner\n",
    "parts.py": "from .more import x\nimport spec\n",
    "more.py": "x = 1\n",
    "folder/__init__.py": "",
    "folder/inner.py": "import more, other.deep",
    "other/deep.py": "",
    "unused.py": "",
    "math/unused.py": "",
    "gacompiler/__init__.py": "",
    "gacompiler/kernel.py": "",
}


@pytest.mark.parametrize("changed", FILES)
def test_a_digest_depends_on_imported_files(tmp_path: Path, changed: str) -> None:
    """Imported directly or by another file, but not on the compiler, which a folder may contain too."""
    for name, text in FILES.items():
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
    spec = tmp_path / "spec.py"
    before = digest_of(spec, spec.read_text())
    with (tmp_path / changed).open("a") as file:
        file.write("# another line\n")
    is_used = changed not in {"unused.py", "math/unused.py", "gacompiler/__init__.py", "gacompiler/kernel.py"}
    assert (digest_of(spec, spec.read_text()) != before) == is_used


@pytest.mark.parametrize(
    ("spec", "parts", "lines"),
    [
        ("import json\njson.loads('{')", "", "spec.py:2"),
        ("import parts\nparts.f()", "def f():\n    1 / 0", "spec.py:2: parts.py:2"),
        ("import parts\nparts.f()", "import json\ndef f():\n    json.loads('{')", "spec.py:2: parts.py:3"),
        ("import parts\nparts.f()", "def f():\n    raise ValueError(__file__)", "spec.py:2"),
    ],
)
def test_the_place_of_a_failure_is_in_files_of_the_author(tmp_path: Path, spec: str, parts: str, lines: str) -> None:
    path = tmp_path / "spec.py"
    path.write_text(spec)
    (tmp_path / "parts.py").write_text(parts)
    with pytest.raises(Exception) as caught, imports_beside(path, spec):
        exec(compile(spec, str(path), "exec"), {})
    assert place_of_failure(path, spec, caught.value).replace(f"{tmp_path}/", "") == lines
