"""Every public name says what it takes, in which shape and unit, what it returns, and which of our errors it raises."""

from __future__ import annotations

import ast
import dataclasses
import importlib
import inspect
import re
import textwrap
from collections.abc import Callable, Iterator
from functools import cached_property
from typing import Any

import pytest

from robots.common import errors
from robots.common.arrays import Array
from robots.common.errors import InputError

PACKAGES = ("robots", "estimation", "oed")
PARTS = (
    *("oed.benchmarks", "oed.campaigns", "oed.campaigns.loops", "oed.controllers", "oed.experiments"),
    *("oed.experiments.drives", "oed.experiments.pose_designs", "oed.exports", "oed.overviews"),
    *("estimation.actuators", "estimation.calibrations", "estimation.comparisons", "estimation.diagnosis"),
    "estimation.payloads",
)
"""Packages below, whose public names are documented to the same degree."""
# Functions that rest on a published method.
METHODS = (
    "robots.default_model", "robots.find_base_parameters", "estimation.bootstrap", "estimation.compare",
    "estimation.diagnose", "estimation.identify_thermal", "estimation.identify",
    "estimation.identify_drive_gains", "estimation.identify_payload", "oed.campaign", "oed.design", "oed.discriminate",
    "oed.retime",
)  # fmt: skip
OURS = {name for name, value in vars(errors).items() if isinstance(value, type) and issubclass(value, Exception)}
ARRAY = re.compile(r"\b(Float|Bool|Int)?Array(Like)?\b|NDArray")
SHAPE = re.compile(r"\(([^()]*,[^()]*|N|n|p|b|m|M|K|P|k|R)\)")
UNIT = re.compile(r"\[[^\]]+\]|\bunits?\b")
# Names that stand for physical quantities wherever they occur.
QUANTITIES = {
    "q", "dq", "ddq", "tau", "t", "current", "temperature", "ambient", "gravity", "period", "duration", "speed",
    "velocity", "acceleration", "jerk", "time_limit", "sample_period", "cutoff", "base_frequency", "cycle_time",
}  # fmt: skip
# What a function does that hands something back; other first words need a section "Returns".
GIVING = {
    "Adds", "Builds", "Compares", "Computes", "Converts", "Copies", "Creates", "Cuts", "Describes", "Draws",
    "Evaluates", "Explains", "Finds", "Follows", "Gives", "Half", "Joins", "Lists", "Loads", "Makes", "Names",
    "Plots", "Predicts", "Reads", "Regroups", "Returns", "Rounds", "Says", "Shares", "Sizes", "Tabulates", "Times",
    "Whether", "Writes", "Yields",
}  # fmt: skip


def public() -> Iterator[tuple[str, Any]]:
    """All public names, each once, and what they stand for."""
    for package in (*PACKAGES, *PARTS):
        module = importlib.import_module(package)
        for name in module.__all__:
            if callable(value := getattr(module, name)):
                yield f"{package}.{name}", value


def members(cls: type) -> Iterator[tuple[str, str, Callable[..., Any]]]:
    """Public methods and properties of a class and of its bases among our packages: name, kind and function."""
    found = set()
    for owner in cls.__mro__:
        if owner.__module__.split(".")[0] not in PACKAGES:
            continue
        for name, value in vars(owner).items():
            if name.startswith("_") or name in found:
                continue
            found.add(name)
            if isinstance(value, property | cached_property):
                function = value.fget if isinstance(value, property) else value.func
                yield name, "property", function
            elif inspect.isfunction(value) or isinstance(value, staticmethod | classmethod):
                yield name, "method", inspect.unwrap(getattr(value, "__func__", value))


def overridden(cls: type, name: str) -> bool:
    """Whether a base class of ours documents the same member: there its arguments are described."""
    return sum(name in vars(owner) for owner in cls.__mro__ if owner.__module__.split(".")[0] in PACKAGES) > 1


def entries(doc: str, section: str) -> dict[str, str]:
    """The entries of a section such as ``Args``: name and text."""
    block = re.search(rf"^{section}:\n((?:    .*\n?|\n)*)", doc, re.MULTILINE)
    pairs = re.findall(r"^    \*{0,2}([\w, ]+): (.*(?:\n      .*)*)", block.group(1) if block else "", re.MULTILINE)
    return {name.strip(): text for names, text in pairs for name in names.split(",")}


def first_paragraph(doc: str) -> str:
    """The text up to the first blank line."""
    return doc.split("\n\n")[0]


def described(name: str, annotation: str, text: str) -> Iterator[str]:
    """What the text on one value leaves out."""
    if text.startswith("factor "):
        return
    if ARRAY.search(annotation) and not SHAPE.search(text):
        yield f"{name}: an array without its shape"
    if name in QUANTITIES and not UNIT.search(text) and re.search(r"Array|float", annotation):
        yield f"{name}: a quantity without its unit"


def arguments(doc: str, function: Callable[..., Any]) -> Iterator[str]:
    """What a docstring leaves out of the arguments."""
    named = [p for p in inspect.signature(function).parameters.values() if p.name not in {"self", "cls"}]
    documented = entries(doc, "Args")
    for parameter in named:
        text = documented.get(parameter.name)
        if text is None and len(named) == 1 and re.search(rf"\b{parameter.name}", first_paragraph(doc)):
            text = first_paragraph(doc)
        if text is None:
            yield f"{parameter.name}: an argument that is not described"
        else:
            yield from described(parameter.name, str(parameter.annotation), text)


