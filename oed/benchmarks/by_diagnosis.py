"""Answers by this project's own diagnosis."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray

from oed.benchmarks.answers.answer import CaseAnswer, NamedEffect, StatedValue
from oed.benchmarks.folders import BlindCase
from oed.benchmarks.taxonomy import EFFECT_NAMES, UNKNOWN, known_parameters

VERDICTS = {"none": "nothing", "named": "effects", "ambiguous": "effects", "unexplained": "unexplained"}

NAMES = {"presliding_travel": "presliding_distance", "level": "limit", "mass_change": "mass"}
"""Parameters of the diagnosis that the benchmark calls otherwise."""


def by_diagnosis(case: BlindCase) -> CaseAnswer:
    """Answers a case by `estimation.diagnose` and the prediction of its extended model.

    Args:
        case: the public part of the case.

    Raises:
        OedError: the diagnosis refuses the log.
    """
    from tempfile import TemporaryDirectory

    from estimation import diagnose, load_model, read_log
    from robots import load_robot
    from robots.common.errors import AssumedValueWarning

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AssumedValueWarning)
        robot = load_robot(case.yaml)
        log, unseen = read_log(case.log, n=robot.n), read_log(case.unseen, n=robot.n, torque=False)
        diagnosis = diagnose(robot, [log])
        with TemporaryDirectory() as folder:
            diagnosis.save(folder)
            model = load_model(folder)
        found = diagnosis.to_dict()
        return CaseAnswer(
            verdict=VERDICTS[found["verdict"]],
            effects=tuple(map(named_effect, found["findings"])) if found["verdict"] != "none" else (),
            torque=_predicted(model, log, unseen),
        )


def _predicted(model: Any, log: Any, unseen: Any) -> NDArray[np.float64]:
    from estimation import predict

    prediction = predict(model, unseen, before=[log] if model.keeps_heat else ())
    t, torque = prediction.motion.t, prediction.predicted
    # The prediction leaves out rows at both ends where filters err; there the nearest one counts.
    return np.column_stack([np.interp(unseen.t, t, torque[:, j]) for j in range(torque.shape[1])])


def named_effect(finding: dict[str, Any]) -> NamedEffect:
    """Translates a finding of ``diagnosis.json``; an effect that the benchmark has no name for is ``unknown``.

    Args:
        finding: its effect, joint and parameters.
    """
    name = finding["effect"] if finding["effect"] in EFFECT_NAMES else UNKNOWN
    values = {NAMES.get(p["name"], p["name"]): p for p in finding["parameters"] or ()}
    scored = known_parameters(name, dict.fromkeys(values, 0.0))
    return NamedEffect(
        effect=name,
        joints=() if finding["joint"] is None else (int(finding["joint"]),),
        parameters={key: stated for key in scored if (stated := _stated(values[key])) is not None},
    )


def _stated(parameter: dict[str, Any]) -> StatedValue | None:
    if parameter["value"] is None:
        return None
    low, high = parameter.get("ci95") or (None, None)
    interval = None if low is None or high is None else (float(low), float(high))
    return StatedValue(value=float(parameter["value"]), interval=interval)
