"""What a log says of a robot's drives: parameters with intervals, effects, and errors of the simulated motion."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from estimation.actuators.search import LoopFinding
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.common.records import Finding, Result, axes_for, findings_of, read, read_json
from robots.drives import Drive
from robots.robot import Robot

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes


MOTION = "motion.parquet"
_REMEDY = "give an actuators.json of oed actuators"
_UNEXPLAINED = 3.0
"""A joint whose held-out error is so many times the median of all joints is named as unexplained."""


@dataclass(frozen=True, kw_only=True)
class DriveValue:
    """One identified parameter.

    Attributes:
        parameter: its name, such as ``armature``.
        group: the joint or class that has it.
        joints: names of these joints.
        value: in its unit.
        standard_error: in its unit.
        lower: end of the 95 % interval.
        upper: the other end.
        unit: such as ``kg m2``.
        described: what the description said; NaN where it said nothing.
        status: ``identified``, ``at its bound`` or ``not determined``.
        partners: other parameters, of which the log shows only a combination with this one.
    """

    parameter: str
    group: str
    joints: tuple[str, ...]
    value: float
    standard_error: float
    lower: float
    upper: float
    unit: str
    described: float
    status: str
    partners: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Parameter and group, for people."""
        return f"{self.parameter} {self.group}"


@dataclass(frozen=True, kw_only=True)
class MotionError:
    """Root mean square errors of one joint's simulated position [rad or m].

    Attributes:
        name: the joint.
        described: with the drives as described, on the fitted runs.
        fitted: with the identified drives, on the fitted runs.
        held_out_described: with the drives as described, on held-out runs.
        held_out: with the identified drives, on held-out runs.
        limit: error on held-out runs above which the motion is not explained: a fifth of what command and measurement
            differ by, and three times the encoder's noise. NaN where it is not known.
    """

    name: str
    described: float
    fitted: float
    held_out_described: float
    held_out: float
    limit: float = math.nan


@dataclass(frozen=True, kw_only=True, eq=False)
class Trace:
    """A held-out run: measured, commanded and simulated positions.

    Attributes:
        name: of the log.
        t: times (N,) [s].
        measured: (N, n) [rad or m].
        command: (N, n) [rad or m].
        described: simulated with the drives as described (N, n).
        identified: simulated with the identified drives (N, n).
    """

    name: str
    t: Array
    measured: Array
    command: Array
    described: Array
    identified: Array


