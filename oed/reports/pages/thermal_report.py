"""The page of a fit of friction and heat."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from estimation.thermal import CampaignEstimate, ThermalChoice, ThermalEstimate
from estimation.thermal.identification import ThermalIdentification
from oed.reports.pictures.thermal_pictures import (
    duty_picture,
    duty_runs,
    friction_curves_picture,
    friction_time_picture,
    time_constant_picture,
)
from oed.reports.rendering.page import Cell, Fact, Page, Section, Table, page_of
from oed.reports.rendering.picture import Picture
from oed.reports.rendering.provenance import recordings_from
from robots.common.arrays import Array
from robots.common.plain import significant, significant_error
from robots.signals import Log


def thermal_result_page(result: ThermalIdentification) -> Page:
    """Builds the page of an identification with heat, see `thermal_page`."""
    return thermal_page(result.estimate, result.logs, joint=result.joint, choice=result.choice)


def thermal_page(
    estimate: CampaignEstimate, logs: Sequence[Log], *, joint: int, choice: ThermalChoice | None = None
) -> Page:
    """Builds the page: change of friction with temperature, time constants, uncertainty, undetermined parameters.

    Args:
        estimate: of rigid body, friction and heat.
        logs: that it was fitted to.
        joint: counted from 1, whose duty cycles are shown and on which the models were compared.
        choice: models beside each other.
    """
    robot, fits = estimate.model.robot, estimate.thermal
    names, kinds = robot.joint_names, robot.chain.kinds
    gain = estimate.gain
    moving = [fit for fit in fits if fit is not None]
    coefficients = _coefficients(estimate)
    fit = fits[joint - 1]
    duty = None if fit is None else duty_picture(fit, duty_runs(logs), title=f"joint {joint}")
    first: list[Picture] = [friction_time_picture(fits, joint_names=names), *([duty] if duty else [])]
    sections = [
        Section(title="Friction over time", pictures=tuple(first), tables=(_joints(estimate),)),
        Section(
            title="Time constants",
            paragraphs=("Time constants fall as the power rises: warm friction is smaller and produces less heat.",),
            pictures=(time_constant_picture(fits, joint_names=names),),
        ),
        Section(
            title="Friction cold to warm",
            pictures=(
                friction_curves_picture(fits, coefficients, _speeds(estimate, logs), joint_names=names, kinds=kinds),
            ),
        ),
        Section(
            title="Parameters",
            paragraphs=(
                (
                    "Without a temperature sensor in the joint, only the ratios of alpha to heat exchanges and "
                    "capacities are determined. Twice the temperature rise with half the friction change per kelvin "
                    "gives the same torques. Friction predictions do not need the undetermined values."
                ),
            ),
            tables=tuple(_parameters(item, j) for j, item in enumerate(fits, start=1) if item is not None),
            folded=True,
        ),
    ]
    if choice is not None:
        sections.insert(1, Section(title="Model comparison", tables=(_models(choice, joint),)))
    worst = int(np.argmin(np.where([item is not None for item in fits], gain, np.inf)))
    return page_of(
        estimate,
        title="Friction and temperature",
        robot=robot.title or robot.name,
        logs=recordings_from(logs),
        facts=(
            Fact(label="Model", value=moving[0].model.name if moving else "–"),
            Fact(label="Largest gain", value=f"{100 * gain.max():.0f} %", note=f"joint {int(gain.argmax()) + 1}"),
            Fact(label="Smallest gain", value=f"{100 * gain[worst]:.0f} %", note=f"joint {worst + 1}"),
            Fact(label="Iterations (dynamics, thermal model)", value=estimate.rounds),
        ),
        sections=sections,
    )


def _joints(estimate: CampaignEstimate) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for j, fit in enumerate(estimate.thermal):
        head: tuple[Cell, ...] = (
            j + 1,
            estimate.model.robot.joint_names[j],
            float(estimate.residual_without[j]),
            float(estimate.residual_rms[j]),
        )
        if fit is None:
            rows.append((*head, None, None, None, "does not move"))
            continue
        texts = [
            f"{significant(q.value / 60, q.standard_error / 60)} ± {significant_error(q.half_width / 60)}"
            if q.determined
            else "not determined"
            for q in fit.time_constants
        ]
        seen = fit.span
        ratio = None
        if seen is not None:
            ratio = f"{significant(seen.value, seen.standard_error)} ± {significant_error(seen.half_width)}"
        bounds = "; ".join(f"{name} above {value / 60:.3g} min" for name, value in fit.bounds.items())
        fast = texts[1] if len(texts) > 1 else None
        rows.append((*head, texts[0], fast, ratio, bounds or "–"))
    headings = (
        "joint",
        "name",
        "error without thermal model [N m or N]",
        "with thermal model [N m or N]",
        "slow time constant [min]",
        "fast time constant [min]",
        "highest / lowest friction [1]",
        "bounds (95 %)",
    )
    caption = (
        "RMS torque error [N m or N]. Time constants at the mean power of the logs. Highest / lowest: friction of the "
        "coldest and the warmest time in the logs. ± holds 95 %, and allows for friction that falls exponentially with "
        "temperature."
    )
    return Table(headings=headings, rows=tuple(rows), caption=caption)


def _parameters(fit: ThermalEstimate, joint: int) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for item in (*fit.parameters, *fit.combinations):
        sure = np.isfinite(item.standard_error)
        value = significant(item.value, item.standard_error) if sure and item.standard_error > 0 else item.value
        note = "not determined" if not item.determined else "" if sure else "fixed"
        rows.append((item.name, value, significant_error(item.standard_error) if sure else "–", item.unit, note or "–"))
    return Table(
        headings=("quantity", "value", "standard error", "unit", "remark"),
        rows=tuple(rows),
        caption=f"Joint {joint}, {fit.model.name} model.",
        align=("left", "right", "right", "left", "left"),
    )


def _models(choice: ThermalChoice, joint: int) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for item in choice.candidates:
        name = f"{item.order} (chosen)" if item.order == choice.best else item.order
        if item.estimate is None:
            rows.append((name, None, None, None, item.failure, *[None] * 5))
            continue
        cells: list[Cell] = []
        for phase in (item.heating, item.cooling):
            shares = (None,) * 3 if phase is None else (phase.mean_share, phase.largest_share, phase.steady_share)
            cells += [None if share is None else f"{100 * share:.2f} %" for share in shares]
        rows.append((name, 100 * item.held_out, item.estimate.aic, item.estimate.bic, *cells))
    words = ("mean", "largest", "steady state")
    return Table(
        headings=(
            "model",
            "held out [%]",
            "AIC",
            "BIC",
            *(f"{phase}: {word}" for phase in ("heating", "cooling") for word in words),
        ),
        rows=tuple(rows),
        caption=(
            f"Friction errors of joint {joint}, averaged over two minutes (as in thesis Tables 6 and 7). Held out: "
            f"{'one run after the other' if choice.held_out == 'runs' else 'the last third of each run'}."
        ),
    )


def _coefficients(estimate: CampaignEstimate) -> Array:
    place = {column.name: value for column, value in zip(estimate.model.parameters, estimate.model.values, strict=True)}
    n = estimate.model.robot.n
    return np.array([[place.get(f"f{k}_{j}", 0.0) for k in range(1, 5)] for j in range(1, n + 1)])


def _speeds(estimate: CampaignEstimate, logs: Sequence[Log]) -> Array:
    """Speeds that the joints reached (n,) [rad/s or m/s], as far as the limits allow."""
    reached = np.max([np.abs(np.diff(log.q, axis=0) / np.diff(log.t)[:, None]).max(axis=0) for log in logs], axis=0)
    return np.maximum(np.minimum(reached, estimate.model.robot.limits.velocity), 1e-3)
