"""A robot controller to test against, on this computer only.

It plays trajectories on the virtual robot. Faults can be ordered. It writes no files.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from oed.cli.options.results import Overwriting
from oed.cli.options.robots import SimulatedRobot
from oed.cli.verbs import Printed, Verb
from oed.controllers.virtual_options import ControllerOptions
from robots.common.errors import InputError
from robots.common.options import Option, numbers
from robots.common.progress import Progress

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from robots.robot import Robot


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
    options: ControllerOptions
    duration: float | None = None
    overwriting: Overwriting = Overwriting()

    def run(self, progress: Progress) -> Printed:
        """Serves until Ctrl-C."""
        from oed.controllers import virtual_controller
        from oed.controllers.interrupts import terminate_as_interrupt
        from robots.plants import load_plant

        if self.duration is not None and not self.duration > 0:
            raise InputError(f"--duration {self.duration}", allowed="seconds above 0")
        options, robot = self.options, self.robot.load()
        plant = load_plant(self.plant, robot) if self.plant else None
        virtual = virtual_controller(robot, plant, options=options, pose=self._stands(robot), seed=options.faults.seed)
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
