"""Read the rows of tables in the Python text of kernels with loops."""

from __future__ import annotations

import ast
from dataclasses import replace

from ..errors import BackendError
from ..gac_runtime.boundaries import NAMES
from ..ir.procedure import Place, Storage, Table
from ..ir.rows import Counter, Following, Numbered, Parent, Previous, Row, Shifted, Through, row_at
from .python_loops import READ_OR


class RowReader:
    """Reads rows, given the tables and the loops around a statement."""

    def __init__(self, where: str) -> None:
        self._where = where
        self._tables: dict[str, Table] = {}
        self._lengths: dict[str, str] = {}
        self._loops: dict[str, bool] = {}
        self._over: dict[str, str] = {}  # the lengths of the loops

    def _read(self, node: ast.expr) -> Place:
        match node:
            case ast.Name(name):
                return Place(self._table(node, name).name)
            case ast.Subscript(ast.Name(name), ast.Tuple([])):
                return Place(self._table(node, name).name)
            case ast.Subscript(ast.Name(name), key):
                return Place(self._table(node, name).name, self._row(key))
            case ast.Call(ast.Name(function), [ast.Name(name), key, ast.Name(start)], []) if function == READ_OR:
                first = self._table(node, start).name
                match key:
                    case ast.Call() | ast.Tuple() if self._is_shifted(key):
                        row: Row = self._row(key, first)
                    case ast.Name() | ast.Tuple() | ast.Subscript(ast.Name(), ast.Tuple([])) if self._computed(key):
                        row = self._row(key, first)
                    case ast.BinOp():
                        counter, step = self._neighbour(key)
                        if step != (1 if self._loops[counter] else -1):
                            raise self._unreadable(node)
                        row = Previous(counter, first)
                    case ast.Subscript(ast.Name(index), ast.Name(counter)) if counter in self._loops:
                        row = Parent(self._index(node, index), counter, first)
                    case _:
                        raise self._unreadable(node)
                return Place(self._table(node, name).name, row)
            case _:
                raise self._unreadable(node)

    def _written(self, node: ast.expr) -> Place:
        match node:
            case ast.Name(name):
                return Place(self._table(node, name).name)
            case ast.Subscript(ast.Name(name), ast.Tuple([]) | ast.Slice(None, None, None)):
                return Place(self._table(node, name).name)
            case ast.Subscript(ast.Name(name), ast.Name() | ast.Tuple() as key):
                return Place(self._table(node, name).name, self._row(key))
            case _:
                raise self._unreadable(node)

    def _row(self, key: ast.expr, start: str = "", *, is_target: bool = False) -> Row:
        """Read the number of a row that exists, or that has a computed number.

        If there is no such row, the table `start` is read in its place, and nothing is added to the target of a sum.
        """
        keys = key.elts if isinstance(key, ast.Tuple) else [key]
        return row_at(tuple(self._along_axis(each, start, is_target=is_target) for each in keys))

    def _onto(self, key: ast.expr) -> Row:
        """Read the number of a row that may not exist."""
        if isinstance(key, ast.BinOp):
            counter, step = self._neighbour(key)
            if step != (-1 if self._loops[counter] else 1):
                raise self._unreadable(key)
            return Following(counter)
        return self._row(key, is_target=True)

    def _computed(self, key: ast.expr) -> bool:
        """Return whether the number of a row is computed along an axis."""
        keys = key.elts if isinstance(key, ast.Tuple) else [key]
        return any(isinstance(each, ast.Name) and each.id in self._tables for each in keys)

    def _is_shifted(self, key: ast.expr) -> bool:
        """Return whether rows are at a distance along an axis."""
        keys = key.elts if isinstance(key, ast.Tuple) else [key]
        return any(isinstance(each, ast.Call) for each in keys)

    def _shifted(self, key: ast.expr, boundary: str, at: ast.expr, length: str, start: str) -> Shifted:
        by, stride = 0, 1
        match at:
            case ast.BinOp(first, ast.Add() | ast.Sub() as operator, ast.Constant(int(distance))):
                at, by = first, distance if isinstance(operator, ast.Add) else -distance
        match at:
            case ast.BinOp(ast.Constant(int(stride)), ast.Mult(), first):
                at = first
        if not isinstance(at, ast.Name) or at.id not in self._loops or length not in self._lengths:
            raise self._unreadable(key)
        row = Shifted(at.id, by, boundary, stride)
        return replace(row, start=start) if row.may_miss(self._over[at.id], self._lengths[length]) else row

    def _along_axis(
        self, key: ast.expr, start: str = "", *, is_target: bool = False
    ) -> Counter | Through | Numbered | Shifted:
        match key:
            case ast.Call(ast.Name(function), [at, ast.Name(length)], []) if function in NAMES:
                return self._shifted(key, function[1:], at, length, start)
            case ast.Name(name) if (start or is_target) and name in self._tables:
                return Numbered(self._tables[name].name, start)
            case ast.Name(counter) if counter in self._loops:
                return Counter(counter)
            case ast.Subscript(ast.Name(index), ast.Name(counter)) if counter in self._loops:
                return Through(self._index(key, index), counter)
            case ast.Subscript(ast.Name(index), ast.Tuple([ast.Name(counter), ast.Constant(int(column))])):
                if counter not in self._loops:
                    raise self._unreadable(key)
                return Through(self._index(key, index), counter, column)
            case _:
                raise self._unreadable(key)

    def _neighbour(self, key: ast.expr) -> tuple[str, int]:
        """Read the counter and the step in ``i - 1``."""
        match key:
            case ast.BinOp(ast.Name(counter), ast.Add() | ast.Sub() as operator, ast.Constant(1)) if (
                counter in self._loops
            ):
                return counter, 1 if isinstance(operator, ast.Add) else -1
            case _:
                raise self._unreadable(key)

    def _index(self, node: ast.AST, name: str) -> str:
        table = self._table(node, name)
        if table.storage is not Storage.INDEX:
            raise self._unreadable(node)
        return table.name

    def _table(self, node: ast.AST, name: str) -> Table:
        if name not in self._tables:
            raise self._unreadable(node)
        return self._tables[name]

    def _unreadable(self, node: ast.AST) -> BackendError:
        return BackendError(self._where, f"line {ast.unparse(node)!r}", "a statement written by gacompiler")
