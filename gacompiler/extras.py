"""The dependencies of gacompiler besides numpy (the extra ``compiler``). Importing this module checks for them."""

from __future__ import annotations

import sys
from importlib.util import find_spec
from pathlib import Path

COMPILER = ("click", "jinja2", "mpmath", "rich")
"""The packages that every compilation needs; others are loaded on demand."""

missing = [name for name in COMPILER if find_spec(name) is None]
if missing:
    line = (
        f"gacompiler needs {', '.join(missing)}; run: pip install 'gacompiler[compiler]'; "
        "generated modules, as in `from generated import pga3`, need only numpy"
    )
    if Path(sys.argv[0]).stem == "gac":
        sys.exit(f"gac: error: {line}")
    raise ImportError(line)
