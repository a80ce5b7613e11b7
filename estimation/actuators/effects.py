"""Effects in the loop that a log may show: what they free, and values from which a search of each begins."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from robots.common.arrays import Array
from robots.drives import Backlash, ElasticGear

SOFTER = (2.0, 5.0, 15.0, 50.0)
"""Stiffnesses of a gear from which a search begins, in position gains of the law."""
LIGHTEST = 1e-4
"""Least inertia of a rotor [kg m2] that counts."""
FLANK, GAPS = 15.0, (0.005, 0.015, 0.045)
"""Stiffness of the flanks, and gaps [rad] likewise."""


class Seen(NamedTuple):
    """What a log shows of one joint: positions, speeds and delayed commands (N,), and the drive's values by name."""

    q: Array
    dq: Array
    command: Array
    values: dict[str, float]


@dataclass(frozen=True, kw_only=True)
class LoopEffect:
    """An effect of one joint.

    Attributes:
        name: in files, as the catalogue has it where both know it.
        title: for people.
        free: the parameters that it frees.
        starts: from what a log shows, the values to begin with, one dictionary an alternative.
        bends: whether the effect is there at once with these values; otherwise they are neutral, and derivatives show
            what it explains.
        states: writes the values in words, with units.
        gear: the gear that the joint has with the effect; None for the one that it has.
    """

    name: str
    title: str
    free: tuple[str, ...]
    starts: Callable[[Seen], Sequence[dict[str, float]]]
    states: Callable[[dict[str, float]], str]
    bends: bool = False
    gear: ElasticGear | None = None


def _gain(seen: Seen) -> float:
    """Torque per position error [N m/rad] of the law."""
    return seen.values.get("kp", seen.values.get("kv", 0.0) * seen.values.get("kr", 0.0))


def _saturations(seen: Seen) -> list[dict[str, float]]:
    """Limits below the torque that the law asks for along the measured motion."""
    damping = seen.values.get("kd", seen.values.get("kv", 0.0))
    asked = np.abs(_gain(seen) * (seen.command - seen.q) - damping * seen.dq)
    peak = float(np.quantile(asked, 0.99))
    return [{"torque_limit": share * peak} for share in (1.0, 0.8, 0.6, 0.45, 0.3) if peak > 0]


def _dead_bands(seen: Seen) -> list[dict[str, float]]:
    """A fit without a dead band takes it for dry friction, of which a part is given back."""
    if "kp" not in seen.values:
        return []
    gain, friction = seen.values["kp"], seen.values["coulomb"]
    return [{"dead_band": s * friction / gain, "coulomb": (1 - s) * friction} for s in (0.3, 0.6, 0.9)]


def _stops(seen: Seen) -> list[dict[str, float]]:
    """A joint that rests at a stop while its command goes on shows it at the end of its range."""
    low, high = (float(np.quantile(seen.q, share)) for share in (0.002, 0.998))
    found = []
    if seen.command.max() > high:
        found.append({"stop_upper": high})
    if seen.command.min() < low:
        found.append({"stop_lower": low})
    return found


def _critical(seen: Seen, stiffness: float) -> float:
    """Damping [N m s/rad] by which a rotor on a spring does not swing, within a factor of two."""
    return float(np.sqrt(stiffness * max(seen.values["armature"], LIGHTEST)))


def _springs(seen: Seen) -> list[dict[str, float]]:
    """Gears so many times as stiff as the law, with a twentieth to a fifth of critical damping of the rotor."""
    stiff = [factor * _gain(seen) for factor in SOFTER if _gain(seen) > 0]
    return [{"stiffness": k, "gear_damping": 0.2 * _critical(seen, k)} for k in stiff]


def _gaps(seen: Seen) -> list[dict[str, float]]:
    """Gaps between flanks that are stiff beside the law."""
    stiff = FLANK * _gain(seen)
    damping = 0.1 * _critical(seen, stiff)
    return [{"backlash": gap, "stiffness": stiff, "gear_damping": damping} for gap in GAPS if stiff > 0]


