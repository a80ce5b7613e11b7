"""Options of what a command writes."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, ClassVar

from oed.cli.verbs import Printed

if TYPE_CHECKING:
    from estimation import Model
    from robots.common.files import ResultFolder
    from robots.robot import Robot

OPEN = "open report.html there in a browser"
"""What to do first with a folder of results."""


@dataclass(frozen=True, kw_only=True)
class Overwriting:
    """Whether results may be overwritten.

    Attributes:
        force: overwrite existing results.
    """

    section: ClassVar[str] = "Output"

    force: bool = False


@dataclass(frozen=True, kw_only=True)
class Folder(Overwriting):
    """A folder of results with a report.

    Attributes:
        out: folder for the results.
        png: also write the report's figures as PNG files.
    """

    out: Path = Path()
    png: bool = False

    def opened(self, *names: str) -> ResultFolder:
        """Opens the folder before the work: existing files end the command early, and an error leaves none behind.

        Args:
            names: of the files that are written.
        """
        from robots.common.files import ResultFolder

        return ResultFolder(self.out, self.force, names=names)

    def save(self, folder: ResultFolder, result: Any, **beside: Any) -> None:
        """Writes the files of a result and its report.

        Args:
            folder: as `opened` gave it.
            result: with a file and a page.
            beside: what its page shows beside it.
        """
        from oed.reports import save_report

        result.save(folder.path("report.html").parent)
        save_report(result, folder, png=self.png, **beside)

    def printed(self, result: Any, *lines: str, without: Collection[str] = (), **more: Any) -> Printed:
        """Gives what a command prints of a result: its summary, further lines and the folder; its data.

        Args:
            result: with a summary and data.
            lines: after the summary.
            without: keys of the data that are too long to print.
            more: further data.
        """
        from robots.common.records import Result

        data: Mapping[str, Any] = result.stated() if isinstance(result, Result) else result.to_dict()
        data = {key: value for key, value in data.items() if key not in without} | more
        return Printed(
            summary="\n".join([result.summary(), *lines, f"written to {self.out.resolve()}; {OPEN}"]), data=data
        )


@dataclass(frozen=True, kw_only=True)
class ModelFolder(Folder):
    """A folder of results, and files of the model beside it.

    Attributes:
        urdf: also write a URDF with the model's bodies and friction.
        mjcf: also write a MuJoCo model (MJCF) with what was identified.
    """

    urdf: Path | None = None
    mjcf: Path | None = None

    @contextmanager
    def files(self) -> Iterator[Mapping[Path, IO[bytes]]]:
        """Opens the files before the work: an existing one ends the command early, and an error leaves none behind."""
        from robots.common.files import open_atomic

        with ExitStack() as stack:
            yield {path: stack.enter_context(open_atomic(path, force=self.force)) for path in self._paths() if path}

    def write_models(
        self, model: Model, robot: Robot, files: Mapping[Path, IO[bytes]]
    ) -> tuple[list[str], dict[str, Any] | None]:
        """Writes the model's files.

        Args:
            model: the model.
            robot: its robot.
            files: as `files` opened them.

        Returns:
            Lines for the summary, and what the MJCF states and does not.

        Raises:
            InputError: a model that a URDF or an MJCF cannot state.
        """
        from estimation.exports import build_mjcf, build_urdf

        lines, data = [], None
        if self.urdf is not None:
            stated = build_urdf(model, robot)
            files[self.urdf].write(stated.text.encode())
            lines += stated.lines()
        if self.mjcf is not None:
            written = build_mjcf(model, robot, folder=self.mjcf.parent)
            files[self.mjcf].write(written.text.encode())
            lines += written.lines()
            data = {"stated": list(written.stated), "remarks": list(written.remarks)}
        return lines, data

    def written(self) -> list[str]:
        """Says where folder and files are."""
        files = [f"written to {path.resolve()}" for path in self._paths() if path is not None]
        return [f"written to {self.out.resolve()}; {OPEN}", *files]

    def _paths(self) -> tuple[Path | None, ...]:
        return self.urdf, self.mjcf
