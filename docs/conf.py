"""Settings of the documentation; build it with ``sphinx-build -W docs docs/_build``."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.errors import SphinxError

sys.path.insert(0, str(Path(__file__).parents[1]))

from oed.cli.app import VERBS
from oed.cli.declarations.reference import with_option_tables
from robots.version import VERSION

project = "robot-oed"
author = "The robot-oed developers"
version = release = VERSION
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.viewcode"]
exclude_patterns = ["_build"]
# Napoleon takes shapes such as "(n,)" in the docstrings of properties for types, and finds several n.
suppress_warnings = ["ref.python"]
myst_enable_extensions = ["dollarmath", "colon_fence", "deflist"]
myst_heading_anchors = 3
html_math_renderer = "mathml"
html_theme = "furo"
html_title = f"robot-oed {VERSION}"
autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
napoleon_numpy_docstring = False
napoleon_use_ivar = True

# Addresses that a browser loads by itself, unlike the target of a link.
LOADED = re.compile(r"(?:<(?!a\b)\w+\b[^>]*\b(?:src|href)=|url\()[\"']?(?:https?:)?//[^\"')>]*")


def _inline(translator: Any, node: nodes.math) -> None:
    translator.body.append(convert(node.astext()))
    raise nodes.SkipNode


def _displayed(translator: Any, node: nodes.math_block) -> None:
    translator.body.append(convert(node.astext(), display="block"))
    raise nodes.SkipNode


def _require_offline(app: Any, exception: Exception | None) -> None:
    """Fails if a page or a style sheet loads anything from another address: pages are read without a network."""
    built = [] if exception or app.builder.format != "html" else Path(app.outdir).rglob("*.*")
    for path in built:
        if path.suffix in {".html", ".css"} and (outside := LOADED.search(path.read_text(encoding="utf-8"))):
            raise SphinxError(f"{path} loads something from outside: {outside[0]}")


def setup(app: Any) -> None:
    """Writes formulas as MathML, which browsers draw by themselves, and tables of options."""
    app.add_html_math_renderer("mathml", (_inline, None), (_displayed, None))
    app.connect("build-finished", _require_offline)
    # The options of each command, as its class declares them.
    app.connect("source-read", lambda _, __, source: source.__setitem__(0, with_option_tables(source[0], VERBS)))
