"""A campaign: its stages, its timetable, and what to expect of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from oed.campaigns.checking import TorqueCheck, checked
from oed.campaigns.heat import Temperatures, expected_temperatures, stage_heat
from oed.campaigns.programme import Programme
from oed.campaigns.stages import Stage
from oed.campaigns.timetable import Slot
from oed.experiments.results.planned import OF_ROBOT, Planned
from oed.experiments.safety_checks.freedom import collides, freedom_text
from oed.experiments.safety_checks.margins import assumption_findings
from oed.exports import read_trajectory, write_trajectory
from robots.collision import Surroundings
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.common.files import sha256
from robots.common.records import Finding, axes_for, damage_refused, findings_of, plain, read_json, write_json
from robots.loading import load_robot
from robots.robot import Robot
from robots.thermal import KnownThermal, SecondOrder
from robots.version import VERSION

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes


CAMPAIGN = "campaign.json"


@dataclass(frozen=True, kw_only=True, eq=False)
class Campaign(Planned, format="robot-oed campaign", tool=True):
    """A whole experiment, from the cold robot to the warm one and back.

    Attributes:
        robot: what it is for.
        programme: what was asked for.
        home: pose (n,) at which every stage begins and ends [rad or m].
        stages: the distinct stages.
        slots: what runs when.
        thermal: models of the joints; None where none are known.
        ambient: ambient temperature [degC].
        cold_friction: friction of the cold robot over that of the description, for the expected temperatures.
        torque_margin: share of the torque limits that friction and warm-up stages leave free.
        notes: what a user should know: what was shortened, what could not be checked.
        settings: options of the planning that show nowhere else, as plain data.
    """

    FILE = CAMPAIGN
    ENTRIES = (
        *OF_ROBOT,
        "assumed",
        "period=robot.period",
        "duration",
        "cycles",
        "samples",
        "home",
        "programme",
        "torque_margin",
        "settings",
        "stages=stated_stages",
        "timetable=slots",
        "heat.by=heat_source",
        "heat.unit=heat_unit",
        "heat.total=total_heat",
        "heat.per_cycle=cycle_heat",
        "temperatures=_temperature_data",
        "notes",
    )

    robot: Robot
    programme: Programme
    home: Array
    stages: tuple[Stage, ...]
    slots: tuple[Slot, ...]
    thermal: KnownThermal | None
    ambient: float
    cold_friction: float
    torque_margin: float
    notes: tuple[str, ...] = ()
    settings: Mapping[str, Any] = field(default_factory=dict)

    @property
    def surroundings(self) -> Surroundings:
        """The floor, and boxes that the arm must not enter."""
        return Surroundings.from_settings(self.settings)

    @property
    def stages_by_name(self) -> dict[str, Stage]:
        """The stages by their names."""
        return {stage.name: stage for stage in self.stages}

    @property
    def duration(self) -> float:
        """Of the whole campaign [s]."""
        return self.slots[-1].end

    @property
    def cycles(self) -> int:
        """How many cycles there are, of all phases."""
        return self.slots[-1].cycle

    @property
    def samples(self) -> int:
        """How many samples are played."""
        return sum(len(self.stages_by_name[slot.stage].motion) for slot in self.slots if slot.stage is not None)

    @property
    def success(self) -> bool:
        """Whether all stages keep all limits."""
        return not any(stage.violated for stage in self.stages)

    @cached_property
    def heat(self) -> dict[str, Array]:
        """Heat of each stage by the described friction, (n,) [J]."""
        return {stage.name: stage_heat(self.robot, stage) for stage in self.stages}

    @cached_property
    def cycle_heat(self) -> Array:
        """Heat of each cycle by the described friction, (cycles, n) [J]."""
        total = np.zeros((self.cycles, self.robot.n))
        for slot in self.slots:
            if slot.stage is not None:
                total[slot.cycle - 1] += self.heat[slot.stage]
        return total

    heat_source, heat_unit = "friction of the robot's description", "J"

    @property
    def total_heat(self) -> Array:
        """Heat of the whole campaign by the described friction, (n,) [J]."""
        return np.asarray(self.cycle_heat.sum(axis=0))

    def stated_stages(self, digests: Mapping[str, str] | None = None) -> list[dict[str, Any]]:
        """The stages with their heat.

        Args:
            digests: SHA-256 of each stage's file, by the stage's name, where the files are written.

        Returns:
            An entry for each stage, as `campaign.json` has it.
        """
        return [
            stage.to_dict(limits=self.robot.limits)
            | {"sha256": None if digests is None else digests[stage.name], "heat": self.heat[stage.name]}
            for stage in self.stages
        ]

    @cached_property
    def temperatures(self) -> Temperatures | None:
        """Temperatures to expect; None where no thermal model is known."""
        if self.thermal is None:
            return None
        return expected_temperatures(
            self.robot, self.stages_by_name, self.slots, self.thermal, cold_friction=self.cold_friction
        )

    def check(self) -> tuple[Stage, ...]:
        """Checks all stages again, from their samples.

        Returns:
            The stages with their margins.

        Raises:
            InfeasibleError: a stage exceeds a limit or does not start and end at rest in the home pose.
        """
        torque = TorqueCheck(self.robot, self.torque_margin)
        return tuple(checked(stage, self.robot, self.home, torque) for stage in self.stages)

    @property
    def conclusion(self) -> str:
        """Whether to play the campaign, and how."""
        codes = {finding.code for finding in self.remarks}
        if "limit.exceeded" in codes:
            return "Do not play this campaign: at least one stage exceeds a limit."
        if "collision.found" in codes:
            return "Do not play this campaign before its collisions are checked."
        return (
            f"Play {len(self.stages)} files in {self.cycles} cycles by the timetable below, "
            f"{self.duration / 60:.1f} min in all."
        )

    @property
    def remarks(self) -> tuple[Finding, ...]:
        """Limits that are exceeded, collisions, notes, and what was assumed."""
        found = [
            Finding(
                code="limit.exceeded",
                subject=f"{stage.name}, joint {margin.joint}:",
                text=f"the limit of {margin.quantity} is exceeded at {margin.time:.3f} s.",
                action="Do not play it.",
            )
            for stage in self.stages
            for margin in stage.margins
            if margin.violated
        ]
        colliding = []
        for stage in self.stages:
            if collides(stage.freedom):
                text = freedom_text(stage.freedom)
                action = (
                    "Design it again with oed design, which avoids collisions."
                    if stage.kind == "excitation"
                    else "Check it first."
                )
                found.append(Finding(code="collision.found", subject=f"{stage.name}:", text=text, action=action))
                colliding.append(stage.name)
        if self.success:
            text = "Every stage respects all limits, and starts and ends at rest in the home pose."
            found += findings_of("done", [text])
        # The notes say the same of collisions.
        own = tuple(f"COLLISION in the {name} stage" for name in colliding)
        notes = [note for note in self.notes if not (own and note.startswith(own))]
        return (*found, *findings_of("experiment.note", notes), *assumption_findings(self.robot))

    def summary(self) -> str:
        """Lists the stages, the expected heating, and notes."""
        lines = [f"{self.robot.name}: {self.duration / 60:.1f} min, {self.cycles} cycles, {self.samples} samples"]
        for stage in self.stages:
            left, tightest = "", stage.tightest
            if tightest is not None:
                share = 100 * tightest.slack_fraction
                left = f", tightest limit: {tightest.quantity} of joint {tightest.joint}, {share:.2f} % left"
            lines.append(f"  {stage.file:18} {stage.duration:8.3f} s{left}")
        if self.programme.cycles:
            heating = next(slot.cycle for slot in self.slots if slot.phase == "heating")
            joules = ", ".join(f"{value / 1e3:.1f}" for value in self.cycle_heat[heating - 1])
            lines.append(f"  friction heat of the first heating cycle, kJ per joint: {joules}")
        if self.temperatures is not None:
            peaks = ", ".join(f"{value:.0f}" for value in self.temperatures.T1.max(axis=0))
            lines.append(f"  highest expected temperature, degC per joint: {peaks}")
        lines += [f"  note: {note}" for note in self.notes]
        return "\n".join(lines)

    def to_frame(self) -> pd.DataFrame:
        """Gives the timetable: start, end, stage, cycle, run, phase, duty, file."""
        import pandas as pd

        return pd.DataFrame(plain(self.slots))

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draws on `ax` the expected temperatures where heat is produced; without a thermal model, the heat so far."""
        axes = axes_for(ax, (9, 4))
        if (temperatures := self.temperatures) is not None:
            t, values, label = temperatures.t, temperatures.T1, "expected temperature [degC]"
        else:
            t = np.array([0.0, *(slot.end for slot in self._last_slots())])
            values = np.vstack([np.zeros(self.robot.n), self.cycle_heat.cumsum(axis=0) / 1e3])
            label = "friction heat [kJ]"
        for joint in range(self.robot.n):
            axes.plot(t / 60.0, values[:, joint], label=f"joint {joint + 1}")
        axes.set_xlabel("time [min]")
        axes.set_ylabel(label)
        axes.legend(ncols=3)
        return axes

    def choices(self) -> dict[str, Any]:
        """Gives what the campaign was planned with, by the names of the choices."""
        return {
            **self.programme.to_dict(),
            "ambient": self.ambient,
            "cold_friction": self.cold_friction,
            "torque_margin": self.torque_margin,
            **self.settings,
        }

    def save(self, folder: str | PathLike[str], *, force: bool = False) -> None:
        """Writes a CSV per stage and `campaign.json`.

        Args:
            folder: an existing one.
            force: replace files that are there.

        Raises:
            InputError: a file is there, and force is not given.
        """
        folder = Path(folder)
        digests, name = {}, self.robot.origin or self.robot.name
        for stage in self.stages:
            metadata = {
                "robot": name,
                "stage": stage.name,
                "tool": f"robot-oed {VERSION}",
                "collisions": freedom_text(stage.freedom),
            }
            write_trajectory(folder / stage.file, stage.motion, metadata, kinds=self.robot.chain.kinds, force=force)
            digests[stage.name] = sha256(folder / stage.file)
        write_json(folder / self.FILE, self.stated(digests=digests), force=force)

    @classmethod
    def load(cls, folder: str | PathLike[str], robot: Robot | None = None) -> Campaign:
        """Reads a saved campaign, and makes sure that its files are what they were.

        Args:
            folder: where `save` wrote.
            robot: the robot; by default the one that the campaign names.

        Raises:
            InputError: a missing, damaged or changed file, or another robot.
        """
        file, remedy = Path(folder) / CAMPAIGN, "run oed campaign again"
        data = read_json(file, cls.FORMAT, cls.FORMAT_VERSION, remedy=remedy)
        with damage_refused(file, remedy=remedy):
            known = robot or load_robot(data["robot"]["origin"], unlimited=True)
            if known.name != data["robot"]["name"]:
                raise InputError(f"the campaign is for {data['robot']['name']}, not for {known.name}", file=file)
            stages = []
            for entry in data["stages"]:
                path = Path(folder) / entry["file"]
                if sha256(path) != entry["sha256"]:
                    raise InputError("changed since the campaign wrote it", file=path, remedy="run oed campaign again")
                stages.append(Stage.from_dict(entry, file=file, motion=read_trajectory(path, n=known.n)[0]))
            expected = data["temperatures"]
            thermal = None
            if expected["models"] is not None:
                models = tuple(SecondOrder(**model) for model in expected["models"])
                thermal = KnownThermal(models=models, sources=tuple(expected["sources"]))
            return cls.from_dict(
                data,
                file=file,
                remedy=remedy,
                robot=known,
                stages=tuple(stages),
                thermal=thermal,
                ambient=expected["ambient"],
                cold_friction=expected["cold_friction"],
            )

    def _last_slots(self) -> list[Slot]:
        return list({slot.cycle: slot for slot in self.slots}.values())

    def _temperature_data(self) -> dict[str, Any]:
        data: dict[str, Any] = {
            "unit": "degC",
            "ambient": self.ambient,
            "cold_friction": self.cold_friction,
            "models": None,
            "sources": None,
        }
        if self.thermal is None or self.temperatures is None:
            return data
        ends = [0.0, *(slot.end for slot in self.slots)]
        T1, T2 = self.temperatures.at(ends)
        return data | {
            "models": [asdict(model) for model in self.thermal.models],
            "sources": list(self.thermal.sources),
            "t": ends,
            "T1": T1.round(4).tolist(),
            "T2": T2.round(4).tolist(),
        }
