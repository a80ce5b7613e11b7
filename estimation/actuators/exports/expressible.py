"""What usual simulators express of a drive: gains, limits, rotor inertia, damping, one dry friction and a delay."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimation.actuators.result import Actuators
from robots.common.arrays import Array

UNLIMITED = 1e5
"""Torque limits [N m] from which on there is none."""
FAR = 100.0
"""Stops [rad] that are farther away are none."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Expressible:
    """Numbers of all joints, and what they leave out.

    Attributes:
        kp: stiffness [N m/rad] (n,); NaN where the law has none.
        kd: damping of the drive [N m s/rad] (n,).
        law: names of the laws (n).
        armature: [kg m2] (n,).
        damping: viscous friction [N m s/rad] (n,).
        friction: dry friction [N m] (n,); friction that varies with the position by its mean over the log.
        limit: largest torque [N m] (n,); infinite without.
        delay: [s] (n,).
        offset: constant torque against the drive [N m] (n,).
        mass_factor: of the links (n,).
        left_out: what no number states, in words.
    """

    kp: Array
    kd: Array
    law: tuple[str, ...]
    armature: Array
    damping: Array
    friction: Array
    limit: Array
    delay: Array
    offset: Array
    mass_factor: Array
    left_out: tuple[str, ...]


def expressible(result: Actuators) -> Expressible:
    """Works out what a simulator can express of identified drives.

    Args:
        result: identified drives.
    """
    values, n = result.values, len(result.joints)

    def of(name: str, missing: float = 0.0) -> Array:
        return np.array([values[j].get(name, missing) for j in range(n)])

    friction, left = of("coulomb"), list[str]()
    for j, name in enumerate(result.joints):
        own = values[j]
        wave = np.array([own["friction_cosine"], own["friction_sine"]])
        if wave.any():
            q = result.traces[0].measured[:, j] if result.traces else np.zeros(1)
            at = own["friction_order"] * q
            friction[j] = max(0.0, friction[j] + float(np.mean(np.cos(at) * wave[0] + np.sin(at) * wave[1])))
            left.append(
                f"{name}: friction that varies with the position by {np.hypot(*wave):.3g} N m; its mean is written"
            )
        if own["stribeck"] > 0:
            left.append(f"{name}: {own['stribeck']:.3g} N m of Stribeck friction")
        if own["load_coulomb"] > 0:
            left.append(f"{name}: friction of {100 * own['load_coulomb']:.3g} % of the load")
        if own.get("dead_band", 0.0) > 0:
            left.append(f"{name}: a dead band of {1e3 * own['dead_band']:.3g} mrad")
        if own["encoder_zero"] != 0:
            left.append(f"{name}: an encoder zero of {1e3 * own['encoder_zero']:.3g} mrad")
        if own.get("backlash", 0.0) > 0:
            left.append(f"{name}: a backlash of {1e3 * own['backlash']:.3g} mrad")
        elif "stiffness" in own:
            left.append(f"{name}: an elastic gear of {own['stiffness']:.3g} N m/rad")
        if own.get("ki", 0.0) > 0:
            left.append(f"{name}: the integral part of its velocity loop")
        stops = [own[key] for key in ("stop_lower", "stop_upper") if abs(own[key]) < FAR]
        if stops:
            left.append(f"{name}: a stop at {', '.join(f'{stop:.4g}' for stop in stops)} rad")
    kp, kd = of("kp", np.nan), of("kd", np.nan)
    cascade = np.isnan(kp)
    # A cascade without integral is PD control: kv kr (q_ref - q) - kv dq.
    kp = np.where(cascade, of("kv") * of("kr"), kp)
    kd = np.where(cascade, of("kv"), kd)
    limit = of("torque_limit", np.inf)
    return Expressible(
        kp=kp,
        kd=kd,
        law=result.law,
        armature=of("armature"),
        damping=of("viscous"),
        friction=friction,
        limit=np.where(limit < UNLIMITED, limit, np.inf),
        delay=of("delay"),
        offset=of("torque_offset"),
        mass_factor=of("mass_factor", 1.0),
        left_out=tuple(left),
    )
