"""Predicts the joint torques of a logged motion.

If the log has torques, the prediction errors are printed.
"""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from oed.cli.options.heat import Warmth
from oed.cli.options.logs import KnownLogs
from oed.cli.options.results import Overwriting
from oed.cli.verbs import Printed, Verb
from robots.common.progress import Progress


@dataclass(frozen=True, kw_only=True)
class Written(Overwriting):
    """What a prediction writes.

    Attributes:
        out: CSV file to write: t, tau1..taun, and of each the limits of the 95 % band and whether it extrapolates
            (tau1_lower, tau1_upper, tau1_extrapolates).
        report: also write a page with pictures to this HTML file.
    """

    out: Path = Path("predicted.csv")
    report: Path | None = None


@dataclass(frozen=True, kw_only=True)
class Predict(Verb):
    """``oed predict``.

    Attributes:
        model: a model.json, or its folder.
        log: a log with the motion.
    """

    function = "estimation.predict"
    examples = ("oed predict --model model --log other.csv --out predicted.csv",)

    model: Path
    log: Path
    known: KnownLogs = KnownLogs()
    warmth: Warmth = Warmth()
    output: Written = Written()

    def run(self, progress: Progress) -> Printed:
        """Predicts the torques."""
        from estimation import load_model
        from estimation.predictions.heat import predict_warm
        from oed.reports import prediction_page, render
        from oed.reports.rendering.provenance import recordings_from
        from robots.common.files import open_atomic

        output = self.output
        with ExitStack() as files:
            # Opened before the work: an existing file ends the command early, and an error leaves no file behind.
            page_file = files.enter_context(open_atomic(output.report, force=output.force)) if output.report else None
            identified = load_model(self.model)
            robot = identified.robot
            _, (recorded,) = self.known.read_known([self.log], robot, torque=False)
            progress.start("predicting", None)
            earlier = self.known.read(self.warmth.before, robot)
            result, heat, clock = predict_warm(self.model, identified, recorded, earlier, self.warmth.ambient)
            result.save(output.out, force=output.force)
            if page_file is not None:
                logs = recordings_from([recorded])
                page = prediction_page(result, robot.title or robot.name, robot.chain.kinds, logs)
                page_file.write(render(page).encode())
        found = [result.gate.summary()] if result.gate is not None and result.gate.findings else []
        assumed = [words for words in (heat, clock) if words]
        return Printed(
            summary="\n".join([*found, result.summary(), *assumed, f"written to {output.out}"]),
            data={
                "file": str(output.out),
                **result.to_dict(),
                "heat": heat or None,
                "clock": clock or None,
            },
        )
