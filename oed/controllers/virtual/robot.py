"""The virtual robot behind the controller: torque of what is played, computed piece by piece."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from robots.common.arrays import Array
from robots.plants import Plant, PlantEffect
from robots.plants.heat import HeatPiece, heat_piece, reference_friction
from robots.signals import Motion
from robots.terms.effect_bases.heat import HeatEffect


class VirtualRobot:
    """A plant that follows its points exactly.

    Args:
        plant: the virtual robot.
        period: of the samples [s].
        seed: of the torque noise.
    """

    def __init__(self, plant: Plant, period: float, seed: int = 0) -> None:
        self._plant = plant
        self._period = period
        self._seed, self._trajectories = seed, 0
        self._rng = self._resting = np.random.default_rng(seed)
        static = all(isinstance(effect, PlantEffect) and effect.static for effect in plant.effects)
        warm = any(isinstance(getattr(effect, "term", None), HeatEffect) for effect in plant.effects)
        # Effects with a memory see so much of the motion [s], effects of heat more; the plant's own heat sees
        # everything.
        self._memory = 2 if static else int((60.0 if warm else 20.0) / period)
        self._pieces: list[HeatPiece] = []
        self._standing: tuple[Array, Array] | None = None
        self.begin(0.0)

    def begin(self, clock: float) -> None:
        """Begins a trajectory at a time of the controller's clock [s]: joints are unstrained, heat remains.

        Its noise is that of its number, however long the robot stood before.
        """
        self._start = clock
        self._past: Motion | None = None
        self._trajectories += 1
        self._rng = np.random.default_rng([self._seed, self._trajectories])
        self._coloured = self._rng.standard_normal(self._plant.robot.n)
        self._squares, self._count = np.zeros(self._plant.robot.n), 0

    def encoders(self, q: Array) -> Array:
        """Rounds positions (m, n) as the encoders do."""
        return self._plant.sensors.position(q, np.asarray(self._plant.robot.gear_ratio))

    def follow(self, t: Array, q: Array, dq: Array, ddq: Array) -> Array:
        """Gives the measured torque (m, n) [N m or N] of the next samples of the trajectory.

        Args:
            t: time since its start (m,) [s].
            q: positions (m, n).
            dq: velocities (m, n).
            ddq: accelerations (m, n).
        """
        new = Motion(t, q, dq, ddq)
        past = self._past
        whole = new if past is None else Motion.concatenate([past, new])
        warmth = None
        if self._plant.heat is not None:
            recent = new if past is None else Motion.concatenate([past.slice(-1, None), new])
            friction = reference_friction(self._plant.model, self._plant.parameters, recent)
            if len(recent) > 1:
                self._pieces.append(heat_piece(recent, friction).shifted(self._start))
            if self._pieces:
                warmth = self._plant.heat.follow(self._pieces)
                warmth = replace(warmth, t=warmth.t - self._start)
        tau = self._plant.torque(whole, warmth)[-len(new) :]
        self._past = whole.slice(-min(self._memory, len(whole)), None)
        self._squares = self._squares + (tau**2).sum(axis=0)
        self._count += len(tau)
        return self._measured(tau, self._rng)

    def stand(self, q: Array) -> Array:
        """Gives the measured torque (n,) of a robot that stands at positions (n,); its noise differs each time."""
        if self._standing is None or not np.array_equal(self._standing[0], q):
            zero = np.zeros((2, len(q)))
            rest = Motion(np.array([0.0, self._period]), np.array([q, q]), zero, zero)
            self._standing = (q, self._plant.torque(rest)[:1])
        return self._measured(self._standing[1], self._resting)[0]

    def _measured(self, tau: Array, rng: np.random.Generator) -> Array:
        """Adds noise that is coloured across pieces; its level follows the RMS of the trajectory's torque so far."""
        sensors = self._plant.sensors
        if not sensors.torque_noise:
            return tau
        squares = self._squares / self._count if self._count else (tau**2).mean(axis=0)
        level = sensors.torque_noise * np.sqrt(squares)
        rho = np.exp(-self._period / sensors.correlation_time) if sensors.correlation_time else 0.0
        white, drive = np.moveaxis(rng.standard_normal((len(tau), 2, tau.shape[1])), 1, 0)
        noise = np.empty_like(tau)
        for k in range(len(tau)):
            self._coloured = rho * self._coloured + np.sqrt(1 - rho**2) * drive[k]
            noise[k] = self._coloured
        share = sensors.coloured_share
        noisy = tau + level * (np.sqrt(1 - share) * white + np.sqrt(share) * noise)
        return np.round(noisy / sensors.torque_step) * sensors.torque_step if sensors.torque_step else noisy
