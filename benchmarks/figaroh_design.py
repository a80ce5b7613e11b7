"""The design of an experiment for the UR10: ours against FIGAROH, in one run.

Run it with ``python benchmarks/figaroh_design.py --python ENV/bin/python``, the interpreter of an environment with
``pip install figaroh cyipopt`` (or casadi, where cyipopt cannot be built). FIGAROH optimises a cubic spline through 7
waypoints, 12 s long, by IPOPT with finite differences, as in the UR10 example of its authors; ours a Fourier series of
5 harmonics and 10 s under the same limits of position, velocity and torque, less the same 10 % of soft limits, and
under acceleration and jerk limits, too. Both minimise the condition number of the rigid body's base columns, which is
measured here by one regressor on the samples of both: base columns are a matter of choice, and FIGAROH's own number is
printed beside it. Times are the processor's, one thread each; our compilation is not in them, nor its preparation.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).parent))
from design import Clock as Stopwatch
from design import OverError, ours, processor, reached

from oed.constraints import TorqueLimit
from oed.criteria import criterion
from oed.experiments import usable_limits
from oed.experiments.problems.problem import FourierProblem
from robots.base_parameters import BaseParameters, find_base_parameters
from robots.common.errors import AssumedValueWarning
from robots.loading import load_robot
from robots.regressor import TorqueModel
from robots.terms import RigidBody

Array = NDArray[np.float64]

SOFT = 0.9
SIDE = Path(__file__).parent / "figaroh_parts" / "side.py"


def rival(python: str, urdf: Path, iterations: int, seed: int) -> dict[str, Array]:
    """Runs FIGAROH and gives its motion, its own condition number and its time."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "figaroh.npz"
        command = [python, str(SIDE), str(urdf), str(out), "--iterations", str(iterations), "--seed", str(seed)]
        ended = subprocess.run(command, capture_output=True, text=True, check=False)
        if ended.returncode:
            raise SystemExit(f"FIGAROH failed: {(ended.stderr.strip().splitlines() or ['no word'])[-1]}")
        return dict(np.load(out))


def problem() -> tuple[BaseParameters, FourierProblem]:
    """The rigid body's base columns of the UR10, and our problem under limits no wider than FIGAROH's."""
    robot = load_robot("ur10")
    narrow = replace(robot.limits, lower=SOFT * robot.limits.lower, upper=SOFT * robot.limits.upper)
    limits = usable_limits(narrow.scaled(velocity=SOFT))
    model = TorqueModel(robot, (RigidBody(),))
    base = find_base_parameters(model)
    torque = TorqueLimit(model, model.nominal, robot.limits.torque, margin=1 - SOFT)
    return base, FourierProblem(base=base, criterion=criterion("cond"), limits=limits, pointwise=(torque,))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--python", required=True, help="of the environment with figaroh")
    parser.add_argument("--iterations", type=int, default=100, help="of its IPOPT; 100 in its authors' example")
    parser.add_argument("--rival-seeds", type=int, default=3)
    parser.add_argument("--seeds", type=int, default=5, help="of ours")
    parser.add_argument("--budget", type=float, default=20.0, help="seconds of ours")
    options = parser.parse_args()
    warnings.simplefilter("ignore", AssumedValueWarning)
    base, ours_problem = problem()
    ours_problem.cost(np.zeros(ours_problem.size))
    ours_problem.shrunk(np.ones(ours_problem.size))
    print(f"{processor()}; one thread each; {base.size} base columns of the rigid body", flush=True)
    traces = []
    for seed in range(options.seeds):
        clock = Stopwatch(options.budget)
        try:
            ours(ours_problem, seed, clock)
        except OverError:
            traces.append(clock.trace)
    for seed in range(options.rival_seeds):
        theirs = rival(options.python, _urdf(), options.iterations, seed)
        Y = base.regressor(theirs["q"], theirs["dq"], theirs["ddq"]).reshape(-1, base.size)
        condition, seconds = float(np.linalg.cond(Y)), float(theirs["seconds"])
        times = [reached(trace, condition) for trace in traces]
        mine = float(np.median(times))
        print(
            f"FIGAROH, seed {seed} ({theirs['solver']}): cond(Y) {condition:.1f} after {seconds:.0f} s (by its own "
            f"{int(theirs['columns'])} columns {float(theirs['condition']):.1f}); ours {mine:.2f} s to the same: "
            f"{seconds / mine:.0f} times as fast",
            flush=True,
        )
    finals = ", ".join(f"{trace[-1][1]:.1f}" for trace in traces)
    print(f"ours after {options.budget:.0f} s: {finals}")
    return 0


def _urdf() -> Path:
    import robots.catalog

    return Path(next(iter(robots.catalog.__path__))) / "ur10.urdf"


if __name__ == "__main__":
    sys.exit(main())
