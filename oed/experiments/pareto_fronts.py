"""The verb: designs for several criteria at once, and shows what each costs the others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations_with_replacement
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from oed.criteria import Blend, Criterion
from oed.criteria import criterion as choose_criterion
from oed.experiments.designing import design
from oed.experiments.quality import excitation_findings
from oed.experiments.results.result import Design
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.common.records import Finding, Result, axes_for
from robots.robot import Robot

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes


PARETO = "pareto.json"


@dataclass(frozen=True, kw_only=True)
class ParetoFront(Result, format="robot-oed pareto front"):
    """Designs between the extremes of several criteria.

    Attributes:
        criteria: the k criteria.
        weights: of each criterion's logarithm, (P, k), each row's sum 1.
        designs: the P designs, one for each row of weights.
        values: of each criterion for the optimised part of each design, (P, k), as people read them.
    """

    FILE = PARETO
    ENTRIES = ("criteria=named_criteria", "points")

    criteria: tuple[Criterion, ...]
    weights: Array
    designs: tuple[Design, ...]
    values: Array

    @property
    def efficient(self) -> NDArray[np.bool_]:
        """Which designs (P,) no other one beats in every criterion."""
        signs = np.array([-1.0 if criterion.larger_is_better else 1.0 for criterion in self.criteria])
        costs = self.values * signs
        worse = (costs[None] <= costs[:, None]).all(axis=2) & (costs[None] < costs[:, None]).any(axis=2)
        efficient: NDArray[np.bool_] = ~worse.any(axis=1)
        return efficient

    @property
    def named_criteria(self) -> list[dict[str, str]]:
        """Name and label of each criterion."""
        return [{"name": criterion.name, "label": criterion.label} for criterion in self.criteria]

    @property
    def points(self) -> list[dict[str, Any]]:
        """The designs, each in a folder beside the file, with weights and values."""
        return [
            {"folder": folder_of(point), "weights": weights, "values": values, "efficient": bool(efficient)}
            for point, (weights, values, efficient) in enumerate(
                zip(self.weights, self.values, self.efficient, strict=True), start=1
            )
        ]

    @property
    def success(self) -> bool:
        """Whether all designs keep their limits and excite all parameters."""
        return all(design.success for design in self.designs)

    def to_frame(self) -> pd.DataFrame:
        """Gives a row per design: weights, values, and whether it is efficient."""
        import pandas as pd

        names = [criterion.name for criterion in self.criteria]
        data: dict[str, Any] = {f"weight_{name}": self.weights[:, k] for k, name in enumerate(names)}
        data |= {name: self.values[:, k] for k, name in enumerate(names)}
        index = pd.RangeIndex(1, len(self.designs) + 1, name="point")
        return pd.DataFrame({**data, "efficient": self.efficient}, index=index)

    @property
    def conclusion(self) -> str:
        """How many designs there are to choose from."""
        return (
            f"Choose one of {int(self.efficient.sum())} Pareto-optimal designs, of {len(self.designs)}: no other "
            "design is better in every criterion."
        )

    @property
    def remarks(self) -> tuple[Finding, ...]:
        """What single designs do not determine, and limits that they exceed."""
        found = [
            replace(finding, subject=f"Point {point}:")
            for point, design in enumerate(self.designs, start=1)
            for finding in excitation_findings(design.whole)
        ]
        found += [
            Finding(
                code="limit.exceeded",
                subject=f"Point {point}:",
                text=f"the motion exceeds {len(design.violated)} limits.",
                action="Do not play it.",
            )
            for point, design in enumerate(self.designs, start=1)
            if design.violated
        ]
        return tuple(found)

    def summary(self) -> str:
        """Lists the designs with their criteria."""
        labels = ", ".join(f"{criterion.name} = {criterion.label}" for criterion in self.criteria)
        head = "  point  " + "".join(f"{criterion.name:>14}" for criterion in self.criteria)
        lines = [f"{self.designs[0].robot.name}: {len(self.designs)} designs; {labels}", head]
        for point, (values, efficient) in enumerate(zip(self.values, self.efficient, strict=True), start=1):
            numbers = "".join(f"{value:14.6g}" for value in values)
            lines.append(f"  {point:5}  {numbers}{'' if efficient else '   dominated'}")
        return "\n".join(lines)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draws the first two criteria against each other.

        Args:
            ax: where to draw; a new figure by default.
        """
        axes = axes_for(ax, (6, 5))
        for efficient, marker in ((True, "o"), (False, "x")):
            chosen = self.efficient == efficient
            axes.plot(self.values[chosen, 0], self.values[chosen, 1], marker, label="efficient" if efficient else "not")
        axes.set_xlabel(self.criteria[0].label)
        axes.set_ylabel(self.criteria[1].label)
        axes.legend()
        return axes

    def _save_beside(self, folder: Path, *, force: bool) -> None:
        """Writes each design in a folder of its own."""
        for point, saved in enumerate(self.designs, start=1):
            own = folder / folder_of(point)
            own.mkdir(exist_ok=True)
            saved.save(own, force=force)


def pareto(
    robot: Robot, *, criteria: Sequence[str | Criterion] = ("cond", "d"), points: int = 5, **options: Any
) -> ParetoFront:
    """Designs experiments between the extremes of several criteria.

    Each design minimises a weighted sum of the criteria's logarithms, see `Blend`; the weights go evenly from one
    criterion to the other. What lies between is a choice for people: what one criterion gains where the other loses
    little is what the picture shows.

    Args:
        robot: the robot.
        criteria: two or three criteria.
        points: designs along each edge from one criterion to another, both ends included.
        options: those of `oed.design`, but for the criterion.

    Returns:
        The front.

    Raises:
        InputError: fewer than two or more than three criteria, one twice, or fewer than two points; see also `design`.
        InfeasibleError: see `design`.
    """
    chosen = tuple(choose_criterion(name) for name in criteria)
    names = [part.name for part in chosen]
    if not 2 <= len(chosen) <= 3 or len(set(names)) < len(names):
        raise InputError(f"criteria {', '.join(names) or 'none'}", allowed="two or three different ones")
    if "i" in names:
        raise InputError(
            "criterion i is not possible in a Pareto front", remedy="use oed design with --criterion i and --task"
        )
    if points < 2 or points != int(points):
        raise InputError(f"{points} points", allowed="a whole number, at least 2")
    weights = lattice(len(chosen), points)
    designs = [
        design(robot, criterion=Blend(dict(zip(chosen, row.tolist(), strict=True))), **options) for row in weights
    ]
    weighted = [made.qualities[1] if "(" in made.qualities[1].part else made.optimised for made in designs]
    values = np.array([[quality.value(part) for part in chosen] for quality in weighted])
    return ParetoFront(criteria=chosen, weights=weights, designs=tuple(designs), values=values)


def lattice(criteria: int, points: int) -> Array:
    """Spreads weights (P, k) evenly over all mixtures, `points` along each edge; each row's sum is 1."""
    rows = []
    for picks in combinations_with_replacement(range(criteria), points - 1):
        rows.append(np.bincount(picks, minlength=criteria) / (points - 1))
    return np.array(rows)


def folder_of(point: int) -> str:
    """Names the folder of a design, counted from 1."""
    return f"point_{point}"
