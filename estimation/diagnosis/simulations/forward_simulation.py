"""Forward simulation of a stretch of held-out data under a position loop, without and with the findings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import butter, sosfiltfilt

from estimation.diagnosis.base_models.payload_and_gravity import build_situation
from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.recordings.recording import Recording, cut_recording
from estimation.diagnosis.simulations.simulation_result import Curves, Simulation
from estimation.diagnosis.validations.gain_intervals import model_columns
from estimation.diagnosis.validations.held_out_errors import HeldOutResult, found_in_one_log_only, split_runs
from estimation.regressions.moments import Moments
from robots.common.arrays import Array
from robots.plants.closed_loop import Driven, Loop, Reference, Tangent, drive
from robots.regressor import TorqueModel
from robots.terms.discrepancies.patterns import PREFIX
from robots.terms.effect_bases.capabilities import Persistence, Reading
from robots.terms.effect_bases.gear_load import ExtraGearLoad, with_gear_load
from robots.terms.effect_bases.static import StaticJointEffect
from robots.terms.situations.flange_body import with_body
from robots.terms.situations.of_model import sign_of
from robots.terms.situations.situation import Situation

# Cut-off of the simulated deviation on which effects depend, over the loop's bandwidth. Above it the deviation is noise
# of the driving torque, and its derivatives would disturb the effects.
SEEN = 3.0
# Least loop inertia, as a share of torque RMS over acceleration RMS.
SLUGGISH = 0.02
# Width of the sign [rad/s or m/s] at which it is zero at any velocity.
NO_SIGN = 1e12


@dataclass(frozen=True, kw_only=True, eq=False)
class FittedRobot:
    """Base model and effects with fitted parameters.

    Attributes:
        model: base model.
        columns: indices of its base parameters.
        values: values of the base parameters (b,).
        members: effects; empty for the base model alone.
        coefficients: coefficients (k,) of each effect.
        base_values_for_effects: base parameters (b,) from which effects compute load and friction; None for `values`.
        extra_load: load of the effects on the gears; None without any.
        since: time origin of phases [s]; None for the first sample of a motion.
    """

    model: TorqueModel
    columns: tuple[int, ...]
    values: Array
    members: Sequence[FittedEffect] = ()
    coefficients: Sequence[Array] = ()
    base_values_for_effects: Array | None = None
    extra_load: ExtraGearLoad | None = None
    since: float | None = None

    def at(self, part: Recording, motion: tuple[Array, Array, Array]) -> Situation:
        """Returns the state of the base model along a motion.

        Args:
            part: recording with the same times, (N,).
            motion: positions, velocities and accelerations, (N, n) each.
        """
        return self._by(self.values, part, motion)

    def felt_at(self, part: Recording, motion: tuple[Array, Array, Array]) -> Situation:
        """Returns the state on which the effects depend, along a motion.

        Args:
            part: recording with the same times, (N,).
            motion: positions, velocities and accelerations, (N, n) each.
        """
        now = self._by(
            self.values if self.base_values_for_effects is None else self.base_values_for_effects, part, motion
        )
        return with_gear_load(now, self.extra_load)

    def _by(self, values: Array, part: Recording, motion: tuple[Array, Array, Array]) -> Situation:
        q, dq, ddq = motion
        now = build_situation(replace(part, q=q, dq=dq, ddq=ddq), self.model, values, self.columns)
        return replace(now, since=self.since)

    def base(self, part: Recording, motion: tuple[Array, Array, Array]) -> Array:
        """Computes the base model's torque (N, n) along a motion of one log, with the log's gravity and payload."""
        own = self.model.under(part.gravities[0]).torque(*motion, self.values, columns=self.columns)
        return own + self.payload_torque(part, motion)

    def payload_torque(self, part: Recording, motion: tuple[Array, Array, Array]) -> Array:
        """Computes the torque (N, n) of the payload of one log along a motion."""
        body = with_body(self.model, np.zeros(self.model.size), part.bodies[0])
        columns = np.flatnonzero(body).tolist()
        if not columns:
            return np.zeros_like(motion[0])
        return self.model.under(part.gravities[0]).torque(*motion, body[columns], columns=columns)

    def beyond(self, now: Situation, members: Sequence[int]) -> Array:
        """Computes the torque (N, n) [N m or N] of the effects with these indices."""
        total = np.zeros_like(now.q)
        for i in members:
            member = self.members[i]
            joints, parts = member.hypothesis.columns(now, member.shape)
            for j, X in zip(joints, parts, strict=True):
                total[:, j] += X @ self.coefficients[i]
        return total

    def unmeasured_torque(self, now: Situation, reading: Array) -> tuple[FittedRobot, Array]:
        """Removes effects that distort only the measured torque.

        Args:
            now: state on which the effects depend.
            reading: measured torque (N, n) [N m or N].

        Returns:
            The robot without these effects, and the undistorted torque (N, n).
        """
        wrong = [i for i, member in enumerate(self.members) if member.hypothesis.effect.reading is Reading.DISTORTS]
        plain = [i for i in range(len(self.members)) if i not in wrong]
        beyond, torque = self.beyond(now, plain), reading.copy()
        for i in wrong:
            effect, joint = self.members[i].hypothesis.effect, self.members[i].hypothesis.joint
            assert isinstance(effect, StaticJointEffect)
            assert joint is not None
            own = (reading - beyond)[:, joint - 1]
            true = effect.undone(now, joint, self.coefficients[i], self.members[i].shape, own)
            torque[:, joint - 1] += true - own
        members, coefficients = [self.members[i] for i in plain], [self.coefficients[i] for i in plain]
        return replace(self, members=members, coefficients=coefficients), torque


def simulate_both(
    before: FittedRobot, after: FittedRobot, whole: Recording, rows: slice, loop: Loop | None = None
) -> Simulation | None:
    """Simulates a stretch of held-out data with both models under the same position loop.

    Args:
        before: base model.
        after: extended model.
        whole: held-out data, with the earlier data on which heat and other histories depend.
        rows: rows of the stretch, within one log.
        loop: position loop; 5 Hz, critically damped, by default.

    Returns:
        Controller corrections and position errors; None if a simulation diverges.
    """
    loop = loop or Loop()
    part = cut_recording(whole, rows)
    inertia = _loop_inertia(before, part)
    # The recording's torque excludes the log's payload, but the driving torque moves it.
    driving = part.tau + before.payload_torque(part, (part.q, part.dq, part.ddq))
    reference = Reference(step=part.step, q=part.q, dq=part.dq, ddq=part.ddq, torque=driving)
    driven = [_driven(plant, whole, rows, reference, inertia, loop) for plant in (before, after)]
    if not all(np.isfinite(run.change) for run, _ in driven):
        return None
    notes = []
    if any(run.filled.any() for run, _ in driven):
        notes.append("The fitted inertia matrix is not positive definite, so the loop also feeds back acceleration.")
    if not driven[1][1]:
        notes.append(
            "The torque of the findings was computed along the measured motion, because the simulated motion did not "
            "converge with it."
        )
    if not all(run.converged for run, _ in driven):
        notes.append("The simulated motion did not converge to 1 %.")
    level = np.maximum(np.sqrt(np.mean(part.tau**2, axis=0)), 1e-300)
    shares, motions = [], []
    for run, _ in driven:
        shares.append(np.sqrt(np.mean(run.correction**2, axis=0)) / level)
        motions.append(np.sqrt(np.mean((run.q - part.q) ** 2, axis=0)))
    (one, _), (two, _) = driven
    return Simulation(
        start=float(part.t[0]),
        end=float(part.t[-1]),
        loop=loop,
        torque=(shares[0], shares[1]),
        motion=(motions[0], motions[1]),
        note=" ".join(notes),
        curves=Curves(
            t=part.t,
            measured=part.tau,
            torque=(part.tau + one.correction, part.tau + two.correction),
            deviation=(one.q - part.q, two.q - part.q),
        ),
    )


def _driven(
    plant: FittedRobot, whole: Recording, rows: slice, reference: Reference, inertia: Array, loop: Loop
) -> tuple[Driven, bool]:
    """Simulates one robot; the flag says whether its effects were evaluated along the simulated motion."""
    part = cut_recording(whole, rows)
    measured = plant.at(part, (part.q, part.dq, part.ddq))
    plant, torque = plant.unmeasured_torque(plant.felt_at(part, (part.q, part.dq, part.ddq)), reference.torque)
    reference = replace(reference, torque=torque)
    width, coulomb, tangent = measured.velocity_scale, _coulomb(measured), _tangent(measured)
    effects = _Effects(plant, whole, rows, SEEN * loop.bandwidth)

    def follow(moving: bool) -> Driven:
        def resistance(q: Array, dq: Array, ddq: Array) -> tuple[Array, Array]:
            base = plant.base(part, (q, dq, ddq))
            smooth, turning = effects.along((q, dq, ddq)) if moving else effects.measured
            return base - coulomb * sign_of(dq, width) + smooth, coulomb + turning

        return drive(reference, resistance, tangent, inertia=inertia, sign_width=width, loop=loop)

    result = follow(bool(plant.members))
    if plant.members and not result.converged:
        return follow(False), False
    return result, True


class _Effects:
    """Torque of the effects near the measured motion: a smooth part, and a factor of the friction sign."""

    def __init__(self, plant: FittedRobot, whole: Recording, rows: slice, cutoff: float) -> None:
        self.plant, self.part = plant, cut_recording(whole, rows)
        # Effects that depend on earlier motion, as free functions may, need the earlier data.
        effects = [member.hypothesis.effect for member in plant.members]
        memoryless = [e.persistence is Persistence.STATE and not e.name.startswith(PREFIX) for e in effects]
        self.near = [i for i, own in enumerate(memoryless) if own]
        self.late = late = [i for i, own in enumerate(memoryless) if not own]
        zero = np.zeros_like(self.part.q)
        self.sections = butter(4, min(2 * cutoff * self.part.step, 0.9), output="sos")
        self.history = (zero, zero)
        if late:
            past = cut_recording(whole, slice(0, rows.stop))
            own = slice(rows.start, rows.stop)
            full = self._parts(past, (past.q, past.dq, past.ddq), late)
            alone = self._parts(self.part, (self.part.q, self.part.dq, self.part.ddq), late)
            self.history = (full[0][own] - alone[0], full[1][own] - alone[1])
        self.measured = self.along((self.part.q, self.part.dq, self.part.ddq)) if plant.members else (zero, zero)

    def along(self, motion: tuple[Array, Array, Array]) -> tuple[Array, Array]:
        """Computes both parts along a motion of this stretch.

        Args:
            motion: positions, velocities and accelerations, (N, n) each.

        Returns:
            Smooth torque and factor of the friction sign, (N, n) each [N m or N].
        """
        part, h = self.part, self.part.step
        off = motion[0] - part.q
        padding = min(len(off) - 1, 3 * round(1 / h))
        off = sosfiltfilt(self.sections, off, axis=0, padtype="odd", padlen=padding)
        rate = np.gradient(off, h, axis=0)
        seen = (part.q + off, part.dq + rate, part.ddq + np.gradient(rate, h, axis=0))
        smooth, turning = self._parts(part, seen, [*self.near, *self.late])
        return smooth + self.history[0], turning + self.history[1]

    def _parts(self, part: Recording, motion: tuple[Array, Array, Array], members: list[int]) -> tuple[Array, Array]:
        now = self.plant.felt_at(part, motion)
        total = self.plant.beyond(now, members)
        smooth = self.plant.beyond(replace(now, velocity_scale=np.full(part.n, NO_SIGN), _cache={}), members)
        return smooth, _factor(total - smooth, now.sign)


def _factor(turning: Array, sign: Array) -> Array:
    """Divides a torque (N, n) by the friction sign, and interpolates where the sign is small."""
    result = np.zeros_like(turning)
    rows = np.arange(len(turning))
    for j in range(turning.shape[1]):
        sure = np.abs(sign[:, j]) > 0.5
        if sure.any() and turning[:, j].any():
            result[:, j] = np.interp(rows, rows[sure], turning[sure, j] / sign[sure, j])
    return result


def _coulomb(now: Situation) -> Array:
    """Returns the base model's Coulomb friction (n,) [N m or N]."""
    result = np.zeros(now.robot.n)
    for column, value in zip(now.model.columns, now.parameters, strict=True):
        if column.symbol == "f1":
            result[column.joint - 1] += value
    return result


