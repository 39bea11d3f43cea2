"""Definitions shared by several specs, as functions of an algebra; no file here is a spec.

Each function declares the kernels of one theme and returns them as a `gacompiler.Family`. A spec assigns the kernels
that it uses to their names, at their places in its module, and defines the others itself.
"""
