"""Public names that cost nothing until they are used, so that ``oed --help`` answers at once."""

from __future__ import annotations

import ast
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any


def lazy_exports(package: str, file: str) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """Builds a package's ``__getattr__``, ``__dir__`` and ``__all__`` from the stub beside its ``__init__.py``.

    A type checker reads the same stub, and so finds a misspelt name.

    Args:
        package: the package's name.
        file: its ``__init__.py``; `__init__.pyi` has a line ``from module import name as name`` for each module.

    Returns:
        A function that imports the module of a name on its first use, one that lists the names, and the public names.
    """
    stub = ast.parse(Path(file).with_suffix(".pyi").read_text(encoding="utf-8"))
    imports = [node for node in stub.body if isinstance(node, ast.ImportFrom)]
    exports = {name.name: str(node.module) for node in imports for name in node.names}

    def load(name: str) -> Any:
        if name not in exports:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return getattr(import_module(exports[name]), name)

    return load, lambda: sorted(exports), sorted(name for name in exports if not name.startswith("_"))
