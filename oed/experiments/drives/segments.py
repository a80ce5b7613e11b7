"""Pieces of a motion for drives: sines, chirps, squares, steps, ramps and holds, from home back to home."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from robots.common.arrays import Array

KINDS = ("sine", "chirp", "square", "steps", "multisine", "ramps", "holds")
BLEND = 0.1
"""Time [s] at each end of a segment in which it leaves home and comes back; a tenth of it at most."""
TONES, STEEP = 6, 20.0
"""Sines of a multisine; slope of a square's edges, in those of a sine."""
MIXED = 0.5
"""Share of segments whose joints have kinds of their own."""
TURNED = 0.6
"""Standard deviation of a change of phases [rad], and of levels and shares."""
STRETCHED = 0.25
"""Standard deviation of the logarithm of a change of frequencies."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Wave:
    """The command of one joint in one segment.

    Attributes:
        kind: one of `KINDS`.
        frequencies: [Hz]; of a chirp the first and the last one, of ramps the number a second.
        phases: [rad].
        levels: weights of sines, or levels of steps and holds, between -1 and 1.
        size: largest command, as a share of the joint's reach.
    """

    kind: str
    frequencies: Array
    phases: Array
    levels: Array
    size: float

    def values(self, t: Array) -> Array:
        """Writes the command (N,) at times from 0 (N,) [s], between -1 and 1 of the reach."""
        own = self._shape(t, float(t[-1] - t[0]))
        return np.asarray(self.size * own / max(float(np.abs(own).max()), 1e-9) * window(t))

    def _shape(self, t: Array, length: float) -> Array:
        count = len(self.levels)
        if self.kind == "multisine":
            waves = np.sin(2 * np.pi * np.outer(t, self.frequencies) + self.phases)
            return np.asarray(waves @ (self.levels / np.sqrt(self.frequencies)))
        if self.kind == "chirp":
            low, high = self.frequencies
            turns = low * t + (high - low) * t**2 / (2 * length)
            return np.asarray(np.sin(2 * np.pi * turns + self.phases[0]))
        if self.kind in ("sine", "square"):
            own = np.sin(2 * np.pi * self.frequencies[0] * t + self.phases[0])
            return np.asarray(own if self.kind == "sine" else np.clip(STEEP * own, -1, 1))
        if self.kind == "steps":
            return np.asarray(self.levels[np.minimum((np.arange(len(t)) * count) // len(t), count - 1)])
        if self.kind == "ramps":
            turns = self.frequencies[0] * t + self.phases[0] / (2 * np.pi)
            return np.asarray(2 * np.abs(2 * (turns % 1) - 1) - 1)
        corners = np.linspace(0, 1, count + 1)[1:-1]
        places = np.concatenate([[0.0], np.repeat(corners, 2) + np.tile([0.0, 0.05], count - 1), [1.0]])
        return np.interp(t / length, places, np.repeat(self.levels, 2))

    def changed(self, slowest: float, fastest: float, rng: np.random.Generator) -> Wave:
        """Gives a wave near this one."""
        stretched = self.frequencies * np.exp(STRETCHED * rng.standard_normal(len(self.frequencies)))
        frequencies = np.clip(stretched, slowest, fastest)
        return replace(
            self,
            frequencies=np.sort(frequencies) if self.kind == "chirp" else frequencies,
            phases=self.phases + TURNED * rng.standard_normal(len(self.phases)),
            levels=np.clip(self.levels + TURNED * rng.standard_normal(len(self.levels)), -1, 1),
            size=float(rng.choice([self.size, 1.0])),
        )


def drawn(kind: str, shared: float, slowest: float, fastest: float, length: float, rng: np.random.Generator) -> Wave:
    """Draws a wave.

    Args:
        kind: one of `KINDS`.
        shared: frequency near which the joints' sines and squares are [Hz].
        slowest: lowest frequency [Hz].
        fastest: highest frequency [Hz].
        length: of the segment [s].
        rng: draws it.
    """
    counts = {"multisine": TONES, "chirp": 2}
    count = counts.get(kind, 1)
    frequencies = np.exp(rng.uniform(np.log(slowest), np.log(fastest), count))
    if kind == "multisine":
        frequencies = np.geomspace(slowest, fastest, TONES) * rng.uniform(0.9, 1.1, TONES)
    elif kind == "chirp":
        frequencies = np.sort(frequencies)
    elif kind in ("sine", "square"):
        frequencies = np.array([shared * rng.uniform(0.9, 1.1)])
    elif kind == "ramps":
        frequencies = np.array([rng.integers(1, 4) / length])
    steps = max(2, round(length / rng.uniform(0.2, 0.5)))
    levels = {"multisine": rng.uniform(0.3, 1.0, TONES), "steps": rng.uniform(-1, 1, steps)}
    return Wave(
        kind=kind,
        frequencies=np.minimum(frequencies, fastest),
        phases=rng.uniform(0, 2 * np.pi, count),
        levels=levels.get(kind, rng.uniform(-1, 1, 3)),
        size=float(rng.choice([1.0, 1.0, 0.5])),
    )


def candidates(
    length: float, n: int, fastest: float, count: int, rng: np.random.Generator
) -> Iterator[tuple[Wave, ...]]:
    """Draws segments of all kinds, a wave per joint.

    Args:
        length: of a segment [s].
        n: number of joints.
        fastest: highest frequency [Hz].
        count: how many.
        rng: draws them.
    """
    slowest = 1 / length
    for k in range(count):
        shared = float(np.exp(rng.uniform(np.log(slowest), np.log(fastest))))
        kinds = [KINDS[k % len(KINDS)]] * n
        if rng.uniform() < MIXED:
            kinds = list(rng.choice(KINDS, n))
        yield tuple(drawn(kind, shared, slowest, fastest, length, rng) for kind in kinds)


def offspring(
    parents: Sequence[tuple[Wave, ...]], length: float, fastest: float, count: int, rng: np.random.Generator
) -> Iterator[tuple[Wave, ...]]:
    """Draws segments near good ones: each joint's wave is one of a parent's, changed or not.

    Args:
        parents: good segments.
        length: of a segment [s].
        fastest: highest frequency [Hz].
        count: how many.
        rng: draws them.
    """
    for k in range(count):
        own = parents[k % len(parents)]
        other = parents[int(rng.integers(len(parents)))]
        mixed = [wave if rng.uniform() < 0.8 else strange for wave, strange in zip(own, other, strict=True)]
        yield tuple(wave.changed(1 / length, fastest, rng) if rng.uniform() < 0.7 else wave for wave in mixed)


def name_of(waves: Sequence[Wave]) -> str:
    """Names a segment by the kinds of its waves."""
    return "/".join(dict.fromkeys(wave.kind for wave in waves))


def chirp(t: Array, n: int, slowest: float, fastest: float) -> Array:
    """Writes sines of growing frequency, one joint a quarter of a period after the other (N, n), between -1 and 1."""
    end = t[-1] - t[0]
    phase = 2 * np.pi * (slowest * t + (fastest - slowest) * t**2 / (2 * end))
    return np.asarray(np.sin(phase[:, None] + 0.5 * np.pi * np.arange(n)) * window(t)[:, None])


def window(t: Array) -> Array:
    """Weights (N,) that rise from zero and fall to zero, smoothly."""
    length = t[-1] - t[0]
    near = np.minimum(t - t[0], t[-1] - t)
    rise = np.clip(near / min(BLEND, 0.1 * length), 0, 1)
    return np.asarray(rise**2 * (3 - 2 * rise))
