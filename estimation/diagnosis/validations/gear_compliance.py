"""Gear compliance from encoders on both sides of the gear."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.stats import t as student

from estimation.diagnosis.calibration import MIN_COMPLIANCE_ENERGY
from estimation.diagnosis.findings import Finding, Gain, Parameter
from estimation.diagnosis.recordings.recording import Recording
from estimation.models.extension import Extension
from estimation.uncertainty.blocks import block_numbers, jackknife_errors
from estimation.uncertainty.correlations import effective_rows
from estimation.uncertainty.quantiles import student_95
from robots.common.arrays import Array
from robots.signals import Log
from robots.terms.base import force_unit, length_unit
from robots.terms.effect_bases.parameters import DAMPING_RATIO
from robots.terms.effect_bases.unknown_rotor import KNOWN_ROTOR
from robots.terms.effects import EFFECTS
from robots.terms.situations.situation import Situation

EFFECT = "joint_elasticity"
ALIGNED = 2  # iterations of the encoder delay
STIFFEST = 1e-12  # compliance below which a gear is rigid [rad/(N m) or m/N]
FEWEST, MOST, BLOCK = 10, 30, 4.0  # least and largest number of blocks, length of a block in between [s]


@dataclass(frozen=True, eq=False)
class MeasuredCompliance:
    """Compliance of one gear, measured by its two encoders.

    Attributes:
        finding: the finding; its errors are those of the link position over the standard deviation of the deflection.
        extension: effect `joint_elasticity` with this compliance.
        coordinate: gear load (M,) [N m or N].
        before: link position, measured minus predicted with a rigid gear (M,) [rad or m].
        after: the same with an elastic gear (M,).
    """

    finding: Finding
    extension: Extension
    coordinate: Array
    before: Array
    after: Array


@dataclass(frozen=True, eq=False)
class _Signals:
    """Signals of one joint, with the encoder delay [s] removed.

    `deflection` and `load` are (M,). `rest` (M, k) has the other regressors, `rival` (M, 2) those of a rival cause.
    """

    t: Array
    deflection: Array
    rest: Array
    load: Array
    rival: Array
    delay: float


def measure_gear_compliance(
    now: Situation,
    recording: Recording,
    logs: Sequence[Log],
    *,
    false_alarm: float,
    unseen: tuple[Situation, Recording, Sequence[Log]] | None = None,
) -> tuple[MeasuredCompliance, ...]:
    """Finds the gears that deflect under load, on joints with logged link positions.

    q - q_link = c load + d dq + h sign(dq) + zero + eccentricity: c is the compliance, d the delay of the link encoder
    behind the motor encoder, h half the lost motion. The eccentricity has one period per turn of the link. The load is
    that of the base model's rigid body. Standard errors are by the jackknife over blocks, because errors of the
    formula are correlated in time.

    Args:
        now: state of the base model along the recording.
        recording: logs on one time grid.
        logs: logs of the recording.
        false_alarm: probability of a false finding on a robot with rigid gears.
        unseen: state, recording and logs of held-out data, to measure the gain on. By default each block is predicted
            from the others.

    Returns:
        The gears with significant compliance.
    """
    robot = now.robot
    joints = [
        j + 1
        for j in range(robot.n)
        if np.ptp(recording.q[:, j]) > 0 and np.isfinite(gear_deflection(recording, logs, j + 1)).any()
    ]
    found = []
    for joint in joints:
        # Delay times velocity holds at constant velocity only, so the delay is removed and estimated again.
        delay = 0.0
        for _ in range(ALIGNED):
            signals = _signals(now, gear_deflection(recording, logs, joint, delay), joint, delay)
            delay += float(_solve(np.column_stack([signals.rest, signals.load]), signals.deflection)[1])
        signals = _signals(now, gear_deflection(recording, logs, joint, delay), joint, delay)
        other = None
        if unseen is not None:
            again = gear_deflection(unseen[1], unseen[2], joint, delay)
            other = _signals(unseen[0], again, joint, delay) if np.isfinite(again).any() else None
        result = _test_joint(now, signals, other, joint, len(joints), false_alarm)
        if result is not None:
            found.append(result)
    return tuple(found)


def gear_deflection(recording: Recording, logs: Sequence[Log], joint: int, delay: float = 0.0) -> Array:
    """Computes a joint's motor position minus its link position.

    Args:
        recording: logs on one time grid.
        logs: logs of the recording.
        joint: joint, counted from 1.
        delay: delay of the link encoder behind the motor encoder [s].

    Returns:
        Gear deflection (N,) [rad or m]. It is NaN without link positions, and where the direction of motion is unknown,
        because the side of the lost motion is unknown there, too.
    """
    result = np.full(len(recording), np.nan)
    ordered = sorted(logs, key=lambda log: float(log.t[0]))
    for log, run in zip(ordered, recording.runs, strict=True):
        if log.qlink is not None and np.isfinite(log.qlink[:, joint - 1]).all():
            t = recording.t[run]
            # Linear interpolation would be biased during acceleration.
            own, link = (CubicSpline(log.t, signal[:, joint - 1]) for signal in (log.q, log.qlink))
            result[run] = own(t) - link(np.clip(t + delay, log.t[0], log.t[-1]))
    result[recording.sign_unknown[:, joint - 1]] = np.nan
    return result


def _signals(now: Situation, measured: Array, joint: int, delay: float) -> _Signals:
    """Evaluates the signals of one joint on the rows with a measured deflection."""
    j = joint - 1
    rows = np.isfinite(measured)
    q, dq, sign = (values[rows, j] for values in (now.q, now.dq, now.sign))
    turns = now.robot.chain.joints[j].kind == "revolute"
    x = q - q.mean()
    once = (np.sin(x), np.cos(x)) if turns else (x, x**2)
    twice = (np.sin(2 * x), np.cos(2 * x)) if turns else (x**3, x**4)
    return _Signals(
        t=now.t[rows],
        deflection=measured[rows],
        rest=np.column_stack([np.ones_like(q), dq, sign, *once]),
        load=now.load[:, joint - 1][rows],
        rival=np.column_stack(twice),
        delay=delay,
    )


def _test_joint(
    now: Situation, own: _Signals, other: _Signals | None, joint: int, tests: int, false_alarm: float
) -> MeasuredCompliance | None:
    """Tests an elastic gear of one joint against a rigid gear, and against an eccentric encoder."""
    w = own.deflection
    alone, whole = own.rest, np.column_stack([own.rest, own.load])
    hidden = own.load - alone @ _solve(alone, own.load)
    if not hidden @ hidden > MIN_COMPLIANCE_ENERGY * np.sum((own.load - own.load.mean()) ** 2):
        return None
    blocks = _blocks(own.t)
    values = _solve(whole, w)
    folds = [_solve(whole[~b], w[~b]) for b in blocks]
    error = jackknife_errors(np.stack(folds))
    freedom = len(blocks) - 1
    quantile = student_95(freedom)
    p_value = min(tests * float(student.sf(values[-1] / max(error[-1], 1e-300), freedom)), 1.0)
    if not (values[-1] > STIFFEST and p_value <= false_alarm):
        return None
    base = [_solve(alone[~b], w[~b]) for b in blocks]
    if other is None:
        errors = [
            (w[b] - alone[b] @ one, w[b] - whole[b] @ two) for b, one, two in zip(blocks, base, folds, strict=True)
        ]
        level = w
    else:
        one, two = _solve(alone, w), values
        level, both = other.deflection, np.column_stack([other.rest, other.load])
        errors = [(level[b] - other.rest[b] @ one, level[b] - both[b] @ two) for b in _blocks(other.t)]
    gain = _gain(errors, level)
    if gain.ci95[1] < 0:
        return None
    residual = w - whole @ values
    count = effective_rows(residual)
    squares = [float(np.sum((w - X @ _solve(X, w)) ** 2)) for X in (alone, np.column_stack([alone, own.rival]))]
    better, worse = (count * float(np.log(s / (residual @ residual))) for s in squares)
    robot = now.robot
    force, length = force_unit(robot, joint - 1), length_unit(robot, joint - 1)
    parameters = tuple(
        _parameter(name, known + factor * values[i], abs(factor) * error[i], unit, quantile)
        for name, i, factor, known, unit in (
            ("compliance", len(values) - 1, 1.0, 0.0, f"{length}/({force})"),
            ("lost_motion", 2, 2.0, 0.0, length),
            ("encoder_delay", 1, 1.0, own.delay, "s"),
        )
    )
    finding = Finding(
        effect=EFFECT,
        joint=joint,
        parameters=parameters,
        p_value=p_value,
        delta_bic=better - float(np.log(count)),
        gain=gain,
        rivals=(("encoder_eccentricity", worse + float(np.log(count))),),
        sentence=_sentence(joint, parameters, force, length),
        visible=float(hidden @ hidden) / float(own.load @ own.load),
        coordinate=f"load of joint {joint} [{force}]",
        measured_by="qlink",
    )
    return MeasuredCompliance(
        finding=finding,
        extension=_extension(now, joint, float(values[-1]), float(error[-1])),
        coordinate=own.load,
        before=-(residual + own.load * values[-1]),
        after=-residual,
    )


def _blocks(t: Array) -> list[NDArray[np.bool_]]:
    """Cuts rows at times (M,) [s] into consecutive blocks of about equal size; returns a mask (M,) of each."""
    count = int(np.clip((len(t) * float(np.median(np.diff(t)))) / BLOCK, FEWEST, MOST))
    number = block_numbers(len(t), count)
    return [number == k for k in range(count)]


def _gain(errors: Sequence[tuple[Array, Array]], level: Array) -> Gain:
    """Computes the fall of the error over the gear deflection's standard deviation, with its 95 % interval.

    `errors` are, per block, those without and with the effect, each (M_b,); `level` is the deflection (M,).
    """
    squares = np.array([[float(one @ one), float(two @ two), float(len(one))] for one, two in errors])
    sums = np.vstack([squares.sum(axis=0), squares.sum(axis=0) - squares])
    shares = np.sqrt(sums[:, :2] / sums[:, 2:]) / max(float(level.std()), 1e-300)
    before, after = shares[0].tolist()
    falls = -np.diff(shares[1:], axis=1)[:, 0]
    reach = student_95(len(falls) - 1) * float(jackknife_errors(falls))
    return Gain(nrmse_before=before, nrmse_after=after, ci95=(before - after - reach, before - after + reach))


def _solve(X: Array, w: Array) -> Array:
    scale = np.maximum(np.linalg.norm(X, axis=0), 1e-300)
    return np.asarray(np.linalg.lstsq(X / scale, w, rcond=1e-9)[0] / scale)


def _parameter(name: str, value: float, error: float, unit: str, quantile: float) -> Parameter:
    reach = quantile * error
    return Parameter(
        name=name,
        value=float(value),
        unit=unit,
        standard_error=float(error),
        ci95=(float(value - reach), float(value + reach)),
        determined=bool(reach < abs(value)),
    )


def _extension(now: Situation, joint: int, compliance: float, error: float) -> Extension:
    """Builds the effect `joint_elasticity`, with the same dynamic stiffness and the known rotor inertia."""
    low, high = EFFECTS[EFFECT].bounds(now, joint)[0]
    stiffness = float(np.clip(1.0 / compliance, low, high)) if compliance > 0 else high
    return Extension(
        effect=EFFECT,
        joint=joint,
        shape=(stiffness, KNOWN_ROTOR, DAMPING_RATIO),
        coefficients=np.array([compliance]),
        covariance=np.diag([error**2, np.inf, np.inf, np.inf]),
    )


def _sentence(joint: int, parameters: Sequence[Parameter], force: str, length: str) -> str:
    compliance, motion, delay = parameters
    low, high = compliance.ci95
    span = f"{_three(1 / high)} to {_three(1 / low)}" if low > 0 else f"above {_three(1 / high)}"
    text = (
        f"The gear of joint {joint} winds up under load, as measured by its two encoders: stiffness "
        f"{_three(1 / compliance.value)} ({span}) {force}/{length}"
    )
    if motion.determined:
        text += f", lost motion {abs(motion.value):.2g} {length} at reversals"
    text += "."
    if delay.determined:
        which = "later" if delay.value > 0 else "earlier"
        text += f" The link encoder is logged {1e3 * abs(delay.value):.2f} ms {which} than the motor encoder."
    return text


def _three(value: float) -> str:
    """Formats with three significant digits, without an exponent for usual stiffnesses."""
    return f"{float(f'{value:.3g}'):.9g}"
