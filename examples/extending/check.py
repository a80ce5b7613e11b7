"""A check of one's own: joints that are slow throughout the log, so that viscous friction is hardly determined.

Run it with ``python check.py``.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from estimation.gate import CHECKS, Check, Context, Finding, Stage, check_log
from robots import load_robot, nominal_plant, simulate
from robots.signals import Motion

SLOW = 0.1  # largest speed over its limit


@CHECKS.register
class SlowJoints(Check):
    """Warns of joints that stay below a tenth of their speed limit."""

    name: ClassVar[str] = "slow_joints"
    stage: ClassVar[Stage] = Stage.SMOOTHED

    def run(self, context: Context) -> list[Finding]:
        """Compares the largest smoothed speed of each joint with its limit."""
        shares = context.smoothed.peak_speeds / context.robot.limits.velocity
        return [
            Finding(
                name="slow",
                severity="warning",
                text=f"{context.robot.joint_names[joint]} reaches {100 * shares[joint]:.2g} % of its speed limit",
                action="its viscous friction is not determined: record a faster motion",
                value=100 * float(shares[joint]),
                unit="%",
                column=f"q{joint + 1}",
                joint=int(joint) + 1,
            )
            for joint in np.flatnonzero(shares < SLOW)
        ]


if __name__ == "__main__":
    robot = load_robot("er3a")
    middle, half = (robot.limits.upper + robot.limits.lower) / 2, (robot.limits.upper - robot.limits.lower) / 2
    for slower in (1.0, 20.0):
        t = 0.004 * np.arange(10_000)
        rate = 2 * np.pi * np.arange(5, 11) / t[-1] / slower  # rad/s
        q, dq = middle + 0.5 * half * np.sin(rate * t[:, None]), 0.5 * half * rate * np.cos(rate * t[:, None])
        log = simulate(nominal_plant(robot), Motion(t=t, q=q, dq=dq, ddq=(middle - q) * rate**2), seed=1)
        print(check_log(robot, log).summary())
