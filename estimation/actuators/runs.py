"""Runs: stretches of logs without gaps, with what was commanded and measured, checked for what drives need."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimation.actuators.base_motion import situation_of
from estimation.actuators.freedom import Fleet
from estimation.logs import read_logs
from estimation.logs.mappings.mapping import LogMapping
from estimation.logs.readers.lerobot import is_lerobot, read_lerobot
from robots.common.arrays import Array
from robots.common.errors import InputError, NotIdentifiableError
from robots.drives import HeldCommand, Situation
from robots.drives.simulation import usual_step
from robots.robot import Robot
from robots.signals import Log

GAP = 5.0
"""Steps of the median length from which on a pause ends a run."""
SHORTEST = 50
"""Samples of the shortest run."""
SLOWEST, SLOW = 25.0, 90.0
"""Rates [Hz]: below the first nothing of a drive is seen; below the second only what is slow."""
SETTLING = 0.2
"""Time [s] at the start of a run that does not count: the state before it is not known exactly."""
BLOCKS, EVERY = 15, 3
"""Blocks of time into which a run is divided to compare effects; one of so many is held out."""
SAME = 1e-3
"""RMS difference of command and measurement, as a fraction of the motion, below which they are the same signal."""
ROUNDING = 1e-9
"""Change of a position [rad or m] up to which it is none."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Run:
    """A stretch without gaps.

    Attributes:
        name: of its log.
        t: times (N,) [s].
        q: positions by the encoders (N, n) [rad or m].
        log_t: times of the whole log (M,) [s], which the command covers.
        command: commanded positions of the whole log (M, n) [rad or m].
        steps: resolution of each joint's command (n,) [rad or m].
        mask: samples that count (N,); None for all.
        coarseness: of the simulation's steps, in usual ones.
        situations: of the chains: bases and payloads; empty where all are as described.
        current: of the motors (N, n) [A, or another unit]; None without.
    """

    name: str
    t: Array
    q: Array
    log_t: Array
    command: Array
    steps: Array
    mask: NDArray[np.bool_] | None = None
    coarseness: float = 1.0
    situations: tuple[Situation, ...] = ()
    current: Array | None = None

    @cached_property
    def _held(self) -> dict[bytes, HeldCommand]:
        return {}

    def of(self, columns: NDArray[np.intp]) -> HeldCommand:
        """The commands of some joints as the controller holds them."""
        key = columns.tobytes()
        if key not in self._held:
            self._held[key] = HeldCommand(self.log_t, self.command[:, columns], self.steps[columns])
        return self._held[key]

    @cached_property
    def step(self) -> float:
        """Step of its simulation [s]."""
        return self.coarseness * usual_step(self.t)

    @cached_property
    def start_velocity(self) -> Array:
        """Velocity at the start (n,), by a parabola through the first samples."""
        count = min(len(self.t), max(8, int(np.searchsorted(self.t, self.t[0] + 0.03))))
        t = self.t[:count] - self.t[0]
        return np.asarray(np.polyfit(t, self.q[:count], 2)[1])

    @cached_property
    def noise(self) -> Array:
        """Noise of measured positions (n,): differences of the third order, or the rounding of the encoder's steps."""
        rough = np.diff(self.q, 3, axis=0).std(axis=0) / np.sqrt(20.0)
        changes = np.abs(np.diff(self.q, axis=0))
        steps = np.where(changes > ROUNDING, changes, np.inf).min(axis=0)
        return np.maximum(rough, np.where(np.isfinite(steps), steps, 0.0) / np.sqrt(12.0))

    @cached_property
    def counted(self) -> NDArray[np.bool_]:
        """Samples that count (N,)."""
        settled = self.t - self.t[0] >= min(SETTLING, 0.1 * (self.t[-1] - self.t[0]))
        return settled if self.mask is None else settled & self.mask

    def joints(self, columns: NDArray[np.intp]) -> Run:
        """Gives some of the joints."""
        return replace(
            self,
            q=self.q[:, columns],
            command=self.command[:, columns],
            steps=self.steps[columns],
            current=None if self.current is None else self.current[:, columns],
        )

    def chain(self, number: int, columns: NDArray[np.intp]) -> Run:
        """Gives one chain with its joints."""
        return replace(self.joints(columns), situations=self.situations[number : number + 1])

    def rows(self, part: slice) -> Run:
        """Gives some of the samples."""
        return replace(
            self, t=self.t[part], q=self.q[part], current=None if self.current is None else self.current[part]
        )

    def cut(self, share: float) -> tuple[Run, Run]:
        """Cuts the run at a share of its time."""
        at = int(np.searchsorted(self.t, self.t[0] + share * (self.t[-1] - self.t[0])))
        return self.rows(slice(None, at)), self.rows(slice(at, None))

    def blocks(self) -> tuple[Run, Run]:
        """Gives the run twice: with the samples of most blocks of time, and with those of the others.

        The simulation runs through all of them, so that both parts have what seldom happens, such as a stop that is
        touched. Its steps are twice as long as usual: effects are compared, not measured.
        """
        block = np.minimum((self.t - self.t[0]) / (self.t[-1] - self.t[0]) * BLOCKS, BLOCKS - 1).astype(int)
        other = block % EVERY == EVERY - 1
        return replace(self, mask=~other, coarseness=2.0), replace(self, mask=other, coarseness=2.0)


