"""Which parameters of the drives are free, and which joints share them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.drives import Drive, DriveDynamics, ElasticGear
from robots.robot import Robot

OWN = ("torque_offset", "encoder_zero", "stop_lower", "stop_upper")
"""Parameters that joints of a class do not share: they belong to one assembly."""


@dataclass(frozen=True, kw_only=True)
class FreeParameter:
    """A free parameter, of one joint or shared by several.

    Attributes:
        name: as the drive has it.
        group: a name of the joints that share it, a joint's name for one.
        joints: these joints, counted from 0 over all chains.
        size: a usual size, by which it is scaled.
        lower: the least value.
        upper: the largest.
        unit: its unit.
    """

    name: str
    group: str
    joints: tuple[int, ...]
    size: float
    lower: float
    upper: float
    unit: str


class Fleet:
    """The chains of a robot with their drives: joints are counted over all of them.

    Args:
        robots: the chains.
        drives: of all joints, in the order of the chains.
        dynamics: of the chains, where they are known: they are compiled.
        situated: whether runs have bases or payloads of their own.
    """

    def __init__(
        self,
        robots: Sequence[Robot],
        drives: Sequence[Drive],
        dynamics: Sequence[DriveDynamics] | None = None,
        *,
        situated: bool = False,
    ) -> None:
        self.robots, self.drives = tuple(robots), tuple(drives)
        ends = np.cumsum([robot.n for robot in robots])
        self.columns = tuple(np.arange(end - robot.n, end) for robot, end in zip(robots, ends, strict=True))
        if len(drives) != ends[-1]:
            raise InputError(f"{len(drives)} drives", allowed=f"{ends[-1]}, one per joint")
        self.dynamics = tuple(
            dynamics
            or (
                DriveDynamics(robot, [drives[j] for j in columns], situated=situated)
                for robot, columns in zip(robots, self.columns, strict=True)
            )
        )
        self.names = tuple(name for robot in robots for name in robot.joint_names)
        self.place = {int(j): (c, k) for c, columns in enumerate(self.columns) for k, j in enumerate(columns)}

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.drives)

    @property
    def situated(self) -> bool:
        """Whether runs have bases or payloads of their own."""
        return self.dynamics[0].situated

    @property
    def values(self) -> tuple[Array, ...]:
        """The drives' parameters, chain by chain."""
        own = self.drives
        return tuple(np.array([own[j].values[name] for j in c for name in own[j].names]) for c in self.columns)

    @property
    def rigid(self) -> Fleet:
        """The chains with rigid gears."""
        return self.with_drives([drive.with_gear(None) for drive in self.drives])

    def index(self, joint: int, name: str) -> tuple[int, int]:
        """Chain and index of a joint's parameter."""
        chain, own = self.place[joint]
        return chain, self.dynamics[chain].layout.place(own, name)

    def of(self, values: Sequence[Array], joint: int, name: str) -> float:
        """One value."""
        chain, index = self.index(joint, name)
        return float(values[chain][index])

    def part(self, chain: int) -> Fleet:
        """Gives one chain alone, with its compiled functions."""
        drives = [self.drives[j] for j in self.columns[chain]]
        return Fleet([self.robots[chain]], drives, [self.dynamics[chain]])

    def with_drives(self, drives: Sequence[Drive]) -> Fleet:
        """Gives the chains with other drives; chains whose drives are the same keep their compiled functions."""
        dynamics = []
        for chain, columns in enumerate(self.columns):
            own = [drives[j] for j in columns]
            same = all(new.members == self.drives[j].members for new, j in zip(own, columns, strict=True))
            dynamics.append(
                self.dynamics[chain] if same else DriveDynamics(self.robots[chain], own, situated=self.situated)
            )
        return Fleet(self.robots, drives, dynamics)

    def with_gear(self, joint: int, gear: ElasticGear | None) -> Fleet:
        """Gives the chains with another gear of one joint; None for a rigid one."""
        drives = list(self.drives)
        drives[joint] = drives[joint].with_gear(gear)
        return self.with_drives(drives)

    def taken(self, values: Sequence[Array], other: Fleet) -> tuple[Array, ...]:
        """Gives values of another fleet of the same joints, as far as these drives have them."""
        new = []
        for known, mine in zip(other.with_values(values), self.drives, strict=True):
            new.append({name: known.values.get(name, value) for name, value in mine.values.items()})
        return tuple(
            np.array([new[j][name] for j in columns for name in self.drives[j].names]) for columns in self.columns
        )

    def changed(self, values: Sequence[Array], name: str, joints: Iterable[int], value: float) -> tuple[Array, ...]:
        """Gives values with another one of some joints."""
        new = [np.array(own) for own in values]
        for joint in joints:
            chain, index = self.index(joint, name)
            new[chain][index] = value
        return tuple(new)

    def with_values(self, values: Sequence[Array]) -> list[Drive]:
        """Gives the drives with other values."""
        found = []
        for joint, drive in enumerate(self.drives):
            chain, own = self.place[joint]
            mine = np.flatnonzero(self.dynamics[chain].layout.joints == own)
            found.append(drive.with_values(dict(zip(drive.names, values[chain][mine].tolist(), strict=True))))
        return found


