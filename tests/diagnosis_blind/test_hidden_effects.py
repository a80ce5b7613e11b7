"""A diagnosis finds what is hidden in logs of a plant that shares no code with it, and nothing where nothing is."""

from __future__ import annotations

import dataclasses
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest

from estimation import diagnose
from oed.benchmarks.truth.cases import Case, draw_case, write_log
from oed.benchmarks.truth.description import write_description
from oed.benchmarks.truth.effects import (
    actuator,
    compliant_base,
    friction,
    surroundings,
    transmission,
    unlisted_joint_effects,
    unlisted_robot_effects,
)
from oed.benchmarks.truth.effects.base import Effect
from oed.benchmarks.truth.oracle import ask_oracle
from oed.cli import main
from robots import load_robot
from robots.signals import Log
from tests.diagnosis_blind.judging import Truth, complaints


@dataclasses.dataclass(frozen=True, kw_only=True)
class Hide:
    """A case by what is hidden; sizes are two to three times what the logs can attribute."""

    seed: int
    effects: tuple[type[Effect], ...] = ()
    size: float = 0.03
    kind: str = "er3a"
    joint: int | None = None
    periodic: bool = True
    ratio: float = 0.7  # of the true effect's gain
    duration: float = 40.0  # [s]
    drives: bool = True  # in the robot's description, which a URDF alone has not
    memory: tuple[float, float] = (0.7, 0.95)  # of the noise, from a sample to the next

    @property
    def name(self) -> str:
        """For the test's name."""
        return "+".join(effect.__name__ for effect in self.effects) or "nothing"

    def draw(self) -> Case:
        """Draws its logs: one of the duration, and half of it of another motion where something is hidden."""
        return draw_case(
            self.seed,
            hide=self.effects,
            size=self.size,
            kind=self.kind,
            joint=self.joint,
            periodic=self.periodic,
            duration=self.duration,
            unseen=self.duration / 2 if self.effects else 0.0,
            noise_memory=self.memory,
        )


# Noise that wanders for half a second to a second is noise, too.
SLOW = (0.99, 0.995)
LABELLED = (
    # Much of what Stribeck friction does is beside reversals, where a log does not show the velocity well.
    Hide(seed=7001, effects=(friction.Stribeck,), joint=2, ratio=0.6),
    Hide(seed=7002, effects=(friction.FrictionStep,), joint=3, periodic=False),
    Hide(seed=7031),
)
NOTHING = Hide(seed=7032, periodic=False)
PAIR = Hide(seed=7011, effects=(friction.PositionDependent, surroundings.Payload), joint=1)
STRANGE = Hide(seed=7021, effects=(unlisted_joint_effects.CrossWave,), joint=2, size=0.05)
SWINGING = Hide(seed=7041, effects=(unlisted_robot_effects.Slosh,), size=0.01, duration=60.0)
MORE = (
    Hide(seed=7004, effects=(surroundings.Payload,), kind="heavy"),
    Hide(seed=7033, kind="ur10"),
    Hide(seed=7034, memory=SLOW, duration=60.0),
    # 0.43 ms: all of it is in the rows beside reversals, whose direction encoders of the motors show.
    Hide(seed=7054, effects=(actuator.Delay,), size=0.01, kind="panda", ratio=0.6),
    # When the load changes sign only one knows who knows the rotor, reported roughly or not at all.
    # And a blow that a model has a sample too early takes as much as it brings.
    Hide(seed=7062, effects=(transmission.Backlash,), size=0.015, kind="panda", joint=1, ratio=0.05),
    Hide(seed=7060, effects=(transmission.Backlash,), size=0.015, kind="panda", joint=1, drives=False),
    Hide(seed=7003, effects=(transmission.Ripple,), joint=1, kind="ur10"),
    Hide(seed=7005, effects=(surroundings.Contact,), periodic=False),
    Hide(seed=7006, effects=(friction.PositionDependent,), joint=4),
    Hide(seed=7007, effects=(surroundings.Tilt,), kind="ur10"),
    Hide(seed=7073, effects=(compliant_base.LeaningBase,), size=0.02, kind="ur10"),
)
MORE_STRANGE = (
    Hide(seed=7071, effects=(unlisted_joint_effects.Drag,), joint=1, size=0.03),
    Hide(seed=7074, effects=(unlisted_joint_effects.DeadZone,), joint=2, size=0.02),
    Hide(seed=7075, effects=(unlisted_robot_effects.SlippedBase,), size=0.015, kind="ur10", periodic=False),
    Hide(seed=7072, effects=(unlisted_robot_effects.Hose,), size=0.03, kind="ur10"),
    Hide(seed=7076, effects=(unlisted_joint_effects.SlippedZero,), size=0.015, joint=3),
    Hide(seed=7077, effects=(unlisted_robot_effects.Conveyor,), size=0.015, kind="panda"),
)
"""Cases for a longer run."""


