"""What a healthy log says of the residual: error model, threshold and levels of the localisation."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimation.external_forces.localisation import Localiser, fit_localiser
from estimation.external_forces.residuals.filters import filtered, time_constant
from estimation.external_forces.residuals.signals import SETTLING, Signals, Velocity
from estimation.external_forces.thresholds.alarm_rates import AlarmThreshold, alarm_threshold
from estimation.external_forces.thresholds.error_models import ErrorModel, fit_error_model
from estimation.models.model import Model
from robots.common.errors import InputError
from robots.common.files import existing_file

Array = NDArray[np.float64]

# Samples of the healthy log from which the levels of the localisation are estimated.
MOST_ROWS = 4000
ROUNDS = 8
# Where the first round cuts residuals off, and a normal distribution's standard deviation over its median size.
WINSOR, NORMAL = 3.0, 1.4826


@dataclass(frozen=True, kw_only=True, eq=False)
class Calibration:
    """Settings of the observer, learned from a healthy robot.

    Attributes:
        bandwidth: of the observer [Hz].
        velocity: what velocities it was learned with.
        period: usual sample period of the healthy logs [s].
        errors: standard deviation of the residual by the motion.
        threshold: of the squared distance of the residual from zero.
        localiser: levels from which joints react.
        friction_square: mean square of each joint's friction (n,) [(N m)^2].
        own: whether the log itself served, without its contacts.
    """

    bandwidth: float
    velocity: Velocity
    period: float
    errors: ErrorModel
    threshold: AlarmThreshold
    localiser: Localiser
    friction_square: Array
    own: bool = False

    @property
    def constant(self) -> float:
        """Time constant of the observer [s]."""
        return time_constant(self.bandwidth)

    def to_dict(self) -> dict[str, Any]:
        """Writes it as plain data."""
        return {
            "bandwidth_hz": self.bandwidth,
            "velocity": self.velocity,
            "period": self.period,
            "errors": self.errors.to_dict(),
            "threshold": asdict(self.threshold),
            "localiser": {
                "joint": self.localiser.joint.tolist(),
                "link": self.localiser.link.tolist(),
                "tool": self.localiser.tool,
            },
            "friction_square": self.friction_square.tolist(),
            "own_log": self.own,
        }

    @staticmethod
    def from_dict(data: Mapping[str, Any]) -> Calibration:
        """Reads what `to_dict` wrote.

        Raises:
            InputError: anything else.
        """
        try:
            levels = data["localiser"]
            return Calibration(
                bandwidth=float(data["bandwidth_hz"]),
                velocity=data["velocity"],
                period=float(data["period"]),
                errors=ErrorModel.from_dict(data["errors"]),
                threshold=AlarmThreshold(**data["threshold"]),
                localiser=Localiser(
                    joint=np.array(levels["joint"], dtype=float),
                    link=np.array(levels["link"], dtype=float),
                    tool=float(levels["tool"]),
                ),
                friction_square=np.array(data["friction_square"], dtype=float),
                own=bool(data["own_log"]),
            )
        except (KeyError, TypeError, ValueError) as error:
            raise InputError(f"no calibration of a force observer ({type(error).__name__}: {error})") from error


def read_calibration(path: str | Path, joints: int) -> Calibration:
    """Reads the calibration in a ``forces.json``, or in the folder that holds one.

    Args:
        path: the file or its folder.
        joints: of the robot.

    Raises:
        InputError: no such file, another content, or a calibration of another number of joints.
    """
    file = Path(path)
    file = file / "forces.json" if file.is_dir() else file
    try:
        data = json.loads(existing_file(file).read_text(encoding="utf-8"))
        found = Calibration.from_dict(data["calibration"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(
            f"holds no calibration of oed force ({type(error).__name__})", file=file, remedy="give a forces.json"
        ) from error
    except InputError as error:
        raise InputError(error.problem, file=file, remedy=error.remedy or "give a forces.json") from error
    if len(found.errors.level) != joints:
        raise InputError(f"a calibration of {len(found.errors.level)} joints", file=file, allowed=f"{joints}")
    return found


@dataclass(frozen=True, eq=False)
class Observed:
    """Filtered signals of one log.

    Attributes:
        residual: external torque (N, n) [N m or N].
        deviation: its standard deviation on a healthy robot (N, n) [N m or N].
        statistic: squared distance of the residual from zero (N,).
    """

    residual: Array
    deviation: Array
    statistic: Array


def observe(signals: Signals, errors: ErrorModel, bandwidth: float) -> Observed:
    """Filters the external torque of a log and scales it by the error model."""
    lag = _lag(signals, bandwidth)
    residual = lag(signals.external, from_zero=True)
    deviation = errors.deviation(lag(errors.amplitudes(signals.dq, signals.friction, signals.variance)))
    return Observed(residual, deviation, errors.statistic(residual, deviation))


def calibrate_signals(
    model: Model,
    healthy: Sequence[Signals],
    *,
    bandwidth: float,
    velocity: Velocity,
    false_alarms: float,
    own: bool = False,
    in_fit: bool = False,
) -> Calibration:
    """Learns the settings from logs of a healthy robot.

    Args:
        model: the identified model.
        healthy: signals of the logs.
        bandwidth: of the observer [Hz].
        velocity: what velocities the signals have.
        false_alarms: an hour.
        own: whether the logs may contain contacts: those are left out, until nothing changes any more.
        in_fit: whether the model was fitted to these logs, so that the parameters' errors hardly show in them.

    Raises:
        InputError: too little data.
    """
    whole = _joined(healthy)
    lag = _lag(whole, bandwidth)
    residual = lag(whole.external, from_zero=True)
    # The filter begins with zero, and its first moments know little of the residual.
    settled = _since(whole) > SETTLING * time_constant(bandwidth)
    counts = settled.copy()
    for number in range(ROUNDS if own else 1):
        first = own and number == 0
        # Contacts are not known at first: they must not enter the size of the errors.
        fitted = _winsorised(residual, settled) if first else residual
        errors = fit_error_model(model, fitted, whole.dq, whole.friction, whole.variance, counts, lag, in_fit=in_fit)
        w = lag(errors.amplitudes(whole.dq, whole.friction, whole.variance * (not in_fit)))
        deviation = errors.deviation(w)
        statistic = errors.statistic(residual, deviation)
        threshold = alarm_threshold(statistic[counts], whole.period, false_alarms, robust=first)
        reach = max(round(3.0 * time_constant(bandwidth) / whole.period), 1)
        kept = settled & ~_near(statistic > threshold.value, reach)
        if (kept == counts).all():
            break
        if own:
            counts = kept
    rows = np.flatnonzero(counts)[:: max(1, int(counts.sum()) // MOST_ROWS)]
    covariance = errors.covariance(deviation[rows])
    localiser = fit_localiser(model.robot.chain, whole.q[rows], residual[rows], covariance, whole.jacobian[rows])
    return Calibration(
        bandwidth=bandwidth,
        velocity=velocity,
        period=whole.period,
        errors=errors,
        threshold=threshold,
        localiser=localiser,
        friction_square=np.maximum((whole.friction**2).mean(axis=0), np.finfo(float).tiny),
        own=own,
    )


def _winsorised(residual: Array, counts: NDArray[np.bool_]) -> Array:
    """Cuts residuals (N, n) off at three robust standard deviations."""
    level = WINSOR * NORMAL * np.median(np.abs(residual[counts]), axis=0)
    return np.clip(residual, -level, level)


def _lag(signals: Signals, bandwidth: float) -> Callable[..., Array]:
    constant = time_constant(bandwidth)

    def lag(x: Array, *, from_zero: bool = False) -> Array:
        return filtered(x, signals.t, constant, signals.begins, from_zero=from_zero)

    return lag


def _since(signals: Signals) -> Array:
    """Time (N,) since the observer began [s]."""
    starts = np.flatnonzero(signals.begins)
    return signals.t - signals.t[starts[np.cumsum(signals.begins) - 1]]


def _near(marked: NDArray[np.bool_], reach: int) -> NDArray[np.bool_]:
    """Marks samples within `reach` samples of marked ones."""
    return np.convolve(marked.astype(float), np.ones(2 * reach + 1), mode="same") > 0.5


def _joined(parts: Sequence[Signals]) -> Signals:
    """One after the other, on one clock that goes on."""
    if len(parts) == 1:
        return parts[0]
    arrays = {name: np.concatenate([getattr(part, name) for part in parts]) for name in Signals.__dataclass_fields__}
    step, times, end = parts[0].period, [], 0.0
    for part in parts:
        times.append(part.t - part.t[0] + end)
        end = float(times[-1][-1]) + step
    return Signals(**{**arrays, "t": np.concatenate(times)})
