"""Write equations as MathML, which browsers draw without scripts or downloads."""

import re
from typing import Any

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx

UNDER = re.compile(r"<munderover>\s*(<mi>[^<]*</mi>)(.*?)(<mo[^>]*>[ˆˉ˙~]</mo>)\s*</munderover>", re.DOTALL)
"""Accented letter whose index docutils writes below it."""


def mathml(node: Any, display: bool) -> str:
    """Translate an equation; bars over symbols stretch, norm bars stay level, accented letters have indices."""
    text: str = tex2mathml(node.astext(), as_block=display)
    text = UNDER.sub(r'<msub><mover accent="true">\1\3</mover>\2</msub>', text)
    text = text.replace(">‖</mo>", ' stretchy="false">‖</mo>')
    return text.replace('<mo accent="true">_</mo>', '<mo stretchy="true">‾</mo>')


def inline(translator: Any, node: nodes.math) -> None:
    """Write an inline equation."""
    translator.body.append(mathml(node, display=False))
    raise nodes.SkipNode


def display(translator: Any, node: nodes.math_block) -> None:
    """Write a display equation in a box that scrolls on narrow screens."""
    translator.body.append(f'<div class="math">{mathml(node, display=True)}</div>')
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the MathML renderer."""
    app.add_html_math_renderer("mathml", inline_renderers=(inline, None), block_renderers=(display, None))
    app.config.html_math_renderer = "mathml"
    return {"parallel_read_safe": True, "parallel_write_safe": True}
