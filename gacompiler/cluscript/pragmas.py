"""The ``#pragma ...`` lines of a script."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

from .tokens import Directive, Place, ScriptError

KNOWN = ("output", "onlyEvaluate", "in2out", "range", "segments", "triangles", "insert", "return", "normalize")


@dataclass(frozen=True, slots=True)
class OutputBlades:
    """``output m e1 e1^e2``: the requested coefficients of m, or all if none are named."""

    name: str
    blades: tuple[str, ...]
    place: Place


@dataclass(frozen=True, slots=True)
class Returned:
    """``return a, b typed T as expression``: how another language packs the results; stored, but not used."""

    names: tuple[str, ...]
    type: str
    expression: str


@dataclass(slots=True)
class Pragmas:
    """All pragmas of a script."""

    outputs: list[OutputBlades] = field(default_factory=list)
    only_evaluate: list[str] = field(default_factory=list)
    signature: tuple[tuple[str, ...], tuple[str, ...], Place] | None = None
    ranges: dict[str, tuple[float, float]] = field(default_factory=dict)
    segments: list[tuple[str, ...]] = field(default_factory=list)
    triangles: list[tuple[str, ...]] = field(default_factory=list)
    insertions: list[str] = field(default_factory=list)
    returns: list[Returned] = field(default_factory=list)
    normalize_from: Place | None = None
    """Outputs assigned after this place are divided by their length."""


_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_RANGE = re.compile(rf"({_NUMBER})\s*<=\s*([\w$]+)\s*<=\s*({_NUMBER})")
_RETURN = re.compile(r"(.+?)\s+typed\s+(\S+)\s+as\s+(.+)")
_OUTPUT = re.compile(r"(?:\{([^}]*)\}|([\w$]+))\s*(.*)")


def read_pragmas(script: str, directives: Sequence[Directive]) -> Pragmas:
    """Return the pragmas of a script.

    Raises
    ------
    ScriptError
        If a pragma is unknown or malformed.
    """
    found = Pragmas()
    for directive in directives:
        _read(script, directive, found)
    return found


def _read(script: str, directive: Directive, found: Pragmas) -> None:
    name, rest, place = directive.name, directive.rest, directive.place

    def fail(expected: str) -> ScriptError:
        return ScriptError(script, place, f"#pragma {name} {rest}".rstrip(), expected)

    if name == "output":
        match = _OUTPUT.fullmatch(rest)
        names = _listed(match[1] if match[1] is not None else match[2]) if match else ()
        if match is None or not names:
            raise fail("#pragma output m e1 e1^e2")
        blades = tuple("1" if blade == "1.0" else blade for blade in match[3].split())
        found.outputs += [OutputBlades(each, blades, place) for each in names]
    elif name == "onlyEvaluate":
        found.only_evaluate += _listed(rest)
    elif name == "in2out":
        sides = rest.split("->")
        if len(sides) != 2 or found.signature is not None:
            raise fail("one #pragma in2out a, b -> c, d")
        found.signature = (_listed(sides[0]), _listed(sides[1]), place)
    elif name == "range":
        match = _RANGE.fullmatch(rest)
        if match is None or float(match[1]) > float(match[3]):
            raise fail("#pragma range 0 <= x <= 1")
        found.ranges[match[2]] = float(match[1]), float(match[3])
    elif name in ("segments", "triangles"):
        size = 2 if name == "segments" else 3
        groups = [tuple(group.split()) for group in rest.split(",")]
        if any(len(group) != size for group in groups):
            raise fail(f"#pragma {name} " + ("A B, C D" if size == 2 else "A B C, D E F"))
        (found.segments if size == 2 else found.triangles).extend(groups)
    elif name == "insert":
        found.insertions.append(rest)
    elif name == "return":
        match = _RETURN.fullmatch(rest)
        if match is None:
            raise fail("#pragma return a, b typed T as expression")
        found.returns.append(Returned(_listed(match[1]), match[2], match[3]))
    elif name == "normalize":
        if rest:
            raise fail("#pragma normalize without arguments")
        found.normalize_from = found.normalize_from or place
    elif name in ("unroll", "count"):
        raise ScriptError(script, place, f"#pragma {name}: scripts have no loops")
    else:
        raise ScriptError(script, place, f"an unknown pragma {name}", "one of " + " ".join(KNOWN))


def _listed(text: str) -> tuple[str, ...]:
    return tuple(text.replace(",", " ").split())