@dataclass(frozen=True, kw_only=True)
class Freedom:
    """The free parameters of a fleet, scaled by their sizes: values = fixed + directions theta.

    Attributes:
        fleet: the chains.
        free: the free parameters (K).
    """

    fleet: Fleet
    free: tuple[FreeParameter, ...]

    @property
    def sizes(self) -> Array:
        """Sizes (K,)."""
        return np.array([parameter.size for parameter in self.free])

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Scaled bounds (K,)."""
        lower, upper = (np.array([getattr(p, key) for p in self.free]) for key in ("lower", "upper"))
        return lower / self.sizes, upper / self.sizes

    @cached_property
    def directions(self) -> tuple[Array, ...]:
        """Change of each chain's parameters per scaled free parameter (P, K)."""
        matrices = tuple(np.zeros((dynamics.size, len(self.free))) for dynamics in self.fleet.dynamics)
        for k, parameter in enumerate(self.free):
            for joint in parameter.joints:
                chain, index = self.fleet.index(joint, parameter.name)
                matrices[chain][index, k] = parameter.size
        return matrices

    def theta(self, values: Sequence[Array]) -> Array:
        """Scaled free parameters (K,) of given values; the mean of joints that share one."""
        found = [
            float(np.mean([self.fleet.of(values, joint, parameter.name) for joint in parameter.joints]))
            for parameter in self.free
        ]
        return np.clip(np.array(found) / self.sizes, *self.bounds)

    def values(self, theta: Array, fixed: Sequence[Array]) -> tuple[Array, ...]:
        """Gives the parameters, chain by chain."""
        new = [np.array(own) for own in fixed]
        for parameter, value in zip(self.free, theta * self.sizes, strict=True):
            for joint in parameter.joints:
                chain, index = self.fleet.index(joint, parameter.name)
                new[chain][index] = value
        return tuple(new)

    def part(self, chain: int) -> Freedom:
        """Gives what is free of one chain alone; what it shares with others is free of it alone, but for the delay."""
        own = {int(j): k for k, j in enumerate(self.fleet.columns[chain])}
        mine = []
        for parameter in self.free:
            joints = tuple(own[j] for j in parameter.joints if j in own)
            if joints and (len(self.fleet.robots) == 1 or parameter.name != "delay"):
                mine.append(replace(parameter, joints=joints))
        return Freedom(fleet=self.fleet.part(chain), free=tuple(mine))

    def with_free(self, more: Iterable[FreeParameter]) -> Freedom:
        """Adds parameters of single joints; a joint that shared one has its own from then on."""
        free = list(self.free)
        for new in more:
            if any(p.name == new.name and p.joints == new.joints for p in free):
                continue
            for k, old in enumerate(free):
                if old.name == new.name and set(old.joints) & set(new.joints):
                    free[k] = replace(old, joints=tuple(j for j in old.joints if j not in new.joints))
            free = [parameter for parameter in free if parameter.joints] + [new]
        return replace(self, free=tuple(free))


def classes_of(names: Sequence[str], share: Sequence[str]) -> dict[str, tuple[int, ...]]:
    """Sorts joints into classes that share parameters.

    Args:
        names: of the joints.
        share: parts of names, such as ``hip``: joints with it are one class; ``all`` for one class. Other joints stand
            alone.

    Raises:
        InputError: a part that no name has, or a joint in two classes.
    """
    if "all" in share:
        return {"all": tuple(range(len(names)))}
    classes: dict[str, tuple[int, ...]] = {}
    taken: dict[int, str] = {}
    for part in share:
        joints = tuple(j for j, name in enumerate(names) if part.lower() in name.lower())
        if not joints:
            raise InputError(f"no joint's name contains {part!r}", allowed=f"parts of {', '.join(names)}")
        for joint in joints:
            if joint in taken:
                raise InputError(
                    f"{names[joint]} belongs to {taken[joint]!r} and to {part!r}", allowed="one class each"
                )
            taken[joint] = part
        classes[part] = joints
    alone = {name: (j,) for j, name in enumerate(names) if j not in taken}
    return classes | alone


def free_parameters(
    fleet: Fleet, names: Sequence[str], classes: Mapping[str, tuple[int, ...]], joints: Iterable[int] | None = None
) -> tuple[FreeParameter, ...]:
    """Makes parameters free, per class of joints or per joint.

    Args:
        fleet: the chains.
        names: of the parameters.
        classes: the joints that share them.
        joints: only these joints and the classes with one of them; all by default.
    """
    wanted = set(range(fleet.n)) if joints is None else set(joints)
    found = []
    for name in names:
        own = name in OWN
        groups = {fleet.names[j]: (j,) for j in range(fleet.n)} if own else classes
        for group, members in groups.items():
            having = tuple(j for j in members if name in fleet.drives[j].names)
            if having and wanted & set(having):
                found.append(_free(fleet, name, group, having))
    return tuple(found)


def shared_delay(fleet: Fleet) -> FreeParameter:
    """One delay of all joints: commands travel together."""
    return _free(fleet, "delay", "all", tuple(range(fleet.n)))


def _free(fleet: Fleet, name: str, group: str, joints: tuple[int, ...]) -> FreeParameter:
    first = fleet.drives[joints[0]]
    described = first.parameters[first.names.index(name)]
    chain, own = fleet.place[joints[0]]
    # Gains and limits differ by orders of magnitude between robots: their own values are their sizes.
    stated = max(abs(fleet.drives[j].values[name]) for j in joints)
    size = stated if described.lower > 0 and stated < 1e5 else described.size
    unit = described.unit_at(fleet.robots[chain], own)
    return FreeParameter(
        name=name,
        group=group,
        joints=joints,
        size=size,
        lower=described.lower,
        upper=described.upper,
        unit=unit,
    )
