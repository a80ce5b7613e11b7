"""Motions of experiments as tables and pictures."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from robots.limits import Limits
from robots.signals import Motion

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes


def motion_frame(motion: Motion) -> pd.DataFrame:
    """Gives a motion as a table: t, q1.., dq1.., ddq1.."""
    import pandas as pd

    data = {"t": motion.t}
    for name in ("q", "dq", "ddq"):
        data |= {f"{name}{joint + 1}": getattr(motion, name)[:, joint] for joint in range(motion.n)}
    return pd.DataFrame(data)


def plot_velocities(motion: Motion, limits: Limits, ax: Axes | None = None) -> Axes:
    """Draws the joint velocities as shares of their limits over time."""
    from matplotlib.figure import Figure

    axes = ax if ax is not None else Figure(figsize=(9, 4)).subplots()
    scale = np.where(
        np.isfinite(limits.velocity) & (limits.velocity > 0), limits.velocity, np.abs(motion.dq).max(axis=0)
    )
    for joint in range(motion.n):
        axes.plot(motion.t, motion.dq[:, joint] / scale[joint], label=f"joint {joint + 1}")
    axes.set_xlabel("time [s]")
    axes.set_ylabel("velocity / limit")
    axes.legend(loc="upper right", ncols=3)
    return axes
