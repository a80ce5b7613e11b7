"""Data of one heating or cooling of one joint, checked once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.thermal import ThermalModel

# Readings of a joint or its surroundings beyond these [degC] are in another unit, or broken.
COLDEST, HOTTEST = -60.0, 160.0
# Surroundings in which people and robots work [degC].
AMBIENT_RANGE = (-30.0, 60.0)
# Readings that go by the place of the sensor instead of a zone's name.
PLACES = {"motor": 0, "joint": 0, "housing": -1}


@dataclass(frozen=True, kw_only=True, eq=False)
class ThermalRun:
    """A joint that was heated by its motion, or cooled down, or both.

    Attributes:
        t: times (N,) [s], increasing.
        power: W, mean power that the friction would take at T0 from each time to the next (N,) [W]; the last counts for
            nothing. None where the heat is not known: it is then taken for constant and unknown.
        friction: measured friction torque (N,) [N m or N]; NaN where none was measured, None without any.
        cold_friction: torque that the friction would take at T0 where it was measured, one number or (N,) [N m or N].
        temperatures: readings (N,) [degC] by zone (``T``, ``T1``, ``T2``), or by place: ``motor`` or ``joint`` (where
            heat is produced), ``housing`` (the outermost zone); NaN where the sensor was silent.
        T3: a thermocouple beside the joint (N,) [degC]: an input of the advanced model.
        ambient: ambient temperature, a number or (N,) [degC]; None where it was not measured.
        drives: 1 from each time to the next in which the drives were powered, a number or (N,).
        weight: number of samples behind each friction value, a number or (N,).
        name: for messages.

    Raises:
        InputError: arrays of other shapes, values that are not finite, temperatures in another unit, no measurement.
    """

    t: Array
    power: Array | None
    friction: Array | None = None
    cold_friction: Array | float = 1.0
    temperatures: Mapping[str, Array] = field(default_factory=dict)
    T3: Array | None = None
    ambient: Array | float | None = 20.0
    drives: Array | float = 1.0
    weight: Array | float = 1.0
    name: str = "run"

    def __post_init__(self) -> None:
        t = np.array(self.t, dtype=np.float64)
        if t.ndim != 1 or len(t) < 3 or not np.isfinite(t).all() or not np.all(np.diff(t) > 0.0):
            raise self._error("times that are fewer than three or do not increase", "t", "increasing times [s]")
        object.__setattr__(self, "t", t)
        if self.power is not None:
            power = self._array("power", self.power)
            if not np.all(np.isfinite(power) & (power >= 0.0)):
                raise self._error("a friction power is negative or not finite", "power", "zero or more watts")
            object.__setattr__(self, "power", power)
        cold, weight = self._array("cold_friction", self.cold_friction), self._array("weight", self.weight)
        drives = self._array("drives", self.drives)
        if self.friction is not None:
            friction = self._array("friction", self.friction)
            known = np.isfinite(friction)
            if np.isinf(friction).any() or not np.all(np.isfinite(cold[known]) & (cold[known] != 0.0)):
                raise self._error(
                    "a friction torque was measured where the cold friction is zero", "cold_friction", "not zero"
                )
            object.__setattr__(self, "friction", friction)
        if not np.all(np.isfinite(weight) & (weight > 0.0)):
            raise self._error("a weight is not positive", "weight", "positive numbers")
        if not np.all((drives >= 0.0) & (drives <= 1.0)):
            raise self._error("drives are neither on nor off", "drives", "numbers from 0 to 1")
        for name, values in (("cold_friction", cold), ("weight", weight), ("drives", drives)):
            object.__setattr__(self, name, values)
        readings = {name: self._temperature(name, values) for name, values in self.temperatures.items()}
        object.__setattr__(self, "temperatures", readings)
        if self.T3 is not None:
            object.__setattr__(self, "T3", self._temperature("T3", self.T3))
        if self.ambient is not None:
            around = self._temperature("ambient", self.ambient)
            low, high = AMBIENT_RANGE
            seen = around[np.isfinite(around)]
            if not len(seen) or seen.min() < low or seen.max() > high:
                raise self._error(
                    f"surroundings of {np.nanmin(around):g} to {np.nanmax(around):g} degC" if len(seen) else "no value",
                    "ambient",
                    f"{low:g} to {high:g} degC",
                )
            object.__setattr__(self, "ambient", around)
            self._check_fahrenheit()
        if not self.has_friction and not any(np.isfinite(values).any() for values in readings.values()):
            raise self._error("the run has neither friction nor temperatures", "friction", "one of them")
        if self.power is None and self.has_friction:
            raise self._error("the run has friction but no friction power", "power", "watts")

    @property
    def has_friction(self) -> bool:
        """Whether friction was measured."""
        return self.friction is not None and bool(np.isfinite(self.friction).any())

    @property
    def ratio(self) -> Array:
        """Measured friction over that at T0 (N,), NaN where none was measured."""
        if self.friction is None:
            return np.full(self.t.shape, np.nan)
        return np.asarray(self.friction / self.cold_friction)

    @property
    def duration(self) -> float:
        """From the first to the last time [s]."""
        return float(self.t[-1] - self.t[0])

    @property
    def held_power(self) -> Array:
        """Power in each step (N - 1,) [W]; one where it is unknown."""
        if self.power is None:
            return np.ones(len(self.t) - 1)
        return np.asarray(self.power)[:-1]

    @property
    def heating(self) -> NDArray[np.bool_]:
        """Which times (N,) end a step under power."""
        under = self.held_power > 1e-9 * max(float(self.held_power.max()), 1e-12)
        return np.concatenate([under[:1], under])

    def readings(self, kind: type[ThermalModel]) -> dict[str, Array]:
        """Gives the temperatures (N,) [degC] by the zones of a model.

        Args:
            kind: the class of the model.

        Raises:
            InputError: a reading of a zone that the model does not have.
        """
        found: dict[str, Array] = {}
        for name, values in self.temperatures.items():
            zone = kind.zones[PLACES[name]] if name in PLACES else name
            # A reading where heat is produced is that of the only zone of a smaller model.
            zone = kind.zones[0] if zone in ("T", "T1") else zone
            if zone not in kind.zones:
                raise self._error(
                    f"a reading of zone {name}, which the {kind.name} model does not have",
                    "temperatures",
                    ", ".join((*kind.zones, *PLACES)),
                )
            found[zone] = values
        return found

    def rows(self, part: slice) -> ThermalRun:
        """Gives the run at some of its times, consecutive ones.

        Args:
            part: which times, as in ``array[part]``.
        """
        cut = {
            name: getattr(self, name)[part]
            for name in ("t", "power", "friction", "cold_friction", "T3", "drives", "weight", "ambient")
            if getattr(self, name) is not None
        }
        for name in ("power", "friction", "T3", "ambient"):
            cut.setdefault(name, None)
        return ThermalRun(
            **cut, temperatures={name: values[part] for name, values in self.temperatures.items()}, name=self.name
        )

    def _array(self, name: str, value: ArrayLike) -> Array:
        array = np.array(value, dtype=np.float64)
        if array.ndim == 0:
            array = np.full(self.t.shape, float(array))
        if array.shape != self.t.shape:
            raise self._error(f"shape {array.shape}", name, f"{self.t.shape}")
        array.flags.writeable = False
        return array

    def _temperature(self, name: str, value: ArrayLike) -> Array:
        array = self._array(name, value)
        seen = array[~np.isnan(array)]
        if not len(seen):
            return array
        low, high = float(seen.min()), float(seen.max())
        if low >= 200.0 and high <= 450.0:
            raise self._error(
                f"{low:g} to {high:g}, which looks like kelvin", name, "degrees Celsius", "subtract 273.15"
            )
        limit = AMBIENT_RANGE[1] if name == "ambient" else HOTTEST
        if low > 32.0 and high > limit and (high - 32.0) / 1.8 <= limit:
            raise self._error(
                f"{low:g} to {high:g}, which looks like Fahrenheit", name, "degrees Celsius", "(F - 32) / 1.8"
            )
        if not (low >= COLDEST and high <= HOTTEST):
            raise self._error(f"{low:g} to {high:g} degC", name, f"{COLDEST:g} to {HOTTEST:g} degC")
        return array

    def _check_fahrenheit(self) -> None:
        """A joint that is hot throughout, and as its surroundings when taken for Fahrenheit, was read in that."""
        around = float(np.nanmean(np.asarray(self.ambient)))
        for name, values in self.temperatures.items():
            low = float(np.nanmin(values)) if np.isfinite(values).any() else 0.0
            if low > AMBIENT_RANGE[1] and abs((low - 32.0) / 1.8 - around) < 5.0:
                raise self._error(
                    f"never below {low:g} beside surroundings of {around:g} degC, which looks like Fahrenheit",
                    name,
                    "degrees Celsius",
                    "(F - 32) / 1.8",
                )

    def _error(self, problem: str, column: str, allowed: str, remedy: str | None = None) -> InputError:
        return InputError(f"{self.name}: {problem}", column=column, allowed=allowed, remedy=remedy)


def named_apart(runs: ThermalRun | Sequence[ThermalRun]) -> list[ThermalRun]:
    """Makes a list of runs whose names differ: a repeated name is counted.

    Raises:
        InputError: no runs.
    """
    data = [runs] if isinstance(runs, ThermalRun) else list(runs)
    if not data:
        raise InputError("no runs", allowed="one or more")
    names = [run.name for run in data]
    if len(set(names)) == len(names):
        return data
    return [replace(run, name=f"{run.name} {k}") for k, run in enumerate(data, start=1)]
