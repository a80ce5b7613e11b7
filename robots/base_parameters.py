"""Parameters that the torques determine: base parameters, their regrouping, and the essential ones."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from robots.common.arrays import Array
from robots.common.errors import NotIdentifiableError
from robots.regressor import TorqueModel
from robots.terms import Column

log = logging.getLogger(__name__)

_COLUMN_ROUNDING = 1e-9  # of a column; rounding in the regressor, and in its least squares, stays well below
_COLUMN_NOISE = 1e-3  # of a column; the largest coefficient that is ever taken for noise of the neglected part

IDENTIFIABLE, COMBINED, UNIDENTIFIABLE = "identifiable", "in combination", "unidentifiable"


@dataclass(frozen=True)
class BaseParameters:
    """A minimal parameter set: Y pi = Y_b pi_b with pi_b = grouping pi.

    Attributes:
        model: the torque model with p standard parameters.
        independent: indices (b,) of the columns kept, ascending.
        grouping: (b, p); row i says which standard parameters base parameter i sums, with what coefficients.
        singular_values: (p,) of the column-scaled sample regressor, descending: the gap after b confirms the rank.
        neglected: the largest part of a column that the kept ones do not span, of the largest norm of its kind: some
            1e-15 by rounding; more where the geometry is close to a special case.
        gravities: (3,) each [m/s2], in the base frame: besides that of the robot's description, those under which the
            grouping holds too.
    """

    model: TorqueModel
    independent: tuple[int, ...]
    grouping: Array
    singular_values: Array
    neglected: float
    gravities: tuple[tuple[float, ...], ...] = ()

    @property
    def size(self) -> int:
        """b, the number of base parameters."""
        return len(self.independent)

    @cached_property
    def columns(self) -> tuple[Column, ...]:
        """The kept columns' descriptions (b,)."""
        return tuple(self.model.columns[i] for i in self.independent)

    @property
    def names(self) -> tuple[str, ...]:
        """The kept columns' names (b,)."""
        return tuple(column.name for column in self.columns)

    @property
    def units(self) -> tuple[str, ...]:
        """Units of the parameters (b,)."""
        return tuple(column.unit for column in self.columns)

    @cached_property
    def classes(self) -> tuple[str, ...]:
        """Each standard parameter's class (p,) after the thesis, section 1.1.

        ``identifiable``: alone in its own base parameter. ``in combination``: shares a base parameter.
        ``unidentifiable``: in none.
        """
        used = self.grouping != 0
        alone = used.sum(axis=1) == 1
        return tuple(
            UNIDENTIFIABLE if not used[:, j].any() else IDENTIFIABLE if alone[used[:, j]].all() else COMBINED
            for j in range(self.model.size)
        )

    def formulas(self) -> tuple[str, ...]:
        """Writes each base parameter as the sum it stands for, such as ``Izz_3 + Iyy_4 + 0.0049 m_4``."""
        names = self.model.names
        return tuple(_formula(row, names, kept) for row, kept in zip(self.grouping, self.independent, strict=True))

    def from_standard(self, parameters: ArrayLike) -> Array:
        """Regroups standard parameters (p,) into base parameters (b,)."""
        return self.grouping @ np.asarray(parameters, dtype=float)

    def regressor(self, q: ArrayLike, dq: ArrayLike, ddq: ArrayLike, *, gravity: ArrayLike | None = None) -> Array:
        """Evaluates the base regressor Y_b (N, n, b).

        Args:
            q: positions (N, n) [rad or m].
            dq: velocities (N, n) [rad/s or m/s].
            ddq: accelerations (N, n) [rad/s2 or m/s2].
            gravity: another one of `gravities` (3,), in the base frame [m/s2]; by default that of the description.
        """
        return self.model.under(gravity).regressor(q, dq, ddq, columns=self.independent)

    def torque(
        self,
        q: ArrayLike,
        dq: ArrayLike,
        ddq: ArrayLike,
        parameters: ArrayLike,
        *,
        gravity: ArrayLike | None = None,
    ) -> Array:
        """Evaluates tau = Y_b pi_b (N, n) [N m or N].

        Args:
            q: positions (N, n) [rad or m].
            dq: velocities (N, n) [rad/s or m/s].
            ddq: accelerations (N, n) [rad/s2 or m/s2].
            parameters: base parameters (b,).
            gravity: another one of `gravities` (3,), in the base frame [m/s2]; by default that of the description.
        """
        return self.model.under(gravity).torque(q, dq, ddq, parameters, columns=self.independent)

    def essential(
        self, q: ArrayLike, dq: ArrayLike, ddq: ArrayLike, parameters: ArrayLike, threshold: float = 0.01
    ) -> tuple[int, ...]:
        """Finds the base parameters that matter on a motion.

        A parameter is essential when its own torque's RMS exceeds the threshold's share of the torque's RMS on at
        least one joint (thesis section 1.3: essential parameters).

        Args:
            q: positions (N, n) [rad or m].
            dq: velocities (N, n) [rad/s or m/s].
            ddq: accelerations (N, n) [rad/s2 or m/s2].
            parameters: base parameters (b,).
            threshold: the share, 0 to 1.

        Returns:
            Indices into the base parameters, ascending.
        """
        Y = self.regressor(q, dq, ddq)
        pi = np.asarray(parameters, dtype=float)
        total = np.sqrt(np.mean((Y @ pi) ** 2, axis=0))  # (n,)
        own = np.sqrt(np.mean(Y**2, axis=0)) * np.abs(pi)  # (n, b)
        share = np.divide(own, total[:, None], out=np.zeros_like(own), where=total[:, None] > 0)
        return tuple(int(i) for i in np.flatnonzero((share >= threshold).any(axis=0)))


