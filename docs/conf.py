"""Settings of the documentation; build it with ``sphinx-build -W docs docs/_build``."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from oed.cli.app import VERBS
from oed.cli.declarations.reference import with_option_tables
from robots.version import VERSION

project = "robot-oed"
author = "The robot-oed developers"
version = release = VERSION
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.mathjax", "sphinx.ext.viewcode"]
exclude_patterns = ["_build"]
# Napoleon takes shapes such as "(n,)" in the docstrings of properties for types, and finds several n.
suppress_warnings = ["ref.python"]
myst_enable_extensions = ["dollarmath", "colon_fence", "deflist"]
myst_heading_anchors = 3
html_theme = "furo"
html_title = f"robot-oed {VERSION}"
autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
napoleon_numpy_docstring = False
napoleon_use_ivar = True


def setup(app):
    """Puts the options of each command into the pages, as its class declares them."""
    app.connect("source-read", lambda _, __, source: source.__setitem__(0, with_option_tables(source[0], VERBS)))