def result(doc: str, function: Callable[..., Any]) -> Iterator[str]:
    """What a docstring leaves out of that which a function returns."""
    annotation = str(inspect.signature(function).return_annotation)
    if annotation == "None":
        return
    section = re.search(r"^(Returns|Yields):\n((?:    .*\n?|\n)*)", doc, re.MULTILINE)
    if not section and doc.split()[0] not in GIVING:
        yield "what it returns is not described"
    text = first_paragraph(doc) + (section.group(2) if section else "")
    if re.fullmatch(r"(Float|Bool|Int)?Array", annotation) and not SHAPE.search(text):
        yield "it returns an array without a shape"


def raised(function: Callable[..., Any]) -> set[str]:
    """Which of our errors the body of a function raises itself."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
    calls = [node.exc for node in ast.walk(tree) if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call)]
    return {call.func.id for call in calls if isinstance(call.func, ast.Name) and call.func.id in OURS}


def of_function(doc: str, function: Callable[..., Any]) -> list[str]:
    """What the docstring of a function or method leaves out."""
    if not doc:
        return ["no docstring"]
    missing = [f"{error} is raised and not described" for error in raised(function) - entries(doc, "Raises").keys()]
    return [*arguments(doc, function), *result(doc, function), *missing]


def of_property(doc: str, function: Callable[..., Any]) -> list[str]:
    """What the docstring of a property leaves out: its sentence is a noun with shape and unit."""
    if not doc:
        return ["no docstring"]
    return list(described(function.__name__, str(inspect.signature(function).return_annotation), doc))


def of_class(doc: str, cls: type) -> list[str]:
    """What the docstring of a class leaves out of its fields, and of the errors that it raises when it is made."""
    if not doc or (dataclasses.is_dataclass(cls) and doc.startswith(f"{cls.__name__}(")):
        return ["no docstring"]
    missing = []
    if dataclasses.is_dataclass(cls):
        documented = {}
        for owner in cls.__mro__:
            text = inspect.cleandoc(owner.__doc__ or "")
            documented |= entries(text, "Args") | entries(text, "Attributes")
        for field in dataclasses.fields(cls):
            if field.name.startswith("_") or not field.init:
                continue
            if field.name in documented:
                missing += described(field.name, str(field.type), documented[field.name])
            else:
                missing.append(f"{field.name}: a field that is not described")
    elif not issubclass(cls, Exception) and "__init__" in vars(cls):
        missing += arguments(doc, cls.__init__)
    for name in {"__post_init__", "__init__"} & vars(cls).keys():
        function = vars(cls)[name]
        if function.__code__.co_filename == inspect.getsourcefile(cls):
            missing += [f"{error} is not described" for error in raised(function) - entries(doc, "Raises").keys()]
    return missing


def left_out(value: Any) -> dict[str, list[str]]:
    """What a public name and its members leave out, by member; the empty name is the object itself."""
    doc = inspect.cleandoc(value.__doc__ or "")
    if not inspect.isclass(value):
        return {"": of_function(doc, inspect.unwrap(value))}
    found = {"": of_class(doc, value)}
    for name, kind, function in members(value):
        text = inspect.cleandoc(function.__doc__ or "")
        if kind == "property":
            found[name] = of_property(text, function)
        elif overridden(value, name):
            found[name] = [] if text else ["no docstring"]
        else:
            found[name] = of_function(text, function)
    return found


@pytest.mark.parametrize("name", [name for name, _ in public()])
def test_docstrings_are_complete(name):
    """A public name and its methods describe arguments, shapes, units, results and our own errors."""
    package, attribute = name.rsplit(".", 1)
    found = left_out(getattr(importlib.import_module(package), attribute))
    assert {member: missing for member, missing in found.items() if missing} == {}


@pytest.mark.parametrize("name", METHODS)
def test_methods_have_a_source(name):
    """A function that rests on a published method names the thesis, or author and year."""
    package, attribute = name.split(".")
    doc = inspect.getdoc(getattr(importlib.import_module(package), attribute))
    year = r"(19|20)\d\d\b"
    source = rf"thesis (chapter|section|eq|table)|[A-Z]\w+ \(?{year}|et al\. {year}|^Source: .*\({year}"
    assert re.search(source, doc, re.MULTILINE)


def incomplete(q: Array, weights: Array, speed: float) -> Array:  # noqa: D417
    """Weighs.

    Args:
        q: positions.
        speed: of the joint.
    """
    raise InputError(f"{q} {weights} {speed}")


def test_gaps_are_found():
    """The check itself sees each kind of gap."""
    assert of_function(inspect.cleandoc(incomplete.__doc__), incomplete) == [
        "q: an array without its shape",
        "q: a quantity without its unit",
        "weights: an argument that is not described",
        "speed: a quantity without its unit",
        "what it returns is not described",
        "it returns an array without a shape",
        "InputError is raised and not described",
    ]


if __name__ == "__main__":
    for each, thing in public():
        for member, missing in left_out(thing).items():
            if missing:
                print(f"{each}.{member}", missing)
