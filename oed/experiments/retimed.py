"""The verb: runs an experiment's path at the speed that the limits allow, and says what that did to its criterion."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from oed.criteria import CRITERIA, criterion as choose_criterion
from oed.experiments.designing import usable_limits
from oed.experiments.result import DESIGN, TRAJECTORY, Quality, design_model, margin_data, measure, measured_margins
from oed.exports import write_trajectory
from oed.retiming import Retimed, retime as retime_by_toppra, retime_with_stops
from robots.base_parameters import BaseParameters, base_parameters
from robots.common.errors import InputError
from robots.common.files import write_atomic
from robots.limits import Margin
from robots.regressor import TorqueModel
from robots.robot import Robot
from robots.signals import Motion
from robots.terms import FrictionPolynomial
from robots.version import VERSION

Array = NDArray[np.float64]

METHODS = ("toppra", "ruckig")


@dataclass(frozen=True, kw_only=True)
class RetimedExperiment:
    """A path with a new timing, and what both timings tell of the parameters.

    Attributes:
        robot: what it is for.
        base: the parameters.
        criterion: the name of the criterion that is compared.
        before: the quality of the given timing.
        after: the quality of the new one.
        retimed: the new motion, and how much of each limit it uses.
        margins: of the new motion to each limit.
    """

    robot: Robot
    base: BaseParameters
    criterion: str
    before: Quality
    after: Quality
    retimed: Retimed
    margins: tuple[Margin, ...]

    @property
    def motion(self) -> Motion:
        """The new motion."""
        return self.retimed.motion

    @property
    def success(self) -> bool:
        """Whether all limits hold."""
        return not any(margin.violated for margin in self.margins)

    def summary(self) -> str:
        """Says what changed."""
        label = CRITERIA[self.criterion]().label
        before, after = (_value(quality, self.criterion) for quality in (self.before, self.after))
        return f"{self.retimed.summary()}\n  {label}: {before} before, {after} after"

    def to_dict(self) -> dict[str, Any]:
        """Writes everything but the samples as plain data for `design.json`."""
        return {
            "format": "robot-oed design",
            "format_version": 1,
            "tool_version": VERSION,
            "robot": {"name": self.robot.name, "origin": self.robot.origin, "sha256": self.robot.digest},
            "assumed": list(self.robot.assumed),
            "model": {
                "columns": list(self.base.names),
                "units": [column.unit for column in self.base.columns],
                "stands_for": list(self.base.formulas()),
                "scaling": "none",
            },
            "criterion": self.criterion,
            "criterion_label": CRITERIA[self.criterion]().label,
            "quality": [self.before.to_dict(), self.after.to_dict()],
            "retiming": {
                "method": self.retimed.method,
                "duration_before": self.retimed.duration_before,
                "duration_after": self.retimed.duration_after,
                "path_deviation": self.retimed.deviation,
                "stops": self.retimed.stops,
                "usage": {name: values.tolist() for name, values in self.retimed.usage.items()},
            },
            "segments": [{"kind": "move", "start": 0.0, "end": self.motion.duration, "joint": None}],
            "duration": self.motion.duration,
            "period": self.robot.period,
            "smallest_margins": [margin_data(margin) for margin in self.margins],
        }

    def save(self, folder: str | Path, *, force: bool = False) -> None:
        """Writes `trajectory.csv` and `design.json` into a folder that is there.

        Raises:
            InputError: a file is there, and force is not given.
        """
        metadata = {
            "robot": self.robot.origin or self.robot.name,
            "period": self.robot.period,
            "tool": f"robot-oed {VERSION}",
        }
        write_trajectory(Path(folder) / TRAJECTORY, self.motion, metadata, force=force)
        write_atomic(Path(folder) / DESIGN, json.dumps(self.to_dict(), indent=2, allow_nan=False) + "\n", force=force)


def retime(
    robot: Robot,
    motion: Motion,
    *,
    method: str = "toppra",
    criterion: str = "cond",
    friction: str = "polynomial",
    velocity_scale: float = 0.02,
    tolerance: float = 0.01,
) -> RetimedExperiment:
    """Runs through the path of a motion as fast as the robot's limits allow.

    Args:
        robot: the robot; its torque limits count where its nominal dynamics are described.
        motion: the path, with its present timing.
        method: ``toppra`` follows the path; ``ruckig`` moves straight from vertex to vertex and stops at each.
        criterion: what to compare, see `oed.design`.
        friction: the model whose parameters are meant.
        velocity_scale: of its Coulomb column.
        tolerance: how far ruckig's polyline may leave the path [rad or m].

    Returns:
        The new motion and the criterion before and after.

    Raises:
        InputError: an unknown method or criterion, a motion of another number of joints.
        InfeasibleError: a path that no timing makes possible.
    """
    if method not in METHODS:
        raise InputError(f"retiming method {method!r}", allowed=", ".join(METHODS))
    if motion.n != robot.n:
        raise InputError(f"a motion of {motion.n} joints", allowed=f"{robot.n}, as {robot.name} has")
    chosen = choose_criterion(criterion)
    settings = {"friction": friction, "velocity_scale": velocity_scale, "rotor": True, "offset": False}
    model = design_model(robot, settings)
    base = base_parameters(model)
    # The path may go to the ends of the ranges; speed and its derivatives keep the reserve of a design.
    limits = replace(usable_limits(robot.limits), lower=robot.limits.lower, upper=robot.limits.upper)
    if method == "toppra":
        rigid, losses = _dynamics(model)
        retimed = retime_by_toppra(motion, limits, period=robot.period, inverse_dynamics=rigid, friction=losses)
    else:
        retimed = retime_with_stops(motion, limits, period=robot.period, tolerance=tolerance)
    return RetimedExperiment(
        robot=robot,
        base=base,
        criterion=chosen.name,
        before=measure("before", base, motion),
        after=measure("after", base, retimed.motion),
        retimed=retimed,
        margins=measured_margins(robot, retimed.motion, base),
    )


def _dynamics(
    model: TorqueModel,
) -> tuple[Callable[[Array, Array, Array], Array] | None, Callable[[Array], Array] | None]:
    """The nominal torque without and of friction, or nothing where the robot's description does not give it."""
    robot = model.robot
    if not (np.isfinite(model.nominal).all() and np.isfinite(robot.limits.torque).any()):
        return None, None
    smooth = TorqueModel(robot, tuple(term for term in model.terms if not isinstance(term, FrictionPolynomial)))
    friction = TorqueModel(robot, tuple(term for term in model.terms if isinstance(term, FrictionPolynomial)))

    def rigid(q: Array, dq: Array, ddq: Array) -> Array:
        return smooth.torque(q, dq, ddq, smooth.nominal)

    def losses(dq: Array) -> Array:
        return friction.torque(np.zeros_like(dq), dq, np.zeros_like(dq), friction.nominal)

    return rigid, losses


def _value(quality: Quality, criterion: str) -> str:
    known: Mapping[str, Any] = quality.to_dict()
    return f"{quality.value(criterion):.4g}" if known["cond_Y"] is not None else "not all parameters excited"
