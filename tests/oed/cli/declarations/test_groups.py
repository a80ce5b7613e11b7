"""Groups of options: an option of several groups, a group that may be missing, angles, and fields left out."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any

import pytest

from oed.cli.app import VERBS, Oed
from oed.cli.commands.first_steps.effects import Effects
from oed.cli.declarations.declared import declared_options
from oed.cli.program import Verbs
from oed.cli.verbs import Printed
from robots.common.options import Option
from robots.common.progress import Progress


@dataclass(frozen=True, kw_only=True)
class Lamp:
    """A lamp.

    Attributes:
        place: where it hangs.
        tilt: of its cone [deg].
        seed: of its flicker.
    """

    place: str
    tilt: Annotated[float, Option(degrees=True)] = math.pi / 4
    seed: int = 3


@dataclass(frozen=True, kw_only=True)
class Sound:
    """A sound.

    Attributes:
        loudness: how loud it is [dB].
        pitch: how high it is [Hz].
        seed: of its noise.
    """

    loudness: float = 1.0
    pitch: float = 440.0
    seed: int = 3


@dataclass(frozen=True, kw_only=True)
class Stage(Effects):
    """A command with two groups."""

    sound: Annotated[Sound, Option(without=("pitch",), only=("loud",))] = Sound()
    lamp: Annotated[Lamp | None, Option(only=("bright",))] = None

    @property
    def use(self) -> str:
        """Loud, or bright where there is a lamp."""
        return "loud" if self.lamp is None else "bright"

    def run(self, progress: Progress) -> Printed:
        """Shows what it got."""
        lamp = None if self.lamp is None else [self.lamp.place, self.lamp.tilt, self.lamp.seed]
        return Printed("", {"sound": [self.sound.loudness, self.sound.pitch, self.sound.seed], "lamp": lamp})


@dataclass(frozen=True, kw_only=True)
class Broken(Effects):
    """Two groups that do not agree on an option."""

    sound: Sound = Sound()
    other: Annotated[Sound, Option(defaults=(("loudness", 2.0),))] = Sound()


@pytest.fixture
def stage(run: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> Callable[..., Any]:
    """Runs the command."""
    found = Verbs({**VERBS._modules, "stage": __name__})
    monkeypatch.setitem(sys.modules, __name__, sys.modules[Stage.__module__])
    monkeypatch.setattr(Oed, "verbs", found)
    return lambda *words: run("stage", *words)


def test_an_option_of_two_groups_is_one(stage: Callable[..., Any]) -> None:
    """It is typed once, stands in both, and belongs to the uses of both."""
    options = declared_options(Stage)
    assert options["seed"].how.only == ("loud", "bright")
    assert options["seed"].help == "Of its noise."
    done = stage("--json", "--seed", "5", "--place", "wall")
    assert (done.data["sound"][2], done.data["lamp"][2]) == (5, 5)


def test_a_group_that_is_not_there(stage: Callable[..., Any]) -> None:
    """Without what it cannot be without it is None; its other options then need that one."""
    assert stage("--json").data["lamp"] is None
    assert stage("--json", "--place", "wall").data["lamp"] == ["wall", math.pi / 4, 3]
    refused = stage("--tilt", "30", "--seed", "1")
    assert refused.code == 2
    assert "--tilt does not apply" in refused.err


def test_angles_are_typed_in_degrees(stage: Callable[..., Any]) -> None:
    """And shown so in the help."""
    assert stage("--json", "--place", "wall", "--tilt", "30").data["lamp"][1] == pytest.approx(math.pi / 6)
    assert declared_options(Stage)["tilt"].default == 45.0


def test_a_field_that_is_left_out_is_no_option(stage: Callable[..., Any]) -> None:
    """It keeps its default."""
    assert "pitch" not in declared_options(Stage)
    assert stage("--json", "--loudness", "2").data["sound"] == [2.0, 440.0, 3]


def test_groups_must_agree() -> None:
    """One option with two defaults would be a riddle."""
    with pytest.raises(AssertionError, match="--loudness twice"):
        declared_options(Broken)
