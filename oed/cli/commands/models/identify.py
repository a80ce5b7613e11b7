"""Identifies a robot's dynamic parameters with their uncertainty.

Writes model.json and report.html.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from oed.cli.options.logs import KnownLogs
from oed.cli.options.models import Fit
from oed.cli.options.results import ModelFolder
from oed.cli.options.robots import RobotOptions
from oed.cli.verbs import Printed, Verb
from robots.common.errors import InputError
from robots.common.options import Option
from robots.common.progress import Progress

if TYPE_CHECKING:
    from estimation import Estimate
    from estimation.logs.parquet_streams import LogStream
    from robots.robot import Robot


@dataclass(frozen=True, kw_only=True)
class Output(ModelFolder):
    """What an identification writes.

    Attributes:
        c_code: also write C code for torque and gravity.
    """

    c_code: Path | None = None

    def _paths(self) -> tuple[Path | None, ...]:
        return *super()._paths(), self.c_code


@dataclass(frozen=True, kw_only=True)
class Identify(Verb):
    """``oed identify``.

    Attributes:
        log: a log, or a folder of logs. Repeatable.
        method: estimator: wls, ols, huber, tukey, tls, constrained, consistent, iv, ml, didim or recursive; or `all` to
            compare them.
        position: include a torque by each joint's position, of unknown cause. By default, where it predicts other
            motions better.
        rotor: include rotor inertias in the model.
        offset: include a constant torque offset per joint in the model.
        stream: read a Parquet file, or a folder of parts, in pieces with bounded memory. By default above 5 million
            rows.
    """

    function = "estimation.identify"
    examples = (
        "oed identify --robot er3a --log log.csv --out model",
        "oed identify --robot ur10 --log rtde_recording.csv bag_folder --method all --out model",
    )
    introduces = True

    robot: RobotOptions
    log: tuple[Path, ...]
    known: KnownLogs = KnownLogs()
    method: Annotated[str, Option(choices="estimation.estimators:ESTIMATORS")] = "wls"
    fit: Fit = Fit()
    position: bool | None = None
    rotor: bool = True
    offset: bool = True
    stream: bool | None = None
    output: Output = Output(out=Path("identified"))

    def run(self, progress: Progress) -> Printed:
        """Identifies the parameters."""
        from estimation import compare_methods, identify
        from estimation.exports import c_code
        from estimation.identifications.streams import METHODS, identify_stream
        from estimation.logs.parquet_streams import is_large
        from robots.common.records import plain

        output = self.output
        with output.files() as files, output.opened("model.json", "report.html") as folder:
            described = self.robot.load()
            options: dict[str, Any] = {
                **{"friction": self.fit.friction, "position": self.position, "rotor": self.rotor},
                **{"offset": self.offset, "seed": self.fit.seed, "progress": progress},
            }
            table = None
            if self.stream or (self.stream is None and self.method in METHODS and is_large(self.log)):
                result = identify_stream(described, self._opened(described), method=self.method, **options)
            else:
                described, logs = self.known.read_known(self.log, described)
                table = compare_methods(described, logs, **options) if self.method == "all" else None
                method = self.method if table is None else table.rows[0].method
                result = identify(described, logs, method=method, **options)
            output.save(folder, result, methods=table)
            lines, mjcf = output.write_models(result.model, described, files)
            if output.c_code is not None:
                files[output.c_code].write(c_code(result.model).encode())
        found = [gate.summary() for gate in result.gates if gate.findings]
        weak = _undetermined(result)
        return Printed(
            summary="\n".join(
                [
                    *found,
                    *([table.summary()] if table else []),
                    result.summary(),
                    *([f"  below 3 standard errors: {', '.join(weak)}"] if weak else []),
                    *lines,
                    *output.written(),
                ]
            ),
            data={
                **result.to_dict(),
                "gate": [gate.to_dict() for gate in result.gates],
                "below_3_standard_errors": weak,
                "methods": plain(table.rows) if table else None,
                "mjcf": mjcf,
            },
        )

    def _opened(self, robot: Robot) -> LogStream:
        """Opens the only log, to be read in pieces, with what is known of its setup."""
        from estimation.logs.parquet_streams import open_stream
        from estimation.logs.torque_source import parse_meaning

        if len(self.log) != 1:
            raise InputError(
                f"--stream with {len(self.log)} logs",
                allowed="one Parquet file or folder",
                remedy="put the parts in a folder",
            )
        known = self.known
        if known.torque_is is not None:
            parse_meaning(known.torque_is, robot.n)
        kinds, torque_is, mapping = robot.chain.kinds, known.torque_is, known.stated
        opened = open_stream(self.log[0], robot.n, kinds=kinds, torque_is=torque_is, mapping=mapping)
        return known.with_setup([opened])[0]


def _undetermined(result: Estimate) -> list[str]:
    """Lists the parameters below three standard errors, if the gate says that a log does not determine inertias."""
    if not any(finding.name == "undetermined" for gate in result.gates for finding in gate.findings):
        return []
    model = result.model
    pairs = zip(model.names, model.values, model.standard_errors, strict=True)
    return [name for name, value, error in pairs if not abs(value) >= 3.0 * error]
