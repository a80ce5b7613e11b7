"""Compares models or drives of several runs, days or robots of one type.

Says which differences are significant, and writes compare.json, a merged model.json and report.html; of results of oed
actuators compare.json, parameters.csv and report.html.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from oed.cli.options.logs import Columns
from oed.cli.options.models import Fit
from oed.cli.options.results import Folder
from oed.cli.options.robots import CATALOGUE, Chain
from oed.cli.verbs import Printed, Verb
from robots.common.errors import InputError
from robots.common.options import Option
from robots.common.progress import Progress

OfLogs = Option(only=("logs",))


@dataclass(frozen=True, kw_only=True)
class Compare(Verb):
    """``oed compare``.

    Attributes:
        models: two or more model.json files or their folders; or actuators.json files or their folders; with --robot,
            logs or folders of logs.
        robot: compare logs: each is identified by itself, with one cut-off and one friction model for all. A catalogue
            name, a URDF, or a robot YAML.
        false_alarms: probability of any false alarm among all tests.
    """

    function = "estimation.compare"
    examples = (
        "oed compare monday/model.json friday/model.json --out compared",
        "oed compare drives_cold drives_warm --out compared",
        "oed compare logs/day1.csv logs/day2.csv logs/day3.csv --robot er3a --out compared",
    )

    models: Annotated[tuple[Path, ...], Option(argument=True)]
    robot: Annotated[str | None, Option(section="Robot", names_file=True, choices=CATALOGUE, only=("logs",))] = None
    chain: Annotated[Chain, OfLogs] = Chain()
    columns: Annotated[Columns, OfLogs] = Columns()
    fit: Fit = Fit()
    false_alarms: float = 0.01
    output: Folder = Folder(out=Path("compared"))

    @property
    def use(self) -> str:
        """Models and drives need no robot; what is neither is a log."""
        if all(_is_drives(path) for path in self.models):
            return "drives"
        return "models" if all(_is_model(path) for path in self.models) else "logs"

    def reason(self, names: Collection[str]) -> tuple[str, str]:
        """Says that models have their robot."""
        return f"the model {self.models[0]}", f"give logs, or leave out {', '.join(names)}"

    def run(self, progress: Progress) -> Printed:
        """Compares models, or identifies logs and compares their models."""
        from estimation import compare
        from estimation.comparisons import identify_runs, read_model_runs

        if self.use == "drives":
            return self._drives()
        mixed = next((path for path in self.models if _is_drives(path)), None)
        if mixed is not None:
            raise InputError("holds drives, and others do not", file=mixed, remedy="compare drives with drives")
        for path in self.models:
            if self.robot is not None and _is_model(path):
                raise InputError("is a model, but --robot is given", file=path, remedy="give logs, or no --robot")
            if self.robot is None and not _is_model(path) and path.exists():
                raise InputError(
                    "is no model.json and no folder that holds one",
                    file=path,
                    remedy="to compare logs, give --robot; else identify them first with oed identify",
                )
        with self.output.opened("compare.json", "model.json", "report.html") as folder:
            if self.robot is None:
                runs = read_model_runs(self.models)
            else:
                described, how = self.chain.load(self.robot), self.fit
                logs = self.columns.read(self.models, described)
                runs = identify_runs(described, logs, friction=how.friction, seed=how.seed, progress=progress)
            result = compare(runs, alpha=self.false_alarms)
            self.output.save(folder, result)
        return self.output.printed(result)

    def _drives(self) -> Printed:
        """Compares results of `oed actuators`."""
        from estimation.comparisons import compare_drives, read_drive_runs

        with self.output.opened("compare.json", "parameters.csv", "report.html") as folder:
            result = compare_drives(*read_drive_runs(self.models), alpha=self.false_alarms)
            result.to_frame().to_csv(folder.path("parameters.csv"), index=False)
            self.output.save(folder, result)
        return self.output.printed(result)


def _is_drives(path: Path) -> bool:
    if path.is_dir():
        return (path / "actuators.json").is_file() and not (path / "model.json").is_file()
    if path.suffix != ".json" or not path.is_file():
        return False
    return b'"robot-oed actuators"' in path.read_bytes()[:200]


def _is_model(path: Path) -> bool:
    return path.suffix == ".json" or (path / "model.json").is_file()