@dataclass(frozen=True, kw_only=True, eq=False)
class Actuators(Result, format="robot-oed actuators"):
    """Identified drives of a robot.

    Attributes:
        robot: its name.
        joints: names of the joints, chain by chain.
        law: names of the joints' control laws.
        values: all parameters of each joint by name.
        parameters: those that were identified.
        errors: of the simulated motion, joint by joint.
        findings: effects that were found in the loop, strongest first.
        notes: what a reader should know.
        held_out: what the held-out data are.
        written_error: mean of the joints' held-out errors with what simulators express of the drives [rad or m].
        traces: the first held-out run; empty if the result was loaded without it.
        success: whether the fit settled.
        provenance: logs, gains, tool version.
        robots: the chains; empty if the result was loaded.
        drives: the drives with the identified values; empty if the result was loaded.
    """

    FILE = "actuators.json"
    ENTRIES = (
        "robot",
        "joints=laws",
        "parameters",
        "errors",
        "findings",
        "notes",
        "held_out",
        "written_error",
        "success",
        "provenance",
    )

    robot: str
    joints: tuple[str, ...]
    law: tuple[str, ...]
    values: tuple[Mapping[str, float], ...]
    parameters: tuple[DriveValue, ...]
    errors: tuple[MotionError, ...]
    findings: tuple[LoopFinding, ...]
    notes: tuple[str, ...]
    held_out: str
    written_error: float = float("nan")
    traces: tuple[Trace, ...] = ()
    success: bool = True
    provenance: Mapping[str, Any] = field(default_factory=dict)
    robots: tuple[Robot, ...] = ()
    drives: tuple[Drive, ...] = ()

    def __repr__(self) -> str:
        return (
            f"Actuators({self.robot!r}, {len(self.joints)} joints, held-out error {1e3 * self.held_out_error:.3g} mrad)"
        )

    @property
    def held_out_error(self) -> float:
        """Mean over the joints of the held-out RMS error of the simulated position [rad or m]."""
        return float(np.mean([error.held_out for error in self.errors]))

    @property
    def described_error(self) -> float:
        """The same with the drives as described."""
        return float(np.mean([error.held_out_described for error in self.errors]))

    @property
    def unexplained(self) -> tuple[MotionError, ...]:
        """Joints whose held-out error is above their limit, or far above that of the others."""
        middle = float(np.median([error.held_out for error in self.errors]))
        return tuple(e for e in self.errors if e.held_out > e.limit or e.held_out > _UNEXPLAINED * middle)

    @property
    def undetermined(self) -> tuple[DriveValue, ...]:
        """Parameters that the motion does not determine."""
        return tuple(value for value in self.parameters if value.status == "not determined")

    def value(self, parameter: str, joint: str) -> DriveValue:
        """Gives an identified parameter of a joint.

        Args:
            parameter: its name.
            joint: name of the joint.

        Raises:
            InputError: it was not identified.
        """
        for item in self.parameters:
            if item.parameter == parameter and joint in item.joints:
                return item
        known = ", ".join(dict.fromkeys(item.parameter for item in self.parameters))
        raise InputError(f"{parameter} of {joint} was not identified", allowed=f"{known} of {', '.join(self.joints)}")

    @property
    def laws(self) -> list[dict[str, Any]]:
        """Name, law and values of each joint's drive, as plain data."""
        return [
            {"name": name, "law": law, "values": values}
            for name, law, values in zip(self.joints, self.law, self.values, strict=True)
        ]

    @property
    def conclusion(self) -> str:
        """How well the simulated motion is, as identified and as described."""
        return (
            f"The simulated motion misses the measured one by {1e3 * self.held_out_error:.3g} mrad on {self.held_out}; "
            f"as described, by {1e3 * self.described_error:.3g} mrad."
        )

    @property
    def remarks(self) -> tuple[Finding, ...]:
        """Effects that were found, joints that stay unexplained, and what is not determined."""
        found = [
            Finding(
                code="drives.effect",
                subject=item.name,
                text=f"{item.title}: {item.states}. Held-out error {1e3 * item.before:.3g} -> {1e3 * item.after:.3g} "
                "mrad.",
            )
            for item in self.findings
        ]
        found += [
            Finding(
                code="drives.unexplained",
                subject=error.name,
                text=f"{1e3 * error.held_out:.3g} mrad remain, with no effect of the catalogue to explain them.",
                action="look at its motion below; compare the joint with its like",
            )
            for error in self.unexplained
        ]
        open_ = self.undetermined
        if open_:
            names = ", ".join(value.name for value in open_[:6]) + (", ..." if len(open_) > 6 else "")
            found.append(
                Finding(
                    code="drives.undetermined",
                    text=f"The motion does not determine {len(open_)} of {len(self.parameters)} parameters: {names}.",
                    action=self.next_motion,
                )
            )
        return (*found, *findings_of("drives.note", self.notes))

    @property
    def next_motion(self) -> str:
        """Says which motion would determine the rest."""
        kinds = {value.parameter for value in self.undetermined}
        parts = []
        if kinds & {"armature", "delay"}:
            parts.append("faster motion (steps, or sines of several Hz), which shows inertia and delay")
        if kinds & {"viscous", "coulomb", "stribeck"}:
            parts.append(
                "constant speeds from slow to fast in both directions, which separate viscous and dry friction"
            )
        if kinds & {"torque_offset", "encoder_zero", "mass_factor"}:
            parts.append("holds at poses with different gravity load")
        if kinds & {"kp", "kd", "kv", "kr", "ki"}:
            parts.append("a known payload, whose weight fixes the scale of gains")
        if not parts:
            return "All parameters are determined. To check them, play another motion and give its log as --held-out."
        return f"Log a motion with {'; '.join(parts)}."

    def summary(self) -> str:
        """Lists errors of the simulated motion, findings, parameters, and what is not determined."""
        lines = [
            f"{self.robot}: drives of {len(self.joints)} joints; simulated position, mean of the joints' RMS errors on "
            f"{self.held_out}: {1e3 * self.described_error:.3g} -> {1e3 * self.held_out_error:.3g} mrad"
        ]
        for item in self.findings:
            lines.append(
                f"  found: {item.title}, {item.name}: {item.states}; held-out error {1e3 * item.before:.3g} -> "
                f"{1e3 * item.after:.3g} mrad"
            )
        if self.written_error > 1.05 * self.held_out_error:
            lines.append(
                f"  with what simulators express of these drives: {1e3 * self.written_error:.3g} mrad on the same data"
            )
        lines.append("  joint                  described   identified   (held-out RMS error, mrad or mm)")
        for error in self.errors:
            lines.append(f"  {error.name[:22]:22} {1e3 * error.held_out_described:9.3g} {1e3 * error.held_out:12.3g}")
        lines.append("  parameter                               value   95 % interval")
        for value in self.parameters:
            interval = f"{value.lower:.3g} to {value.upper:.3g} {value.unit}"
            known = interval if value.status == "identified" else f"{interval}; {value.status}"
            lines.append(f"  {value.name[:36]:36} {value.value:9.4g}   {known}")
        lines += [f"  {note}" for note in self.notes]
        return "\n".join(lines)

    def to_frame(self) -> pd.DataFrame:
        """Gives a row per identified parameter."""
        import pandas as pd

        rows = [asdict(value) | {"joints": ", ".join(value.joints)} for value in self.parameters]
        return pd.DataFrame(rows).drop(columns="partners") if rows else pd.DataFrame()

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draws each joint's held-out error as described and identified.

        Args:
            ax: where to draw; a new figure by default.
        """
        axes = axes_for(ax, (7, 4))
        place = np.arange(len(self.errors))
        for shift, key, label in ((-0.2, "held_out_described", "as described"), (0.2, "held_out", "identified")):
            axes.bar(place + shift, [1e3 * getattr(error, key) for error in self.errors], width=0.4, label=label)
        axes.set_xticks(place, [error.name for error in self.errors], rotation=90)
        axes.set_ylabel("held-out position error, RMS [mrad or mm]")
        axes.legend()
        return axes

    def _save_beside(self, folder: Path, *, force: bool) -> None:
        """Writes `motion.parquet`."""
        if self.traces:
            import pandas as pd

            trace = self.traces[0]
            columns: dict[str, Array] = {"t": trace.t}
            names = {"q": "measured", "qref": "command", "described": "described", "identified": "identified"}
            for prefix, key in names.items():
                columns |= {f"{prefix}{j + 1}": getattr(trace, key)[:, j] for j in range(len(self.joints))}
            target = folder / MOTION
            if target.exists() and not force:
                raise InputError("the file exists", file=target, remedy="use --force")
            pd.DataFrame(columns).to_parquet(target, index=False)


def load_actuators(path: str | Path) -> Actuators:
    """Reads an `actuators.json`, or the one in a folder, with the motion beside it.

    Args:
        path: the file, or its folder.

    Raises:
        InputError: a missing file, or one that holds no drives.
    """
    file = Path(path)
    file = file / Actuators.FILE if file.is_dir() else file
    data = read_json(file, Actuators.FORMAT, Actuators.FORMAT_VERSION, remedy=_REMEDY)
    return replace(actuators_of(data, file), traces=_traces(file.parent / MOTION, data))


def actuators_of(data: Mapping[str, Any], file: str | Path | None = None) -> Actuators:
    """Reads the content of an `actuators.json`, without the motion beside it.

    Args:
        data: plain data.
        file: in which they were found, for messages.

    Raises:
        InputError: data that are damaged.
    """
    drives = read(list[_Law], data.get("joints"), "joints", file=file, remedy=_REMEDY)
    return Actuators.from_dict(
        data,
        file=file,
        remedy=_REMEDY,
        joints=tuple(drive.name for drive in drives),
        law=tuple(drive.law for drive in drives),
        values=tuple(drive.values for drive in drives),
    )


@dataclass(frozen=True, kw_only=True)
class _Law:
    name: str
    law: str
    values: Mapping[str, float]


def _traces(path: Path, data: Mapping[str, Any]) -> tuple[Trace, ...]:
    n, name = len(data["joints"]), str(data["held_out"])
    if not path.is_file():
        return ()
    import pandas as pd

    table = pd.read_parquet(path)

    def signal(prefix: str) -> Array:
        return table[[f"{prefix}{j + 1}" for j in range(n)]].to_numpy(dtype=float)

    return (
        Trace(
            name=name,
            t=table["t"].to_numpy(dtype=float),
            measured=signal("q"),
            command=signal("qref"),
            described=signal("described"),
            identified=signal("identified"),
        ),
    )
