"""Scripts as kernels: read, traced, and ready for every pass and backend."""

from __future__ import annotations

import keyword
from collections import namedtuple
from collections.abc import Sequence
from dataclasses import dataclass, fields
from fractions import Fraction
from pathlib import Path
from typing import Any

from ..algebra.algebra import Algebra
from ..algebra.layout import SCALAR, SCALARS, Layout
from ..algebra.multivector import Multivector
from ..errors import AlgebraError, InexactError, KernelError, LayoutError, OperandError, SpecError, text_of
from ..frontend.expression import Expression, evaluate, lift
from ..frontend.kernel import Kernel, Parameter
from ..frontend.operations import assemble
from ..frontend.traced import Traced
from .calls import check_calls, macros_of
from .dialects import DECLARED, Dialect, dialect, fitting
from .lowering import Lowering, Meaning
from .parser import parse
from .pragmas import OutputBlades, Pragmas, Returned, read_pragmas
from .syntax import Assignment, Declaration, Statement
from .tokens import Place, ScriptError, words

NOTHING = "nothing"
"""The placeholder argument of a script without inputs, since kernels have at least one."""
RESERVED = ("out", "num_threads", NOTHING)
"""Names that are reserved in generated functions."""


@dataclass(frozen=True, slots=True)
class Drawn:
    """An object that a script draws.

    Attributes
    ----------
    name : str
    value : Multivector or Expression
        A multivector of numbers after `Script.draw`, before that an expression.
    colour : tuple, optional
        Red, green, blue and alpha, in [0, 1]; None if the script does not set a colour.
    null_space : str, optional
        ``IPNS`` or ``OPNS``, if the script specifies it.
    """

    name: str
    value: Any
    colour: tuple[Any, ...] | None
    null_space: str | None


@dataclass(frozen=True)
class Script(Kernel):
    """A script of Gaalop's language: a kernel whose arguments and results have names.

    `gacompiler.compile`, `jacobian` and other kernels take it. What `gacompiler.read_cluscript` returns can be called
    with numbers, too (`gacompiler.scripts`).

    Attributes
    ----------
    name : str
    inputs, outputs : tuple of str
        Names of the arguments and results, in order.
    algebra : Algebra
    drawn : tuple of Drawn
        The drawn objects, in order.
    background : tuple, optional
        Red, green, blue, alpha.
    ranges : dict of str to (float, float)
        The ranges of inputs given by ``#pragma range``.
    segments, triangles : tuple of tuples of str
        Names of points to be connected.
    evaluated : tuple of str
        Variables marked with ``!`` or by ``#pragma onlyEvaluate``. The optimiser decides independently what it keeps.
    insertions, returned
        Directives for Gaalop's own targets: stored, but not used.
    """

    inputs: tuple[str, ...] = ()
    outputs: tuple[str, ...] = ()
    algebra: Algebra = SCALARS
    drawn: tuple[Drawn, ...] = ()
    background: tuple[Any, ...] | None = None
    ranges: Any = None
    segments: tuple[tuple[str, ...], ...] = ()
    triangles: tuple[tuple[str, ...], ...] = ()
    evaluated: tuple[str, ...] = ()
    insertions: tuple[str, ...] = ()
    returned: tuple[Returned, ...] = ()
    file: str = ""

    def __hash__(self) -> int:
        return hash((self.name, self.function, self.file))

    def __eq__(self, other: object) -> bool:
        mine, others = ([getattr(each, field.name, None) for field in fields(self)] for each in (self, other))
        return isinstance(other, Script) and mine == others

    @property
    def where(self) -> str:
        """The name of the script in error messages."""
        return f"{self.file}: script {self.name}"

    def place_of(self, error: BaseException) -> str:
        """Return nothing: errors of scripts contain their own place."""
        return ""

    def __call__(self, /, *arguments: Any, **named: Any) -> Any:
        names = dict(zip(self.inputs, arguments, strict=False)) | named
        return self.function(*(names[name] for name in self.inputs))

    def multivectors(self, /, **values: Any) -> Any:
        """Evaluate the results with the algebra layer: a named tuple of multivectors, exact if the values are."""
        expressions = self.function(*(parameter.symbols() for parameter in self.parameters))
        found = self._evaluated(expressions, values)
        kind: Any = namedtuple(f"{self.name}_multivectors", self.outputs)  # type: ignore[misc]
        return kind(*found)

    def draw(self, /, **values: Any) -> list[Drawn]:
        """Return the drawn objects for given inputs, with numerical multivectors and colours."""
        found = []
        for each in self.drawn:
            (value,) = self._evaluated([lift(each.value)], values)
            parts = [part for part in each.colour or () if isinstance(part, Expression)]
            known = iter(self._evaluated(parts, values))
            colour = each.colour and tuple(
                float(next(known).scalar) if isinstance(part, Expression) else part for part in each.colour
            )
            found.append(Drawn(each.name, value, colour, each.null_space))
        return found

    def _evaluated(self, expressions: Sequence[Any], values: dict[str, Any]) -> list[Multivector]:
        missing = [name for name in self.inputs if name not in values]
        if missing or len(values) != len(self.inputs):
            raise TypeError(f"{self.name}: arguments {' '.join(values)}; expected {' '.join(self.inputs)}")
        known = {name: 0 for parameter in self.parameters for name in parameter.components} | values
        exact = all(isinstance(value, (int, Fraction)) for value in values.values())
        try:
            try:
                found = evaluate(expressions, known, lift=None if exact else _float)
            except InexactError:
                found = evaluate(expressions, {name: _float(value) for name, value in known.items()}, lift=_float)
        except (ValueError, ArithmeticError) as error:
            given = ", ".join(f"{name} = {value}" for name, value in values.items()) or "its numbers"
            raise KernelError(self.where, f"no result for {given}: {error}", "values where it is defined") from error
        return [Multivector(self.algebra, value.terms) for value in found]


