"""Algorithms of geometric computing on generated kernels."""

from importlib.util import find_spec

if find_spec("scipy") is None:
    raise ImportError("algorithms needs scipy; run: pip install scipy")
