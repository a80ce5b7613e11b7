"""Estimates external forces from the drives' torques, and finds contacts.

Writes forces.csv with the force at each sample, forces.json with the contacts, and report.html.
"""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from estimation.external_forces.options import ForceOptions
from oed.cli.options.heat import Warmth
from oed.cli.options.logs import KnownLogs
from oed.cli.options.results import Folder
from oed.cli.verbs import Printed, Verb
from robots.common.errors import InputError
from robots.common.progress import Progress

if TYPE_CHECKING:
    from estimation.models.model import Model
    from estimation.predictions.prediction import Prediction
    from robots.signals import Log


@dataclass(frozen=True, kw_only=True)
class Output(Folder):
    """What an estimate of forces writes.

    Attributes:
        c_code: also write the observer as C code for a controller; needs --velocity logged.
    """

    c_code: Path | None = None


@dataclass(frozen=True, kw_only=True)
class Force(Verb):
    """``oed force``.

    Attributes:
        model: a model.json, or its folder.
        log: a log with positions and torques.
        healthy: a log without contacts, from which the threshold follows. Repeatable. Default: the log itself.
        calibration: a forces.json of an earlier run, whose threshold is used instead of --healthy.
    """

    function = "estimation.estimate_forces"
    examples = (
        "oed force --model model --log log.csv --healthy healthy.csv --out forces",
        "oed force --model model --log log.csv --calibration forces/forces.json --out other",
    )
    alternatives = (("healthy", "calibration"),)

    model: Path
    log: Path
    healthy: tuple[Path, ...] = ()
    calibration: Path | None = None
    known: KnownLogs = KnownLogs()
    warmth: Warmth = Warmth()
    options: ForceOptions = ForceOptions()
    output: Output = Output(out=Path("forces"))

    def run(self, progress: Progress) -> Printed:
        """Estimates the forces."""
        from estimation import load_model
        from estimation.external_forces import estimate_forces
        from estimation.external_forces.online.c_export import observer_code
        from estimation.external_forces.thresholds.calibrations import read_calibration
        from estimation.predictions.heat import predict_warm
        from oed.reports.rendering.provenance import recordings_from
        from robots.common.files import open_atomic

        output = self.output
        if output.c_code is not None and self.calibration is None and self.options.velocity != "logged":
            raise InputError("--c-code without --velocity logged", remedy="a controller has no smoothed velocities")
        with ExitStack() as files:
            folder = files.enter_context(output.opened("forces.csv", "forces.json", "report.html"))
            code = files.enter_context(open_atomic(output.c_code, force=output.force)) if output.c_code else None
            identified = load_model(self.model)
            robot = identified.robot
            _, (recorded, *normal) = self.known.read_known([self.log, *self.healthy], robot)
            earlier, assumed = self.known.read(self.warmth.before, robot), ""

            def predicted(sharp: Model, own: Log) -> Prediction:
                nonlocal assumed
                found, *words = predict_warm(self.model, identified, own, earlier, self.warmth.ambient, by=sharp)
                if own is recorded:
                    assumed = "\n".join(word for word in words if word)
                return found

            result = estimate_forces(
                identified,
                recorded,
                healthy=normal,
                calibration=None if self.calibration is None else read_calibration(self.calibration, robot.n),
                options=self.options,
                predictor=predicted,
                progress=progress,
            )
            output.save(folder, result, kinds=robot.chain.kinds, logs=recordings_from([recorded]))
            if code is not None:
                gravity, payload = recorded.gravity, recorded.payload
                text = observer_code(
                    identified, result.calibration, tool=self.options.tool, gravity=gravity, payload=payload
                )
                code.write(text.encode())
        return output.printed(result, *([assumed] if assumed else []), heat=assumed or None)
