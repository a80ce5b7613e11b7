"""How a design's criterion judges: which rows and columns count how much, and what is known already."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from oed.criteria import SCALINGS, Criterion, Prior, Weighting, nominal_scale, task_transform
from robots.base_parameters import BaseParameters
from robots.common.errors import InputError
from robots.signals import Motion


def choose_weighting(
    base: BaseParameters,
    criterion: Criterion,
    scaling: str,
    noise: ArrayLike | None,
    after: Prior | None,
    task: Motion | None,
    samples: float,
) -> Weighting:
    """Collects how rows and columns count, and what is known already.

    Args:
        base: the parameters that will be fitted.
        criterion: that will judge.
        scaling: of the columns, see `oed.design`.
        noise: of each joint (n,).
        after: an earlier identification.
        task: a motion to predict.
        samples: how many the experiment will bring.

    Raises:
        InputError: an unknown scaling, noise that is not one positive number a joint, a task without criterion ``i``.
    """
    if scaling not in SCALINGS:
        raise InputError(f"scaling {scaling!r}", allowed=", ".join(SCALINGS))
    if (criterion.name == "i") != (task is not None):
        raise InputError(
            "criterion i needs a task, and a task needs criterion i",
            remedy="give both (--criterion i --task FILE), or neither",
        )
    joints = base.model.robot.n
    levels = after.noise if noise is None and after is not None else noise
    rows = None
    if levels is not None:
        sizes = np.asarray(levels, dtype=float)
        if sizes.shape != (joints,) or not (np.isfinite(sizes) & (sizes > 0)).all():
            raise InputError(f"torque noise {levels}", allowed=f"{joints} positive numbers")
        rows = 1 / sizes
    transform = nominal_scale(base) if scaling == "nominal" else None
    if task is not None:
        if task.n != joints:
            raise InputError(f"a task of {task.n} joints", allowed=f"{joints}")
        transform = task_transform(base, task.q, task.dq, task.ddq)
    words = [
        *([f"columns by {scaling}"] if scaling != "none" else []),
        *(["rows by noise"] if rows is not None else []),
        *(["after an earlier model"] if after is not None else []),
        *(["for the task"] if task is not None else []),
    ]
    return Weighting(
        rows=rows,
        transform=transform,
        unit_columns=scaling == "unit",
        prior=None if after is None else after.information(base.names),
        amount=samples / (after.colour**2 if after is not None else 1.0),
        name=", ".join(words) or "none",
    )
