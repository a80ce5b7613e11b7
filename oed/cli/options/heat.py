"""Thermal inputs of commands that predict torques."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from oed.cli.declarations.declared import INPUT

if TYPE_CHECKING:
    from estimation.logs.mappings.mapping import LogMapping
    from estimation.models.model import Model
    from robots.signals import Log


@dataclass(frozen=True, kw_only=True)
class Heat:
    """Thermal inputs of a prediction, and a sentence on the assumed initial state."""

    options: dict[str, Any] = field(default_factory=dict)
    assumed: str = ""


@dataclass(frozen=True, kw_only=True)
class Warmth:
    """What the robot did before, and how warm its surroundings are.

    Attributes:
        before: thermal model: a log, or a folder of logs, of the robot's motion before this log. Repeatable.
        ambient: thermal model: ambient temperature of logs that do not state it [degC].
    """

    section = INPUT

    before: tuple[Path, ...] = ()
    ambient: float | None = None

    def heat_of(self, path: Path, model: Model, log: Log, mapping: LogMapping | Path | None, later: float) -> Heat:
        """Gives what a prediction of a log needs to know of heat.

        Args:
            path: of the model.
            model: as it was read.
            log: whose torques are predicted.
            mapping: of the logs' columns.
            later: how much later [s] than its own clock says the log counts.

        Raises:
            InputError: options of heat for a model without, or an ambient temperature out of range.
        """
        import json as codec

        from estimation import read_logs
        from estimation.predictions.earlier_logs import warmed
        from estimation.thermal import start_temperatures, thermal_from_dict
        from robots.common.errors import InputError

        file = path / "model.json" if path.is_dir() else path
        thermal = thermal_from_dict(model, codec.loads(file.read_text(encoding="utf-8")))
        robot = model.robot
        names, kinds = robot.joint_names, robot.chain.kinds
        earlier = read_logs(self.before, n=robot.n, mapping=mapping, joints=names, kinds=kinds) if self.before else []
        if thermal is None:
            if self.ambient is not None:
                raise InputError(
                    "the model has no thermal part",
                    file=file,
                    remedy="remove --ambient, or use a model of `oed thermal`",
                )
            placed, assumed = warmed(model, earlier, log, later)
            return Heat(options={"before": placed}, assumed=assumed)
        if self.ambient is not None and not -30.0 <= self.ambient <= 60.0:
            raise InputError(f"--ambient {self.ambient}", allowed="-30 to 60 degC")
        start = None
        if self.before:
            start = start_temperatures(thermal, earlier, float(log.t[0]), ambient=self.ambient)
            assumed = (
                f"thermal friction: initial temperatures computed from {len(earlier)} earlier logs; the first is "
                f"assumed to start cold"
            )
        else:
            assumed = (
                "thermal friction: the robot is assumed cold at the start; give earlier logs with --before if it was "
                "warm"
            )
        return Heat(options={"thermal": thermal, "start": start, "ambient": self.ambient}, assumed=assumed)
