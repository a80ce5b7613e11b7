"""A robot controller to test against, on this computer only.

It plays trajectories on the virtual robot. Faults can be ordered. It writes no files.
"""

from __future__ import annotations

import sys
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from oed.cli.options.links import Behaviour, Link
from oed.cli.options.results import Overwriting
from oed.cli.options.robots import SimulatedRobot
from oed.cli.verbs import Printed, Verb
from robots.common.errors import InputError
from robots.common.options import Option, Seed, numbers
from robots.common.progress import Progress

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from robots.robot import Robot


@dataclass(frozen=True, kw_only=True)
class Disturbance:
    """What goes wrong.

    Attributes:
        lose: UDP: share of lost datagrams.
        double: UDP: share of doubled datagrams.
        late: UDP: share of late datagrams.
        late_by: delay of late datagrams [s].
        reorder: UDP: share of reordered datagrams.
        silent_after: fall silent after so many points.
        error_after: report an error after so many points.
        e_stop_after: emergency stop after so many points.
        restart_after: restart after so many points.
        stuck: play nothing, so that the buffer never empties.
        path: what the robot does wrong: none, swap, sign, half-speed, stall, offset or other-robot.
        path_after: begin with it so long after the start of a trajectory [s].
        seed: seed of the random numbers.
    """

    lose: float = 0.0
    double: float = 0.0
    late: float = 0.0
    late_by: float = 0.05
    reorder: float = 0.0
    silent_after: int | None = None
    error_after: int | None = None
    e_stop_after: int | None = None
    restart_after: int | None = None
    stuck: bool = False
    path: Annotated[str, Option(name="path-fault")] = "none"
    path_after: Annotated[float, Option(name="path-fault-after")] = 0.0
    seed: Seed = 0


@dataclass(frozen=True, kw_only=True)
class Controller(Verb):
    """``oed controller``.

    Attributes:
        plant: YAML file with the virtual robot's true behaviour. Default: the robot's nominal dynamics.
        pose: where the robot stands [rad or m], comma-separated, or a trajectory.csv with that start.
        duration: end after so long [s]. Default: Ctrl-C.
    """

    function = "oed.controllers.virtual_controller"
    examples = (
        "oed controller --robot er3a --plant plant.yaml",
        "oed controller --robot er3a --replies echo --lose 0.05 --double 0.05 --late 0.05",
    )

    robot: SimulatedRobot
    plant: Path | None = None
    pose: Annotated[str | None, Option(names_file=True)] = None
    link: Link = Link()
    behaviour: Behaviour = Behaviour()
    duration: float | None = None
    faults: Disturbance = Disturbance()
    overwriting: Overwriting = Overwriting()

    def run(self, progress: Progress) -> Printed:
        """Serves until Ctrl-C."""
        from oed.controllers import Faults, virtual_controller
        from oed.controllers.interrupts import terminate_as_interrupt
        from robots.plants import load_plant

        if self.duration is not None and not self.duration > 0:
            raise InputError(f"--duration {self.duration}", allowed="seconds above 0")
        options = self.behaviour.options(self.link, faults=Faults(**asdict(self.faults)))
        robot = self.robot.load()
        plant = load_plant(self.plant, robot) if self.plant else None
        virtual = virtual_controller(robot, plant, options=options, pose=self._stands(robot), seed=self.faults.seed)
        ports = f"motion port {virtual.motion_port}, state port {virtual.state_port}"
        if not self.quiet:
            place = f"{robot.name} at {options.host} ({options.transport.upper()}), {ports}"
            print(place, file=sys.stderr, flush=True)
        with terminate_as_interrupt():
            virtual.serve(self.duration)
        data = {
            "robot": robot.name,
            "points": virtual.points,
            "trajectories": virtual.played,
            "malformed": virtual.malformed,
            "error": virtual.error,
            "stalled": round(virtual.stalled, 3),
        }
        late = f"; this computer was late by {virtual.stalled:.2g} s in sum" if virtual.stalled else ""
        return Printed(
            f"{data['points']} points received, {data['trajectories']} trajectories played, {data['malformed']} "
            f"messages not understood{late}",
            data,
        )

    def _stands(self, robot: Robot) -> NDArray[np.float64] | None:
        """Where the robot stands (n,) [rad or m]; None for its home."""
        import numpy as np

        from oed.exports import read_trajectory

        if self.pose is None:
            return None
        if self.pose.endswith(".csv"):
            return read_trajectory(self.pose, n=robot.n)[0].q[0]
        return np.array(numbers("--pose", self.pose))
