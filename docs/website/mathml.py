"""A Sphinx extension that writes formulas as MathML, which browsers show without scripts from the network."""

from __future__ import annotations

import re
from html import escape
from typing import Any

from docutils.nodes import SkipNode
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.util.logging import getLogger

_LOGGER = getLogger(__name__)


def formula(tex: str, block: bool) -> str:
    """Convert a formula to MathML.

    Raises
    ------
    MathError
        If the formula has an unknown command.
    """
    known = re.sub(r"\\(begin|end)\{align\*?\}", r"\\\1{aligned}", re.sub(r"\\displaystyle\b", "", tex))
    return str(tex2mathml(known.strip(), as_block=block))


def _visit(block: bool) -> Any:
    def visit(translator: Any, node: Any) -> None:
        tex = node.astext()
        try:
            text = formula(tex, block)
        except MathError as error:
            _LOGGER.warning("cannot convert a formula: %s: %s", error, tex, location=node)
            text = f"<code>{escape(tex)}</code>"
        translator.body.append(f'<div class="math">{text}</div>' if block else text)
        raise SkipNode

    return visit


def setup(app: Any) -> dict[str, bool]:
    """Register the renderer."""
    app.add_html_math_renderer("mathml", (_visit(False), None), (_visit(True), None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