def _tangent(now: Situation) -> Tangent:
    inertia, damping = now.sensitivity("inertia").copy(), now.sensitivity("velocity").copy()
    for i, column in enumerate(now.model.columns):
        if column.term == "rotor_inertia":
            inertia[:, column.joint - 1, column.joint - 1] += now.parameters[i]
    # Derivative of friction without its sign term, by central differences.
    step = 1e-3 * np.maximum(np.sqrt(np.mean(now.dq**2, axis=0)), 1e-9)
    up, down = now.dq + step, now.dq - step
    turning = _coulomb(now) * (sign_of(up, now.velocity_scale) - sign_of(down, now.velocity_scale))
    rows = np.arange(now.robot.n)
    damping[:, rows, rows] += (now.friction_at(up) - now.friction_at(down) - turning) / (2 * step)
    return Tangent(inertia=inertia, damping=damping, stiffness=now.sensitivity("position"))


def _loop_inertia(plant: FittedRobot, part: Recording) -> Array:
    """Returns the inertia (n,) for the loop gains, with a lower bound from torque and acceleration RMS."""
    now = plant.at(part, (part.q, part.dq, part.ddq))
    own = np.mean(np.diagonal(_tangent(now).inertia, axis1=1, axis2=2), axis=0)
    torque, curve = (np.sqrt(np.mean(values**2, axis=0)) for values in (part.tau, part.ddq))
    return np.maximum(own, SLUGGISH * torque / np.maximum(curve, 1e-3 * max(float(curve.max()), 1e-9)))


