"""What generated modules run on: kernels, layouts and values. It needs numpy, and numba only where no C is compiled.

This folder is copied beside generated modules; a module that is copied elsewhere needs it there.
"""

from .kernel import Kernel
from .layout import SCALAR, Layout, layout
from .module import INTERFACE, GeneratedModule
from .value import Value

__all__ = ["INTERFACE", "SCALAR", "GeneratedModule", "Kernel", "Layout", "Value", "layout"]
