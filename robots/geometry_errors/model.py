"""A model of measured poses: arms with geometric errors, and the setup of a measurement, with one Jacobian."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.geometry_errors.arm import ArmColumns, ErroneousArm
from robots.geometry_errors.measurements import Setup
from robots.geometry_errors.measurements.setup import known_setup, setup_parameters
from robots.geometry_errors.poses import MeasuredPoses
from robots.geometry_errors.terms import ErrorParameter, ErrorTerm
from robots.robot import Robot


@dataclass(frozen=True, kw_only=True, eq=False)
class Prediction:
    """Residuals and derivatives of N poses.

    Attributes:
        residual: measured minus predicted (N, r), NaN where nothing was measured.
        jacobian: derivative of the prediction by all P errors, then by the K parameters of the setup (N, r, P + K).
    """

    residual: Array
    jacobian: Array


class GeometryModel:
    """Arms with kinds of errors at measured poses.

    Args:
        robots: one per arm that the measurement needs.
        terms: the kinds of errors of each arm.
        poses: the measured poses.
        reference: temperature at which the description holds [degC]; the mean of the poses by default.
    """

    def __init__(
        self,
        robots: Sequence[Robot],
        terms: Sequence[ErrorTerm],
        poses: MeasuredPoses,
        *,
        reference: float | None = None,
    ) -> None:
        self.robots, self.terms, self.poses = tuple(robots), tuple(terms), poses
        self.states = poses.states(*self.robots, reference=reference)
        self._arms: list[ArmColumns] = [
            ErroneousArm(robot=robot, terms=self._usable(robot, k)).columns(self.states[k])
            for k, robot in enumerate(self.robots)
        ]
        self._counts = [arm.count for arm in self._arms]

    def _usable(self, robot: Robot, arm: int) -> tuple[ErrorTerm, ...]:
        return tuple(term for term in self.terms if not term.missing(robot, self.states[arm]))

    @cached_property
    def errors(self) -> tuple[ErrorParameter, ...]:
        """The P parameters of the arms; those of a second arm have names that begin with "second_"."""
        named = list(self._arms[0].parameters)
        for arm in self._arms[1:]:
            named += [_renamed(item) for item in arm.parameters]
        return tuple(named)

    def parameters(self, setup: Setup) -> tuple[ErrorParameter, ...]:
        """Lists the P errors, then the K parameters of a setup."""
        return self.errors + setup_parameters(setup)

    def flanges(self, values: Array) -> list[Array]:
        """Flange of each arm in its base frame (N, 4, 4).

        Args:
            values: of the errors (P,).
        """
        return [arm.flange(part) for arm, part in zip(self._arms, self._split(values), strict=True)]

    def start(self) -> Setup:
        """Finds a first setup with nominal arms.

        Raises:
            InputError: a known part that the measurement has not, or that is of another kind.
        """
        found = self.poses.measurement.start(self.flanges(np.zeros(len(self.errors))), self.poses.observed)
        unknown = next((name for name in self.poses.known if name not in found), None)
        if unknown is not None:
            raise InputError(f"{self.poses.measurement.title} have no {unknown!r}", allowed=", ".join(found))
        for name, value in self.poses.known.items():
            if np.shape(value) != found[name].value.shape:
                given = {(3,): "a point", (4, 4): "a pose"}.get(np.shape(value), f"numbers of shape {np.shape(value)}")
                wanted = {"pose": f"{name}=X,Y,Z,ROLL,PITCH,YAW", "point": f"{name}=X,Y,Z"}
                raise InputError(
                    f"{name} is known as {given}", allowed=wanted.get(found[name].kind, "it is always estimated")
                )
        return known_setup(found, self.poses.known)

    def evaluate(self, values: Array, setup: Setup) -> Prediction:
        """Computes residuals and derivatives.

        Args:
            values: of the errors (P,).
            setup: of the measurement.
        """
        found = [arm.jacobian(part) for arm, part in zip(self._arms, self._split(values), strict=True)]
        seen = self.poses.measurement.evaluate([flange for flange, _ in found], self.poses.observed, setup)
        blocks = [by_flange @ twists for by_flange, (_, twists) in zip(seen.by_flange, found, strict=True)]
        return Prediction(residual=seen.residual, jacobian=np.concatenate([*blocks, seen.by_setup], axis=2))

    def residual(self, values: Array, setup: Setup) -> Array:
        """Computes residuals alone (N, r)."""
        return self.poses.measurement.evaluate(self.flanges(values), self.poses.observed, setup).residual

    def _split(self, values: Array) -> list[Array]:
        return np.split(np.asarray(values, dtype=float), np.cumsum(self._counts)[:-1])


def _renamed(item: ErrorParameter) -> ErrorParameter:
    return replace(item, name=f"second_{item.name}")
