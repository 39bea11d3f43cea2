"""Write the playground of the site: the compiler in the browser, from files next to the page and Pyodide.

The pages in ``browser/`` are copied as they are. Python packages are in one archive, from this environment: the
compiler without what needs other packages, jinja2 with markupsafe, mpmath, and sympy, which factors polynomials.
Pyodide is loaded from the content delivery network of its authors, or from a copy of its folder in the site
(``--pyodide``).
"""

from __future__ import annotations

import io
import json
import re
import zipfile
from importlib.metadata import distribution
from pathlib import Path

from .places import ROOT

PYODIDE = "https://cdn.jsdelivr.net/pyodide/v314.0.7/full/"
"""The folder of Pyodide; the version is that of the tests."""

PAGE = "docs/playground.md"
FRAME = """
```{raw} html
<p><a href="../playground/playground.html">Open the playground in the whole window</a></p>
<iframe src="../playground/playground.html" title="playground" loading="lazy"
    style="width:100%;height:900px;border:1px solid #8884;border-radius:8px"></iframe>
```
"""
"""What the site adds to the page."""

BROWSER = Path(__file__).with_name("browser")

OTHERS = ("jinja2", "markupsafe", "mpmath", "sympy")
"""The packages that the compiler needs besides the standard library, all in Python."""

LEFT_OUT = ("calculus", "cli", "gac_runtime/jit", "objects", "robots", "specs", "symbolic", "wheels")
"""Folders of the compiler that need other packages, or that no kernel imports; ``specs/families`` is kept."""


NOT_OF_OTHERS = re.compile(
    r"/(tests|benchmarks)/|^sympy/(categories|codegen|crypto|diffgeom|holonomic|physics|stats|testing|vector)/|^isympy"
)
"""Files that are not imported when polynomials are factored."""

_NEEDED = ("pyodide-lock.json", "pyodide.asm.mjs", "pyodide.asm.wasm", "pyodide.mjs", "python_stdlib.zip")
"""The files of Pyodide that a browser loads."""


def files(pyodide: Path | None = None) -> dict[str, bytes]:
    """Return the files of the playground by name.

    Parameters
    ----------
    pyodide : Path, optional
        A folder with a release of Pyodide, which is copied into the site.
    """
    found = {path.name: path.read_bytes() for path in sorted(BROWSER.iterdir()) if path.is_file()}
    found["packages.zip"] = archive()
    places = {"pyodide": "pyodide/" if pyodide else PYODIDE, "archive": len(found["packages.zip"])}
    found["places.json"] = json.dumps(places).encode()
    if pyodide:
        found |= {f"pyodide/{name}": (pyodide / name).read_bytes() for name in _NEEDED}
    return found


def archive() -> bytes:
    """Return the archive of all packages, whose bytes depend only on their contents."""
    texts = {}
    for path in sorted((ROOT / "gacompiler").rglob("*")):
        name = path.relative_to(ROOT / "gacompiler").as_posix()
        unused = any(name.startswith(f"{folder}/") for folder in LEFT_OUT) and not name.startswith("specs/families/")
        if path.suffix in (".py", ".jinja") and (not unused or name == "specs/__init__.py"):
            texts[f"gacompiler/{name}"] = path.read_bytes()
    for package in OTHERS:
        known = distribution(package)
        for entry in known.files or ():
            name = entry.as_posix()
            is_wanted = entry.suffix == ".py" and not NOT_OF_OTHERS.search(name)
            if ".." not in entry.parts and (is_wanted or "license" in name.lower()):
                texts[name] = Path(str(known.locate_file(entry))).read_bytes()
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as target:
        for name, content in sorted(texts.items()):
            info = zipfile.ZipInfo(name)
            info.compress_type = zipfile.ZIP_DEFLATED
            target.writestr(info, content)
    return packed.getvalue()
