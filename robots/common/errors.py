"""The errors of all packages: what was found, where, what is allowed, and what to do."""

from __future__ import annotations

from os import PathLike, fspath


class OedError(Exception):
    """Base class of all errors that this software raises on purpose.

    The message reads ``file: column c, row r, joint j: problem; allowed: ...; remedy``; the parts that do not
    apply are left out. They stay available as attributes, for programs that act on them.

    Args:
        problem: what was found, in one clause.
        file: the file in which it was found.
        column: the column of a table, or the key of a YAML file.
        row: the line of the file, counted from 1.
        joint: the joint, counted from 1, or its name.
        allowed: what would have been accepted.
        remedy: what to do about it.
    """

    exit_code = 1

    def __init__(
        self,
        problem: str,
        *,
        file: str | PathLike[str] | None = None,
        column: str | None = None,
        row: int | None = None,
        joint: int | str | None = None,
        allowed: str | None = None,
        remedy: str | None = None,
    ) -> None:
        self.problem = problem
        self.file = None if file is None else fspath(file)
        self.column = column
        self.row = row
        self.joint = joint
        self.allowed = allowed
        self.remedy = remedy
        super().__init__(str(self))

    def __str__(self) -> str:
        named = (("column", self.column), ("row", self.row), ("joint", self.joint))
        place = ", ".join(f"{word} {value}" for word, value in named if value is not None)
        head = ": ".join(part for part in (self.file, place, self.problem) if part)
        tail = (f"allowed: {self.allowed}" if self.allowed else None, self.remedy)
        return "; ".join(part for part in (head, *tail) if part)

    def __reduce__(self) -> tuple[object, ...]:
        # Exceptions cross process borders; the default pickle would lose every keyword field.
        return _rebuild, (type(self), self.__dict__.copy())


def _rebuild(kind: type[OedError], fields: dict[str, object]) -> OedError:
    return kind(**fields)  # type: ignore[arg-type]


class InputError(OedError):
    """Input that cannot be accepted: a file, a column, an option, an array of the wrong shape."""

    exit_code = 2


class InfeasibleError(OedError):
    """A request without a solution, such as an experiment with a velocity limit of zero."""


class NotIdentifiableError(OedError):
    """The data do not determine the requested quantities."""


class SolverError(OedError):
    """A numerical solver ended without a usable result."""


class OtherRobotWarning(UserWarning):
    """A file was made for another robot than the one that is used."""


class NearestBodiesWarning(UserWarning):
    """The links of a written file are not those identified but the nearest that can exist."""


class ShorterWayWarning(UserWarning):
    """Angles that jump by more than half a turn were taken the shorter way round."""


class AssumedValueWarning(UserWarning):
    """A robot description contains values without a source; results that depend on them are uncertain."""


class DescriptionWarning(AssumedValueWarning):
    """A note on a robot's description: assumed or doubtful values, or parts that are not used.

    Args:
        text: the note.
        origin: of the robot, as ``oed robot show`` takes it.
    """

    def __init__(self, text: str, origin: str = "") -> None:
        super().__init__(text)
        self.origin = origin
