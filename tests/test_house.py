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

# Folders whose numeric constants do not have one meaning each yet.
NOT_YET_NAMED = (
    "estimation/actuators",
    "estimation/calibrations",
    "estimation/diagnosis",
    "estimation/gate",
    "estimation/logs",
    "estimation/recordings",
    "oed/cli",
    "oed/experiments/drives",
    "oed/experiments/pose_designs",
    "oed/experiments/searches",
    "oed/experiments/solvers",
    "oed/overviews",
    "oed/reports",
    "robots/drives",
    "robots/geometry_errors",
)

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


def numbers_of(path: Path) -> list[str]:
    """The names that a module gives to numbers, without underscores in front: once more each time."""
    found = []
    for statement in ast.parse(path.read_text(encoding="utf-8")).body:
        targets = statement.targets if isinstance(statement, ast.Assign) else []
        if isinstance(statement, ast.AnnAssign) and statement.value is not None:
            targets = [statement.target]
        for target in targets:
            whole = isinstance(target, ast.Tuple) and isinstance(statement.value, ast.Tuple)
            pairs = zip(target.elts, statement.value.elts, strict=True) if whole else [(target, statement.value)]
            found += [name.id.lstrip("_") for name, value in pairs if isinstance(name, ast.Name) and is_number(value)]
    return found


def is_number(value: ast.expr) -> bool:
    """Whether an expression is a number: a literal, or arithmetic, functions and constants of numpy with literals."""
    match value:
        case ast.Constant():
            return isinstance(value.value, int | float) and not isinstance(value.value, bool)
        case ast.UnaryOp():
            return is_number(value.operand)
        case ast.BinOp():
            return is_number(value.left) and is_number(value.right)
        case ast.Attribute():
            return ast.unparse(value) in {"np.pi", "np.inf", "math.pi", "math.inf"}
        case ast.Call():
            scalar = {"float", "int", "np.deg2rad", "np.sqrt", "np.exp", "math.radians", "math.sqrt", "math.exp"}
            return ast.unparse(value.func) in scalar and all(map(is_number, value.args))
    return False


def test_numeric_constants_have_one_meaning():
    """No two modules give a number the same name, nor does one twice: a reader need not look which one is meant."""
    homes: dict[str, list[str]] = {}
    for path in FILES:
        file = path.relative_to(ROOT).as_posix()
        if not file.startswith(NOT_YET_NAMED):
            for name in numbers_of(path):
                homes.setdefault(name, []).append(file)
    assert {name: files for name, files in homes.items() if len(files) > 1} == {}


@pytest.mark.slow
def test_modules_import_without_circles():
    """No module imports itself by way of others: not within functions, nor for type checkers."""
    modules = {name_of(path): path for path in FILES}
    graph = {name: imports_of(path, modules) for name, path in modules.items()}
    # Modules that import nothing of what is left are taken away; what stays is in a circle, or above one.
    while free := {name for name, others in graph.items() if not others & graph.keys()}:
        graph = {name: others for name, others in graph.items() if name not in free}
    assert sorted(graph) == []
