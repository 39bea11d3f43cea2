"""Algorithms of geometric computing on generated kernels."""

from importlib.util import find_spec

_missing = [name for name in ("numba", "scipy") if find_spec(name) is None]
if _missing:
    raise ImportError(f"algorithms needs {' and '.join(_missing)}; run: pip install 'gacompiler[algorithms]'")
