"""Packages that an installation may lack. Importing this module checks for those that all of gacompiler needs.

They are dependencies of the distribution and lack only where it was installed without them, for generated modules.
"""

from __future__ import annotations

import sys
from importlib.util import find_spec
from pathlib import Path

COMPILER = ("jinja2", "mpmath")
"""The packages that every compilation needs; others are loaded on demand."""

COMMAND = ("click", "rich")
"""The packages that the command needs besides."""

is_command = Path(sys.argv[0]).stem in ("gac", "-m")
missing = sorted(name for name in (*COMPILER, *COMMAND * is_command) if find_spec(name) is None)
if missing:
    line = (
        f"gacompiler needs {', '.join(missing)}; run: pip install {' '.join(missing)}; "
        "generated modules, as in `from generated import pga3`, need only numpy"
    )
    if is_command:
        sys.exit(f"gac: error: {line}")
    raise ImportError(line)
