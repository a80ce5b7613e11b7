"""The page of an identification."""

from __future__ import annotations

import numpy as np

from estimation.identifications.estimate import Estimate
from estimation.predictions.method_table import MethodTable
from oed.reports.pictures.parameter_pictures import error_bars_picture, friction_picture, parameter_picture
from oed.reports.pictures.torque_pictures import residual_picture, torque_picture
from oed.reports.rendering.page import Cell, Fact, Page, Section, Table, page_of
from oed.reports.rendering.picture import Picture
from oed.reports.rendering.provenance import recordings_of
from robots.common.arrays import Array
from robots.common.plain import significant, significant_error

# Pairs of parameters shown, and the correlation of their errors from which they are.
PAIRS, CORRELATED = 12, 0.8


def estimate_page(estimate: Estimate, methods: MethodTable | None = None) -> Page:
    """Builds the page: torque errors, parameters and their uncertainty.

    Args:
        estimate: the identification.
        methods: estimators compared on held-out data.
    """
    model, joints = estimate.model, estimate.joints
    robot = model.robot
    known = int(model.determined.sum())
    period = float(np.median(np.diff(estimate.t))) if len(estimate.t) > 1 else 1.0
    kinds, names = robot.chain.kinds, robot.joint_names
    residual = estimate.measured - estimate.predicted
    sections = [
        Section(
            title="Torque",
            paragraphs=(
                (
                    "Measured and predicted torque, and the residual, on the fitted rows. The table compares the "
                    "model's error on held-out blocks of the logs with that of a constant and of the robot's "
                    "description."
                ),
            ),
            pictures=(
                _errors(estimate),
                torque_picture(
                    estimate.t,
                    estimate.measured,
                    estimate.predicted,
                    band=[joint.band for joint in joints],
                    joint_names=names,
                    kinds=kinds,
                    errors=[(joint.residual_rms, joint.torque_rms) for joint in joints],
                ),
            ),
            tables=(_joints(estimate),),
        ),
        Section(
            title="Parameters",
            pictures=_parameter_pictures(estimate),
            tables=(_parameters(estimate), *_correlations(estimate)),
        ),
        Section(
            title="Residual",
            pictures=(residual_picture(residual, estimate.dq, period=period, joint_names=names, kinds=kinds),),
        ),
        Section(
            title="Method",
            paragraphs=(
                f"Estimator: {model.provenance['method']}. Positions: {estimate.choice.smoother.text}, without phase "
                f"lag; the smoothing was chosen by cross-validation on contiguous blocks of the logs. "
                "What the logs leave open is regularised by a prior: each parameter may be wrong by its own size. "
                "Standard errors: sandwich estimator with an autoregressive model of the residuals, correlated across "
                "joints, and the scatter of the prior. "
                "The 95 % band is that of the fitted logs. For another motion it is widened by the parameters' errors, "
                "times a factor by which it holds 98 % where parts of the logs predicted other parts.",
            ),
            tables=(_logs(estimate),),
            folded=True,
        ),
    ]
    if methods is not None:
        sections.insert(1, Section(title="Estimators", tables=(_methods(methods),)))
    return page_of(
        estimate,
        title="Identified dynamics",
        robot=robot.title or robot.name,
        logs=recordings_of(model.provenance["logs"]),
        facts=(
            Fact(label="Parameters determined", value=f"{known} of {len(model.names)}"),
            Fact(label="Worst joint, held-out data", value=f"{100 * max(joint.nrmse for joint in joints):.1f} %"),
            Fact(label="Samples", value=estimate.samples),
            Fact(
                label="Residual correlation factor",
                value=f"{estimate.colour:.1f}",
                note="the standard errors are this many times those of white noise",
            ),
        ),
        sections=sections,
        seed=model.provenance.get("seed"),
    )


def _errors(estimate: Estimate) -> Picture:
    def shares(name: str) -> Array:
        pairs = [(getattr(joint, name), joint.torque_rms) for joint in estimate.joints]
        return np.array([error / scale if scale else np.nan for error, scale in pairs])

    errors = {"fitted": shares("residual_rms"), "held out": shares("held_out_rms")}
    errors["noise floor"] = shares("noise_floor")
    rivals = {"a constant instead of the model": shares("torque_spread")}
    nominal = shares("nominal_rms")
    if np.isfinite(nominal).any():
        rivals["robot's description"] = nominal
    return error_bars_picture(errors, rivals=rivals, joint_names=estimate.model.robot.joint_names)


def _joints(estimate: Estimate) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for joint in estimate.joints:
        scale = joint.torque_rms or np.nan
        errors = (
            joint.residual_rms,
            joint.held_out_rms,
            joint.torque_spread,
            joint.nominal_rms,
            joint.noise_floor,
            joint.band,
        )
        rows.append(
            (
                joint.joint,
                joint.name,
                joint.torque_rms,
                *(None if not np.isfinite(e) else 100 * e / scale for e in errors),
                "yes" if joint.identified else "NO",
            )
        )
    headings = (
        "joint",
        "name",
        "torque RMS [N m or N]",
        "fitted [%]",
        "held out [%]",
        "constant [%]",
        "description [%]",
        "noise floor [%]",
        "95 % band ± [%]",
        "identified",
    )
    return Table(
        headings=headings,
        rows=tuple(rows),
        caption=(
            "RMS errors in per cent of the joint's torque RMS. Fitted and held-out errors count only rows in which "
            "the joint moves."
        ),
    )