EFFECTS: tuple[LoopEffect, ...] = (
    LoopEffect(
        name="stribeck",
        title="Stribeck friction",
        free=("stribeck", "stribeck_velocity"),
        starts=lambda seen: [{"stribeck": 0.0, "stribeck_velocity": v} for v in (0.05, 0.15, 0.5)],
        states=lambda v: (
            f"{v['stribeck']:.3g} N m more friction at rest, gone above {v['stribeck_velocity']:.2g} rad/s"
        ),
    ),
    LoopEffect(
        name="load_dependent_friction",
        title="load-dependent friction",
        free=("load_coulomb",),
        starts=lambda seen: [{"load_coulomb": 0.0}],
        states=lambda v: f"friction grows by {100 * v['load_coulomb']:.3g} % of the load",
    ),
    LoopEffect(
        name="position_dependent_friction",
        title="position-dependent friction",
        free=("friction_cosine", "friction_sine"),
        starts=lambda seen: [{"friction_cosine": 0.0, "friction_sine": 0.0, "friction_order": o} for o in (1, 2, 4)],
        states=lambda v: (
            f"friction varies by {np.hypot(v['friction_cosine'], v['friction_sine']):.3g} N m "
            f"{v['friction_order']:.2g} times a turn"
        ),
    ),
    LoopEffect(
        name="current_clipping",
        title="saturation of the torque",
        free=("torque_limit",),
        starts=_saturations,
        states=lambda v: f"the torque saturates at {v['torque_limit']:.3g} N m",
        bends=True,
    ),
    LoopEffect(
        name="dead_band",
        title="dead band of the servo",
        free=("dead_band",),
        starts=_dead_bands,
        states=lambda v: f"errors within {1e3 * v['dead_band']:.3g} mrad make no torque",
        bends=True,
    ),
    LoopEffect(
        name="time_delay",
        title="delay of this joint's command",
        free=("delay",),
        starts=lambda seen: [{"delay": seen.values["delay"]}],
        states=lambda v: f"this joint's command is late by {1e3 * v['delay']:.3g} ms",
    ),
    LoopEffect(
        name="encoder_offset",
        title="zero of the encoder",
        free=("encoder_zero",),
        starts=lambda seen: [{"encoder_zero": 0.0}],
        states=lambda v: f"the encoder shows {1e3 * v['encoder_zero']:.3g} mrad at the zero of the description",
    ),
    LoopEffect(
        name="payload_change",
        title="mass of the link",
        free=("mass_factor",),
        starts=lambda seen: [{"mass_factor": 1.0}],
        states=lambda v: f"the link's mass and inertia are {v['mass_factor']:.3g} times those described",
    ),
    LoopEffect(
        name="joint_limit",
        title="a stop of the joint",
        free=("stop_upper", "stop_lower"),
        starts=_stops,
        states=lambda v: (
            "the joint touches its stop at "
            + " and ".join(f"{v[k]:.4g} rad" for k in ("stop_lower", "stop_upper") if k in v and abs(v[k]) < 100)
        ),
        bends=True,
    ),
    LoopEffect(
        name=Backlash.name,
        title=Backlash.title,
        free=("backlash", "stiffness", "gear_damping"),
        starts=_gaps,
        states=lambda v: f"motor and link have {1e3 * v['backlash']:.3g} mrad of play",
        bends=True,
        gear=Backlash(),
    ),
    LoopEffect(
        name=ElasticGear.name,
        title=ElasticGear.title,
        free=("stiffness", "gear_damping"),
        starts=_springs,
        states=lambda v: f"the gear has a stiffness of {v['stiffness']:.3g} N m/rad",
        bends=True,
        # The gear of the effect above with a gap of zero: it is compiled once.
        gear=Backlash(),
    ),
)
"""All effects, in the order in which they are tried."""

BY_NAME = {effect.name: effect for effect in EFFECTS}