def runs_of(logs: Sequence[Log], fleet: Fleet) -> tuple[tuple[Run, ...], tuple[str, ...]]:
    """Takes the runs out of logs.

    Args:
        logs: with commands.
        fleet: the robot's chains; its joints are those of the logs.

    Returns:
        The runs, and what a reader should know of them.

    Raises:
        InputError: no command, a command that is the measurement, other units, or a slow log.
        NotIdentifiableError: a command that does not change, or no run that is long enough.
    """
    runs: list[Run] = []
    notes: list[str] = []
    steps = np.array([drive.step for drive in fleet.drives])
    for log in logs:
        notes += _check(log, fleet)
        assert log.command is not None
        around = tuple(situation_of(log, robot) for robot in fleet.robots) if fleet.situated else ()
        edges = np.flatnonzero(np.diff(log.t) > GAP * np.median(np.diff(log.t))) + 1
        for part in np.split(np.arange(len(log.t)), edges):
            if len(part) >= SHORTEST:
                runs.append(
                    Run(
                        name=log.name,
                        t=log.t[part],
                        q=log.q[part],
                        log_t=log.t,
                        command=log.command,
                        steps=steps,
                        situations=around,
                        current=None if log.current is None else log.current[part],
                    )
                )
    if not runs:
        raise NotIdentifiableError(
            f"no stretch of {SHORTEST} samples without a gap", remedy="log without pauses, or give longer logs"
        )
    return tuple(runs), tuple(dict.fromkeys(notes))


def _check(log: Log, fleet: Fleet) -> list[str]:
    file = log.metadata.get("file")
    if log.n != fleet.n:
        raise InputError(f"{log.n} joints", file=file, allowed=f"{fleet.n}: {', '.join(fleet.names)}")
    if log.command is None:
        left_out = [note for note in log.metadata.get("repairs", ()) if str(note["name"]).startswith("command_")]
        raise InputError(
            f"no command: {left_out[0]['text']}" if left_out else "no command",
            file=file,
            column="qref1",
            allowed="columns qref1..qn of commanded positions, beside q1..qn",
            remedy="log what was sent to the drives, or name its columns by `command` in a mapping (--mapping)",
        )
    rate = (len(log.t) - 1) / (log.t[-1] - log.t[0])
    if rate < SLOWEST:
        raise InputError(
            f"{rate:.3g} samples per second",
            file=file,
            column="t",
            allowed=f"{SLOWEST:g} or more; 200 or more for delays and inertias",
            remedy="log at the rate of the controller: between such samples a drive has settled",
        )
    notes = []
    if rate < SLOW:
        notes.append(
            f"{rate:.3g} samples per second: delays, inertias and gains of drives that settle within "
            f"{1e3 / rate:.0f} ms are known roughly or not at all"
        )
    moving = [j for j in range(log.n) if np.ptp(log.command[:, j]) > 1e-9]
    if not moving:
        raise NotIdentifiableError(
            f"{file or log.name}: the command does not change in any joint",
            remedy="command a motion, such as that of `oed design --for actuators`",
        )
    still = [fleet.names[j] for j in range(log.n) if j not in moving]
    if still:
        notes.append(f"{log.name}: the command of {', '.join(still)} does not change")
    for joint in moving:
        _check_units(log, fleet, joint, file)
    span = np.ptp(log.q[:, moving], axis=0)
    same = np.sqrt(np.mean((log.command - log.q)[:, moving] ** 2, axis=0)) < SAME * np.maximum(span, 1e-9)
    if same.all():
        raise InputError(
            "the command equals the measured position",
            file=file,
            column=f"qref{moving[0] + 1}",
            allowed="what was sent to the drives, which the joint follows with an error",
            remedy="log the target, not the state; a leader arm's positions are a target, too",
        )
    notes += [
        f"{log.name}: {fleet.names[moving[k]]} follows its command without an error" for k in np.flatnonzero(same)
    ]
    return notes