def _parameters(estimate: Estimate) -> Table:
    model = estimate.model
    rows: list[tuple[Cell, ...]] = []
    for column, value, error, known, formula in zip(
        model.parameters, model.values, model.standard_errors, model.determined, model.formulas, strict=True
    ):
        if known:
            percent = significant(100 * error / abs(value), digits=2) if value else "–"
            shown = (significant(value, error), significant_error(error), percent)
            rows.append((column.name, *shown, column.unit, formula))
        else:
            rows.append((column.name, "not determined", "–", "–", column.unit, formula))
    return Table(
        headings=("parameter", "value", "standard error", "percent", "unit", "meaning"),
        rows=tuple(rows),
        caption="Values are rounded to two digits of the standard error.",
        align=("left", "right", "right", "right", "left", "left"),
    )


def _correlations(estimate: Estimate) -> tuple[Table, ...]:
    """Pairs of determined parameters with strongly correlated errors."""
    model = estimate.model
    known = np.flatnonzero(model.determined)
    errors = np.sqrt(np.maximum(np.diag(model.covariance), np.finfo(float).tiny))
    correlation = (model.covariance / errors[:, None] / errors)[np.ix_(known, known)]
    first, second = np.triu_indices(len(known), 1)
    values = correlation[first, second]
    order = [k for k in np.argsort(-np.abs(values))[:PAIRS] if abs(values[k]) >= CORRELATED]
    if not order:
        return ()
    names = [model.names[i] for i in known]
    rows = tuple((names[first[k]], names[second[k]], f"{values[k]:+.3f}") for k in order)
    caption = (
        f"Pairs of determined parameters with error correlations of {CORRELATED:g} or more. Do not interpret them "
        f"separately."
    )
    return (Table(headings=("parameter", "parameter", "correlation"), rows=rows, caption=caption),)


def _methods(methods: MethodTable) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for row in methods.rows:
        shares = [None if row.problem else 100 * float(value) for value in row.unseen]
        mean = None if row.problem else 100 * float(row.unseen.mean())
        rows.append((row.method, *shares, mean, 100 * row.determined, row.seconds, row.problem or "–"))
    joints = (f"joint {joint} [%]" for joint in range(1, len(methods.joint_names) + 1))
    return Table(
        headings=("estimator", *joints, "mean [%]", "determined [%]", "time [s]", "problem"),
        rows=tuple(rows),
        caption=(
            "Standard deviation of the error divided by that of the torque, on held-out data. This report shows the "
            "best estimator."
        ),
    )


def _parameter_pictures(estimate: Estimate) -> tuple[Picture, ...]:
    model = estimate.model
    known = model.determined
    pictures: list[Picture] = []
    if known.any():
        pictures.append(
            parameter_picture(
                [name for name, k in zip(model.names, known, strict=True) if k],
                model.values[known],
                model.standard_errors[known],
                [column.unit for column, k in zip(model.parameters, known, strict=True) if k],
            )
        )
    speed = np.abs(estimate.dq).max(axis=0)
    if any(column.friction for column in model.parameters) and (speed > 0).all():
        pictures.append(_friction(estimate, speed))
    return tuple(pictures)


def _logs(estimate: Estimate) -> Table:
    rows = tuple(
        (log["name"], log["samples"], log["duration"], (log["sha256"] or "")[:16])
        for log in estimate.model.provenance["logs"]
    )
    return Table(headings=("log", "samples", "duration [s]", "sha256"), rows=rows)


def _friction(estimate: Estimate, speed: Array) -> Picture:
    """The friction curves of the model's own friction term."""
    model = estimate.model
    n = model.robot.n
    own = [[k for k, c in enumerate(model.parameters) if c.friction and c.joint == joint + 1] for joint in range(n)]
    most = max(map(len, own))
    coefficients, covariances = np.zeros((n, most)), np.zeros((n, most, most))
    for joint, places in enumerate(own):
        coefficients[joint, : len(places)] = model.values[places]
        covariances[joint, : len(places), : len(places)] = model.covariance[np.ix_(places, places)]

    def shapes(joint: int, dq: Array) -> Array:
        columns = np.zeros((len(dq), most))
        places = [model.columns[k] for k in own[joint]]
        for row, velocity in enumerate(dq):
            columns[row, : len(places)] = model.torque_model.friction_at(np.full(n, velocity))[places]
        return columns

    return friction_picture(
        coefficients,
        speed,
        shapes=shapes,
        covariances=covariances,
        joint_names=model.robot.joint_names,
        kinds=model.robot.chain.kinds,
    )
