"""Gaalop's language CLUScript as an alternative input language for kernels."""

from .dialects import NAMES, dialect
from .script import Drawn, Script, load_script, read_script
from .tokens import ScriptError

__all__ = ["NAMES", "Drawn", "Script", "ScriptError", "dialect", "load_script", "read_script"]
