"""Names of members: built-in ones, registered ones, and those that installed packages offer."""

from __future__ import annotations

import os
import subprocess
import sys
from abc import ABC, abstractmethod
from pathlib import Path

import pytest

from robots.common.errors import InputError
from robots.common.registry import ExtensionWarning, Registry, subclass_check

ROOT = Path(__file__).parents[3]


class Shape(ABC):
    name: str

    @abstractmethod
    def area(self) -> float: ...


class Square(Shape):
    name = "square"

    def area(self) -> float:
        return 1.0


class Circle(Shape):
    name = "circle"

    def area(self) -> float:
        return 3.0


class Nameless(Shape):
    def area(self) -> float:
        return 0.0


class Unfinished(Shape):
    name = "unfinished"


SOURCE = """
from tests.robots.common.test_registry import Shape

class Triangle(Shape):
    name = "triangle"

    def area(self):
        return 0.5

class Second(Triangle):
    name = "square"

class Wrong(Triangle):
    name = "other"
"""


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """Puts a distribution on the path that offers good and bad members."""
    info = tmp_path / "offer-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: offer\nVersion: 1.0\n", encoding="utf-8")
    lines = [
        "[test.shapes]",
        "triangle = offer_shapes:Triangle",
        "absent = offer_absent:Nothing",
        "typo = offer_shapes:Trianlge",
        "square = offer_shapes:Second",
        "misnamed = offer_shapes:Wrong",
        "number = math:pi",
    ]
    (info / "entry_points.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (tmp_path / "offer_shapes.py").write_text(SOURCE, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    yield tmp_path
    sys.modules.pop("offer_shapes", None)


def registry() -> Registry[type[Shape]]:
    return Registry("shape", "test.shapes", [Square], check=subclass_check(Shape))


def test_register():
    """A registered member is found by its name, in order; the same once more is no conflict."""
    shapes = registry()
    assert shapes.register(Circle) is Circle
    shapes.register(Circle)
    assert list(shapes) == ["square", "circle"]
    assert len(shapes) == 2
    assert shapes["circle"] is shapes.get_or_raise("circle") is Circle
    shapes.unregister("circle")
    assert "circle" not in shapes


@pytest.mark.parametrize(
    ("member", "message"),
    [
        (type("Square", (Circle,), {"name": "square", "__module__": "elsewhere"}), "shape 'square' exists already"),
        (Nameless, "Nameless has no name"),
        (Unfinished, "Unfinished lacks area"),
        (int, "int is no Shape"),
        (Circle(), "is no Shape"),
    ],
)
def test_what_cannot_be_registered(member, message):
    """A name that exists, no name, missing methods and another kind are one error each; the rest stays."""
    shapes = registry()
    with pytest.raises(InputError, match=message):
        shapes.register(member)
    assert list(shapes) == ["square"]


def test_an_unknown_name_lists_the_members():
    """The message gives all names that there are."""
    with pytest.raises(InputError, match="unknown shape 'line'; allowed: square"):
        registry().get_or_raise("line")


def test_offered_members_are_found_by_name(installed):
    """An entry point is imported when its name is asked for, and not before."""
    shapes = registry()
    assert shapes["square"] is Square
    assert "offer_shapes" not in sys.modules
    assert shapes.get_or_raise("triangle")().area() == 0.5


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("absent", "ModuleNotFoundError: No module named 'offer_absent'"),
        ("typo", "AttributeError.*Trianlge"),
        ("misnamed", "its name is 'other'; allowed: 'misnamed'"),
        ("number", "is no Shape"),
    ],
)
def test_a_failing_entry_point_is_named(installed, name, reason):
    """One that cannot be used is an error with package, object and reason when it is asked for."""
    shapes = registry()
    with pytest.raises(InputError, match=f"the shape '{name}' of offer .*cannot be used: .*{reason}"):
        shapes.get_or_raise(name)
    assert shapes.get_or_raise("triangle").name == "triangle"


def test_the_rest_works_beside_failing_entry_points(installed):
    """Listing warns once of each that fails, and gives all others."""
    shapes = registry()
    with pytest.warns(ExtensionWarning) as caught:
        names = list(shapes)
    assert names == ["square", "triangle"]
    messages = [str(warning.message) for warning in caught]
    assert len(messages) == 5
    assert any("'square' exists already" in text for text in messages)
    assert list(shapes) == names


PACKAGE = """
from examples.extending.check import SlowJoints
from examples.extending.criterion import TwoSmallest
from examples.extending.effect import TightHose
from examples.extending.estimator import LoadWeighted
from examples.extending.family import Bumps
from examples.extending.friction import SaturatingFriction
"""

POINTS = """
[robot_oed.checks]
slow_joints = plant_room:SlowJoints
[robot_oed.criteria]
two-smallest = plant_room:TwoSmallest
[robot_oed.effects]
tight_hose = plant_room:TightHose
broken_effect = plant_room:NoSuchThing
[robot_oed.estimators]
load-weighted = plant_room:LoadWeighted
[robot_oed.trajectories]
bumps = plant_room:Bumps
[robot_oed.terms]
saturating_friction = plant_room:SaturatingFriction
"""

CHECK = """
from estimation.estimators import estimator
from estimation.gate import CHECKS
from estimation.models.extension import find_effect
from oed.criteria import criterion
from oed.trajectories import family
from robots.common.errors import InputError
from robots.regressor import friction_term
from robots.terms import build_term, describe_term

print(criterion("two-smallest").name, criterion("0.5*cond+0.5*two-smallest").name)
print(find_effect("tight_hose").title)
print(estimator("load-weighted").name, family("bumps", harmonics=4).size)
term = friction_term("saturating_friction")
assert build_term(describe_term(term)) == term
print(term.name)
for name in ("broken_effect", "nothing"):
    try:
        find_effect(name)
    except InputError as error:
        print(error)
print(CHECKS.get_or_raise("slow_joints").stage.name)
"""


@pytest.mark.slow
def test_an_installed_package_offers_every_kind(tmp_path):
    """All groups are read: members of a package are found by name, without an import by the user."""
    info = tmp_path / "plant_room-2.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: plant-room\nVersion: 2.0\n", encoding="utf-8")
    (info / "entry_points.txt").write_text(POINTS, encoding="utf-8")
    (tmp_path / "plant_room.py").write_text(PACKAGE, encoding="utf-8")
    path = os.pathsep.join([str(tmp_path), str(ROOT)])
    ran = subprocess.run(
        [sys.executable, "-c", CHECK],
        env={**os.environ, "PYTHONPATH": path},
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr
    lines = ran.stdout.splitlines()
    assert lines[0] == "two-smallest 0.5*cond+0.5*two-smallest"
    assert lines[1:4] == ["tight hose", "load-weighted 7", "saturating_friction"]
    refused = "the effect 'broken_effect' of plant-room (plant_room:NoSuchThing) cannot be used: AttributeError"
    assert refused in lines[4]
    assert lines[5].startswith("unknown effect 'nothing'")
    assert "tight_hose" in lines[5]
    assert lines[6] == "SMOOTHED"
    # It was reported as an error already: listing all names does not repeat it.
    assert "ExtensionWarning" not in ran.stderr
