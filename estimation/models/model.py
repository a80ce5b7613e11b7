"""The identified model: parameters with their uncertainty, and the file that carries them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from estimation.logs.known_setup import require_known
from estimation.models.extension import Extension, extension_torque, read_extension, read_gear_load
from estimation.models.robot_in_file import build_robot, describe_robot, require_described
from estimation.uncertainty.quantiles import normal_quantile
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.common.plain import as_html
from robots.common.records import Record, damage_refused, read, read_json, write_json
from robots.regressor import TorqueModel
from robots.robot import Robot
from robots.signals import Motion
from robots.terms import Column, build_term, describe_term
from robots.terms.effect_bases.capabilities import Persistence, Reading
from robots.terms.effect_bases.gear_load import ExtraGearLoad
from robots.terms.situations.flange_body import with_body
from robots.terms.situations.joining import join_situations
from robots.terms.situations.situation import Situation, situation

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, kw_only=True)
class Model(Record, format="robot-oed model", shares=("robot",)):
    """A torque model with the parameters that the data determined.

    Attributes:
        torque_model: robot and terms.
        columns: indices (b,) of the regressor columns that carry a parameter.
        values: base parameters (b,), in the columns' units.
        covariance: (b, b) of the values.
        determined: (b,), False where the data do not determine a parameter: its value is then a convention that
            makes the others right together, and means nothing by itself.
        formulas: (b,) the sum of standard parameters that each value stands for.
        provenance: logs with hashes, method, residual level per joint, tool version.
        extensions: effects beyond the terms, as a diagnosis found them.
        felt: base parameters (b,) by which the extensions reckon load and friction, those that they were fitted beside;
            None for `values`. The two differ where an effect and the base model share a torque.
        bearing: what of the extensions the gears bear, so that others feel it as load; None for nothing.
        since: moment from which the phase of an extension that vibrates counts [s]; None for the first of a motion.
    """

    ENTRIES = (
        "robot=described_robot",
        "terms=described_terms",
        "parameters=stated_parameters",
        "covariance",
        "provenance",
        "extensions?",
        "felt_by_extensions?=_extended.felt",
        "phases_since?=_extended.since",
        "borne_by_gears?=_extended.bearing",
    )

    torque_model: TorqueModel
    columns: tuple[int, ...]
    values: Array
    covariance: Array
    determined: NDArray[np.bool_]
    formulas: tuple[str, ...]
    provenance: Mapping[str, Any] = field(default_factory=dict)
    extensions: tuple[Extension, ...] = ()
    felt: Array | None = None
    bearing: ExtraGearLoad | None = None
    since: float | None = None

    def __repr__(self) -> str:
        found = f"{int(self.determined.sum())} of {len(self.values)} parameters determined"
        effects = "".join(f", {extension.effect} of joint {extension.joint}" for extension in self.extensions)
        return f"Model({self.robot.name!r}, {found}{effects})"

    def _repr_html_(self) -> str:
        return as_html(repr(self)) + self.to_frame().to_html()

    @property
    def gravities(self) -> tuple[tuple[float, ...], ...]:
        """Gravities (3,) in the base frame [m/s2] besides the description's, under which the parameters hold too."""
        return tuple(tuple(map(float, gravity)) for gravity in self.provenance.get("gravities", ()))

    @property
    def robot(self) -> Robot:
        """The robot."""
        return self.torque_model.robot

    @cached_property
    def parameters(self) -> tuple[Column, ...]:
        """The parameters' descriptions (b,)."""
        return tuple(self.torque_model.columns[i] for i in self.columns)

    @property
    def names(self) -> tuple[str, ...]:
        """The parameters' names (b,)."""
        return tuple(column.name for column in self.parameters)

    @property
    def standard_errors(self) -> Array:
        """Standard errors (b,), infinite where the data do not determine the parameter."""
        return np.where(self.determined, np.sqrt(np.diag(self.covariance)), np.inf)

    @property
    def cutoff(self) -> float:
        """Cut-off of the smoothing of its logs [Hz]; 10 Hz where the model states none."""
        return float(self.provenance.get("cutoff_hz", 10.0))

    @property
    def keeps_heat(self) -> bool:
        """Whether what came before a motion acts in it still."""
        return any(extension.source.persistence is Persistence.HEAT for extension in self.extensions)

    def torque(
        self,
        q: ArrayLike,
        dq: ArrayLike,
        ddq: ArrayLike,
        t: ArrayLike | None = None,
        *,
        gravity: ArrayLike | None = None,
        payload: ArrayLike | None = None,
        before: Sequence[Motion] = (),
    ) -> Array:
        """Predicts the torque (N, n) [N m or N] of a motion.

        Args:
            q: positions (N, n) [rad or m].
            dq: velocities (N, n) [rad/s or m/s].
            ddq: accelerations (N, n) [rad/s2 or m/s2].
            t: times (N,) [s]. With them the extensions count, some of which depend on time or on what came before;
                without, the terms alone.
            gravity: (3,) in the base frame [m/s2], where the base stands otherwise than the robot's description says.
            payload: inertial parameters (10,) of a body on the flange, in its frame, as in `Log`.
            before: motions that came before on the same clock, with the same gravity and payload: the heat they left
                acts.

        Raises:
            InputError: a gravity that shows parameters which the model lacks.
        """
        model = self.torque_model.under(gravity)
        if model is not self.torque_model:
            require_known(self.torque_model, self.columns, self.gravities, np.asarray(gravity, dtype=float))
        parameters, felt = (
            _with_payload(model, self.columns, values, payload)
            for values in (self.values, self.values if self.felt is None else self.felt)
        )
        asked: tuple[int, ...] = self.columns
        if payload is not None:
            asked = tuple(np.union1d(asked, np.flatnonzero(parameters)).tolist())
        own = model.torque(q, dq, ddq, parameters[list(asked)], columns=asked)
        if t is None or not self.extensions:
            return own
        arrays = [np.asarray(t, dtype=float), *(np.atleast_2d(np.asarray(x, dtype=float)) for x in (q, dq, ddq))]

        def state(known: Array) -> Situation:
            earlier = [situation(model, known, m.t, m.q, m.dq, m.ddq) for m in before]
            return replace(
                join_situations([*earlier, situation(model, known, *arrays)], self.torque_model), since=self.since
            )

        cut = any(extension.source.reading is Reading.CUTS for extension in self.extensions)
        extended = extension_torque(self.extensions, state(felt), state(parameters) if cut else None, self.bearing)
        return own + extended[-len(own) :]

    def conf_int(self, level: float = 0.95) -> pd.DataFrame:
        """Gives the confidence interval of each parameter, by the normal distribution and its standard error.

        Args:
            level: chance that an interval holds the parameter, between 0 and 1.

        Returns:
            A row per parameter: lower, upper; infinite where the data do not determine it.

        Raises:
            InputError: a level outside 0 to 1.
        """
        import pandas as pd

        if not 0.0 < level < 1.0:
            raise InputError(f"confidence level {level:g}", allowed="between 0 and 1")
        half = normal_quantile(0.5 + level / 2) * self.standard_errors
        limits = {"lower": self.values - half, "upper": self.values + half}
        return pd.DataFrame(limits, index=pd.Index(self.names, name="parameter"))

    def to_frame(self) -> pd.DataFrame:
        """Gives a row per parameter: joint, value, standard error, percent, unit, determined, formula."""
        import pandas as pd

        errors = self.standard_errors
        with np.errstate(divide="ignore", invalid="ignore"):
            percent = 100 * errors / np.abs(self.values)
        columns = {
            "joint": [column.joint for column in self.parameters],
            "value": self.values,
            "standard_error": errors,
            "percent": percent,
            "unit": [column.unit for column in self.parameters],
            "determined": self.determined,
            "stands_for": self.formulas,
        }
        return pd.DataFrame(columns, index=pd.Index(self.names, name="parameter"))

    @property
    def described_robot(self) -> dict[str, Any]:
        """All of the robot that a prediction needs, as plain data."""
        return describe_robot(self.robot)

    @property
    def described_terms(self) -> list[dict[str, Any]]:
        """The terms, as plain data."""
        return [describe_term(term) for term in self.torque_model.terms]

    @property
    def stated_parameters(self) -> list[dict[str, Any]]:
        """The parameters with standard errors, as plain data."""
        return [
            {
                "name": column.name,
                "joint": column.joint,
                "term": column.term,
                "value": float(value),
                "unit": column.unit,
                "standard_error": float(error),
                "determined": bool(known),
                "stands_for": formula,
            }
            for column, value, error, known, formula in zip(
                self.parameters, self.values, self.standard_errors, self.determined, self.formulas, strict=True
            )
        ]

    @property
    def _extended(self) -> Model | None:
        """The model; None without extensions."""
        return self if self.extensions else None

    def save(self, path: Path, *, force: bool = False) -> None:
        """Writes `model.json`, whole or not at all.

        Args:
            path: the file.
            force: replace a file that is there.

        Raises:
            InputError: the file is there, and force is not given.
        """
        write_json(path, self.to_dict(), force=force)


