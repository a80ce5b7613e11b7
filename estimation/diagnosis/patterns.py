"""What a model error looks like when no cause of the catalogue explains it: which joint, of which inputs, how."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from estimation.diagnosis.pulling import Pulling
from estimation.diagnosis.resonance import resonance
from estimation.diagnosis.swinging import Swinging
from robots.robot import Robot
from robots.terms.effects import Coefficient, JointEffect, Shape, Situation

Array = NDArray[np.float64]

PREFIX = "pattern:"
HARMONICS = (1, 2, 3, 4)
MEMORIES = (0.1, 0.3, 1.0, 3.0)  # [s]
KNOTS = 8
# Frequencies of a ringing load and of a vibration [Hz].
RINGING = tuple(float(f) for f in np.geomspace(0.5, 8.0, 13))
TURNS = tuple(float(h) for h in (*range(5, 33), 40, 48, 64))
SLOWEST = 0.6
# Swings of a torque that goes to and fro by itself: fewer than so many in the data are a drift.
SWINGS = 5.0
SWAYING = ("vibration", "sway")


@dataclass(frozen=True)
class Pattern(JointEffect):
    """Functions of one or two inputs on one joint's torque, linear in their coefficients.

    Attributes:
        kind: which family of functions.
        other: the joint (from 1) whose motion is the input; 0 for the joint itself.
        odd: whether the functions turn round with the joint's direction.
    """

    kind: str
    other: int = 0
    odd: bool = False

    @property
    def name(self) -> str:  # type: ignore[override]
        """A text that `build_pattern` reads."""
        return f"{PREFIX}{self.kind}:{self.other}:{'odd' if self.odd else 'even'}"

    @property
    def title(self) -> str:  # type: ignore[override]
        """Its name for people."""
        return self.sentence(None)

    @property
    def fast(self) -> bool:  # type: ignore[override]
        """Whether it is looked for above the bands too: what vibrates owes nothing to accelerations."""
        return self.kind == "vibration"

    @property
    def shapes(self) -> tuple[Shape, ...]:  # type: ignore[override]
        """A frequency or an order where the family has one."""
        if self.kind == "ringing":
            return (Shape("frequency", "Hz", 0.3, 12.0, "log", RINGING),)
        if self.kind in SWAYING:
            return (Shape("frequency", "Hz", 1e-3 if self.kind == "sway" else 0.3, 50.0, "linear"),)
        if self.kind == "turns":
            return (Shape("order", "periods per turn", 4.0, 80.0, "linear", TURNS),)
        return ()

    def parameters(self, robot: Robot, joint: int | None) -> tuple[Coefficient, ...]:
        """Describes the coefficients: numbers of functions, without a physical meaning each."""
        return tuple(Coefficient(f"function_{i + 1}", "") for i in range(_COUNTS[self.kind]))

    def grid(self, situation: Situation, joint: int | None) -> tuple[tuple[float, ...], ...]:
        """Lists the frequencies of what goes to and fro half a resolution apart; else the family's own points."""
        if self.kind not in SWAYING:
            return super().grid(situation, joint)
        duration = _duration(situation)
        bottom, top = SLOWEST, min(0.15 / max(situation.period, 1e-6), 30.0)
        if self.kind == "sway":
            bottom, top = SWINGS / duration, SLOWEST
        return tuple((float(f),) for f in np.arange(bottom, top, 0.5 / duration))

    def bounds(self, situation: Situation, joint: int | None) -> tuple[tuple[float, float], ...]:
        """Keeps a vibration's frequency below what the samples resolve, and a swing's where it is one."""
        if self.kind == "sway":
            return ((SWINGS / _duration(situation), 2 * SLOWEST),)
        if self.kind == "vibration":
            return ((0.5 * SLOWEST, min(0.2 / max(situation.period, 1e-6), 50.0)),)
        return super().bounds(situation, joint)

    def propose(
        self, situation: Situation, joint: int | None, residual: Array, count: int = 8
    ) -> tuple[tuple[float, ...], ...]:
        """Ranks the frequencies of a vibration by the residual's spectrum over that of its surroundings."""
        grid = self.grid(situation, joint)
        if self.kind not in SWAYING or len(grid) <= count:
            return grid
        assert joint is not None
        rows = len(situation)
        series = residual[:, joint - 1] - residual[:, joint - 1].mean()
        f = np.fft.rfftfreq(4 * rows, situation.period)
        power = np.abs(np.fft.rfft(series * np.hanning(rows), 4 * rows)) ** 2
        width = 401
        level = np.convolve(np.pad(power, width // 2, mode="reflect"), np.ones(width) / width, mode="valid")
        contrast = np.interp([point for (point,) in grid], f, power / np.maximum(level, 1e-300))
        return tuple(grid[i] for i in np.argsort(-contrast)[:count])

    def local(self, situation: Situation, joint: int, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates the functions (N, k)."""
        X = _FAMILIES[self.kind](situation, joint, self.other or joint, shape)
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
        """Says what the residual depends on."""
        return self.sentence(joint, shape)

    def sentence(self, joint: int | None, shape: tuple[float, ...] = ()) -> str:
        """Says in words which joint's residual depends on what."""
        where = f"of joint {joint}" if joint else "of the joint"
        who = f"joint {self.other}" if self.other and self.other != joint else "its own joint"
        point = f"{shape[0]:.3g}" if shape else ""
        text = _WORDS[self.kind].format(who=who, point=point)
        turn = ", and turns round with the direction of motion" if self.odd else ""
        return f"The residual torque {where} {text}{turn}."


def build_pattern(text: str) -> Pattern | Swinging | Pulling | None:
    """Reads the name of a pattern; None for anything else."""
    for whole in (Swinging, Pulling):
        if text == whole.name:
            return whole()
    parts = text.removeprefix(PREFIX).split(":")
    if not text.startswith(PREFIX) or len(parts) != 3 or parts[0] not in _FAMILIES or not parts[1].isdigit():
        return None
    return Pattern(parts[0], int(parts[1]), parts[2] == "odd")


def all_patterns(robot: Robot) -> tuple[Pattern | Swinging | Pulling, ...]:
    """Lists the patterns to look for on every joint, and on the robot as a whole."""
    joints = range(1, robot.n + 1)
    own = [Pattern("speed"), Pattern("speed", odd=True), Pattern("load"), Pattern("load", odd=True)]
    own += [Pattern("acceleration"), Pattern("memory"), Pattern("time"), Pattern("time", odd=True)]
    own += [Pattern("ringing"), Pattern("vibration"), Pattern("sway"), Pattern("turns")]
    each = [Pattern("angle", k, odd) for k in joints for odd in (False, True)]
    each += [Pattern("angles", k) for k in joints] if robot.n > 1 else []
    each += [Pattern("motion", k, odd) for k in joints for odd in (False, True)] if robot.n > 1 else []
    each += [Pattern("drag", k) for k in joints]
    each += [Pattern("posture", k) for k in joints] if robot.n > 1 else []
    return (*own, *each, Swinging(), Pulling())


def is_of_time(effect: object) -> bool:
    """Whether a pattern's function knows nothing of the motion but, at most, its direction."""
    return isinstance(effect, Pattern) and effect.kind == "time"


def _angle(s: Situation, joint: int, other: int, shape: tuple[float, ...]) -> Array:
    q = s.q[:, other - 1]
    return np.column_stack([f(h * q) for h in HARMONICS for f in (np.cos, np.sin)])


def _angles(s: Situation, joint: int, other: int, shape: tuple[float, ...]) -> Array:
    if other == joint:
        return np.zeros((len(s), 16))
    a, b = s.q[:, joint - 1], s.q[:, other - 1]
    first = [f(h * a) for h in (1, 2) for f in (np.cos, np.sin)]
    second = [f(h * b) for h in (1, 2) for f in (np.cos, np.sin)]
    return np.column_stack([x * y for x in first for y in second])


def _duration(s: Situation) -> float:
    return max(float(s.t[-1] - s.t[0]), 1.0)


def _motion(s: Situation, joint: int, other: int, shape: tuple[float, ...]) -> Array:
    if other == joint:
        return np.zeros((len(s), 5))
    v = s.dq[:, other - 1]
    own = s.dq[:, joint - 1]
    return np.column_stack([v, np.abs(v), v * np.abs(v), s.sign[:, other - 1], v * own])


def _drag(s: Situation, joint: int, other: int, shape: tuple[float, ...]) -> Array:
    return _products(s.q[:, joint - 1], s.dq[:, other - 1])


def _posture(s: Situation, joint: int, other: int, shape: tuple[float, ...]) -> Array:
    if other == joint:
        return np.zeros((len(s), 8))
    return _products(s.q[:, other - 1], s.dq[:, joint - 1])


def _products(q: Array, v: Array) -> Array:
    waves = [f(h * q) for h in (1, 2) for f in (np.cos, np.sin)]
    return np.column_stack([wave * speed for wave in waves for speed in (v, v * v)])


def _speed(s: Situation, joint: int, other: int, shape: tuple[float, ...]) -> Array:
    v = s.dq[:, joint - 1]
    x = np.abs(v) / max(float(np.abs(v).max()), 1e-9)
    centres = (0.0, 0.05, 0.15, 0.35, 0.65, 1.0)
    widths = (0.03, 0.06, 0.1, 0.2, 0.25, 0.3)
    return np.column_stack([np.exp(-0.5 * ((x - c) / w) ** 2) for c, w in zip(centres, widths, strict=True)])


def _load(s: Situation, joint: int, other: int, shape: tuple[float, ...]) -> Array:
    load = s.load[:, joint - 1]
    x = load / max(float(np.abs(load).max()), 1e-9)
    return np.column_stack([x, np.abs(x), x * np.abs(x), x**2, np.abs(x) ** 3])


def _acceleration(s: Situation, joint: int, other: int, shape: tuple[float, ...]) -> Array:
    a = s.ddq[:, joint - 1]
    x = a / max(float(np.abs(a).max()), 1e-9)
    return np.column_stack([np.abs(x), x * np.abs(x), x**3])


def _memory(s: Situation, joint: int, other: int, shape: tuple[float, ...]) -> Array:
    columns = []
    for memory in MEMORIES:
        keep = float(np.exp(-s.period / memory))
        column = np.zeros(len(s))
        for run in s.runs:
            column[run] = lfilter([1 - keep], [1.0, -keep], s.dq[run, joint - 1])
        columns.append(column)
    return np.column_stack(columns)


def _time(s: Situation, joint: int, other: int, shape: tuple[float, ...]) -> Array:
    x = (s.t - s.t[0]) / max(float(s.t[-1] - s.t[0]), 1e-9)
    return np.column_stack([np.cos(np.pi * k * x) for k in range(1, KNOTS + 1)])


def _ringing(s: Situation, joint: int, other: int, shape: tuple[float, ...]) -> Array:
    sources = np.column_stack([s.rigid[:, joint - 1], s.ddq[:, joint - 1]])
    for run in s.runs:
        sources[run] -= sources[run].mean(axis=0)
    place, rate = resonance(s, sources, shape[0])
    return np.column_stack([place[:, 0], rate[:, 0], place[:, 1], rate[:, 1]])


def _vibration(s: Situation, joint: int, other: int, shape: tuple[float, ...]) -> Array:
    phase = 2 * np.pi * shape[0] * (s.t - s.t[0])
    pull = s.sensitivity("gravity")[:, joint - 1]
    size = np.abs(pull).max(axis=0)
    # An axis along gravity feels none of it, but for rounding.
    pull = np.where(size > 1e-6 * max(float(size.max()), 1e-300), pull, 0.0)
    if not float(size.max()) > 1e-9:
        pull = np.ones((len(s), 1)) * [1.0, 0.0, 0.0]
    waves = (np.cos(phase), np.sin(phase))
    columns = [wave * pull[:, i % pull.shape[1]] for i in range(3) for wave in waves]
    return np.column_stack([*columns, *waves])


def _sway(s: Situation, joint: int, other: int, shape: tuple[float, ...]) -> Array:
    phase = 2 * np.pi * shape[0] * (s.t - s.t[0])
    return np.column_stack([np.cos(phase), np.sin(phase)])


def _turns(s: Situation, joint: int, other: int, shape: tuple[float, ...]) -> Array:
    q, v, a = (x[:, joint - 1] for x in (s.q, s.dq, s.ddq))
    waves = (np.cos(shape[0] * q), np.sin(shape[0] * q))
    # What an error of the position of so many waves does through stiffness, friction and inertia.
    return np.column_stack([wave * factor for factor in (np.ones(len(s)), v, v**2, a) for wave in waves])


_FAMILIES: dict[str, Callable[[Situation, int, int, tuple[float, ...]], Array]] = {
    "angle": _angle,
    "angles": _angles,
    "motion": _motion,
    "drag": _drag,
    "posture": _posture,
    "speed": _speed,
    "load": _load,
    "acceleration": _acceleration,
    "memory": _memory,
    "time": _time,
    "ringing": _ringing,
    "vibration": _vibration,
    "sway": _sway,
    "turns": _turns,
}
_COUNTS = {
    "angle": 8,
    "angles": 16,
    "motion": 5,
    "drag": 8,
    "posture": 8,
    "speed": 6,
    "load": 5,
    "acceleration": 3,
    "memory": 4,
    "time": KNOTS,
    "ringing": 4,
    "vibration": 8,
    "sway": 2,
    "turns": 8,
}
_WORDS = {
    "angle": "depends on the position of {who}",
    "angles": "depends on its own position and that of {who} together",
    "motion": "depends on the velocity of {who}",
    "drag": "depends on its own position and the velocity of {who} together",
    "posture": "depends on its own velocity and the position of {who} together",
    "speed": "depends on the speed of the joint",
    "load": "depends on the load of the joint",
    "acceleration": "depends on the acceleration of the joint, not in proportion",
    "memory": "remembers the velocity of the joint for a while",
    "time": "changes slowly with time",
    "ringing": "rings at {point} Hz after the motion",
    "vibration": "vibrates at {point} Hz whatever the motion",
    "sway": "swings to and fro at {point} Hz whatever the motion",
    "turns": "repeats {point} times a turn of the joint and grows with its speed",
}
