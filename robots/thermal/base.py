"""Interface of the thermal models of a joint, and everything that follows from the heat balance."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import expm

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.common.parallel import one_blas_thread
from robots.common.records import Record
from robots.thermal.checks import checked_ambient, checked_power, checked_steps
from robots.thermal.parameters import Inputs, ThermalParameter


@dataclass(frozen=True, kw_only=True)
class ThermalModel(Record, ABC):
    """A joint that its own friction heats, and whose friction falls as it warms up.

        tau_f = tau_cold(dq) (alpha (T - T0) + beta)           (thesis eq. 100 to 104)
        heat  = tau_f dq = W (alpha (T - T0) + beta)           (thesis eq. 105)

    T is the temperature where the heat is produced, W = tau_cold(dq) dq the power at T0. A member states its parameters
    and its heat balance, which is linear in the temperatures while W is constant; the rest follows.

    Args:
        alpha: relative change of friction per degree [1/K], zero or less.
        beta: friction at T0 divided by its reference; 1 except for errors of the fit.
        ambient: ambient temperature Te where none is given [degC].
        reference: T0, the temperature at which the cold friction holds [degC]; ``ambient`` by default.

    Raises:
        InputError: a parameter that is out of range or not finite.
    """

    ENTRIES = ("model=name", "*")

    name: ClassVar[str]
    parameters: ClassVar[tuple[ThermalParameter, ...]]
    zones: ClassVar[tuple[str, ...]]

    alpha: float
    beta: float
    ambient: float = 20.0
    reference: float | None = None

    def __post_init__(self) -> None:
        for parameter in self.parameters:
            value = getattr(self, parameter.name)
            if parameter.name == "alpha":
                fits, allowed = value <= 0.0, "zero or a negative number"
            elif parameter.positive:
                fits, allowed = value > 0.0, "a positive number"
            else:
                fits, allowed = value >= 0.0, "zero or a positive number"
            if not (np.isfinite(value) and fits):
                raise InputError(f"thermal model: {parameter.name} is {value}", allowed=allowed)
        for word, value in (("ambient", self.ambient), ("reference", self.T0)):
            if not np.isfinite(value):
                raise InputError(f"thermal model: the {word} temperature is {value}", allowed="a finite number")

    @property
    def T0(self) -> float:
        """Temperature at which the cold friction holds [degC]."""
        return self.ambient if self.reference is None else self.reference

    @property
    def values(self) -> dict[str, float]:
        """The parameters by name, and T0."""
        return {**{p.name: float(getattr(self, p.name)) for p in self.parameters}, "T0": self.T0}

    # What a member states.

    @classmethod
    @abstractmethod
    def rates(cls, p: Mapping[str, Any], x: Sequence[Any], u: Inputs) -> list[Any]:
        """The heat balance: dx/dt of the states, linear in them.

        Args:
            p: the parameters by name, and T0: numbers or CasADi expressions.
            x: the states.
            u: what acts on the joint.
        """

    @classmethod
    def state_count(cls, *, coarse: bool = False) -> int:
        """The number of states: one a zone, unless a member remembers more; then fewer where `coarse` will do."""
        return len(cls.zones)

    @classmethod
    def zone_temperatures(cls, p: Mapping[str, Any], x: Sequence[Any]) -> list[Any]:
        """Temperatures of the zones [degC] from the states; that where heat is produced comes first."""
        return list(x)

    @classmethod
    def start_state(cls, temperatures: Sequence[Any], size: int) -> list[Any]:
        """The `size` states of a joint whose zones have had these temperatures [degC] so far."""
        return list(temperatures)

    @abstractmethod
    def rise(self, time: float) -> float:
        """Bounds the warming by 1 W within a time [s] from equilibrium [K]."""

    # What follows.

    def friction_factor(self, temperature: ArrayLike) -> Array:
        """Friction over that at T0: alpha (T - T0) + beta (thesis eq. 100).

        Args:
            temperature: where the heat is produced [degC], of any shape.

        Returns:
            The factor, of the same shape.
        """
        return self.alpha * (np.asarray(temperature, dtype=np.float64) - self.T0) + self.beta

    def derivative(
        self, state: ArrayLike, power: ArrayLike, *, ambient: ArrayLike | None = None, drives: ArrayLike = 1.0
    ) -> Array:
        """Evaluates dx/dt [K/s].

        Args:
            state: (..., s).
            power: W [W], (...).
            ambient: ambient temperature [degC]; that of the model by default.
            drives: 1 where the drives are powered.
        """
        x = np.moveaxis(np.asarray(state, dtype=np.float64), -1, 0)
        u = Inputs(checked_power(power), self._ambient(ambient), None, np.asarray(drives, dtype=np.float64))
        return np.stack(np.broadcast_arrays(*self.rates(self.values, list(x), u)), axis=-1)

    def system(
        self,
        power: ArrayLike,
        *,
        ambient: ArrayLike | None = None,
        T3: ArrayLike | None = None,
        drives: ArrayLike = 1.0,
    ) -> tuple[Array, Array]:
        """Gives A and b of dx/dt = A x + b (thesis eq. 120 and 121).

        Args:
            power: W [W], of any shape, zero or more.
            ambient: ambient temperature [degC]; that of the model by default.
            T3: reading of a thermocouple beside the joint [degC]; only the advanced model uses it.
            drives: 1 where the drives are powered.

        Returns:
            A (..., s, s) [1/s] and b (..., s) [K/s].

        Raises:
            InputError: a power that is negative or not finite.
        """
        third = None if T3 is None else np.asarray(T3, dtype=np.float64)
        u = Inputs(checked_power(power), self._ambient(ambient), third, np.asarray(drives, dtype=np.float64))
        shape = np.broadcast_shapes(*(np.shape(value) for value in u if value is not None))
        size, p = self.state_count(), self.values
        # The ambient temperature is set to zero, because a large constant part would cost digits of A.
        still = Inputs(u.power, 0.0, None if third is None else 0.0, 0.0)
        homogeneous = self.rates({**p, "T0": 0.0}, [0.0] * size, still)
        A, b = np.empty((*shape, size, size)), np.empty((*shape, size))
        for column in range(size):
            moved = self.rates({**p, "T0": 0.0}, [float(k == column) for k in range(size)], still)
            for row in range(size):
                A[..., row, column] = moved[row] - homogeneous[row]
        for row, value in enumerate(self.rates(p, [0.0] * size, u)):
            b[..., row] = value
        return A, b

    def time_constants(self, power: ArrayLike) -> Array:
        """Gives the time constants at constant power (thesis eq. 112, 125 to 127 and 152).

        Args:
            power: W [W], of any shape.

        Returns:
            (..., k) [s], the slowest first.
        """
        rates = np.linalg.eigvals(self.system(power)[0]).real
        return np.sort(-1.0 / rates, axis=-1)[..., ::-1]

    def steady_state(self, power: ArrayLike, *, ambient: ArrayLike | None = None, drives: ArrayLike = 1.0) -> Array:
        """Gives the zones' temperatures that are reached at constant power (thesis eq. 111 and 124).

        Args:
            power: W [W], of any shape.
            ambient: ambient temperature [degC]; that of the model by default.
            drives: 1 where the drives are powered.

        Returns:
            (..., z) [degC].
        """
        A, b = self.system(power, ambient=ambient, drives=drives)
        return np.asarray(-np.linalg.solve(A, b[..., None])[..., 0], dtype=np.float64)

    def transition(self, power: ArrayLike, step: ArrayLike, *, thermocouple: bool = False) -> tuple[Array, Array]:
        """Discretises exactly at constant power: x(t + step) = Phi x(t) + Gamma b (thesis eq. 122).

        Args:
            power: W [W], of any shape.
            step: time [s], of that shape or one for all, zero or more.
            thermocouple: whether T3 is an input; only the advanced model uses it.

        Returns:
            Phi = exp(A step) (..., s, s), and its integral Gamma (..., s, s) [s].

        Raises:
            InputError: a negative power or time.
        """
        W, h = np.broadcast_arrays(checked_power(power), checked_steps(step))
        pairs, index = np.unique(np.stack([W.ravel(), h.ravel()]), axis=1, return_inverse=True)
        Phi, Gamma = self.exponentials(self.system(pairs[0], T3=0.0 if thermocouple else None)[0], pairs[1])
        index, size = index.reshape(W.shape), self.state_count()
        return Phi[index].reshape(*W.shape, size, size), Gamma[index].reshape(*W.shape, size, size)

    def temperatures(
        self,
        power: ArrayLike,
        steps: ArrayLike,
        *,
        start: ArrayLike | None = None,
        ambient: ArrayLike | None = None,
        T3: ArrayLike | None = None,
        drives: ArrayLike = 1.0,
    ) -> Array:
        """Follows the zones while the power is constant in each of N steps; exact, however long the steps.

        Args:
            power: W in each step, (N,) [W].
            steps: how long each lasts [s], (N,) or one number.
            start: temperatures of the zones at first, (z,) [degC]; ambient temperature by default.
            ambient: ambient temperature, one number or one in each step [degC].
            T3: reading of a thermocouple beside the joint in each step [degC].
            drives: 1 in steps in which the drives are powered.

        Returns:
            Temperatures before the first step and after each, (N + 1, z) [degC].

        Raises:
            InputError: arrays of other shapes, or a negative power or time.
        """
        W = checked_power(power)
        if W.ndim != 1:
            raise InputError(f"thermal model: powers of shape {W.shape}", allowed="shape (N,)")
        around = np.broadcast_to(self._ambient(ambient), W.shape)
        first = np.full(len(self.zones), around[0] if len(around) else self.ambient)
        if start is not None:
            first = np.asarray(start, dtype=np.float64)
        if first.shape != (len(self.zones),) or not np.isfinite(first).all():
            raise InputError(
                f"thermal model: start temperatures {first}", allowed=f"finite numbers for {', '.join(self.zones)}"
            )
        _, b = self.system(W, ambient=around, T3=T3, drives=drives)
        Phi, Gamma = self.transition(W, steps, thermocouple=T3 is not None)
        push = (Gamma @ b[..., None])[..., 0]
        states = np.empty((W.size + 1, self.state_count()))
        states[0] = self.start_state(list(first), self.state_count())
        for k in range(W.size):
            states[k + 1] = Phi[k] @ states[k] + push[k]
        return np.stack(self.zone_temperatures(self.values, list(states.T)), axis=-1)

    def response(self, t: ArrayLike, power: float, *, start: ArrayLike | None = None) -> Array:
        """Gives the temperatures at constant power in closed form (thesis eq. 110, 122 and 141).

        Args:
            t: times since the start (N,) [s].
            power: W [W].
            start: temperatures of the zones at first, (z,) [degC]; ambient temperature by default.

        Returns:
            (N, z) [degC].
        """
        times = checked_steps(t)
        first = np.full(len(self.zones), self.ambient) if start is None else np.asarray(start, dtype=np.float64)
        limit = self.steady_state(power)
        Phi, _ = self.transition(np.full(times.shape, float(power)), times)
        return limit + (Phi @ (first - limit)[:, None])[..., 0]

    @classmethod
    def exponentials(cls, A: Array, h: Array) -> tuple[Array, Array]:
        """Gives exp(A h) and its integral over h, (M, s, s) each, of M systems over M times [s]."""
        size = A.shape[-1]
        augmented = np.zeros((len(A), 2 * size, 2 * size))
        augmented[:, :size, :size] = A * h[:, None, None]
        augmented[:, :size, size:] = np.eye(size) * h[:, None, None]
        # One small matrix after another: threads would wait for each other hundreds of times as long as they work.
        with one_blas_thread():
            full = expm(augmented)
        return full[:, :size, :size], full[:, :size, size:]

    def _ambient(self, ambient: ArrayLike | None) -> Array:
        return checked_ambient(self.ambient if ambient is None else ambient)
