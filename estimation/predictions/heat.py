"""What a prediction needs to know of heat: the state at the start, from earlier logs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from estimation.models.model import Model
from estimation.predictions.earlier_logs import clock_shift, warmed
from estimation.predictions.prediction import Prediction, predict
from estimation.thermal import start_temperatures, thermal_from_dict
from robots.common.errors import InputError
from robots.common.records import read_json
from robots.signals import Log


@dataclass(frozen=True, kw_only=True)
class Heat:
    """Thermal inputs of a prediction.

    Attributes:
        options: for `predict`.
        assumed: a sentence on the assumed initial state.
    """

    options: dict[str, Any] = field(default_factory=dict)
    assumed: str = ""


def heat_of(path: Path, model: Model, log: Log, earlier: Sequence[Log], ambient: float | None, later: float) -> Heat:
    """Gives what a prediction of a log needs to know of heat.

    Args:
        path: of the model.
        model: as it was read.
        log: whose torques are predicted.
        earlier: logs of what the robot did before.
        ambient: ambient temperature where logs do not state it [degC].
        later: how much later [s] than its own clock says the log counts.

    Raises:
        InputError: an ambient temperature for a model without heat, or out of range.
    """
    file = path / "model.json" if path.is_dir() else path
    thermal = thermal_from_dict(model, read_json(file, remedy="give the model.json of oed thermal"))
    if thermal is None:
        if ambient is not None:
            raise InputError(
                "the model has no thermal part",
                file=file,
                remedy="remove --ambient, or use a model of `oed thermal`",
            )
        placed, assumed = warmed(model, earlier, log, later)
        return Heat(options={"before": placed}, assumed=assumed)
    if ambient is not None and not -30.0 <= ambient <= 60.0:
        raise InputError(f"--ambient {ambient}", allowed="-30 to 60 degC")
    start = None
    if earlier:
        start = start_temperatures(thermal, earlier, float(log.t[0]), ambient=ambient)
        assumed = (
            f"thermal friction: initial temperatures computed from {len(earlier)} earlier logs; the first is "
            f"assumed to start cold"
        )
    else:
        assumed = (
            "thermal friction: the robot is assumed cold at the start; give earlier logs with --before if it was warm"
        )
    return Heat(options={"thermal": thermal, "start": start, "ambient": ambient}, assumed=assumed)


def predict_warm(
    path: Path, model: Model, log: Log, earlier: Sequence[Log], ambient: float | None, *, by: Model | None = None
) -> tuple[Prediction, str, str]:
    """Predicts the torques of a log with what is known of heat and of the time since the model was identified.

    Args:
        path: of the model.
        model: as it was read.
        log: whose torques are predicted.
        earlier: logs of what the robot did before.
        ambient: ambient temperature where logs do not state it [degC].
        by: the same model with another smoothing, that predicts.

    Returns:
        The prediction, a sentence on the assumed initial state, and one on the clock; empty where there is none.

    Raises:
        InputError: see `heat_of` and `predict`.
    """
    later, clock = clock_shift(model, log)
    heat = heat_of(path, model, log, earlier, ambient, later)
    return predict(by or model, log, later=later, **heat.options), heat.assumed, clock
