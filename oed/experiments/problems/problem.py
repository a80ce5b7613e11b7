"""The design problem: a criterion of the information matrix over a family's coefficients, under kinematic limits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from functools import cached_property

import numpy as np

from oed.constraints import KinematicRows, PointwiseLimit, TorqueRms, kinematic_rows
from oed.criteria import Criterion, Information, Weighting
from oed.trajectories import Family, Fourier, Kinematics, Trajectory
from robots.base_parameters import BaseParameters
from robots.common.arrays import Array
from robots.common.errors import InfeasibleError
from robots.limits import Limits

# How far within each pointwise bound, in its own scale, a motion counts as feasible: a solver starts strictly inside.
INNER_ROOM = 1e-3


@dataclass(frozen=True, kw_only=True)
class FourierProblem:
    """Minimise a criterion over the motions of a family that keep the limits at all times.

    The unknown z (n K,) scales the free coefficients of each joint so that entries of about one bring the joint to its
    limits.

    Attributes:
        base: the parameters that will be fitted (m columns).
        criterion: what is minimised.
        limits: of position, velocity, acceleration and jerk.
        family: of motions, with K coefficients a joint; they start and end at rest.
        samples: per period, at which the regressor is evaluated; they lie half a step off the start, for all joints
            rest there and a row of zeros informs of nothing.
        limit_samples: per period, at which the limits are imposed, tightened for what lies between.
        pointwise: limits that are not linear in the coefficients, such as torque; imposed at the same samples.
        averaged: limits on the root mean square over the period.
        weighting: of rows and columns, and what is known already.
        home: pose (n,) to shrink motions to where the middle of the ranges breaks a pointwise limit.
    """

    base: BaseParameters
    criterion: Criterion
    limits: Limits
    family: Family = field(default_factory=Fourier)
    samples: int = 104
    limit_samples: int = 250
    pointwise: tuple[PointwiseLimit, ...] = ()
    averaged: tuple[TorqueRms, ...] = ()
    home: Array | None = None
    weighting: Weighting = field(default_factory=Weighting)

    def __getstate__(self) -> dict[str, object]:
        # Derived data, such as compiled code, are rebuilt in the process that needs them.
        return {item.name: getattr(self, item.name) for item in fields(self)}

    def __setstate__(self, state: dict[str, object]) -> None:
        self.__dict__.update(state)

    def resampled(self, samples: int) -> FourierProblem:
        """Gives the same problem with another number of regressor samples; compiled functions and limits are shared."""
        other = replace(self, samples=samples)
        known = {name: value for name, value in self.__dict__.items() if name not in ("samples", "_sampled")}
        # Two problems must not write into each other's regressor.
        other.__dict__.update(known, information=self.information.unshared())
        return other

    @property
    def joints(self) -> int:
        """n, the number of joints."""
        return self.base.model.robot.n

    @property
    def size(self) -> int:
        """N K, the number of unknowns."""
        return self.joints * self.family.size

    @cached_property
    def information(self) -> Information:
        """The information matrix of sampled motion."""
        return Information(self.base.model, self.base.independent, self.weighting.rows)

    @cached_property
    def scale(self) -> Array:
        """(n, K): free coefficients per unit of z, from the range and the velocity limit of each joint."""
        ranges = (self.limits.upper - self.limits.lower) / 2
        half = np.where(np.isfinite(ranges), ranges, np.pi)
        velocity = np.where(np.isfinite(self.limits.velocity), self.limits.velocity, 1.0)
        return self.family.scale(half, velocity)

    @cached_property
    def centre(self) -> Array:
        """(n,): the pose of z = 0: the middle of each range (zero where it has none), or home if only that is allowed.

        Raises:
            InfeasibleError: neither keeps the pointwise limits, so that no motion around it does.
        """
        middle = self.limits.middle
        if not self.curved:
            return middle
        poses = [middle] if self.home is None else [middle, np.asarray(self.home, dtype=float)]
        still = np.zeros((1, self.joints))
        broken: list[str] = []
        for pose in poses:
            excess = [limit.excess(pose[None], still, still)[0] for limit in self.pointwise]
            excess += [limit.values(pose[None], still, still) - 1 for limit in self.averaged]
            if max(e.max() for e in excess) < -INNER_ROOM:
                return pose
            labels = [label for limit in self.pointwise for label in limit.labels]
            labels += [label for limit in self.averaged for label in limit.labels]
            broken = [labels[row] for row in np.flatnonzero(np.concatenate(excess) >= -INNER_ROOM)]
        raise InfeasibleError(
            (
                f"even at rest, in the home pose and in the middle of the ranges, {', '.join(broken[:3])} exceeds its "
                f"limit"
            ),
            remedy="choose another home pose, or correct the limits",
        )

    @property
    def curved(self) -> bool:
        """Whether there are limits that are not linear in the coefficients."""
        return bool(self.pointwise or self.averaged)

    @cached_property
    def _sampled(self) -> Kinematics:
        return self.family.basis(self.family.regressor_times(self.samples))

    @cached_property
    def rows(self) -> KinematicRows:
        """The limits as rows in the free coefficients of each joint; kept there, they hold at all times."""
        return kinematic_rows(self.limit_bases, self.limits, shares=self.family.shares(self.limit_samples))

    def free(self, z: Array) -> Array:
        """Unscales z (n K,) to the free coefficients (n, K)."""
        coefficients = z.reshape(self.joints, -1) * self.scale
        coefficients[:, 0] += self.centre
        return coefficients

    def series(self, z: Array, periods: int = 1) -> Trajectory:
        """Builds the trajectory of z."""
        return self.family.trajectory(self.free(z), periods)

    def gram(self, z: Array) -> Array:
        """Evaluates the mean information matrix Y'Y / samples (m, m)."""
        free = self.free(z).T
        q, dq, ddq = (np.ascontiguousarray(basis @ free) for basis in self._sampled[:3])
        return self.information.gram(q, dq, ddq) / self.samples

    def pullback(self, weights: Array) -> Array:
        """Turns dL/dG (m, m) at the last `gram` into dL/dz (n K,)."""
        gradients = self.information.pullback(weights / self.samples)
        total = sum(g.T @ basis for g, basis in zip(gradients, self._sampled[:3], strict=True))
        return (total * self.scale).reshape(-1)

    def surrogate(self, z: Array, sharpness: float) -> tuple[float, Array]:
        """Evaluates the criterion's smooth stand-in and its exact gradient (n K,)."""
        value, gradient = self.value_first(z, sharpness)
        return value, gradient()

    def value_first(self, z: Array, sharpness: float) -> tuple[float, Callable[[], Array]]:
        """Evaluates the stand-in; its gradient (n K,) can be asked for until another point is evaluated."""
        gram = self.gram(z)
        eigenvalues, vectors = np.linalg.eigh(self.weighting.apply(gram))
        value, slope = self.criterion.surrogate(eigenvalues, sharpness)
        return value, lambda: self.pullback(self.weighting.pullback((vectors * slope) @ vectors.T, gram))

    def cost(self, z: Array) -> float:
        """Evaluates the criterion itself on the samples, smaller being better."""
        eigenvalues: Array = np.asarray(np.linalg.eigvalsh(self.weighting.apply(self.gram(z))), dtype=np.float64)
        return self.criterion.cost(eigenvalues)

    @cached_property
    def limit_bases(self) -> Kinematics:
        """The basis matrices (M, K) at the limit samples."""
        return self.family.basis(self.family.limit_times(self.limit_samples))

    @cached_property
    def state_basis(self) -> Array:
        """Basis of position, velocity and acceleration at the limit samples (M, 3, K)."""
        return np.stack(self.limit_bases[:3], axis=1)

    def pointwise_excess(self, z: Array) -> Array:
        """How far the pointwise limits are passed at the limit samples (M, R), negative within."""
        q, dq, ddq = self.limit_states(z)
        return np.concatenate([limit.excess(q, dq, ddq) for limit in self.pointwise], axis=1)

    def inside(self, z: Array, stride: int = 1) -> bool:
        """Whether all limits that are not linear hold, with some room, at every `stride`-th limit sample."""
        states = self.limit_states(z, stride)
        if any(limit.excess(*states).max() > -INNER_ROOM for limit in self.pointwise):
            return False
        return all(limit.values(*states).max() <= 1 - INNER_ROOM for limit in self.averaged)

    def limit_states(self, z: Array, stride: int = 1) -> tuple[Array, Array, Array]:
        """Position, velocity and acceleration (M, n) at every `stride`-th limit sample."""
        free = self.free(z).T
        q, dq, ddq = (np.ascontiguousarray(basis[::stride] @ free) for basis in self.limit_bases[:3])
        return q, dq, ddq

    def shrunk(self, z: Array, fraction: float = 1.0, halvings: int = 12, stride: int = 1) -> Array:
        """Pulls each joint's motion towards the pose of z = 0 until it keeps the limits.

        Args:
            z: any point (n K,).
            fraction: of the way to the limits that it may go.
            halvings: of the interval in which the way to the pointwise limits is sought.
            stride: of the limit samples at which those are checked; more than 1 is faster and may miss a peak.
        """
        still = self.free(np.zeros(self.size))
        room = self.rows.room(still, self.free(z) - still)
        kept = (z.reshape(self.joints, -1) * np.minimum(1.0, fraction * room)[:, None]).reshape(-1)
        return self._inside(kept, halvings, stride) if self.curved else kept

    def _inside(self, z: Array, halvings: int, stride: int) -> Array:
        """Shrinks all joints alike until the pointwise limits hold; z = 0 does."""
        low, high = 0.0, 1.0
        if self.inside(z, stride):
            return z
        for _ in range(halvings):
            middle = (low + high) / 2
            low, high = (middle, high) if self.inside(middle * z, stride) else (low, middle)
        return low * z
