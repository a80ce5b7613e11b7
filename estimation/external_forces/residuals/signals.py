"""What an observer sees of a log: external torque by the momentum and by inverse dynamics, before the filter."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from estimation.external_forces.options import Velocity
from estimation.external_forces.residuals.dynamics import Dynamics
from estimation.external_forces.residuals.filters import external_torque, filtered, restarts, time_constant
from estimation.external_forces.residuals.friction_levels import friction_excess
from estimation.external_forces.residuals.velocity_noise import logged_noise, sliding_speed, smoothed_noise
from estimation.models.model import Model
from estimation.predictions.checked_motions import smoother_of
from estimation.predictions.prediction import Prediction
from estimation.preprocessing import Smoother
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.signals import Log

# Time constants that a log must last.
SHORTEST_LOG_CONSTANTS = 10.0
# Time constants after a start in which nothing is judged.
SETTLING_CONSTANTS = 3.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Signals:
    """Signals of a log for the observer.

    Attributes:
        t: times (N,) [s].
        q: positions (N, n).
        dq: velocities (N, n).
        torque: measured joint torque (N, n) [N m or N].
        friction: by the model, cold (N, n) [N m or N].
        variance: of the torque by the parameters' errors (N, n) [(N m)^2].
        jacobian: of the tool point in the base frame (N, 6, n).
        raw: external torque by the momentum and the model's own friction, not filtered (N, n) [N m or N].
        mean_friction: of each step, as `raw` (N, n) [N m or N].
        external: `raw` with the level of friction that is followed (N, n) [N m or N].
        direct: the same by inverse dynamics (N, n) [N m or N].
        excess: of the friction over the model's, as a share of it (N, n).
        velocity_noise: standard deviation of the velocities' noise (N, n), one for each log [rad/s or m/s].
        extrapolates: where (N, n) the prediction extrapolates.
        begins: where (N,) the observer begins anew.
    """

    t: Array
    q: Array
    dq: Array
    torque: Array
    friction: Array
    variance: Array
    jacobian: Array
    raw: Array
    mean_friction: Array
    external: Array
    direct: Array
    excess: Array
    velocity_noise: Array
    extrapolates: NDArray[np.bool_]
    begins: NDArray[np.bool_]

    @property
    def period(self) -> float:
        """Usual time step [s]."""
        return float(np.median(np.diff(self.t)))

    def levelled(self, weights: Array) -> Signals:
        """Follows the level of friction anew, with weights (N,) of the samples."""
        fast = np.abs(self.dq) >= sliding_speed(self.velocity_noise)
        # Through the whole step.
        slides = fast & np.concatenate([fast[:1], fast[:-1]])
        excess = friction_excess(self.t, self.raw, self.mean_friction, self.begins, weights, slides)
        return replace(
            self,
            external=np.where(self.begins[:, None], 0.0, self.raw + excess * self.mean_friction),
            direct=self.direct + (excess - self.excess) * self.friction,
            excess=excess,
        )


def signals_of(
    model: Model, dynamics: Dynamics, log: Log, prediction: Prediction, bandwidth: float, velocity: Velocity
) -> Signals:
    """Evaluates the momentum and the torques of a log.

    Args:
        model: the identified model.
        dynamics: of it, with the log's gravity and payload.
        log: as it was read.
        prediction: of this log by the model, with heat and extensions.
        bandwidth: of the observer [Hz].
        velocity: ``smoothed``, of the prediction's motion, or ``logged``, the log's own.

    Raises:
        InputError: a log without torque, without velocities where they are asked for, or too short.
    """
    file = log.metadata.get("file")
    if prediction.measured is None:
        raise InputError("the log has no torque", file=file, remedy="record tau1.. or i1.. with the positions")
    motion, constant = prediction.motion, time_constant(bandwidth)
    if motion.duration < SHORTEST_LOG_CONSTANTS * constant:
        raise InputError(
            f"a log of {motion.duration:.2g} s",
            file=file,
            allowed=f"{SHORTEST_LOG_CONSTANTS * constant:.2g} s or more at a bandwidth of {bandwidth:g} Hz",
        )
    q, dq, ddq = motion.q, motion.dq, motion.ddq
    cold = model.torque(q, dq, ddq, gravity=log.gravity, payload=log.payload)
    begins = _unsettled(motion.t, restarts(motion.t, constant), constant, smoother_of(model, prediction.cutoff))
    noise = smoothed_noise(log, motion, prediction.cutoff)
    if velocity == "logged":
        q, dq = logged_motion(log, motion.t)
        noise = logged_noise(dq)
        ddq = filtered(_differences(dq, motion.t, begins), motion.t, constant, begins)
    momentum, rest, friction, jacobian = dynamics(q, dq)
    # What the model adds to its terms, heat and extensions, acts at the joints as friction does.
    beta = rest + friction + (prediction.predicted - cold)
    external = external_torque(motion.t, momentum, prediction.measured - beta, begins)
    zeros = np.zeros(motion.q.shape)
    signals = Signals(
        t=motion.t,
        q=q,
        dq=dq,
        torque=prediction.measured,
        friction=friction,
        variance=dynamics.variance(q, dq, ddq),
        jacobian=jacobian,
        raw=external,
        # As the external torque, the mean of each step.
        mean_friction=np.concatenate([friction[:1], (friction[1:] + friction[:-1]) / 2.0]),
        external=external,
        direct=prediction.predicted - prediction.measured,
        excess=zeros,
        velocity_noise=noise + zeros,
        extrapolates=zeros.astype(bool) if prediction.extrapolates is None else prediction.extrapolates,
        begins=begins,
    )
    return signals.levelled(np.ones(len(motion.t)))


def logged_motion(log: Log, t: Array) -> tuple[Array, Array]:
    """Gives the logged positions and velocities (N, n) at some of the log's times.

    Raises:
        InputError: a log without velocities.
    """
    if log.dq is None:
        raise InputError(
            "the log has no velocities",
            file=log.metadata.get("file"),
            allowed="columns dq1..dqn",
            remedy="use velocities from smoothed positions: leave --velocity out",
        )
    return tuple(np.column_stack([np.interp(t, log.t, column) for column in x.T]) for x in (log.q, log.dq))  # type: ignore[return-value]


def _unsettled(t: Array, begins: NDArray[np.bool_], constant: float, smoother: Smoother) -> NDArray[np.bool_]:
    """Marks samples (N,) near the ends of each part, where smoothed positions are not reliable.

    At the start filters of the recorder settle as well: the observer waits for some of its time constants.
    """
    result = np.zeros(len(t), dtype=bool)
    edges = [*np.flatnonzero(begins).tolist(), len(t)]
    for first, last in pairwise(edges):
        own = t[first:last]
        # The momentum's change feels the smoothing's end for a period of its cut-off.
        edge = max(smoother.edge(float(own[-1] - own[0])), 1.0 / smoother.cutoff)
        result[first:last] = (own < own[0] + max(edge, SETTLING_CONSTANTS * constant)) | (own > own[-1] - edge)
    return result


def _differences(x: Array, t: Array, begins: NDArray[np.bool_]) -> Array:
    """Backward differences (N, n), zero where the observer begins."""
    slope = np.zeros_like(x)
    slope[1:] = np.diff(x, axis=0) / np.diff(t)[:, None]
    slope[begins] = 0.0
    return slope
