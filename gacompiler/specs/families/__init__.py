"""Definitions that specs share, as functions of an algebra; no file here is a spec.

Each function declares the kernels of one theme and gives them back as a `gacompiler.Family`. A spec assigns those that
it has to their names, at the places that they are to have in its module, and defines the rest itself.
"""
