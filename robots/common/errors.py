"""The errors of all packages: what was found, where, what is allowed and what to do; codes of frequent errors."""

from __future__ import annotations

from dataclasses import dataclass
from os import PathLike, fspath
from typing import ClassVar


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
        kind: name of a frequent error, see `ERRORS`; empty for others.
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
        kind: str = "",
    ) -> None:
        self.problem = problem
        self.file = None if file is None else fspath(file)
        self.column = column
        self.row = row
        self.joint = joint
        self.allowed = allowed
        self.remedy = remedy
        self.kind = kind
        super().__init__(str(self))

    @property
    def code(self) -> str | None:
        """Code under which `oed explain` explains it; None of an error that has none."""
        return ERROR_CODES.get(self.kind)

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


@dataclass(frozen=True, kw_only=True)
class Explanation:
    """One kind of message.

    Attributes:
        number: of its code; it never changes, and none is used twice in a series.
        name: by which the code names it.
        meaning: what it says.
        example: what causes it.
        remedy: what to do.
        series: L: findings on logs; D: data files that cannot be read; R: descriptions of robots; O: options;
            F: files of results.
    """

    ENTRIES: ClassVar = ("code", "name", "meaning", "example", "remedy")

    number: int
    name: str
    meaning: str
    example: str
    remedy: str
    series: str = "L"

    @property
    def code(self) -> str:
        """Its code, such as OED-L014."""
        return f"OED-{self.series}{self.number:03d}"

    @property
    def cause(self) -> str:
        """What the example is."""
        return "A log that causes it" if self.series == "L" else "An example"

    def text(self) -> str:
        """Writes the explanation as a paragraph for each part."""
        parts = (f"{self.code} {self.name}", self.meaning, f"{self.cause}: {self.example}", self.remedy)
        return "\n".join(parts)


def _series(letter: str, *rows: tuple[str, str, str, str]) -> tuple[Explanation, ...]:
    return tuple(
        Explanation(number=number, name=name, meaning=meaning, example=example, remedy=remedy, series=letter)
        for number, (name, meaning, example, remedy) in enumerate(rows, start=1)
    )


ERRORS: tuple[Explanation, ...] = (
    *_series(
        "D",
        (
            "missing_column",
            "A column that is needed has no known name in this file.",
            "The time is called Zeit, or the file has a line of text above its header.",
            "Save the mapping that the message prints, correct it, and give it with --mapping.",
        ),
        (
            "unknown_file_type",
            "The end of the file's name says no format that can be read here.",
            "A log is called run.xyz.",
            "Rename the file to what it holds, such as .csv, or convert it.",
        ),
        (
            "empty_file",
            "The file holds nothing.",
            "The logger was stopped before it wrote.",
            "Record again, or give the right file.",
        ),
        (
            "other_joints",
            "The log has another number of joints than the robot.",
            "A log of a UR5 (6 joints) is read with --robot panda (7 joints).",
            "Give the robot of the log; of a description with more axes, choose with --tip or --joints.",
        ),
        (
            "no_numbers",
            "No row has a number in all columns that are needed.",
            "tau1 is empty in each row, because the driver does not send it.",
            "Log the quantity, or name the column that holds it in a mapping (--mapping).",
        ),
        (
            "unknown_unit",
            "The unit of a column is not one that this quantity can have.",
            "The head of the file states `Nm/rad` for a torque.",
            "State one of the units that the message lists.",
        ),
        (
            "given_twice",
            "The same log is given more than once; it would count more than once.",
            "--log run.csv run.csv, or a folder and a file in it.",
            "Give each log once.",
        ),
        (
            "mapping_without_column",
            "The mapping names a column that the file does not have.",
            "The mapping says `joint_1`, the file `joint1`.",
            "Correct the name in the mapping; the message lists those of the file.",
        ),
        (
            "no_logs",
            "The folder holds no file of a format that can be read as a log.",
            "--log names the folder above the one with the logs.",
            "Give the folder with the logs, or the files.",
        ),
    ),
    *_series(
        "R",
        (
            "unknown_robot",
            "The name is neither a robot of the catalogue nor a file.",
            "--robot ur99.",
            "`oed robots` lists the names; a description is given by the path of its file.",
        ),
        (
            "branches",
            "The description has several chains, and it is not clear which one is meant.",
            "A URDF with an arm and a gripper.",
            "Name the last link with --tip, or the joints with --joints.",
        ),
        (
            "unknown_link",
            "The description has no link of this name.",
            "--tip tool, where the link is called tool0.",
            "Give a name of the description; the message says which is near.",
        ),
        (
            "unknown_joint",
            "The description has no joint of this name.",
            "--joints j1,j2, where they are called joint_1 and joint_2.",
            "Give names of the description; the message says which is near.",
        ),
        (
            "broken_xml",
            "The file is not well-formed XML, so nothing of it can be read.",
            "A tag is not closed.",
            "Correct the line that the message names.",
        ),
        (
            "xacro_not_expanded",
            "The xacro file cannot be expanded to a URDF.",
            "An argument without a default is not given.",
            'State arguments behind the path, as in --robot "arm.xacro name:=left", or expand the file with xacro.',
        ),
        (
            "package_not_found",
            "A file names a package that is not around it.",
            "package://my_robot/meshes, and only the URDF was copied.",
            "Keep the description in the folder of its package.",
        ),
    ),
    *_series(
        "O",
        (
            "options_together",
            "Two options exclude each other.",
            "--floor 0 --no-floor.",
            "Leave one of them out; one in oed.toml gives way to a typed one.",
        ),
        (
            "option_not_used",
            "An option has no effect beside the others, so it was probably meant otherwise.",
            "oed diagnose --limits --log run.csv: limits need no log.",
            "Do what the message says: leave the option out, or add the one it belongs to.",
        ),
        (
            "unknown_option",
            "The command has no option, or the program no command, of this name.",
            "oed identify --log-file run.csv.",
            "`oed COMMAND --help` lists the options.",
        ),
        (
            "not_numbers",
            "Numbers were expected, separated by commas without spaces.",
            "--home 0;0;1.57.",
            "Type them as in --home 0,0,1.57.",
        ),
        (
            "configuration_value",
            "A value in oed.toml is not one that the option takes.",
            'harmonics = "five".',
            "Write a value of the kind that the message names; `oed schema` prints a schema for editors.",
        ),
        (
            "configuration_key",
            "A key in oed.toml is no option.",
            'frictoin = "polynomial".',
            "Correct the key; the message says which is near.",
        ),
    ),
    *_series(
        "F",
        (
            "no_such_file",
            "There is no file at this path.",
            "--model modle.",
            "Check the path; relative ones count from the working directory, those of oed.toml from its folder.",
        ),
        (
            "file_exists",
            "The result would replace one that is there.",
            "The same command with the same --out a second time.",
            "Choose another --out, or add --force.",
        ),
        (
            "other_file",
            "The file is no result of the kind that is needed here.",
            "--model design.json.",
            "Give the file, or the folder, that the message names.",
        ),
        (
            "newer_version",
            "A newer version of this software has written the file.",
            "A model of a colleague whose version is newer.",
            "Install that version, or make the result again.",
        ),
        (
            "damaged_result",
            "An entry of the file is missing, or of another kind than it should be.",
            "A number was replaced by a text, or an older version did not write the entry.",
            "Make the result again with the command that the message names.",
        ),
    ),
)
"""Frequent errors. New ones come last in their series: codes stay."""

ERROR_CODES = {item.name: item.code for item in ERRORS}
"""Code of each, by its name."""
