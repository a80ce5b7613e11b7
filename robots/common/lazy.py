"""Public names that cost nothing until they are used, so that ``oed --help`` answers at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any


def lazy_exports(package: str, exports: Mapping[str, str]) -> Callable[[str], Any]:
    """Builds a package's ``__getattr__``.

    Args:
        package: the package's name.
        exports: public name -> the module that defines it.

    Returns:
        A function that imports the module of a name on its first use.
    """

    def load(name: str) -> Any:
        if name not in exports:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return getattr(import_module(exports[name]), name)

    return load


def listed(exports: Mapping[str, str]) -> Callable[[], list[str]]:
    """Builds a package's ``__dir__``: its public names, whether they were used or not."""
    return lambda: sorted(exports)
