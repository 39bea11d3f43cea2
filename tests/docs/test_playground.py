"""The playground: its archive is enough to compile, under CPython and in Pyodide, and its page runs kernels.

Tests with Pyodide need its folder: ``npm install --prefix build pyodide``, or another folder in GAC_PYODIDE.
"""

from __future__ import annotations

import functools
import http.server
import io
import json
import math
import os
import re
import shutil
import subprocess
import sys
import threading
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from browser import PROGRAM, Browser
from website import playground
from website.places import ROOT

PYODIDE = Path(os.environ.get("GAC_PYODIDE", ROOT / "build" / "node_modules" / "pyodide"))
needs_pyodide = pytest.mark.skipif(
    not (PYODIDE / "pyodide.asm.wasm").is_file(), reason="no Pyodide; run: npm install --prefix build pyodide"
)
needs_node = pytest.mark.skipif(not shutil.which("node"), reason="no node on the PATH")


def examples() -> dict[str, str]:
    """The examples on the page."""
    text = (playground.BROWSER / "page.mjs").read_text().replace("\\`", "\0")
    found = re.findall(r'^  "([\w ]+)": `(.*?)`,$', text, re.MULTILINE | re.DOTALL)
    assert len(found) == 3
    return {name: example.replace("\0", "`") for name, example in found}


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the playground, with the archive unpacked in ``packages``."""
    folder = tmp_path_factory.mktemp("playground")
    for name, content in playground.files().items():
        (folder / name).write_bytes(content)
    with zipfile.ZipFile(folder / "packages.zip") as archive:
        archive.extractall(folder / "packages")
    return folder


@pytest.mark.slow
def test_the_archive_has_only_these_packages() -> None:
    content = playground.archive()
    assert content == playground.archive()
    names = zipfile.ZipFile(io.BytesIO(content)).namelist()
    packages = {name.partition("/")[0] for name in names if name.endswith((".py", ".jinja"))}
    assert packages == {"gacompiler", "jinja2", "markupsafe", "mpmath", "sympy"}
    assert not [name for name in names if name.endswith((".so", ".pyc", ".c")) or "/tests/" in name]
    licensed = {name.partition("-")[0] for name in names if "license" in name.lower()}
    assert licensed >= {"jinja2", "markupsafe", "mpmath", "sympy"}


def test_the_page_says_where_things_come_from() -> None:
    texts = [(playground.BROWSER / name).read_text() for name in ("playground.html", "page.mjs", "worker.mjs")]
    assert not any(re.search(r"https?://", text) for text in texts), "the only other place is that in places.json"
    place = playground.PYODIDE.split("/")[2]
    assert place in texts[0] and place in (ROOT / playground.PAGE).read_text()


@pytest.mark.slow
def test_places(place: Path) -> None:
    size = (place / "packages.zip").stat().st_size
    assert json.loads((place / "places.json").read_text()) == {"pyodide": playground.PYODIDE, "archive": size}


ALONE = """
import json, sys
sys.path[:] = [path for path in sys.path if "site-packages" not in path] + ["packages"]
from report import report
for name in ("numpy", "scipy", "numba", "cffi", "click", "rich"):
    try:
        __import__(name)
    except ImportError:
        continue
    raise SystemExit(f"{name} can be imported")
