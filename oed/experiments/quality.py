"""Information of a motion on the parameters."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from oed.criteria import Criterion, Weighting, triangle
from oed.criteria import criterion as choose_criterion
from robots.base_parameters import BaseParameters
from robots.common.parallel import one_blas_thread
from robots.common.plain import significant
from robots.common.records import Finding, Record
from robots.regressor import TorqueModel, default_model
from robots.robot import Robot
from robots.signals import Motion

ASSUMED_NOISE = 0.02
"""Torque noise over the torque: what models of robots commonly leave."""

_LABELS = {"fourier": "Fourier series", "sinusoid": "velocity strokes", "whole": "whole experiment"}


@dataclass(frozen=True, kw_only=True)
class Quality(Record):
    """Information of a part of the experiment on the parameters.

    Attributes:
        part: which segments, such as ``fourier`` or ``whole``.
        samples: how many.
        singular_values: of the unscaled regressor Y (m,), ascending.
    """

    ENTRIES = (
        "part",
        "samples",
        "cond_Y=cond",
        "log_det_YtY=log_det",
        "smallest_singular_value_Y=smallest",
        "singular_values_Y=singular_values",
    )

    part: str
    samples: int
    singular_values: tuple[float, ...]

    @property
    def label(self) -> str:
        """The part's name in reports."""
        kind, *rest = self.part.split(" ", 1)
        return " ".join([_LABELS.get(kind, kind), *rest])

    @property
    def full(self) -> bool:
        """Whether Y has full rank, so that the motion excites all parameters."""
        return self.singular_values[0] > 1e-10 * self.singular_values[-1]

    @property
    def cond(self) -> float | None:
        """Condition number of Y; None where it has not full rank."""
        return self.value("cond") if self.full else None

    @property
    def log_det(self) -> float | None:
        """Logarithm of det(Y'Y); None where Y has not full rank."""
        return self.value("d") if self.full else None

    @property
    def smallest(self) -> float:
        """Smallest singular value of Y; 0 where it has not full rank."""
        return self.singular_values[0] if self.full else 0.0

    def value(self, criterion: str | Criterion) -> float:
        """Evaluates a criterion."""
        return choose_criterion(criterion).value(np.square(self.singular_values))


@one_blas_thread()
def measure(part: str, base: BaseParameters, motion: Motion, weighting: Weighting | None = None) -> Quality:
    """Computes the singular values of a motion's regressor, or of what a weighting makes of it."""
    judged = weighting or Weighting()
    reduced = triangle(base.model, base.independent, motion.q, motion.dq, motion.ddq, judged.rows)
    values = judged.singular_values(reduced, len(motion))
    return Quality(part=part, samples=len(motion), singular_values=tuple(float(v) for v in values))


def design_model(robot: Robot, settings: Mapping[str, Any]) -> TorqueModel:
    """Builds the model whose columns a design with these settings is for."""
    keys = ("friction", "velocity_scale", "rotor", "offset")
    return default_model(robot, **{key: settings[key] for key in keys})


def excitation_findings(quality: Quality) -> tuple[Finding, ...]:
    """Says whether a motion determines all parameters, and whether noise leaves one of them open.

    With torque noise of `ASSUMED_NOISE` of the torque, the standard error of the worst-determined direction is about
    NOISE cond(Y) / sqrt(N) of the parameters' size. Above 1 that direction is not determined.

    Args:
        quality: of the whole motion.
    """
    cond = quality.cond
    code = excitation_code(cond, quality.samples)
    if not code:
        return ()
    action = "Give the motion more room or time: --velocity-fraction, --periods or --effort thorough."
    if cond is None:
        text = "The motion does not excite all parameters: the regressor lacks rank."
        return (Finding(code=code, text=text, action=action),)
    error = _worst_error(cond, quality.samples)
    text = (
        f"At least one combination of parameters is not determined: cond(Y) is {significant(cond, digits=2)}. With "
        f"torque noise of {100 * ASSUMED_NOISE:g} %, its standard error is about {significant(error, digits=2)} times "
        "the parameters' size."
    )
    return (Finding(code=code, text=text, action=action),)


def excitation_code(cond: float | None, samples: int) -> str:
    """Gives the code of a finding about the excitation; empty if the motion determines all parameters.

    Args:
        cond: condition number of the regressor; None if it lacks rank.
        samples: number of its samples.
    """
    if cond is None:
        return "excitation.incomplete"
    return "excitation.weak" if _worst_error(cond, samples) > 1.0 else ""


def _worst_error(cond: float, samples: int) -> float:
    """Standard error of the worst-determined direction over the parameters' size, see `excitation_findings`."""
    return ASSUMED_NOISE * cond / math.sqrt(samples)
