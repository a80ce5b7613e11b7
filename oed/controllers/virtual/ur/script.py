"""Programs in URScript: read, checked, and run one command at a time.

Blocks of URScript end with ``end``; otherwise what is needed of the language has the grammar of Python.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Generator, Mapping
from typing import Any

Run = Generator[None, None, Any]

_OPENS = re.compile(r"(def|while|if|thread|sec)\b.*:$")
_CONTINUES = re.compile(r"(elif\b.*|else):$")
_ALLOWED = (
    *(ast.Module, ast.FunctionDef, ast.arguments, ast.While, ast.If, ast.Assign, ast.Expr, ast.Call, ast.keyword),
    *(ast.Name, ast.Constant, ast.List, ast.Subscript, ast.BinOp, ast.UnaryOp, ast.BoolOp, ast.Compare),
    *(ast.Load, ast.Store, ast.Add, ast.Sub, ast.Mult, ast.Div, ast.USub, ast.UAdd, ast.Not, ast.And, ast.Or),
    *(ast.Lt, ast.LtE, ast.Gt, ast.GtE, ast.Eq, ast.NotEq),
)


class ScriptError(Exception):
    """A program that the controller does not understand."""


class Halt(Exception):
    """The program has ended itself."""


def program_of(text: str) -> ast.Module:
    """Reads a program: one function that begins in the first column.

    Raises:
        ScriptError: naming the line.
    """
    lines, depth = [], 0
    for number, line in enumerate(text.splitlines(), start=1):
        code = line.split("#", 1)[0].rstrip() if '"' not in line else line.rstrip()
        words = code.strip()
        if not words:
            continue
        if (code == words) != (depth == 0 or (depth == 1 and words == "end")):
            raise ScriptError(f"line {number}: wrong indentation")
        if words == "end":
            depth -= 1
            continue
        if _CONTINUES.match(words):
            lines.append("  " * (depth - 1) + words)
            continue
        lines.append("  " * depth + ("halt()" if words == "halt" else words))
        depth += bool(_OPENS.match(words))
    if depth:
        raise ScriptError("a block without end")
    try:
        tree = ast.parse("\n".join(lines))
    except SyntaxError as error:
        raise ScriptError(f"{error.msg}: {error.text}") from error
    if len(tree.body) != 1 or not isinstance(tree.body[0], ast.FunctionDef):
        raise ScriptError("a program is one function")
    for node in ast.walk(tree):
        if not isinstance(node, _ALLOWED):
            raise ScriptError(f"{type(node).__name__} is not known")
    return tree


class _Waiting(ast.NodeTransformer):
    """Lets every command take its time: a call becomes one that may wait."""

    def __init__(self, known: Mapping[str, Callable[..., Run]]) -> None:
        self._known = known

    def visit_Call(self, node: ast.Call) -> ast.AST:
        self.generic_visit(node)
        if not isinstance(node.func, ast.Name) or node.func.id not in self._known:
            raise ScriptError(f"the command {ast.unparse(node.func)} is not known")
        return ast.copy_location(ast.YieldFrom(value=node), node)


def run_program(tree: ast.Module, commands: Mapping[str, Callable[..., Run]]) -> Run:
    """Runs a program.

    Args:
        tree: see `program_of`.
        commands: what it may call; each is a generator that yields once for each cycle that it takes.

    Raises:
        ScriptError: an unknown command.
    """
    changed = ast.fix_missing_locations(_Waiting(commands).visit(tree))
    place: dict[str, Any] = {"__builtins__": {}, **commands}
    exec(compile(changed, "<urscript>", "exec"), place)
    function = tree.body[0]
    assert isinstance(function, ast.FunctionDef)
    return _ended_by_halt(place[function.name]())


def _ended_by_halt(run: Run | None) -> Run:
    try:
        if run is not None:
            yield from run
    except Halt:
        return
