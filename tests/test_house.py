"""The house keeps its order: sizes of files and folders, and imports without circles."""

from __future__ import annotations

import ast
from collections import Counter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("robots", "estimation", "oed")
MOST_LINES, MOST_FILES, MEDIAN_LINES = 450, 15, 150
# One file a member: these folders grow with the catalogue, and their machinery is elsewhere.
FAMILIES = {"robots/terms/effects"}

FILES = [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]


def name_of(path: Path) -> str:
    """The dotted name of a module."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imports_of(path: Path, modules: dict[str, Path]) -> set[str]:
    """All modules of ours that a file imports, within functions and for type checkers too."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module:
            for alias in node.names:
                inner = f"{node.module}.{alias.name}"
                found.add(inner if inner in modules else node.module)
        elif isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
    return {name for name in found if name in modules} - {name_of(path)}


def test_files_are_short():
    """No file of the packages has more than 450 lines, and half of them have at most 150."""
    lengths = {path: len(path.read_text(encoding="utf-8").splitlines()) for path in FILES}
    long = {str(path.relative_to(ROOT)): count for path, count in lengths.items() if count > MOST_LINES}
    assert long == {}
    assert sorted(lengths.values())[len(lengths) // 2] <= MEDIAN_LINES


def test_folders_are_small():
    """No folder has more than 15 files of its own, families of one file a member excepted."""
    counts = Counter(path.parent.relative_to(ROOT).as_posix() for path in FILES)
    assert {folder: count for folder, count in counts.items() if count > MOST_FILES and folder not in FAMILIES} == {}


def test_families_are_larger_than_folders_may_be():
    """An exception that is no longer needed is taken off the list."""
    counts = Counter(path.parent.relative_to(ROOT).as_posix() for path in FILES)
    assert all(counts[folder] > MOST_FILES for folder in FAMILIES)


@pytest.mark.slow
def test_modules_import_without_circles():
    """No module imports itself by way of others: not within functions, nor for type checkers."""
    modules = {name_of(path): path for path in FILES}
    graph = {name: imports_of(path, modules) for name, path in modules.items()}
    # Modules that import nothing of what is left are taken away; what stays is in a circle, or above one.
    while free := {name for name, others in graph.items() if not others & graph.keys()}:
        graph = {name: others for name, others in graph.items() if name not in free}
    assert sorted(graph) == []