def find_base_parameters(
    model: TorqueModel,
    *,
    gravities: Iterable[ArrayLike] = (),
    columns: Sequence[int] | None = None,
    samples: int = 400,
    seed: int = 0,
    tolerance: float = 3e-3,
) -> BaseParameters:
    """Finds the base parameters by a QR factorisation that walks the columns from left to right.

    A column that the ones before it span, on random states all over the robot's ranges, is regrouped into them
    (thesis section 1.3.1); the singular values must confirm the rank (section 1.3.2). Columns are measured against the
    largest of their kind (masses, moments, inertias, ...). Where right angles are rounded to 1.57, some are independent
    by parts in a million; where a calibration found axes that lean by a milliradian, by a thousandth. Their torque is
    below what noise and motion show. Arms as they are designed have no column between 0.0001 and 0.03 (20 public
    descriptions). `BaseParameters.neglected` says how much was left out.

    Args:
        model: the torque model.
        gravities: (3,) each [m/s2], in the base frame: bases that stand otherwise than the description says. A joint on
            a vertical axis gets parameters by a base that is tilted.
        columns: indices of the columns that are asked for, the other parameters being known; None for all.
        samples: how many random states.
        seed: of the random states.
        tolerance: the part of a column, of the largest norm of its kind, below which it counts as spanned.

    Returns:
        The base parameters.

    Raises:
        NotIdentifiableError: the singular values show a lower rank than the columns kept.
    """
    others = tuple(dict.fromkeys(tuple(np.asarray(gravity, dtype=float).tolist()) for gravity in gravities))
    others = tuple(gravity for gravity in others if not np.array_equal(gravity, model.robot.chain.gravity))
    Y = np.concatenate([_random_regressor(model.under(gravity), samples, seed) for gravity in (None, *others)])
    if columns is not None:
        Y[:, np.setdiff1d(np.arange(model.size), list(columns))] = 0.0
    scale = _scales(model, np.linalg.norm(Y, axis=0))
    scaled = Y / scale
    independent = _walk(scaled, tolerance)
    singular_values = np.asarray(np.linalg.svd(scaled, compute_uv=False), dtype=np.float64)
    _confirm(singular_values, len(independent))
    combination = np.linalg.lstsq(scaled[:, independent], scaled, rcond=None)[0]  # (b, p)
    left = np.linalg.norm(scaled - scaled[:, independent] @ combination, axis=0)
    neglected = float(left.max())
    # Columns of friction may be nearly alike, too: that is not the geometry's.
    of_links = np.array([column.term == "rigid_body" for column in model.columns])
    if left[of_links].max(initial=0.0) > _COLUMN_ROUNDING:
        log.warning(
            (
                "%s: axes that are nearly parallel, perpendicular or intersecting are treated as exactly so (%.1e of "
                "the regressor is neglected). Usual causes: rounded angles in the description, such as 1.5708 for pi / "
                "2, and calibrated axes"
            ),
            model.robot.name,
            left[of_links].max(),
        )
    grouping = combination * scale[None, :] / scale[independent][:, None]
    # Values as small as the neglected part are its noise.
    noise = max(_COLUMN_ROUNDING, min(10 * neglected, _COLUMN_NOISE))
    grouping = np.where(np.abs(combination) < noise, 0.0, _snap(grouping))
    grouping[:, independent] = np.eye(len(independent))
    return BaseParameters(model, tuple(independent), grouping, singular_values, neglected, others)


