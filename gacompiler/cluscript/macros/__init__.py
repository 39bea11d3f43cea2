"""The standard macros of each named algebra, as functions of multivectors and expressions.

A table maps a name and a number of arguments to a function. Scripts may redefine any of them.
"""
