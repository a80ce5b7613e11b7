"""Patterns: model errors without a known cause, described by free functions of their inputs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robots.common.arrays import Array
from robots.robot import Robot
from robots.terms.discrepancies.clock_drift import ClockDrift
from robots.terms.discrepancies.end_stop import EndStop
from robots.terms.discrepancies.families import FAMILIES
from robots.terms.discrepancies.flange_oscillator import FlangeOscillator
from robots.terms.discrepancies.flange_spring import FlangeSpring
from robots.terms.discrepancies.gain_drift import GainDrift, OverTime
from robots.terms.discrepancies.gain_step import GainStep
from robots.terms.discrepancies.intermittent_torque import IntermittentTorque, PeriodicTorque, has_long_pauses
from robots.terms.discrepancies.local_fault import LocalFault
from robots.terms.discrepancies.offset_step import BaseStep, Step, ZeroStep
from robots.terms.discrepancies.payload_drift import PayloadDrift
from robots.terms.discrepancies.session_friction import SessionFriction
from robots.terms.effect_bases.capabilities import AboveBand
from robots.terms.effects import Coefficient, Effect, JointEffect, Shape, Situation

PREFIX = "pattern:"
# Frequencies of a ringing load and of a vibration [Hz].
RINGING = tuple(float(f) for f in np.geomspace(0.5, 8.0, 13))
# Orders per turn of the joint.
TURNS = tuple(float(h) for h in (*range(5, 33), 40, 48, 64))
# Highest frequency [Hz] of an oscillating torque; above are vibrations.
VIBRATION_FREQUENCY = 0.6
# Least number of periods of an oscillation in the data; fewer are a drift.
FEWEST_OSCILLATIONS = 5.0
SWAYING = ("vibration", "sway")
# Effects on the whole robot.
WHOLE: tuple[Effect, ...] = (
    FlangeOscillator(),
    FlangeSpring(),
    GainDrift(),
    PayloadDrift(),
    ClockDrift(),
    BaseStep(),
    PeriodicTorque(),
    SessionFriction(),
)
# Effects at a position of a joint, or at a time.
SINGLE: tuple[Effect, ...] = (
    LocalFault(),
    LocalFault(odd=True),
    EndStop(),
    EndStop(below=True),
    GainStep(),
    ZeroStep(),
    IntermittentTorque(),
)


@dataclass(frozen=True)
class Pattern(JointEffect):
    """Functions of one or two inputs on one joint's torque, linear in their coefficients.

    Attributes:
        kind: the family of functions, a key of `FAMILIES`.
        other: the joint (from 1) whose motion is the input; 0 for the joint itself.
        odd: whether the functions change sign with the joint's direction of motion.
    """

    kind: str
    other: int = 0
    odd: bool = False

    @property
    def name(self) -> str:  # type: ignore[override]
        """The effect's name, which `build_pattern` reads."""
        return f"{PREFIX}{self.kind}:{self.other}:{'odd' if self.odd else 'even'}"

    @property
    def title(self) -> str:  # type: ignore[override]
        """The effect's title in reports."""
        return self.sentence(None)

    @property
    def above_band(self) -> AboveBand:  # type: ignore[override]
        """Exogenous for an external vibration: it excites the arm but does not depend on its motion."""
        return AboveBand.EXOGENOUS if self.kind == "vibration" else AboveBand.NO

    @property
    def shapes(self) -> tuple[Shape, ...]:  # type: ignore[override]
        """The shape parameter of the family: a frequency, an order, the scale of its input, or none."""
        if self.kind == "ringing":
            return (Shape("frequency", "Hz", 0.3, 12.0, "log", RINGING),)
        if self.kind in SWAYING:
            return (Shape("frequency", "Hz", 1e-3 if self.kind == "sway" else 0.3, 50.0, "linear"),)
        if self.kind == "turns":
            return (Shape("order", "periods per turn", 4.0, 80.0, "linear", TURNS),)
        family = FAMILIES[self.kind]
        return (Shape("largest", family.unit, 0.0, np.inf),) if family.of else ()

    def parameters(self, robot: Robot, joint: int | None) -> tuple[Coefficient, ...]:
        """Describes the coefficients, which have no physical meaning."""
        return tuple(Coefficient(f"function_{i + 1}", "") for i in range(FAMILIES[self.kind].count))

    def grid(self, situation: Situation, joint: int | None) -> tuple[tuple[float, ...], ...]:
        """Lists the shape values of a scan.

        An input is scaled by its largest absolute value in these data. Frequencies of oscillations and vibrations are
        half a resolution apart. All other families have fixed values.
        """
        of = FAMILIES[self.kind].of
        if of:
            assert joint is not None
            return ((max(float(np.abs(of(situation, joint)).max(initial=0.0)), 1e-9),),)
        if self.kind not in SWAYING:
            return super().grid(situation, joint)
        duration = _duration(situation)
        bottom, top = VIBRATION_FREQUENCY, min(0.15 / max(situation.period, 1e-6), 30.0)
        if self.kind == "sway":
            bottom, top = FEWEST_OSCILLATIONS / duration, self._fastest
        return tuple((float(f),) for f in np.arange(bottom, top, 0.5 / duration))

    def bounds(self, situation: Situation, joint: int | None) -> tuple[tuple[float, float], ...]:
        """Bounds the frequencies of oscillations and vibrations by the data, and fixes the scale of an input."""
        if FAMILIES[self.kind].of:
            ((largest,),) = self.grid(situation, joint)
            return ((largest, largest),)
        if self.kind == "sway":
            return ((FEWEST_OSCILLATIONS / _duration(situation), 2 * self._fastest),)
        if self.kind == "vibration":
            return ((0.5 * VIBRATION_FREQUENCY, min(0.2 / max(situation.period, 1e-6), 50.0)),)
        return super().bounds(situation, joint)

    def propose(
        self, situation: Situation, joint: int | None, residual: Array, count: int = 8
    ) -> tuple[tuple[float, ...], ...]:
        """Ranks frequencies by the ratio of the residual's spectrum to its local level."""
        grid = self.grid(situation, joint)
        if self.kind not in SWAYING or len(grid) <= count:
            return grid
        assert joint is not None
        rows = len(situation)
        series = residual[:, joint - 1] * (situation.sign[:, joint - 1] if self.odd else 1.0)
        series = series - series.mean()
        f = np.fft.rfftfreq(4 * rows, situation.period)
        power = np.abs(np.fft.rfft(series * np.hanning(rows), 4 * rows)) ** 2
        width = 401
        level = np.convolve(np.pad(power, width // 2, mode="reflect"), np.ones(width) / width, mode="valid")
        points = np.array(grid)[:, 0]
        contrast = np.interp(points, f, power / np.maximum(level, 1e-300))
        # The search must start at the top of a narrow spectral line; from beside it, it would not reach the top.
        return tuple((_top(np.asarray(f), power, float(points[i])),) for i in np.argsort(-contrast)[:count])

    @property
    def _fastest(self) -> float:
        """Highest frequency [Hz] of an oscillation; friction may oscillate faster, as with each turn of a belt."""
        return 2.0 if self.odd else VIBRATION_FREQUENCY

    def local(self, situation: Situation, joint: int, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates the functions (N, k)."""
        X = FAMILIES[self.kind].columns(situation, joint, self.other or joint, shape)
        return X * situation.sign[:, joint - 1, None] if self.odd else X

    def describe(
        self,
        joint: int | None,
        coefficients: Array,
        shape: tuple[float, ...] = (),
        *,
        force: str = "N m",
        length: str = "rad",
    ) -> str:
        """Describes the dependence of the residual."""
        text = self.sentence(joint, shape)
        if self.kind != "turns" or length == "rad":
            return text
        return text.replace(
            f"repeats {shape[0]:.3g} times a turn of the joint", f"repeats every {2000 * np.pi / shape[0]:.3g} mm"
        )

    def sentence(self, joint: int | None, shape: tuple[float, ...] = ()) -> str:
        """Describes the dependence of a joint's residual in one sentence."""
        where = f"of joint {joint}" if joint else "of the joint"
        who = f"joint {self.other}" if self.other and self.other != joint else "its own joint"
        point = f"{shape[0]:.3g}" if shape else ""
        text = FAMILIES[self.kind].words.format(who=who, point=point)
        turn = " and changes sign with the direction of motion" if self.odd else ""
        return f"The residual torque {where} {text}{turn}."


def build_pattern(text: str) -> Effect | None:
    """Builds the pattern with a given name; None if the name is not that of a pattern."""
    for known in (*SINGLE, *WHOLE):
        if text == known.name:
            return known
    parts = text.removeprefix(PREFIX).split(":")
    if not text.startswith(PREFIX) or len(parts) != 3 or parts[0] not in FAMILIES or not parts[1].isdigit():
        return None
    return Pattern(parts[0], int(parts[1]), parts[2] == "odd")


def all_patterns(robot: Robot) -> tuple[Effect, ...]:
    """Lists the patterns to search on every joint, and on the robot as a whole."""
    joints = range(1, robot.n + 1)
    own = [Pattern("speed"), Pattern("speed", odd=True), Pattern("load"), Pattern("load", odd=True)]
    own += [
        Pattern("torque"),
        Pattern("acceleration"),
        Pattern("memory"),
        Pattern("worked", odd=True),
        Pattern("creep"),
        Pattern("hysteresis"),
        Pattern("supply"),
    ]
    own += [Pattern("time"), Pattern("time", odd=True), Pattern("ageing"), Pattern("start", odd=True)]
    own += [Pattern("ringing"), Pattern("vibration"), Pattern("sway"), Pattern("sway", odd=True), Pattern("turns")]
    each = [Pattern("angle", k, odd) for k in joints for odd in (False, True)]
    each += [Pattern("angles", k) for k in joints] if robot.n > 1 else []
    each += [Pattern("motion", k, odd) for k in joints for odd in (False, True)] if robot.n > 1 else []
    each += [Pattern("push", k) for k in joints] if robot.n > 1 else []
    each += [Pattern("whirl", k) for k in joints] if robot.n > 2 else []
    each += [Pattern("drag", k) for k in joints]
    each += [Pattern("posture", k) for k in joints] if robot.n > 1 else []
    return (*own, *SINGLE, *each, *WHOLE)


def is_of_time(effect: object) -> bool:
    """Returns whether a pattern describes a change with time, not a dependence on the motion."""
    return isinstance(effect, (OverTime, GainStep, Step, IntermittentTorque)) or (
        isinstance(effect, Pattern) and effect.kind in ("time", "ageing")
    )


def is_oscillation(effect: object) -> bool:
    """Returns whether a pattern oscillates in time, independent of the motion; its phase in other logs is unknown."""
    return isinstance(effect, Pattern) and effect.kind in SWAYING


def _top(f: Array, power: Array, near: float) -> float:
    """Finds the frequency of a spectrum's (K,) maximum next to a point, by a parabola through three values."""
    k = int(np.clip(round(near / f[1]), 2, len(f) - 3))
    k += int(np.argmax(power[k - 1 : k + 2])) - 1
    low, middle, high = np.log(np.maximum(power[k - 1 : k + 2], 1e-300))
    bend = low - 2 * middle + high
    return float(f[k] + (0.5 * (low - high) / bend * f[1] if bend < 0 and middle >= max(low, high) else 0.0))


def _duration(situation: Situation) -> float:
    """Returns the time from first to last sample [s], or the recorded time if there are long pauses between logs."""
    span, recorded = float(situation.t[-1] - situation.t[0]), len(situation) * situation.period
    return max(recorded if has_long_pauses(situation) else span, 1.0)
