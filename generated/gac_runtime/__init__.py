"""Runtime of generated modules: kernels, layouts and values. It requires numpy, and numba only if no C is compiled.

This folder is copied next to generated modules; a module that is moved to another folder needs a copy there.
"""
