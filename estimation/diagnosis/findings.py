"""A cause that was found, with parameters, gain and rivals, and its plain data."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from robots.common.records import Record, read_null_as
from robots.terms.effects import EFFECTS

# Number of parameters of one finding that a summary lists.
MOST_LISTED = 8


@dataclass(frozen=True, kw_only=True)
class Parameter(Record):
    """A parameter of an effect.

    Attributes:
        name: as the effect names it.
        value: the estimate.
        unit: its unit.
        ci95: 95 % interval; infinite if the data do not determine it.
        standard_error: NaN if the data do not determine it.
        determined: whether the data determine it well. The standard error of a coefficient is then below half of the
            effect's largest one. The 95 % interval of a shape parameter is within a fifth of its value, that of a
            change time within 0.2 s.
    """

    name: str
    value: float
    unit: str
    ci95: tuple[float, float] = field(metadata=read_null_as(-np.inf, np.inf))
    standard_error: float
    determined: bool

    @property
    def text(self) -> str:
        """Name with interval; with the value alone if it is a choice, and without a value if it is not determined."""
        low, high = self.ci95
        if not np.isfinite([low, high]).all():
            return self.name
        unit = "" if self.unit in ("", "1") else f" {self.unit}"
        if high <= low:
            return f"{self.name} = {self.value:.3g}{unit}"
        # Enough digits to distinguish the ends of a narrow interval.
        digits = max(3, 1 + math.ceil(math.log10(max(abs(low), abs(high)) / (high - low))))
        return f"{self.name} ({low:.{digits}g} to {high:.{digits}g}{unit})"


@dataclass(frozen=True, kw_only=True)
class Gain:
    """Held-out gain of an effect, averaged over the joints on which it acts.

    Attributes:
        nrmse_before: residual RMS over torque RMS without the effect.
        nrmse_after: the same with it.
        ci95: 95 % interval of the decrease.
        joints: those joints, from 1; empty in files that do not state them.
    """

    nrmse_before: float
    nrmse_after: float
    ci95: tuple[float, float]
    joints: tuple[int, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Finding(Record):
    """One cause.

    Attributes:
        effect: its name in the catalogue; ``unexplained`` for a pattern without a known cause.
        joint: counted from 1; None for the whole robot.
        parameters: coefficients, then shape parameters.
        p_value: family-wise: the probability that noise alone gives a finding this strong.
        delta_bic: decrease of the BIC with the effect.
        gain: gain on held-out data.
        rivals: other possible causes, ``(name, how much worse their BIC is)``, the closest first.
        sentence: what it means, in words.
        visible: share of its energy that the base model does not absorb.
        coordinate: label of the axis on which it shows in a picture.
        pattern: description of an unexplained pattern; empty for a named effect.
        measured_by: ``qlink`` if the encoders behind the gears show it instead of the torque. Its gain is then that of
            the link's position, over the standard deviation of the gear's deflection.
    """

    ENTRIES = (
        "effect",
        "joint",
        "parameters",
        "p_value",
        "delta_bic",
        "gain",
        "rivals",
        "sentence",
        "visible",
        "pattern?",
        "measured_by?",
    )

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
    def named(self) -> bool:
        """Whether it is an effect of the catalogue, not a pattern without a known cause."""
        return self.effect in EFFECTS

    @property
    def title(self) -> str:
        """What it is, in words."""
        return EFFECTS[self.effect].title if self.named else "a pattern without a known cause"

    @property
    def elsewhere(self) -> str:
        """Names the joints of the gain, with a leading space; empty if they are the finding's own."""
        joints = self.gain.joints
        if self.joint is None or joints in ((), (self.joint,)):
            return ""
        return f" of joint{'s' if len(joints) > 1 else ''} {', '.join(map(str, joints))}"


def list_parameters(texts: Sequence[str]) -> str:
    """Joins texts of parameters to a list; of more than nine only the first eight."""
    left = len(texts) - MOST_LISTED
    return ", ".join(texts if left <= 1 else [*texts[:MOST_LISTED], f"and {left} more in diagnosis.json"])