print(json.dumps([json.loads(report(text)) for text in json.loads(sys.stdin.read())]))
"""


def alone(place: Path, *texts: str) -> list[dict[str, Any]]:
    """What the program of the worker reports, with the standard library and the archive alone."""
    (place / "alone.py").write_text(ALONE)
    # -E and -s, not -I: the folder of the script is needed, and -S would hide nothing else.
    command = [sys.executable, "-E", "-s", "-S", "alone.py"]
    done = subprocess.run(command, cwd=place, input=json.dumps(texts), capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-2000:]
    return json.loads(done.stdout)


def is_screw(numbers: list[float], angle: float) -> None:
    """Test the image of (1, 1, 0) under the screw of the page, which rises by the angle."""
    c, s = math.cos(angle), math.sin(angle)
    assert numbers == pytest.approx([c - s, s + c, angle], rel=1e-5)


@needs_node
@pytest.mark.slow
def test_examples_compile_without_other_packages(place: Path) -> None:
    screw, mirrors, arm = alone(place, *examples().values())
    assert [each["name"] for each in screw["kernels"][0]["inputs"]] == ["angle", "pitch", "p"]
    assert screw["kernels"][0]["outputs"] == [
        {"name": "out", "scalar": False, "blades": ["e032", "e013", "e021"], "unit": False}
    ]
    assert [part["unit"] for part in mirrors["kernels"][0]["inputs"]] == [True, True, False]
    assert arm["kernels"][0]["inputs"] is None and "n * (" in arm["kernels"][0]["cost"]
    for each in (screw, mirrors, arm):
        assert set(each["files"]) == {"C", "Rust", "JavaScript", "Python"} and each["kernels"][0]["stages"]
    (place / "screw.mjs").write_text(screw["files"]["JavaScript"])
    program = 'import { screw } from "./screw.mjs"; console.log(JSON.stringify([...screw(0.7, 1, [1, 1, 0])]));'
    done = subprocess.run(["node", "--input-type=module", "-e", program], cwd=place, capture_output=True, text=True)
    is_screw(json.loads(done.stdout), 0.7)


@pytest.mark.slow
def test_errors_are_messages(place: Path) -> None:
    syntax, names, empty = alone(place, "def f(:\n", "from gacompiler import nothing\n", "x = 1\n")
    assert syntax["error"].startswith("kernels.py:1:7: syntax error")
    assert "kernels.py:1: ImportError" in names["error"] and "no kernel in it" in empty["error"]


NODE = """
import { readFileSync } from "node:fs";
import { compiler } from "./worker.mjs";
const { loadPyodide } = await import(process.argv[2]);
const archive = new Uint8Array(readFileSync("packages.zip")).buffer, said = [];
const compile = await compiler(loadPyodide, {}, archive, readFileSync("report.py", "utf8"), (text) => said.push(text));
const reports = JSON.parse(readFileSync("texts.json", "utf8")).map(compile);
console.log(JSON.stringify({ said, reports }));
"""


@needs_node
@needs_pyodide
@pytest.mark.peers
def test_the_compiler_in_pyodide_gives_the_same_code(place: Path) -> None:
    texts = [*examples().values(), "x = 1\n"]
    (place / "node.mjs").write_text(NODE)
    (place / "texts.json").write_text(json.dumps(texts))
    command = ["node", "node.mjs", (PYODIDE / "pyodide.mjs").as_uri()]
    done = subprocess.run(command, cwd=place, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-1000:]
    found = json.loads(done.stdout)
    assert found["said"] == ["starting Python", "unpacking the compiler", "importing the compiler"]
    for here, there in zip(alone(place, *texts), found["reports"], strict=True):
        assert {**here, "seconds": 0} == {**there, "seconds": 0}


@pytest.mark.skipif(PROGRAM is None, reason="no Chromium on the PATH")
@pytest.mark.slow
def test_the_page_has_the_colours_of_the_site_and_says_that_it_needs_a_server(place: Path) -> None:
    frame = place / "site.html"
    frame.write_text('<body data-theme="dark"><iframe src="playground.html" width="600" height="500"></iframe>')
    with Browser(800, 600) as page:
        page.open(place / "playground.html", "document.getElementById('status')")
        assert "http.server" in page.run("document.getElementById('status').textContent")
        assert page.run("document.documentElement.className") == ""
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), served_from(place)) as server, Browser(800, 600) as page:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        page.call("Page.navigate", url=f"http://127.0.0.1:{server.server_port}/site.html")
        inner = "document.querySelector('iframe')?.contentDocument"
        for _ in range(100):
            if page.run(f"new Promise(done => setTimeout(() => done(Boolean({inner}?.querySelector('option'))), 50))"):
                break
        assert page.run(f"{inner}.documentElement.className") == "dark"
        assert page.run(f"{inner}.getElementById('status').textContent") == ""
        server.shutdown()


def served_from(folder: Path) -> Any:
    """A handler that serves a folder without messages."""

    class Quiet(http.server.SimpleHTTPRequestHandler):
        def log_message(self, *_: Any) -> None:
            pass

    return functools.partial(Quiet, directory=str(folder))


@pytest.fixture
def address(tmp_path: Path) -> Iterator[str]:
    """The address of the page, on a server of this process."""
    for name, content in playground.files(PYODIDE).items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(content)

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), served_from(tmp_path))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}/playground.html"
    server.shutdown()


@pytest.mark.skipif(PROGRAM is None, reason="no Chromium on the PATH")
@needs_pyodide
@pytest.mark.peers
@pytest.mark.parametrize("width", [390, 1400])
def test_the_page_compiles_and_runs_a_kernel(width: int, address: str) -> None:
    with Browser(width, 900) as page:
        page.call("Page.navigate", url=address)

        def until(expression: str) -> None:
            for _ in range(600):
                if page.run(f"new Promise(done => setTimeout(() => done(Boolean({expression})), 200))"):
                    return
            raise AssertionError(page.run("document.getElementById('status').textContent"))

        until("document.getElementById('size')?.textContent")
        page.run("document.getElementById('compile').click()")
        until("document.getElementById('status').textContent.startsWith('compiled')")
        until("document.querySelectorAll('#plot path').length === 3")
        assert page.run("document.documentElement.scrollWidth") == width
        page.run("const at = document.getElementById('at'); at.value = 0.25; at.oninput()")
        values = re.findall(r"= (-?[\d.]+?\d{5})", page.run("document.getElementById('values').textContent"))
        is_screw([float(value) for value in values], 6.28 / 4)
        tabs = page.run("[...document.getElementById('tabs').children].map(each => each.textContent)")
        assert tabs == ["Counts", "Stages", "C", "Rust", "JavaScript", "Python"]
        page.run("document.getElementById('tabs').children[3].click()")
        assert "pub fn screw<T: Real>" in page.run("document.getElementById('shown').textContent")
        page.run("document.getElementById('spec').value = 'x = 1'; document.getElementById('compile').click()")
        until("document.getElementById('status').className === 'bad'")
        assert "no kernel in it" in page.run("document.getElementById('status').textContent")