def _check_units(log: Log, fleet: Fleet, joint: int, file: str | None) -> None:
    """Compares command and measurement by the slope of one over the other.

    Raises:
        InputError: they differ by the factor of a unit, or neither is in radians.
    """
    assert log.command is not None
    q, command, name = log.q[:, joint], log.command[:, joint], fleet.names[joint]
    if np.ptp(q) < 1e-6:
        return
    slope = float(np.std(command) / np.std(q))
    centred = np.corrcoef(command, q)[0, 1]
    units = {"degrees": np.rad2deg(1.0), "ticks of 4096 a turn": 4096 / (2 * np.pi), "percent": 100 / np.pi}
    for factor in (1, -1):
        for unit, scale in units.items():
            ratio = slope / scale**factor
            if centred > 0.8 and 0.6 < ratio < 1.6 and not 0.2 < slope < 5.0:
                which, other = ("command", "measurement") if factor > 0 else ("measurement", "command")
                raise InputError(
                    f"the {which} is {slope**factor:.3g} times the {other}, as if it were in {unit}",
                    file=file,
                    column=f"{'qref' if factor > 0 else 'q'}{joint + 1}",
                    joint=name,
                    allowed="both in one unit",
                    remedy="state the unit of each in the file's head or in a mapping (--mapping)",
                )
    chain, own = fleet.place[joint]
    revolute = fleet.robots[chain].chain.joints[own].kind == "revolute"
    limits = fleet.robots[chain].limits
    reach = float(np.abs([limits.lower[own], limits.upper[own]]).max())
    if revolute and np.isfinite(reach) and float(np.abs(q).max()) > max(3 * reach, 4 * np.pi):
        raise InputError(
            f"positions up to {np.abs(q).max():.3g}",
            file=file,
            column=f"q{joint + 1}",
            joint=name,
            allowed=f"{limits.lower[own]:.3g} to {limits.upper[own]:.3g} rad, as its description says",
            remedy="they look like degrees or encoder ticks: state the unit, or a scale in a mapping (--mapping)",
        )


def read_command_logs(
    paths: Sequence[Path],
    chains: Sequence[Robot],
    *,
    joints: Sequence[str] | None = None,
    mapping: LogMapping | Path | None = None,
) -> list[Log]:
    """Reads logs with commands: files of any known format, and LeRobot data sets.

    Args:
        paths: files and folders; none for no logs.
        chains: of the robot.
        joints: names of the log's joints in its order; by default that of the chains.
        mapping: of the logs' columns.

    Returns:
        Logs whose joints are in the order of the chains.

    Raises:
        InputError: see `read_logs` and `read_lerobot`.
    """
    if not paths:
        return []
    own = [name for chain in chains for name in chain.joint_names]
    names = list(joints or own)
    # Where each joint of the chains is in the log, and the other way round.
    places = [names.index(name) for name in own]
    back = [places.index(column) for column in range(len(places))]
    kinds = [kind for chain in chains for kind in chain.chain.kinds]
    sets = [path for path in paths if is_lerobot(path)]
    files = [path for path in paths if path not in sets]
    settings: dict[str, Any] = {"n": len(names), "torque": False, "mapping": mapping, "joints": tuple(names)}
    found = list(read_logs(files, kinds=tuple(kinds[k] for k in back), **settings)) if files else []
    # Normalised positions of a data set are read by the joints' limits.
    lower = np.array([float(value) for chain in chains for value in chain.limits.lower])[back]
    upper = np.array([float(value) for chain in chains for value in chain.limits.upper])[back]
    for path in sets:
        found += read_lerobot(path, tuple(names), (lower, upper))
    return [_in_order(log, places) for log in found]


def _in_order(log: Log, places: list[int]) -> Log:
    if places == sorted(places):
        return log
    columns = ("q", "command", "tau", "current", "dq", "ddq", "temperature", "qlink")
    return replace(log, **{key: getattr(log, key)[:, places] for key in columns if getattr(log, key) is not None})
