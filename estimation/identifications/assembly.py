"""An estimate from a fit: model, provenance and the errors of each joint, however the rows were read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimation.estimators import Estimator
from estimation.identifications.estimate import Estimate, JointFit, colour_of
from estimation.identifications.fit import Fit
from estimation.identifications.verdicts import determined_parameters
from estimation.logs.provenance import describe_logs
from estimation.models.model import Model
from robots.common.arrays import Array
from robots.signals import Log
from robots.version import VERSION


@dataclass(frozen=True, kw_only=True, eq=False)
class Figures:
    """Sums over the rows of each joint (n,) that are judged.

    Attributes:
        rows: number of rows, at least 1.
        torque: squared torques.
        sums: torques.
        residual: squared errors.
        floor: noise level [N m or N].
        band: half-width of the band that holds 95 % of the errors.
    """

    rows: Array
    torque: Array
    sums: Array
    residual: Array
    floor: Array
    band: Array


def joint_fits(found: Fit, figures: Figures, identified: NDArray[np.bool_]) -> tuple[JointFit, ...]:
    """States each joint's errors, beside what a constant and the robot's description would give.

    Args:
        found: the fit.
        figures: of all rows.
        identified: joints (n,) whose torque follows from the motion.
    """
    rms, residual, nominal = np.sqrt(np.array([figures.torque, figures.residual, found.nominal]) / figures.rows)
    columns = {
        "torque_rms": rms,
        "torque_spread": np.sqrt(np.maximum(rms**2 - (figures.sums / figures.rows) ** 2, 0.0)),
        "residual_rms": residual,
        "held_out_rms": found.choice.held_out,
        "nominal_rms": nominal,
        # A residual that is not white at its fast end has less noise than that end says.
        "noise_floor": np.minimum(figures.floor, residual),
        "band": figures.band,
    }
    return tuple(
        JointFit(
            joint=j + 1,
            name=name,
            identified=bool(identified[j]),
            **{key: float(column[j]) for key, column in columns.items()},
        )
        for j, name in enumerate(found.base.model.robot.joint_names)
    )


def assemble(found: Fit, joints: tuple[JointFit, ...], provenance: dict[str, object], **more: Any) -> Estimate:
    """Makes an estimate of a fit.

    Args:
        found: the fit.
        joints: errors of each joint.
        provenance: what is known of the logs, for `model.json`.
        more: further attributes of the estimate.
    """
    base, choice = found.base, found.choice
    determined = determined_parameters(found, joints)
    stated = {
        **provenance,
        "cutoff_hz": choice.low_pass,
        "smoothing": choice.smoother.to_dict(),
        "ridge": choice.ridge,
        "velocity_scales": list(choice.velocity_scales),
        "band95": [joint.band for joint in joints],
        "band_growth": choice.band.growth.tolist(),
        "band_covariance": choice.band.covariance.tolist(),
        "band_reach": choice.band.reach.tolist(),
        "noise_floor": [joint.noise_floor for joint in joints],
        "residual_rms": [joint.residual_rms for joint in joints],
        "held_out_rms": [joint.held_out_rms for joint in joints],
        "torque_rms": [joint.torque_rms for joint in joints],
        "joints_identified": [joint.identified for joint in joints],
        "colour": colour_of(np.sqrt(np.maximum(np.diag(found.covariance), 0.0)), found.white, determined),
        "gravities": [list(gravity) for gravity in base.gravities],
    }
    if found.prior_share is not None:
        stated["prior_share"] = found.prior_share.tolist()
    if "standard" in found.solution.extras:
        stated["standard_parameters"] = np.asarray(found.solution.extras["standard"], dtype=float).tolist()
    if found.solution.extras.get("active"):
        stated["at_bounds"] = list(found.solution.extras["active"])
    return Estimate(
        model=Model(
            torque_model=base.model,
            columns=base.independent,
            values=found.solution.values,
            covariance=found.covariance,
            determined=determined,
            formulas=base.formulas(),
            provenance=stated,
        ),
        choice=choice,
        joints=joints,
        white_noise_errors=found.white,
        t=np.concatenate([part.motion.t for part in found.rows]),
        dq=np.concatenate([part.motion.dq for part in found.rows]),
        measured=np.concatenate([part.tau for part in found.rows]),
        predicted=found.torque,
        **more,
    )


def describe_logs_and_method(logs: Sequence[Log], method: Estimator, seed: int) -> dict[str, object]:
    """Lists what was fitted, and how, for `model.json`."""
    return {"logs": describe_logs(logs), "method": method.name, "tool_version": VERSION, "seed": seed}
