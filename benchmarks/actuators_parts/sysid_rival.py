"""MuJoCo's own system identification on one log, in an environment with `mujoco[sysid]`; run as a script.

python sysid_rival.py MODEL.xml LOG.npz RESULT.json: the model has the names of its joints; the log has t, q, command.
"""

from __future__ import annotations

import json
import sys
import time

import mujoco
import numpy as np
from mujoco import sysid

FIELDS = {"armature": "armature", "viscous": "damping", "coulomb": "frictionloss"}


def main() -> None:
    """Fits armature, damping and frictionloss of each joint, and writes values, half-widths and the time."""
    model_file, log_file, result_file = sys.argv[1:]
    spec = mujoco.MjSpec.from_file(model_file)
    log = np.load(log_file)
    names = [joint.name for joint in spec.joints]
    for name in names:
        kinds = {"type": mujoco.mjtSensor.mjSENS_JOINTPOS, "objtype": mujoco.mjtObj.mjOBJ_JOINT}
        spec.add_sensor(name=f"{name}_pos", objname=name, **kinds)
    model = spec.compile()
    parameters = sysid.ParameterDict()
    for key, field in FIELDS.items():
        for name in names:
            joint = spec.joint(name)
            nominal = float(np.ravel(getattr(joint, field))[0])

            def write(spec, parameter, name=name, field=field):
                value = float(np.ravel(parameter.value)[0])
                joint = spec.joint(name)
                old = getattr(joint, field)
                setattr(joint, field, [value, *np.ravel(old)[1:]] if np.ndim(old) else value)

            parameters[f"{key} {name}"] = sysid.Parameter(f"{key} {name}", nominal, 0.0, 20 * nominal, modifier=write)
    t = log["t"]
    control = sysid.TimeSeries.from_control_names(t, log["command"], model)
    sensors = sysid.TimeSeries.from_names(t, log["q"], model)
    state = sysid.create_initial_state(model, log["q"][0])
    sequences = sysid.ModelSequences("leg", spec, "run", state, control, sensors)
    residual = sysid.build_residual_fn(models_sequences=[sequences])
    began = time.perf_counter()
    cpu = time.process_time()
    found, result = sysid.optimize(parameters, residual, verbose=False)
    took, used = time.perf_counter() - began, time.process_time() - cpu
    left = residual(result.x, found)[0]
    _, half = sysid.calculate_intervals(left, result.jac)
    names = [f"{key} {name}" for key in FIELDS for name in names]
    values = {name: float(np.ravel(found[name].value)[0]) for name in names}
    answer = {"values": values, "half_widths": dict(zip(values, np.ravel(half).tolist(), strict=True))}
    with open(result_file, "w") as file:
        json.dump(answer | {"seconds": took, "cpu": used}, file)


if __name__ == "__main__":
    main()
