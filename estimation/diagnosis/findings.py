"""A cause that was found: its parameters, what it brings, its rivals, as values and as plain data."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from robots.common.plain import finite, number

# Parameters of one finding that a summary lists.
MOST_LISTED = 8


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """A parameter of an effect.

    Attributes:
        name: as the effect names it.
        value: the estimate.
        unit: its unit.
        standard_error: NaN where the data say nothing of it.
        ci95: 95 % interval; infinite where the data say nothing of it.
        determined: whether they tell it well: a coefficient from zero, and a nonlinear parameter to a fifth of its
            value, a moment to .2 s.
    """

    name: str
    value: float
    unit: str
    standard_error: float
    ci95: tuple[float, float]
    determined: bool

    @property
    def text(self) -> str:
        """Its name, with its interval where it has one, or its value where that was chosen among a few."""
        low, high = self.ci95
        if not np.isfinite([low, high]).all():
            return self.name
        unit = "" if self.unit in ("", "1") else f" {self.unit}"
        if high <= low:
            return f"{self.name} = {self.value:.3g}{unit}"
        # As many digits as distinguish the ends of a narrow interval.
        digits = max(3, 1 + math.ceil(math.log10(max(abs(low), abs(high)) / (high - low))))
        return f"{self.name} ({low:.{digits}g} to {high:.{digits}g}{unit})"

    def to_dict(self) -> dict[str, Any]:
        """Writes it as plain data; what is not determined is None."""
        return {
            "name": self.name,
            "value": self.value,
            "unit": self.unit,
            "ci95": [finite(bound) for bound in self.ci95],
            "standard_error": finite(self.standard_error),
            "determined": self.determined,
        }


@dataclass(frozen=True, kw_only=True)
class Gain:
    """Held-out gain of an effect, averaged over the joints on which it acts.

    Attributes:
        nrmse_before: residual RMS over torque RMS without it.
        nrmse_after: with it.
        ci95: interval of the fall.
        joints: those joints, from 1; none where older files do not say.
    """

    nrmse_before: float
    nrmse_after: float
    ci95: tuple[float, float]
    joints: tuple[int, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Finding:
    """One cause.

    Attributes:
        effect: its name in the vocabulary; ``unexplained`` for a pattern without a known cause.
        joint: counted from 1; None for the whole robot.
        parameters: coefficients, then shape.
        p_value: family-wise: the chance that noise alone has an effect this strong found.
        delta_bic: how much better the model with it is (Schwarz).
        gain: on unseen data.
        rivals: other causes in its place, ``(name, how much worse their BIC is)``, the closest first.
        sentence: what it means, in words.
        visible: share of its energy that the base model does not absorb.
        coordinate: label of the axis on which it shows.
        pattern: the description of an unexplained pattern; empty for a named effect.
        measured_by: what it was seen in where that is not the torque: ``qlink``, the encoders behind the gears. Its
            gain is then of the link's position, over the standard deviation of the wind-up.
    """

    effect: str
    joint: int | None
    parameters: tuple[Parameter, ...]
    p_value: float
    delta_bic: float
    gain: Gain
    rivals: tuple[tuple[str, float], ...]
    sentence: str
    visible: float
    coordinate: str = ""
    pattern: str = ""
    measured_by: str = ""

    @property
    def elsewhere(self) -> str:
        """Says on which joints the gain is, where those are not the finding's own; begins with a space, or is empty."""
        joints = self.gain.joints
        if self.joint is None or joints in ((), (self.joint,)):
            return ""
        return f" of joint{'s' if len(joints) > 1 else ''} {', '.join(map(str, joints))}"

    def to_dict(self) -> dict[str, Any]:
        """Writes it as plain data."""
        return {
            "effect": self.effect,
            "joint": self.joint,
            "parameters": [parameter.to_dict() for parameter in self.parameters],
            "p_value": self.p_value,
            "delta_bic": self.delta_bic,
            "gain": {
                "nrmse_before": self.gain.nrmse_before,
                "nrmse_after": self.gain.nrmse_after,
                "ci95": list(self.gain.ci95),
                "joints": list(self.gain.joints),
            },
            "rivals": [[name, worse] for name, worse in self.rivals],
            "sentence": self.sentence,
            "visible": self.visible,
            **({"pattern": self.pattern} if self.pattern else {}),
            **({"measured_by": self.measured_by} if self.measured_by else {}),
        }


def read_finding(item: dict[str, Any]) -> Finding:
    """Reads what `Finding.to_dict` wrote."""
    parameters = tuple(
        Parameter(
            name=p["name"],
            value=float(p["value"]),
            unit=p["unit"],
            standard_error=number(p["standard_error"]),
            ci95=(
                -np.inf if p["ci95"][0] is None else float(p["ci95"][0]),
                np.inf if p["ci95"][1] is None else float(p["ci95"][1]),
            ),
            determined=bool(p["determined"]),
        )
        for p in item["parameters"]
    )
    gain = item["gain"]
    return Finding(
        effect=item["effect"],
        joint=item["joint"],
        parameters=parameters,
        p_value=float(item["p_value"]),
        delta_bic=float(item["delta_bic"]),
        gain=Gain(
            nrmse_before=float(gain["nrmse_before"]),
            nrmse_after=float(gain["nrmse_after"]),
            ci95=(float(gain["ci95"][0]), float(gain["ci95"][1])),
            joints=tuple(int(joint) for joint in gain.get("joints", ())),
        ),
        rivals=tuple((str(name), float(worse)) for name, worse in item["rivals"]),
        sentence=item["sentence"],
        visible=float(item["visible"]),
        pattern=item.get("pattern", ""),
        measured_by=item.get("measured_by", ""),
    )


def list_parameters(texts: Sequence[str]) -> str:
    """Lists parameters, no more than a line holds: a force at a place of a body has twelve."""
    left = len(texts) - MOST_LISTED
    return ", ".join(texts if left <= 1 else [*texts[:MOST_LISTED], f"and {left} more in diagnosis.json"])
