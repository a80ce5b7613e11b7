"""Effects of the robot's surroundings: a payload, a tilted base, a contact."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from oed.benchmarks.truth.dynamics import massless, point_force_torque, rigid_torque, with_gravity, with_tool
from oed.benchmarks.truth.effects.base import Effect, log_uniform
from oed.benchmarks.truth.machines import Machine
from oed.benchmarks.truth.ride import Ride


@dataclass(frozen=True, kw_only=True)
class Payload(Effect):
    """A rigid payload of `amount` [kg] at the flange from one time on, picked up within 20 ms."""

    moment: float = 0.0
    centre: tuple[float, float, float] = (0.0, 0.0, 0.1)
    size: tuple[float, float, float] = (0.1, 0.1, 0.1)

    name = "payload_change"
    loads_gears = True
    largest = 150.0

    @classmethod
    def joints(cls, machine: Machine) -> tuple[int | None, ...]:
        return (None,)

    @classmethod
    def draw(cls, machine: Machine, rng: np.random.Generator, joint: int | None, span: float) -> Payload:
        centre = (rng.uniform(-0.06, 0.06), rng.uniform(-0.06, 0.06), rng.uniform(0.05, 0.18))
        return cls(
            joint=None,
            moment=span * rng.uniform(0.2, 0.8),
            centre=centre,
            size=tuple(rng.uniform(0.05, 0.2, 3).tolist()),
        )

    def torque(self, ride: Ride) -> np.ndarray:
        tool = pin.Inertia.FromBox(self.amount, *self.size)
        tool.lever = np.array(self.centre)
        carried = np.clip((ride.t - self.moment) / 0.02, 0.0, 1.0)[:, None]
        body = with_tool(massless(ride.machine.model), tool)
        return carried * rigid_torque(body, ride.link_q, ride.link_v, ride.link_a)

    def truths(self) -> dict[str, float]:
        return {"change_time": self.moment, "mass": self.amount}


@dataclass(frozen=True, kw_only=True)
class Tilt(Effect):
    """A tilted base: `amount` [rad] about a horizontal axis."""

    heading: float = 0.0

    name = "base_tilt"
    loads_gears = True
    largest = 0.2

    @classmethod
    def joints(cls, machine: Machine) -> tuple[int | None, ...]:
        return (None,)

    @classmethod
    def draw(cls, machine: Machine, rng: np.random.Generator, joint: int | None, span: float) -> Tilt:
        return cls(joint=None, heading=rng.uniform(0, 2 * np.pi))

    @property
    def turn(self) -> np.ndarray:
        """The rotation (3, 3) of gravity in the frame of the base."""
        return np.asarray(pin.exp3(self.amount * np.array([np.cos(self.heading), np.sin(self.heading), 0.0])))

    def torque(self, ride: Ride) -> np.ndarray:
        turned = self.turn @ ride.machine.model.gravity.linear
        field = with_gravity(ride.machine.model, turned - ride.machine.model.gravity.linear)
        still = np.zeros_like(ride.q)
        return rigid_torque(field, ride.link_q, still, still)

    def truths(self) -> dict[str, float]:
        return {"tilt": self.amount}


@dataclass(frozen=True, kw_only=True)
class Contact(Effect):
    """An external contact: a short force of `amount` [N] on a link."""

    moment: float = 0.0
    seconds: float = 0.3
    link: int = 6
    point: tuple[float, float, float] = (0.0, 0.0, 0.1)
    direction: tuple[float, float, float] = (1.0, 0.0, 0.0)
    form: str = "half-sine"

    name = "external_contact"
    loads_gears = True
    largest = 3000.0
    lasting = False

    @classmethod
    def joints(cls, machine: Machine) -> tuple[int | None, ...]:
        return (None,)

    @classmethod
    def draw(cls, machine: Machine, rng: np.random.Generator, joint: int | None, span: float) -> Contact:
        direction = rng.normal(size=3)
        return cls(
            joint=None,
            moment=span * rng.uniform(0.1, 0.9),
            seconds=log_uniform(rng, 0.15, 1.0),
            link=int(rng.integers(max(machine.n - 3, 2), machine.n + 1)),
            point=tuple(rng.uniform(-0.1, 0.15, 3).tolist()),
            direction=tuple((direction / np.linalg.norm(direction)).tolist()),
            form=str(rng.choice(["half-sine", "hold"])),
        )

    def torque(self, ride: Ride) -> np.ndarray:
        s = (ride.t - self.moment) / self.seconds
        inside = (s > 0) & (s < 1)
        strength = np.where(inside, np.sin(np.pi * np.clip(s, 0, 1)), 0.0)
        if self.form == "hold":
            strength = np.where(inside, np.minimum(1.0, np.minimum(s, 1 - s) * 10), 0.0)
        force = self.amount * strength[:, None] * np.array(self.direction)
        return point_force_torque(ride.machine.model, ride.link_q, self.link, np.array(self.point), force)

    def truths(self) -> dict[str, float]:
        return {"start": self.moment, "duration": self.seconds}
