"""Result of a payload identification: the body, its intervals, and the evidence."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from estimation.payloads.body import DAMAGED, FORMAT, PAYLOAD_VERSION, Body, body_from_dict, read_payload_file
from estimation.payloads.determination import determined
from estimation.payloads.intervals import Quantity, quantities
from robots.common.arrays import Array
from robots.common.plain import two_digits
from robots.common.records import Finding, Result, axes_for, findings_of
from robots.terms.situations.sensitivities import moved_body

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes


FILE = "payload.json"
TITLES = {"mass": "mass", **{f"centre_{axis}": f"centre of mass {axis}" for axis in "xyz"}}
METHODS = {
    "difference": "the difference of two logs of one path",
    "joint fit": "a joint fit of logs with and without it",
    "model": "one log and a model of the robot without it",
}


@dataclass(frozen=True, kw_only=True)
class JointEvidence:
    """Torque errors of one joint.

    Attributes:
        joint: counted from 1.
        name: the joint's name.
        torque_rms: of the log with the payload [N m or N].
        without: RMS error of the best model without payload.
        residual: RMS error with the payload.
    """

    joint: int
    name: str
    torque_rms: float
    without: float
    residual: float


@dataclass(frozen=True, kw_only=True)
class PayloadEstimate(Result, format=FORMAT, version=PAYLOAD_VERSION):
    """A payload, rigidly on the flange or on another link.

    Attributes:
        robot: the robot's name.
        method: ``difference``, ``joint fit`` or ``model``.
        body: the most plausible body, in the frame of what carries it; one without mass if no payload was found.
        nearest: parameters (10,) of the body that fits best.
        values: least squares without constraints (10,).
        covariance: of `values` (10, 10).
        joints: torque errors.
        rows: number of fitted rows.
        link: the link that carries it, counted from 1; None for the flange.
        warnings: about the use of the results.
        provenance: logs, model, tool version.
        frame: pose (4, 4) of the frame that `quantities` refer to, in the flange frame.
    """

    FILE = "payload.json"
    ENTRIES = (
        "robot",
        "method",
        "link",
        "found",
        "mass=seen.mass",
        "centre_of_mass=seen.centre",
        "inertia=seen.inertia",
        "principal_moments=seen.principal[0]",
        "principal_axes=seen.principal[1]",
        "frame",
        "quantities=stated_quantities",
        "parameters=body.parameters",
        "nearest",
        "unconstrained=values",
        "covariance",
        "joints",
        "rows",
        "warnings",
        "provenance",
    )

    robot: str
    method: str
    body: Body
    nearest: Array
    values: Array
    covariance: Array
    joints: tuple[JointEvidence, ...]
    rows: int
    link: int | None = None
    warnings: tuple[str, ...] = ()
    provenance: Mapping[str, Any] = field(default_factory=dict)
    frame: Array = field(default_factory=lambda: np.eye(4))

    def __repr__(self) -> str:
        return f"PayloadEstimate({self.quantities[0].value:.4g} kg at {np.round(self.seen.centre, 4).tolist()} m)"

    @property
    def success(self) -> bool:
        """Whether nothing of the result is in doubt: moments of inertia that stay open are not."""
        return not self.warnings

    @property
    def found(self) -> bool:
        """Whether there is a payload: its mass cannot be zero, with 95 %."""
        return self.body.mass > 0

    @property
    def seen(self) -> Body:
        """The body in `frame`."""
        return self.body.seen_from(self.frame)

    @cached_property
    def quantities(self) -> tuple[Quantity, ...]:
        """Mass, centre of mass, and inertia about the centre of mass, in the axes of `frame`."""
        turn = moved_body(np.asarray(np.linalg.inv(self.frame), dtype=np.float64))
        return quantities(turn @ self.values, turn @ self.covariance @ turn.T, turn @ self.body.parameters)

    @cached_property
    def determined(self) -> tuple[bool, ...]:
        """Which of the quantities the logs determine."""
        return determined(self.quantities)

    @property
    def stated_quantities(self) -> list[dict[str, Any]]:
        """The quantities, with an interval where the logs determine them."""
        return [
            {
                "name": item.name,
                "value": item.value,
                "unit": item.unit,
                "ci95": [item.lower, item.upper] if known else [None, None],
                "determined": known,
            }
            for item, known in zip(self.quantities, self.determined, strict=True)
        ]

    @property
    def limit(self) -> str:
        """The largest mass that a payload may have where none was found, in words."""
        return f"at most {two_digits(self.quantities[0].upper)} kg at 95 %"

    @property
    def source(self) -> str:
        """One line for files that carry the body: where it comes from, and which of its numbers no log determines."""
        open_ = [item.name for item, known in zip(self.quantities, self.determined, strict=True) if not known]
        named = f"; assumed, not determined by the logs: {', '.join(open_)}" if open_ else ""
        return f"payload of {self.robot}, identified by robot-oed{named}"

    def seen_from(self, pose: ArrayLike) -> PayloadEstimate:
        """Gives the result in a frame with this pose (4, 4) in the flange frame."""
        return replace(self, frame=np.asarray(pose, dtype=float))

    @property
    def conclusion(self) -> str:
        """What to enter as the payload, or the largest that there may be."""
        if not self.found:
            return f"No payload was found: {self.limit}."
        mass, *centre = self.quantities[:4]
        widest = max(centre, key=lambda item: item.half_width)
        return (
            f"Set the payload to {mass.text} kg ({mass.interval_text}); its centre of mass is known to "
            f"{1000 * widest.half_width:.2g} mm or better."
        )

    @property
    def remarks(self) -> tuple[Finding, ...]:
        """Its warnings."""
        return findings_of("payload.uncertain", self.warnings)

    def summary(self) -> str:
        """Lists the quantities with their 95 % intervals, the torque errors, and warnings."""
        own = "flange frame" if self.link is None else f"on link {self.link}, in its frame"
        where = own if np.array_equal(self.frame, np.eye(4)) else "frame of --frame"
        lines = [f"{self.robot}: payload by {METHODS[self.method]} ({self.rows} rows); {where}, 95 % intervals"]
        if not self.found:
            lines = [f"{self.robot}: no payload found: {self.limit}, by {METHODS[self.method]} ({self.rows} rows)"]
        for item, known in zip(self.quantities, self.determined, strict=True) if self.found else ():
            # A centre that another motion would show is refused by the identification.
            never = item.unit == "m"
            open_ = "no motion of this robot shows it" if never else "typical of a body of this mass"
            title = TITLES.get(item.name, f"{item.name} about the centre of mass")
            # An interval beside a value that no log determines would look like knowledge.
            value = (
                f"{item.value:.4g} ({item.lower:.4g} to {item.upper:.4g}) {item.unit}"
                if known
                else f"not determined; assumed {item.value:.4g} {item.unit}, {open_}"
            )
            lines.append(f"  {title:28} {value}")
        lines.append(
            "  joint                 torque RMS   without payload   with payload   (errors in % of torque RMS)"
        )
        for joint in self.joints:
            shares = [100 * value / joint.torque_rms if joint.torque_rms else np.nan for value in _errors(joint)]
            lines.append(
                f"  {joint.joint} {joint.name[:18]:18} {joint.torque_rms:11.4g} {shares[0]:15.2f} % {shares[1]:12.2f} %"
            )
        lines += [f"  {warning}" for warning in self.warnings]
        return "\n".join(lines)

    def to_frame(self) -> pd.DataFrame:
        """Gives a row per quantity: value, lower, upper, unit, determined; no bounds of what is not determined."""
        import pandas as pd

        rows = [
            (item.value, item.lower if known else np.nan, item.upper if known else np.nan, item.unit, known)
            for item, known in zip(self.quantities, self.determined, strict=True)
        ]
        index = pd.Index([item.name for item in self.quantities], name="quantity")
        return pd.DataFrame(rows, columns=["value", "lower", "upper", "unit", "determined"], index=index)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draws each joint's torque error without and with the payload.

        Args:
            ax: where to draw; a new figure by default.
        """
        axes = axes_for(ax, (6, 4))
        place = np.arange(len(self.joints))
        errors = np.array([_errors(joint) for joint in self.joints]).T
        for shift, values, label in zip((-0.2, 0.2), errors, ("without payload", "with payload"), strict=True):
            axes.bar(place + shift, values, width=0.4, label=label)
        axes.set_xticks(place, [str(joint.joint) for joint in self.joints])
        axes.set_xlabel("joint")
        axes.set_ylabel("torque error RMS [N m or N]")
        axes.legend()
        return axes


def load_payload(path: str | Path) -> PayloadEstimate:
    """Reads a `payload.json`, or the one in a folder.

    Args:
        path: the file, or its folder.

    Raises:
        InputError: a missing file, or one that is no payload.
    """
    data = read_payload_file(path)
    return PayloadEstimate.from_dict(data, file=path, remedy=DAMAGED, body=body_from_dict(data, path))


def _errors(joint: JointEvidence) -> tuple[float, float]:
    return joint.without, joint.residual