def _float(value: Any) -> Any:
    return float(value) if isinstance(value, (int, Fraction)) else value


def read_script(text: str, algebra: str | Path | Algebra | None = None, name: str = "script", file: str = "") -> Script:
    """Read a script of Gaalop's language; see `gacompiler.read_cluscript`.

    Raises
    ------
    ScriptError
        If the script cannot be read; it contains `line` and `column`.
    SpecError
        If the algebra does not exist.
    """
    if not isinstance(text, str):
        raise OperandError("read_cluscript()", type(text).__name__, "the text of a script")
    where = file or name
    try:
        return _read(text, algebra, name, where)
    except RecursionError:
        found = "too many nested brackets, signs or macros"
        raise ScriptError(
            where, Place(1, 1), found, "at most some hundred", "assign intermediate results to names"
        ) from None


def _read(text: str, algebra: str | Path | Algebra | None, name: str, where: str) -> Script:
    tokens, directives = words(where, text)
    pragmas = read_pragmas(where, directives)
    statements = parse(where, tokens)
    chosen = fitting(_dialect(where, statements, algebra), {token.text for token in tokens})
    own = macros_of(where, statements)
    if chosen.source:
        library, _ = words(chosen.where, chosen.source)
        own = macros_of(chosen.where, parse(chosen.where, library)) | own
    check_calls(where, own, statements, chosen)
    symbols: dict[str, Parameter] = {}

    def symbol(written: str) -> Any:
        if written not in symbols:
            symbols[written] = Parameter(_legal(written, {p.name for p in symbols.values()}), SCALAR)
        return symbols[written].symbols()

    assigned = frozenset(each.target.text for each in statements if isinstance(each, Assignment) and each.value)
    lowering = Lowering(where, chosen, own, pragmas.normalize_from, symbol, assigned)
    meaning = lowering.run(statements)
    return _script(where, name, chosen.algebra, meaning, pragmas, symbols)


def _dialect(where: str, statements: Sequence[Statement], algebra: str | Path | Algebra | None) -> Dialect:
    declared = next((each for each in statements if isinstance(each, Declaration)), None)
    if algebra is None:
        if declared is None:
            raise SpecError(where, "no algebra", "a name such as cga", "give --algebra, or begin with DefVarsN3();")
        return dialect(DECLARED[declared.name])
    chosen = dialect(algebra)
    if declared is not None and dialect(DECLARED[declared.name]).algebra != chosen.algebra:
        raise ScriptError(where, declared.place, f"{declared.name} in a script for {chosen.algebra.name}")
    return chosen