def load_model(path: str | Path) -> Model:
    """Reads the `model.json` at `path`, or in the folder there. It holds all of the robot that a prediction needs.

    Raises:
        InputError: a missing file, or one that is no model.
    """
    file = Path(path)
    file = file / "model.json" if file.is_dir() else file
    remedy = "give the model.json of oed identify or oed diagnose, or the folder that holds one"
    data = read_json(file, Model.FORMAT, Model.FORMAT_VERSION, remedy=remedy)
    with damage_refused(file, remedy="identify the robot again with oed identify"):
        return model_from_dict(data)


def model_from_dict(data: Mapping[str, Any]) -> Model:
    """Reads what `Model.to_dict` gives.

    Raises:
        InputError: parameters that do not belong to the terms, are not finite, or have a negative variance.
    """
    with damage_refused(None, entry="robot"):
        robot = build_robot(data["robot"])
    with damage_refused(None, entry="terms"):
        torque_model = TorqueModel(robot, tuple(build_term(term) for term in data["terms"]))
    index = {name: i for i, name in enumerate(torque_model.names)}
    parameters = [vars(item) for item in read(list[_Stated], data.get("parameters"), "parameters")]
    unknown = [item["name"] for item in parameters if item["name"] not in index]
    if unknown:
        raise InputError(f"parameter {unknown[0]} does not belong to the model's terms")
    torque_model.symbolic()  # a term that does not suit the robot says so now, not at the first prediction
    columns = tuple(index[item["name"]] for item in parameters)
    values = np.array([item["value"] for item in parameters], dtype=float)
    if data.get("covariance") is None:
        raise InputError("the model has no covariance, so nothing tells what its parameters are worth")
    covariance = _shaped("covariance", data["covariance"], (len(parameters), len(parameters)))
    felt = _shaped("felt_by_extensions", data.get("felt_by_extensions", values), (len(parameters),))
    if not columns or len(set(columns)) < len(columns):
        raise InputError("parameters are missing or repeated", allowed="one or more, each once")
    if not all(np.isfinite(numbers).all() for numbers in (values, covariance, felt)):
        raise InputError("values or covariances that are not finite", remedy="identify the robot again")
    if (np.diag(covariance) < 0).any():
        wrong = parameters[int(np.argmin(np.diag(covariance)))]["name"]
        raise InputError(f"the variance of {wrong} is negative", remedy="identify the robot again")
    if data.get("extensions"):
        require_described(data["robot"])
    cutoff = read(dict[str, Any], data.get("provenance"), "provenance").get("cutoff_hz", 1.0)
    if isinstance(cutoff, bool) or not (isinstance(cutoff, int | float) and 0 < cutoff < np.inf):
        raise InputError(f"provenance: cutoff_hz is {cutoff!r}", allowed="a positive number [Hz]")
    return Model(
        torque_model=torque_model,
        columns=columns,
        values=values,
        covariance=covariance,
        determined=np.array([item["determined"] for item in parameters], dtype=bool),
        formulas=tuple(item["stands_for"] for item in parameters),
        provenance=data["provenance"],
        extensions=tuple(read_extension(item, torque_model.robot) for item in data.get("extensions", [])),
        felt=felt if "felt_by_extensions" in data else None,
        since=None if data.get("phases_since") is None else float(data["phases_since"]),
        bearing=read_gear_load(data["borne_by_gears"], torque_model.robot) if "borne_by_gears" in data else None,
    )


@dataclass(frozen=True, kw_only=True)
class _Stated:
    """A parameter as a file has it."""

    name: str
    value: float
    determined: bool
    stands_for: str


def _shaped(entry: str, found: ArrayLike, shape: tuple[int, ...]) -> Array:
    """An array of the shape that the parameters ask for."""
    with damage_refused(None, entry=entry):
        array = np.array(found, dtype=float)
    if array.shape != shape:
        raise InputError(f"found the shape {array.shape}", column=entry, allowed=f"{shape}, as there are parameters")
    return array


def _with_payload(model: TorqueModel, columns: Sequence[int], values: Array, payload: ArrayLike | None) -> Array:
    """Standard parameters (p,) of base parameters, with a body at the flange."""
    parameters = np.zeros(model.size)
    parameters[list(columns)] = values
    return parameters if payload is None else with_body(model, parameters, np.asarray(payload, dtype=float))