def _random_regressor(model: TorqueModel, samples: int, seed: int) -> Array:
    robot = model.robot
    rng = np.random.default_rng(seed)
    revolute = np.array([joint.kind == "revolute" for joint in robot.chain.joints])
    # Whole turns rather than the limits: which parameters act is the geometry's, not a narrow range's.
    half = np.where(revolute, np.pi, 1.0)
    q, dq, ddq = (rng.uniform(-1, 1, (samples, robot.n)) * factor for factor in (half, 3.0, 10.0))
    # CasADi's interpreter: compiling or translating the expression takes longer for so few samples.
    Y = model.symbolic().map(samples)(q.T, dq.T, ddq.T).full().reshape(robot.n, samples, model.size)
    return np.asarray(Y.transpose(1, 0, 2).reshape(samples * robot.n, model.size))


def _scales(model: TorqueModel, norms: Array) -> Array:
    """The largest norm (p,) among the columns of the same kind, 1 where all of a kind are zero."""
    kinds = [(column.term, column.unit) for column in model.columns]
    largest: dict[tuple[str, str], float] = {}
    for kind, norm in zip(kinds, norms, strict=True):
        largest[kind] = max(largest.get(kind, 0.0), float(norm))
    return np.array([largest[kind] or 1.0 for kind in kinds])


def _walk(scaled: Array, tolerance: float) -> list[int]:
    """Orthogonalises the columns in order, twice each for accuracy, and keeps those that bring something new."""
    basis = np.empty((scaled.shape[0], 0))
    kept = []
    for j in range(scaled.shape[1]):
        column = scaled[:, j]
        for _ in range(2):
            column = column - basis @ (basis.T @ column)
        length = np.linalg.norm(column)
        if length > tolerance:
            basis = np.column_stack([basis, column / length])
            kept.append(j)
    return kept


def _confirm(singular_values: Array, kept: int) -> None:
    rank = int(np.sum(singular_values > _COLUMN_ROUNDING * singular_values[0]))
    if kept > rank:
        raise NotIdentifiableError(
            f"{kept} base parameters by QR, {rank} by SVD: columns that differ only by rounding were kept",
            remedy="use a larger tolerance",
        )


def _snap(values: Array) -> Array:
    rounded = np.round(values)
    return np.where(np.abs(values - rounded) < 1e-9, rounded, values)


def _formula(row: Array, names: Sequence[str], kept: int) -> str:
    others = [j for j in map(int, np.flatnonzero(row)) if j != kept]
    text = names[kept]
    for j in others:
        size = abs(row[j])
        factor = "" if size == 1.0 else f"{size:.6g} "
        text += f" {'-' if row[j] < 0 else '+'} {factor}{names[j]}"
    return text
