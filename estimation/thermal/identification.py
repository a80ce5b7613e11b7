"""A robot's parameters together with the effect of temperature on friction."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from estimation.gate import GateReport
from estimation.identifications.identification import identify
from estimation.thermal.campaign_fit import fit_campaign
from estimation.thermal.model_choice import choose_thermal
from estimation.thermal.options import ThermalOptions
from estimation.thermal.results.campaign_estimate import CampaignEstimate
from estimation.thermal.results.choice import ThermalChoice
from estimation.thermal.runs.extraction import thermal_runs
from robots.common.errors import InputError
from robots.common.files import write_atomic
from robots.common.progress import Progress
from robots.common.records import Record
from robots.robot import Robot
from robots.signals import Log
from robots.thermal import thermal_model_class


@dataclass(frozen=True, kw_only=True)
class ThermalIdentification(Record):
    """What logs say of a robot and of its heat.

    Attributes:
        estimate: parameters of robot and heat.
        joint: for which thermal models are compared, and figures drawn; counted from 1.
        choice: the comparison of thermal models; None where one was asked for.
        gates: what was found in the logs before.
        logs: as they were used.
    """

    ENTRIES = ("**estimate", "joint", "choice")

    estimate: CampaignEstimate
    joint: int
    choice: ThermalChoice | None
    gates: Sequence[GateReport]
    logs: tuple[Log, ...]

    def summary(self) -> str:
        """Writes what was found, for people."""
        found = [gate.summary() for gate in self.gates if gate.findings]
        table = [f"joint {self.joint}: {self.choice.summary()}"] if self.choice else []
        return "\n".join([*found, *table, self.estimate.summary()])

    def save(self, folder: str | PathLike[str]) -> None:
        """Writes model.json into a folder.

        Args:
            folder: that exists.
        """
        data = self.estimate.torque_model.to_dict()
        write_atomic(Path(folder) / "model.json", json.dumps(data, indent=2, allow_nan=False) + "\n")


def identify_thermal(
    robot: Robot, logs: Sequence[Log], *, options: ThermalOptions | None = None, progress: Progress | None = None
) -> ThermalIdentification:
    """Identifies rigid body, friction, and the change of friction with temperature.

    The source is thesis section 4: thermal models of first and second order, an advanced and a fractional one.

    Args:
        robot: the robot.
        logs: on one clock, with the pauses between them.
        options: which thermal model, and what is known of it.
        progress: hears how far it is.

    Returns:
        Parameters of robot and heat, and the comparison of thermal models where it was asked for.

    Raises:
        InputError: an unknown thermal model, or a joint that the robot does not have or that does not move.
    """
    how = options or ThermalOptions()
    wanted = "second" if how.order == "auto" else thermal_model_class(how.order).name
    if how.joint is not None and how.joint > robot.n:
        raise InputError(f"--joint {how.joint}", allowed=f"1 to {robot.n}")
    known = tuple(_surrounded(log, how.ambient) for log in logs)
    identified = identify(robot, known, friction=how.friction, seed=how.seed, progress=progress)
    settings: dict[str, Any] = {"alpha": how.alpha, "seed": how.seed, "progress": progress}
    result = fit_campaign(robot, known, order=wanted, model=identified.model, **settings)
    joint = how.joint or _hottest(result)
    if result.thermal[joint - 1] is None:
        raise InputError(f"--joint {joint}", allowed="a joint that moves in the logs")
    choice = None
    if how.order == "auto":
        choice = choose_thermal(thermal_runs(result.model, known, joint), **settings)
        if choice.best != wanted:
            result = fit_campaign(robot, known, order=choice.best, model=identified.model, **settings)
    return ThermalIdentification(estimate=result, joint=joint, choice=choice, gates=identified.gates, logs=known)


def _surrounded(log: Log, ambient: float | None) -> Log:
    """A log with this ambient temperature, if it states none."""
    return log if ambient is None or log.ambient is not None else replace(log, ambient=np.full(len(log), ambient))


def _hottest(estimate: CampaignEstimate) -> int:
    """Finds the joint whose friction takes the most power."""
    powers = [0.0 if fit is None else max(run.power for run in fit.runs) for fit in estimate.thermal]
    return powers.index(max(powers)) + 1
