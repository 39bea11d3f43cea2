"""What `import gacompiler` needs beside numpy: the extra ``compiler``. Loading this file checks that it is there."""

from __future__ import annotations

import sys
from importlib.util import find_spec
from pathlib import Path

COMPILER = ("click", "jinja2", "mpmath", "rich")
"""The packages without which no kernel is compiled; others are loaded when something needs them."""

missing = [name for name in COMPILER if find_spec(name) is None]
if missing:
    line = (
        f"gacompiler needs {', '.join(missing)}; run: pip install 'gacompiler[compiler]'; "
        "generated modules, as in `from generated import pga3`, need numpy alone"
    )
    if Path(sys.argv[0]).stem == "gac":
        sys.exit(f"gac: error: {line}")
    raise ImportError(line)
