"""A start without simulation: the balance of torques along the measured motion, for each delay."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import lsq_linear

from estimation.actuators.freedom import Freedom
from estimation.actuators.runs import Run
from estimation.preprocessing.resampling import resample
from estimation.preprocessing.smoothing import low_pass, smooth
from robots.common.arrays import Array
from robots.drives.simulation import followed

CUTOFF, HIGHEST = 0.1, 20.0
"""Cut-off as a share of the sampling rate, and its largest value [Hz]: a start needs no more."""
DELAYS = np.concatenate([np.arange(0.0, 0.02, 0.002), np.arange(0.02, 0.1, 0.005)])
"""Delays that are tried [s]."""
ROWS = 2000
"""Rows of the balance that are used, evenly over the runs."""
RIDGE = 1e-3
"""Weight of the description's values, relative to the mean square of the columns: what no row shows stays there."""


def started(freedom: Freedom, values: Sequence[Array], runs: Sequence[Run]) -> tuple[Array, ...]:
    """Gives values to start from: least squares on torques, of the delay that leaves the least.

    Drives with states of their own start from their given values, because their states are not measured.

    Args:
        freedom: what is free.
        values: of the description.
        runs: what was recorded.
    """
    fleet = freedom.fleet
    if any(dynamics.parted for dynamics in fleet.dynamics):
        # Where the links are is not measured: the start is that of rigid gears.
        rigid = fleet.rigid
        own = tuple(p for p in freedom.free if all(p.name in rigid.drives[j].names for j in p.joints))
        known = fleet.taken(started(Freedom(fleet=rigid, free=own), rigid.taken(values, fleet), runs), rigid)
        mine = [p for p in freedom.free if p not in own]
        for parameter in mine:
            for joint in parameter.joints:
                known = fleet.changed(known, parameter.name, [joint], fleet.of(values, joint, parameter.name))
        return known
    if any(len(dynamics.owners) for dynamics in fleet.dynamics):
        return tuple(values)
    linear = [k for k, parameter in enumerate(freedom.free) if parameter.name != "delay"]
    delay = next((k for k, parameter in enumerate(freedom.free) if parameter.name == "delay"), None)
    motions = [_motion(run) for run in runs]
    share = max(1, sum(len(run.t) for run in runs) // ROWS)
    best: tuple[float, Array] | None = None
    theta = freedom.theta(values)
    for candidate in DELAYS if delay is not None else (0.0,):
        trial = theta.copy()
        if delay is not None:
            trial[delay] = candidate / freedom.free[delay].size
        now = freedom.values(trial, values)
        matrix, right = [], []
        for run, motion in zip(runs, motions, strict=True):
            for columns, residual in _balance(freedom, now, run, motion, share):
                matrix.append(columns[:, linear])
                right.append(residual)
        A, b = np.concatenate(matrix), -np.concatenate(right)
        gram = A.T @ A
        size = np.maximum(np.diag(gram), 1e-12 * np.trace(gram))
        root = np.linalg.cholesky(gram + RIDGE * np.diag(size)).T
        lower, upper = (bound[linear] - trial[linear] for bound in freedom.bounds)
        found = lsq_linear(root, np.linalg.solve(root.T, A.T @ b), (lower - 1e-9, upper + 1e-9), method="bvls")
        cost = float(((A @ found.x - b) ** 2).sum())
        if best is None or cost < best[0]:
            trial[linear] += found.x
            best = cost, np.clip(trial, *freedom.bounds)
    assert best is not None
    return freedom.values(best[1], values)


def _motion(run: Run) -> tuple[Array, Array, Array, float]:
    """Smoothed positions, velocities and accelerations (N, n), and the cut-off [Hz]."""
    rate = (len(run.t) - 1) / (run.t[-1] - run.t[0])
    cutoff = min(CUTOFF * rate, HIGHEST)
    motion = smooth(resample(run.t, run.q), cutoff)
    return motion.q, motion.dq, motion.ddq, cutoff


def _balance(
    freedom: Freedom, values: Sequence[Array], run: Run, motion: tuple[Array, Array, Array, float], share: int
) -> list[tuple[Array, Array]]:
    """Derivatives of the balance by the free parameters, and the balance itself, joint by joint."""
    q, dq, ddq, cutoff = motion
    found = []
    period = float(np.median(np.diff(run.t)))
    rows = slice(len(q) // 50, len(q) - len(q) // 50, share)
    for chain, columns in enumerate(freedom.fleet.columns):
        dynamics, p = freedom.fleet.dynamics[chain], values[chain]
        layout, directions = dynamics.layout, freedom.directions[chain]
        edges = np.append(run.t, run.t[-1] + period) - period / 2
        delays = p[layout.of("delay")]
        means = low_pass(run.of(columns).means(edges, delays)[0], period, cutoff)
        own = q[:, columns] - p[layout.of("encoder_zero")]
        signals = [signal[rows] for signal in (own, dq[:, columns], ddq[:, columns], means)]
        count, around = len(signals[0]), run.situations[chain] if run.situations else None
        full = followed(p, around)
        base = np.zeros((count, 0)) if around is None else around.at(run.t[rows])
        residual, _, by_own, by_mass, *_ = dynamics.slopes(
            *signals, np.zeros((count, 0)), np.broadcast_to(full, (count, len(full))), base
        )
        mass = layout.of("mass_factor")
        for joint in range(len(columns)):
            mine = layout.of_joints[joint]
            matrix = by_own[:, 0, mine] @ directions[mine] + by_mass[:, joint] @ directions[mass]
            found.append((matrix, residual[:, joint, 0]))
    return found