def _script(
    where: str, name: str, algebra: Algebra, meaning: Meaning, pragmas: Pragmas, symbols: dict[str, Parameter]
) -> Script:
    inputs = sorted(meaning.inputs, key=lambda each: meaning.inputs[each])
    outputs = list(meaning.outputs)
    for pragma in pragmas.outputs:
        if pragma.name not in meaning.values:
            raise ScriptError(where, pragma.place, f"#pragma output of {pragma.name}, which is not assigned")
        if pragma.name not in outputs:
            outputs.append(pragma.name)
    if pragmas.signature is not None:
        inputs, outputs = _signature(where, pragmas.signature, inputs, outputs)
    if not outputs and not meaning.drawings:
        raise ScriptError(where, Place(1, 1), "no output in the script", "?x; or ?x = expression;")
    values, layouts = [], []
    for each in outputs:
        blades = [p for p in pragmas.outputs if p.name == each and p.blades]
        value, layout = _restricted(where, algebra, meaning.values[each], blades)
        values.append(value)
        layouts.append(layout)
    parameters = tuple(symbols[each] for each in inputs) or (Parameter(NOTHING, SCALAR),)
    only_drawn = " and ".join(each.name for each in meaning.drawings) if not outputs else ""
    fields: list[str] = []
    for each in outputs:
        fields.append(_legal(each.lstrip("_"), set(fields)))
    names = tuple(symbols[each].name for each in inputs)
    if only_drawn:
        function: Any = _OnlyDrawn(f"{where}: script {name}", only_drawn)
    else:
        function = Traced(tuple(parameter.symbols() for parameter in parameters), tuple(map(lift, values)))
    return Script(
        name,
        function,
        parameters,
        tuple(layouts) if any(layouts) else None,
        f"The script `{name}` in {algebra.name}: {', '.join(fields)}.",
        tuple(fields),
        False,
        names,
        tuple(fields),
        algebra,
        tuple(Drawn(each.name, each.value, _numbers(each.colour), each.null_space) for each in meaning.drawings),
        _numbers(meaning.background),
        {symbols[each].name: limits for each, limits in pragmas.ranges.items() if each in symbols},
        tuple(pragmas.segments),
        tuple(pragmas.triangles),
        tuple(dict.fromkeys([*meaning.evaluated, *pragmas.only_evaluate])),
        tuple(pragmas.insertions),
        tuple(pragmas.returns),
        where,
    )


@dataclass(frozen=True, slots=True)
class _OnlyDrawn:
    """The function of a script that has drawings and no results: it raises an error to that effect."""

    where: str
    names: str

    def __call__(self, *arguments: Any) -> Any:
        found = f"it draws {self.names} and has no results"
        raise KernelError(self.where, found, "an output", "write ?x; or call draw() of the script")


def _signature(
    where: str, signature: tuple[tuple[str, ...], tuple[str, ...], Place], inputs: list[str], outputs: list[str]
) -> tuple[list[str], list[str]]:
    """Return the order of names given by ``#pragma in2out``, which must name all."""
    place = signature[2]
    for what, given, found in (("inputs", signature[0], inputs), ("outputs", signature[1], outputs)):
        if sorted(given) != sorted(found):
            raise ScriptError(
                where, place, f"#pragma in2out names the {what} {' '.join(given) or 'none'}", " ".join(found) or "none"
            )
    return list(signature[0]), list(signature[1])


def _restricted(where: str, algebra: Algebra, value: Any, pragmas: Sequence[OutputBlades]) -> tuple[Any, Layout | None]:
    """Return a result, with its layout if ``#pragma output`` specifies its blades."""
    if not pragmas:
        return value, None
    names = [blade for pragma in pragmas for blade in pragma.blades]
    value = lift(value)
    try:
        layout = algebra.layout(f"({' '.join(names)})", " ".join(names))
        parts = {each: value[each] if value.algebra != SCALARS else value * int(each == "1") for each in names}
    except (AlgebraError, LayoutError) as error:
        raise ScriptError(where, pragmas[0].place, error.found, error.expected) from error
    if names == ["1"]:
        return parts["1"], SCALAR
    return assemble(algebra, parts), layout


def _numbers(colour: tuple[Any, ...] | None) -> tuple[Any, ...] | None:
    return colour and tuple(float(part) if isinstance(part, (int, Fraction)) else part for part in colour)


def _legal(written: str, taken: set[str]) -> str:
    """Return a valid Python name as close as possible to a name of the script."""
    name = written.replace("$", "_") or "_"
    name = name if not name.startswith("_") else "v" + name
    while keyword.iskeyword(name) or name in RESERVED or name in taken:
        name += "_"
    return name


def load_script(path: Path, algebra: str | None) -> Script:
    """Read a file with a script; its function is named after the file.

    Raises
    ------
    SpecError
        If the file does not exist or its name is not a valid function name.
    """
    if not path.is_file():
        raise SpecError(str(path), "no such file", "a script")
    if not path.stem.isidentifier() or keyword.iskeyword(path.stem):
        raise SpecError(str(path), f"{path.stem!r} cannot name a function", "letters, digits and _", "rename the file")
    return read_script(text_of(path), algebra, path.stem, str(path))
