"""Gaalop's language, CLUScript, as a second way to write kernels."""

from .dialects import NAMES, dialect
from .script import Drawn, Script, load_script, read_script
from .tokens import ScriptError

__all__ = ["NAMES", "Drawn", "Script", "ScriptError", "dialect", "load_script", "read_script"]