# Duration of the simulated stretch [s], and largest number of rows of the fit for it.
STRETCH = 5.0
ENOUGH_ROWS = 12_000


def simulate_held_out(
    problem: Problem, members: Sequence[FittedEffect], measured: HeldOutResult, held_out: bool
) -> Simulation | None:
    """Simulates the stretch of held-out data in which the effects are strongest, without and with them.

    Args:
        problem: data of the fit.
        members: findings, at least one.
        measured: held-out results of these members.
        held_out: whether there are held-out logs. If not, the fit leaves out the part with the stretch.

    Returns:
        The simulation; None if the simulated motion diverges.
    """
    whole, first = measured.whole, measured.first_held_out_row
    parts = [slice(max(run.start, first), run.stop) for run in whole.runs if run.stop > first]
    if not held_out and (len(parts) == 1 or found_in_one_log_only(whole, measured.effects)):
        parts = split_runs(whole)
    strength = np.sum((measured.torque / problem.whitening.scale) ** 2, axis=1)
    part, rows = _strongest(parts, np.concatenate([np.zeros(first), strength]), round(STRETCH / whole.step))
    base, extended = _fits(problem, measured, None if held_out else part)
    known = problem.baseline.base
    b = known.size
    before = FittedRobot(model=known.model, columns=known.independent, values=base[:b])
    edges = np.cumsum([problem.baseline.columns.shape[2], *(X.shape[2] for X in measured.effects)])
    there = [i for i in range(len(members)) if i not in measured.absent]
    after = replace(
        before,
        values=extended[:b],
        base_values_for_effects=problem.parameters_without_payload[list(known.independent)],
        extra_load=problem.extra_load,
        since=problem.situation.origin,
        members=tuple(members[i] for i in there),
        coefficients=tuple(extended[edges[i] : edges[i + 1]] for i in there),
    )
    return simulate_both(before, after, whole, rows)


