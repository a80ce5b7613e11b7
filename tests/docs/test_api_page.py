"""The pages on Python list what the packages offer."""

from __future__ import annotations

import importlib
import re
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"


@pytest.mark.parametrize("package", ["oed", "estimation", "robots"])
def test_public_names_are_documented(package):
    """Every public name of a package is on its page, and nothing else but public names of its own packages."""
    page = (DOCS / f"api_{package}.md").read_text(encoding="utf-8")
    documented = re.findall(rf"^\.\. auto\w+:: ({package}(?:\.\w+)*)\.(\w+)$", page, flags=re.MULTILINE)
    public = importlib.import_module(package).__all__
    assert set(public) <= {name for _, name in documented}
    for module, name in documented:
        assert name in public or name in importlib.import_module(module).__all__
