"""What generated modules run on: kernels, layouts and values. It needs numpy, and numba only where no C is compiled.

This folder is copied beside generated modules; a module that is copied elsewhere needs it there.
"""