def _strongest(parts: Sequence[slice], strength: Array, length: int) -> tuple[slice, slice]:
    """Finds the window of `length` rows with the largest mean of `strength` (N,), and the part that contains it."""
    sums = np.concatenate([[0.0], np.cumsum(strength)])
    best, chosen = -1.0, (parts[0], parts[0])
    for part in parts:
        size = min(length, part.stop - part.start)
        for start in range(part.start, part.stop - size + 1, max(1, size // 4)):
            mean = float(sums[start + size] - sums[start]) / size
            # Shorter windows are weighted down: their mean varies more by chance.
            value = mean * min(1.0, size / length)
            if value > best:
                best, chosen = value, (part, slice(start, start + size))
    return chosen


def _fits(problem: Problem, measured: HeldOutResult, left_out: slice | None) -> tuple[Array, Array]:
    """Fits base model and nuisance, without and with the effects, to all rows except those left out."""
    recording, effects = problem.recording, measured.effects
    kept = np.ones(len(recording), dtype=bool)
    if left_out is not None:
        kept[left_out] = False
    rows = np.flatnonzero(kept)
    rows = rows[:: max(1, -(-len(rows) // ENOUGH_ROWS))]
    full = np.concatenate([problem.baseline.columns[rows], *(X[rows] for X in effects)], axis=2)
    weights = (~recording.sign_unknown / problem.whitening.scales(len(recording)))[rows]
    # Compensates the decimation, so that the prior keeps its weight.
    factor = np.full(recording.n, kept.sum() / max(len(rows), 1))
    moments = Moments.of(full, recording.tau[rows], weights).joined(factor).pulled(measured.prior)
    alone, *_, everything = model_columns(problem.baseline.columns.shape[2], effects)
    return moments.columns(alone).posterior(), moments.columns(everything).posterior()
