"""Elements as blocks: conversion to the blocks of matrices that levels describe, their products, and back.

The optimiser uses it for expressions, `gacompiler.structure.representation` for numbers. Coefficients may be of any
ring.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from fractions import Fraction
from typing import Any

from ..algebra.algebra import Algebra
from ..algebra.blades import Rational
from ..algebra.coefficients import is_zero, scale
from ..algebra.products import product
from .levels import COMPLEX, NILPOTENT, Level

Terms = Mapping[int, Any]
Blocks = Any
"""An element without levels left (a mapping of blades), or one for each block, row by row."""


def matrix_product(
    algebra: Algebra, factors: Sequence[Terms], chosen: Sequence[Level], possible: Iterable[int]
) -> dict[int, Any]:
    """Return the geometric product of sums of blades, from left to right, through the levels of a plan.

    Only the `possible` blades are formed: sums that cancel for every element (odd blades in a product of even ones) do
    not cancel symbolically.
    """
    blocks = to_blocks(chosen, factors[0])
    for factor in factors[1:]:
        blocks = _multiply(algebra, chosen, blocks, to_blocks(chosen, factor))
    values, scales = from_blocks(chosen, blocks)
    wanted = [blade for blade in sorted(possible) if not chosen or blade in chosen[0].places]
    short = _entries(chosen, wanted) if chosen and len(wanted) < len(chosen[0].places) else {}
    result: dict[int, Any] = {}
    for blade in wanted:
        if blade in short:
            path, place, share = short[blade]
            result[blade] = scale(_at(blocks, path).get(place, 0), share)
        elif blade in values:
            result[blade] = scale(values[blade], scales[blade])
    return {blade: value for blade, value in result.items() if not is_zero(value)}


def _entries(chosen: Sequence[Level], wanted: Sequence[int]) -> dict[int, tuple[tuple[int, ...], int, Rational]]:
    """Return the blades that are alone in some entry of a block: the path to the block, the blade of C, the factor.

    A vector rotated by a rotor need not be collected from redundant blocks.
    """
    contained: dict[tuple[tuple[int, ...], int], list[tuple[int, Rational]]] = {}
    for blade in wanted:
        for path, terms in leaves(to_blocks(chosen, {blade: 1})):
            for z, factor in terms.items():
                contained.setdefault((path, z), []).append((blade, factor))
    found: dict[int, tuple[tuple[int, ...], int, Rational]] = {}
    for (path, z), blades in sorted(contained.items()):
        if len(blades) == 1:
            ((blade, factor),) = blades
            found.setdefault(blade, (path, z, 1 / Fraction(factor)))
    return found


def leaves(blocks: Blocks) -> Iterator[tuple[tuple[int, ...], Terms]]:
    """Return the elements that no level decomposes, with the numbers of their blocks."""
    if not isinstance(blocks, tuple):
        yield (), blocks
        return
    for k, block in enumerate(blocks):
        for path, terms in leaves(block):
            yield (k, *path), terms


def _at(blocks: Blocks, path: Sequence[int]) -> Terms:
    for k in path:
        blocks = blocks[k]
    found: Terms = blocks
    return found


def to_blocks(chosen: Sequence[Level], terms: Terms) -> Blocks:
    """Return the blocks of an element, applying one level after the other."""
    if not chosen:
        return terms
    level = chosen[0]
    parts: list[dict[int, Any]] = [{} for _ in level.kind.duals]
    for blade, value in terms.items():
        z, j, factor = level.places[blade]
        parts[j][z] = scale(value, factor)
    if level.kind is NILPOTENT:
        parts.append({z: -value if z in level.opposite else value for z, value in parts[0].items()})
        return tuple(to_blocks(chosen[1:], part) for part in parts)
    return tuple(to_blocks(chosen[1:], _combined(zip(parts, row, strict=True))) for row in level.kind.entries)


def _combined(parts: Iterable[tuple[Terms, Rational]]) -> dict[int, Any]:
    total: dict[int, Any] = {}
    for terms, factor in parts:
        for blade, value in terms.items() if factor else ():
            if blade in total and factor == -1:  # not a sum with the negative, which would be a separate node
                total[blade] = total[blade] - value
            else:
                total[blade] = total[blade] + scale(value, factor) if blade in total else scale(value, factor)
    return total


def _multiply(algebra: Algebra, chosen: Sequence[Level], a: Blocks, b: Blocks) -> Blocks:
    if not chosen:
        return _product(algebra, a, b)
    if chosen[0].kind is COMPLEX:
        return _three_products(lambda x, y: _multiply(algebra, chosen[1:], x, y), a, b)
    found = []
    for pairs in chosen[0].kind.products:
        terms = [_multiply(algebra, chosen[1:], a[j], b[k]) for j, k in pairs]
        found.append(terms[0] if len(terms) == 1 else _sum(terms[0], terms[1]))
    return tuple(found)


def _product(algebra: Algebra, a: Terms, b: Terms) -> dict[int, Any]:
    """Return a product of sums of blades. Squares other than 1 and -1 multiply blades of the second factor once."""
    squares = {abs(value) for row in algebra.gram for value in row}
    if squares <= {0, 1}:
        return product(algebra, "geometric_product", a, b)
    total: dict[int, Any] = {}
    for left, x in a.items():
        for right, y in b.items():
            terms: Mapping[int, Rational] = algebra.blade_product(left, right)
            for blade, factor in terms.items():
                term = x * scale(y, factor if factor > 0 else -factor)
                if blade in total:
                    total[blade] = total[blade] + term if factor > 0 else total[blade] - term
                else:
                    total[blade] = term if factor > 0 else -term
    return total


def _three_products(multiply: Callable[[Blocks, Blocks], Blocks], a: Blocks, b: Blocks) -> Blocks:
    """Return ``(p + z q) (r + z s)`` with ``z z = -1``: ``p r - q s``, and ``(p + q) (r + s) - p r - q s``."""
    (p, q), (r, s) = a, b
    if not (_is_empty(p) or _is_empty(q) or _is_empty(r) or _is_empty(s)):
        first, last = multiply(p, r), multiply(q, s)
        return _sum(first, last, -1), _sum(_sum(multiply(_sum(p, q), _sum(r, s)), first, -1), last, -1)
    return _sum(multiply(p, r), multiply(q, s), -1), _sum(multiply(p, s), multiply(q, r))


def _is_empty(blocks: Blocks) -> bool:
    return not any(terms for _, terms in leaves(blocks))


def _sum(a: Blocks, b: Blocks, factor: int = 1) -> Blocks:
    if not isinstance(a, tuple):
        return _combined([(a, 1), (b, factor)])
    return tuple(_sum(x, y, factor) for x, y in zip(a, b, strict=True))


def from_blocks(chosen: Sequence[Level], blocks: Blocks) -> tuple[dict[int, Any], Mapping[int, Rational]]:
    """Return coefficients, and their remaining scale factors."""
    if not chosen:
        return dict(blocks), _Ones()
    level = chosen[0]
    inner = [from_blocks(chosen[1:], block) for block in blocks[: len(level.kind.entries)]]
    inner_scales = inner[0][1]
    parts = [_combined(zip((terms for terms, _ in inner), row, strict=True)) for row in level.kind.duals]
    values: dict[int, Any] = {}
    scales: dict[int, Rational] = {}
    for blade, (z, j, factor) in level.places.items():
        scales[blade] = inner_scales[z] * level.kind.scales[j] / Fraction(factor)
        if z in parts[j]:
            values[blade] = parts[j][z]
    return values, scales


class _Ones(dict[int, Rational]):
    """The factor 1 for every blade."""

    def __missing__(self, blade: int) -> Rational:
        return 1