def logs_of(records: Sequence[Any]) -> list[Log]:
    """What a user has."""
    return [Log(t=record.t, q=record.q, tau=record.tau) for record in records]


def examined(hide: Hide) -> tuple[Truth, dict[str, Any]]:
    """The truth of a case and what the diagnosis says of its logs."""
    case = hide.draw()
    with TemporaryDirectory() as folder:
        robot = load_robot(write_description(case.machine, Path(folder), drives=hide.drives))
    said = diagnose(robot, logs_of(case.logs), held_out=logs_of(case.unseen) or None).to_dict()
    return truth_of(case), said


def truth_of(case: Case) -> Truth:
    """What the judge needs to know of a case."""
    if not case.unseen or not all(effect.lasting for effect in case.effects):
        return Truth(effects=case.effects)
    size = np.mean(np.concatenate([record.tau for record in case.unseen]) ** 2, axis=0)
    reported = ask_oracle(case)
    return Truth(
        effects=case.effects, before=float((reported.before / size).sum()), after=float((reported.after / size).sum())
    )


@pytest.mark.longer
def test_two_effects_are_both_found_by_the_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """``oed diagnose``, given files of t, q and tau, names both of two effects and nothing else."""
    case = PAIR.draw()
    described = write_description(case.machine, tmp_path)
    for record, name in ((case.logs[0], "log.csv"), (case.unseen[0], "unseen.csv")):
        write_log(record, tmp_path / name)
    line = ["oed", "diagnose", "--robot", described, "--log", tmp_path / "log.csv", "--quiet"]
    line += ["--held-out", tmp_path / "unseen.csv", "--out", tmp_path / "said"]
    monkeypatch.setattr(sys, "argv", [str(word) for word in line])
    with pytest.raises(SystemExit) as ended:
        main()
    assert not ended.value.code
    said = json.loads((tmp_path / "said" / "diagnosis.json").read_text())
    assert complaints(truth_of(case), said) == []
    strength = [finding["delta_bic"] for finding in said["findings"]]
    assert strength == sorted(strength, reverse=True)


@pytest.mark.longer
@pytest.mark.parametrize("hide", MORE, ids=lambda hide: f"{hide.name}-{hide.kind}-{hide.seed}")
def test_more_cases(hide: Hide) -> None:
    """Effects at two to three times the attributable size are named, on their joints, with their values and gain."""
    assert complaints(*examined(hide), ratio=hide.ratio) == []


@pytest.mark.slow
def test_nothing_is_found_where_nothing_is() -> None:
    """Logs without an effect get the verdict ``none``."""
    assert complaints(*examined(NOTHING)) == []


@pytest.mark.slow
@pytest.mark.parametrize(
    "hide",
    [STRANGE, *(pytest.param(hide, marks=pytest.mark.longer) for hide in MORE_STRANGE)],
    ids=lambda hide: hide.name,
)
def test_what_no_catalogue_has_is_not_named(hide: Hide) -> None:
    """An effect outside the catalogue is ``unexplained``, and its extension brings half of the possible gain."""
    truth, said = examined(hide)
    assert complaints(truth, said, ratio=0.5) == []


@pytest.mark.longer
def test_what_swings_at_the_flange_is_reported_with_its_frequency() -> None:
    """Liquid in a tank is ``unexplained`` on the whole robot, reported by its frequency, and mends unseen data."""
    truth, said = examined(SWINGING)
    (hidden,) = truth.effects
    assert isinstance(hidden, unlisted_robot_effects.Slosh)
    assert said["verdict"] == "unexplained"
    (finding,) = said["findings"]
    assert (finding["effect"], finding["joint"]) == ("unexplained", None)
    assert finding["pattern"] == "pattern:swinging:0:even"
    reported = {parameter["name"]: parameter["value"] for parameter in finding["parameters"]}
    assert reported["frequency"] == pytest.approx(hidden.frequency, rel=0.1)
    assert reported["mass_level"] > 0
    assert finding["gain"]["ci95"][0] > 0
    assert "swings at" in finding["sentence"]


@pytest.mark.longer
def test_swapped_labels_break_the_score() -> None:
    """A friction step, Stribeck friction and nothing are reported; with swapped labels each would be judged wrong."""
    cases = [(*examined(hide), hide.ratio) for hide in LABELLED]
    for i, (truth, said, ratio) in enumerate(cases):
        assert complaints(truth, said, ratio=ratio) == []
        for other, _, _ in cases[:i] + cases[i + 1 :]:
            assert complaints(other, said)
