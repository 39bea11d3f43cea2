"""The usual macros of each named algebra, as functions on multivectors and expressions.

A table maps name and number of arguments to a function. Scripts may replace any of them.
"""
