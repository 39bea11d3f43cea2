"""The text of the spec of one robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from decimal import Decimal
from textwrap import wrap
from typing import Any

from .chains import Chain, Number, exact
from .kernel_texts import kernel_text


def spec_text(name: str, chain: Chain, source: str, methods: Sequence[str], inverse: str = "") -> str:
    """Return the text of the spec of one robot, with its constants and kernels.

    Parameters
    ----------
    name : str
        The name of the robot, for documentation.
    chain : Chain
        Numbers within 5e-11 (of their unit; for tensors, of their largest entry) of a number with six decimals are
        replaced by that number, because many files give right angles with eleven digits, and their cosines should
        vanish. Tensors are written to fifteen digits of their largest entry.
    source : str
        The origin of the numbers, in a sentence or two.
    methods : sequence of str
        The kernels, as names of functions of `gacompiler.robots`.
    inverse : str, optional
        The text of the kernel `inverse`, as returned by `inverse_text`.
    """
    parts = [
        _literal("kinds", [f'"{kind}"' for kind in chain.kinds]),
        _literal("parents", list(map(repr, chain.parents))),
        _rows("axes", [tuple(map(_nice, row)) for row in chain.axes]),
        f"    tip={chain.tip},\n",
        _literal("tool", [repr(_nice(x)) for x in chain.tool]),
        _rows("inertias", [_nice_body(row) for row in chain.inertias]) if chain.inertias else "",
        _literal("gravity", [repr(float(x)) for x in chain.gravity]),
        _literal("armature", [repr(_nice(x)) for x in chain.armature]) if any(map(exact, chain.armature)) else "",
        _followed(chain) if chain.variables else "",
        _rows("home", [tuple(map(_nice, row)) for row in chain.home]) if "forward_all" in methods else "",
    ]
    own = "\n".join(
        (
            f'"""{name}: kinematics and dynamics with folded constants.',
            "",
            *wrap(source, 118),
            "",
            "Joint variables are in radians, or in metres for prismatic joints.",
            *(_FLOATING if chain.is_floating else ()),
            '"""',
            "",
            "from gacompiler import SCALAR, array, kernel, robots",
            "from gacompiler.algebra.catalog import PGA3",
            "",
            "ROBOT = robots.Chain(",
            f"{''.join(parts)})",
            "__doc__ = robots.signed(__doc__, ROBOT)",
            *((f"POSITIONS = array(SCALAR, {chain.n_positions})",) if chain.is_floating else ()),
            f"JOINTS = array(SCALAR, {chain.n_variables})",
            "",
        )
    )
    return own + "".join(kernel_text(method, chain.is_floating) for method in methods) + inverse


def inverse_text(function: str, tables: Mapping[str, Any], joints: Sequence[str]) -> str:
    """Return the definition of the kernel `inverse` of a robot.

    Parameters
    ----------
    function : str
        A function of `gacompiler.robots.inverse`.
    tables : mapping
        What it takes after the pose and, for an elbow circle, the elbow angle: numbers, or rows of them.
    joints : sequence of str
        Names of the joints.
    """
    elbow = function == "elbow_circle"
    arguments, types = ("pose, elbow", "pose=PGA3.MOTOR, elbow=SCALAR") if elbow else ("pose", "pose=PGA3.MOTOR")
    given = "".join(f"        {name}={_plain(value)!r},\n" for name, value in tables.items())
    compared = "the pose that it reaches and the given one"
    if function == "three_parallel_axes":
        compared = "the motion of the three joints with parallel axes and the one that the others leave them"
    returned = wrap(
        "Returns eight branches, the discriminant of each, and its error: the largest difference between coefficients "
        f"of {compared}, of the sign that fits. Branches with errors above rounding are no solutions.",
        116,
    )
    returns = "\n    ".join(returned)
    variables = "\n".join(wrap(f"Joint variables: {', '.join(joints)}.", 114, subsequent_indent="    "))
    return f'''

@kernel({types}, returns=(array(SCALAR, 8, {len(joints)}), array(SCALAR, 8), array(SCALAR, 8)))
def inverse({arguments}):
    """All configurations that reach a pose of the end effector, a unit motor of either sign.

    {returns}

    {variables}
    """
    return robots.{function}(
        ROBOT,
        {arguments},
{given}    )
'''


def _plain(value: Any) -> Any:
    """Return numbers and rows of numbers as constants of a spec."""
    if isinstance(value, bool):
        return value
    return tuple(map(_plain, value)) if hasattr(value, "__iter__") else _nice(float(value))


_FLOATING = (
    "The base floats: `q` begins with its motor, of any norm and sign. Rates and forces begin with six numbers",
    "in its frame, angular x, y, z over linear x, y, z.",
)


def _followed(chain: Chain) -> str:
    names = ("variables", "ratios", "offsets")
    rows = (chain.variables, *(tuple(map(_nice, row)) for row in (chain.ratios, chain.offsets)))
    return "".join(_literal(name, list(map(repr, row))) for name, row in zip(names, rows, strict=True))


def _literal(name: str, entries: Sequence[str], indent: int = 4) -> str:
    """Format a tuple on one line if it fits, else with one entry per line, like common code formatters."""
    head, space = (f"{name}=" if name else ""), " " * indent
    line = f"{space}{head}({', '.join(entries)}{',' if len(entries) == 1 else ''}),\n"
    if len(line) <= 121:
        return line
    return "".join([f"{space}{head}(\n", *(f"{space}    {entry},\n" for entry in entries), f"{space}),\n"])


def _rows(name: str, rows: Sequence[tuple[Number, ...]]) -> str:
    return "".join([f"    {name}=(\n", *(_literal("", list(map(repr, row)), 8) for row in rows), "    ),\n"])


def _nice(x: Number, decade: int = 0) -> float:
    """Round to six decimals in units of ``10**decade`` if this changes the number by at most 5e-11 units."""
    unit = float(f"1e{decade}")
    near = round(round(float(x) / unit, 6) * unit, 6 - decade)
    return (near if abs(float(x) - near) <= 5e-11 * unit else float(x)) + 0.0


def _nice_body(row: tuple[Number, ...]) -> tuple[float, ...]:
    # Use the printed decimal: logarithms are not always exact integers at powers of ten.
    largest = Decimal(repr(max(map(abs, map(float, row[4:])))))
    decade = largest.adjusted() if largest else 0
    # Keep fifteen digits: the others are rounding errors from transforming the tensor, which make equal moments differ.
    return (float(row[0]), *map(_nice, row[1:4]), *(_nice(round(float(x), 14 - decade), decade) for x in row[4:]))
