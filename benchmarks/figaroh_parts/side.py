"""FIGAROH's own optimiser on a URDF, run by the interpreter that has FIGAROH; see ``figaroh_design.py``.

The settings are those of the UR10 example that its authors publish: rigid-body columns, 7 waypoints 2 s apart, 20 Hz,
100 iterations, soft limits of 10 %. Where cyipopt, which FIGAROH asks for, is not installed, the same IPOPT is called
through CasADi, with FIGAROH's own gradient and Jacobian by finite differences.
"""

from __future__ import annotations

import argparse
import sys
import time
import types
from pathlib import Path

import numpy as np

CONFIG = """
robot:
  name: ur10
  properties:
    joints:
      active_joints: [{joints}]
    mechanics:
      reduction_ratios: [1, 1, 1, 1, 1, 1]
      friction_coefficients: {{viscous: [0, 0, 0, 0, 0, 0], static: [0, 0, 0, 0, 0, 0]}}
      actuator_inertias: [0, 0, 0, 0, 0, 0]
      joint_offsets: [0, 0, 0, 0, 0, 0]
tasks:
  identification:
    enabled: true
    problem:
      include_external_forces: false
      use_joint_torques: true
      model_components: {{friction: false, joint_offset: false, actuator_inertia: false}}
    signal_processing: {{sampling_frequency: 500.0, cutoff_frequency: 50.0}}
  optimal_trajectory:
    enabled: true
    problem: {{soft_lim: 0.1, max_attempts: 500, max_iterations: {iterations}}}
    trajectory: {{waypoints: 7, frequency: 20, segment_duration: 2.0}}
"""


class ByCasadi:
    """The part of cyipopt.Problem that FIGAROH uses, over the IPOPT that comes with CasADi."""

    def __init__(self, n, m, problem_obj, lb, ub, cl, cu):
        self._bounds = [np.asarray(b, dtype=float) for b in (lb, ub, cl, cu)]
        self._n, self._m, self._problem, self._options = n, m, problem_obj, {}

    def add_option(self, key, value):
        """Keeps an option of IPOPT."""

        def text(item):
            return item.decode() if isinstance(item, bytes) else item

        self._options[text(key)] = text(value)

    def solve(self, x0):
        """Solves from a start, and answers as cyipopt does."""
        import casadi

        f = _callback(self._n, 1, self._problem.objective, lambda x: self._problem.gradient(x)[None], "f")
        g = _callback(self._n, self._m, self._problem.constraints, self._problem.jacobian, "g")
        x = casadi.MX.sym("x", self._n)
        options = {"error_on_fail": False, "calc_lam_p": False, "calc_lam_x": False, "ipopt": self._options}
        solver = casadi.nlpsol("s", "ipopt", {"x": x, "f": f(x), "g": g(x)}, options)
        lower, upper, low, high = self._bounds
        found = solver(x0=x0, lbx=lower, ubx=upper, lbg=low, ubg=high)
        status = solver.stats()["return_status"]
        code = {"Solve_Succeeded": 0, "Solved_To_Acceptable_Level": 1, "Maximum_Iterations_Exceeded": -1}.get(
            status, -2
        )
        return np.array(found["x"]).ravel(), {"status": code, "status_msg": status, "obj_val": float(found["f"])}


def _callback(size, rows, function, slope, name):
    import casadi

    class Jacobian(casadi.Callback):
        def __init__(self) -> None:
            casadi.Callback.__init__(self)
            self.construct(f"{name}_slope", {"enable_fd": False})

        def get_n_in(self) -> int:
            return 2

        def get_sparsity_in(self, index: int) -> casadi.Sparsity:
            return casadi.Sparsity.dense(size if index == 0 else rows, 1)

        def get_sparsity_out(self, _: int) -> casadi.Sparsity:
            return casadi.Sparsity.dense(rows, size)

        def eval(self, arguments):
            return [casadi.DM(np.asarray(slope(np.array(arguments[0]).ravel()), dtype=float))]

    class Value(casadi.Callback):
        def __init__(self) -> None:
            casadi.Callback.__init__(self)
            self._jacobian = Jacobian()
            self.construct(name, {"enable_fd": False})

        def get_sparsity_in(self, _: int) -> casadi.Sparsity:
            return casadi.Sparsity.dense(size, 1)

        def get_sparsity_out(self, _: int) -> casadi.Sparsity:
            return casadi.Sparsity.dense(rows, 1)

        def eval(self, arguments):
            return [casadi.DM(np.asarray(function(np.array(arguments[0]).ravel()), dtype=float).ravel())]

        def has_jacobian(self) -> bool:
            return True

        def get_jacobian(self, *_: object) -> casadi.Function:
            return self._jacobian

    kept = Value()
    _KEPT.append(kept)
    return kept


_KEPT: list = []


def main() -> int:
    parser = argparse.ArgumentParser(description="FIGAROH on a URDF")
    parser.add_argument("urdf")
    parser.add_argument("out")
    parser.add_argument("--iterations", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    solver = "cyipopt"
    try:
        import cyipopt  # noqa: F401
    except ImportError:
        module = types.ModuleType("cyipopt")
        module.Problem = ByCasadi
        sys.modules["cyipopt"], solver = module, "IPOPT by CasADi"
    from figaroh.optimal.base_optimal_trajectory import BaseOptimalTrajectory, BaseTrajectoryIPOPTProblem
    from figaroh.tools.robot import load_robot

    class Trajectory(BaseOptimalTrajectory):
        def create_ipopt_problem(self, *arguments):
            return BaseTrajectoryIPOPTProblem(self, *arguments)

    np.random.seed(options.seed)  # noqa: NPY002 -- FIGAROH draws from the legacy generator
    robot = load_robot(options.urdf, load_by_urdf=True)
    names = [name for name in robot.model.names if name != "universe"]
    config = Path(options.out).with_suffix(".yaml")
    config.write_text(CONFIG.format(joints=", ".join(names), iterations=options.iterations), encoding="utf-8")
    search = Trajectory(robot, names, str(config))
    joints = [robot.model.joints[robot.model.getJointId(name)] for name in names]
    search.identif_config.update(
        active_joints=names,
        act_Jid=[robot.model.getJointId(name) for name in names],
        act_J=joints,
        act_idxq=[joint.idx_q for joint in joints],
        act_idxv=[joint.idx_v for joint in joints],
    )
    search.initialize()
    start = time.process_time()
    results = search.solve(stack_reps=1)
    seconds = time.process_time() - start
    if not results["T_F"]:
        print(f"FIGAROH found no feasible segment in {seconds:.0f} s", file=sys.stderr)
        return 1
    q, dq, ddq = (np.asarray(results[key][0]) for key in ("P_F", "V_F", "A_F"))
    condition = np.linalg.cond(search._stack_base_regressors(q, dq, ddq))
    np.savez(
        options.out, q=q, dq=dq, ddq=ddq, condition=condition, seconds=seconds, columns=len(search.idx_b), solver=solver
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
