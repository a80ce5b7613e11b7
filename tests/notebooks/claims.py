"""What each notebook claims, checked on the names that it leaves, against the truth that it made."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

Names = dict[str, Any]


def first_tour(names: Names) -> None:
    """The model predicts the unseen motion down to the noise of 2 %, and its standard errors are right."""
    # The noise is coloured, so that single joints may have a little more.
    assert names["prediction"].nrmse.max() < 0.03
    # RMS of 12 normal scores: outside 0.4 to 1.8 with a chance below 1e-4 if the standard errors are right.
    assert np.sqrt(np.mean(names["score"] ** 2)) < 1.8


def calibration(names: Names) -> None:
    """Other poses are predicted to the noise, and the errors lie within four standard errors of the truth."""
    found = names["calibration"]
    # Three axes of 0.05 mm are 0.087 mm, and 25 poses leave an error of estimation.
    assert found.check.held_out < 1.4e-4
    assert found.check.before > 10 * found.check.held_out
    assert len(names["shown"]) >= 3
    # Zeros may take over what a link without a place of its own does: some tenths of a mrad.
    assert np.abs(names["scores"]).max() < 8


def real_robot(names: Names) -> None:
    """The model of one part of the recording predicts the other part; 20 % is between model and description."""
    prediction = names["prediction"]
    assert np.all(prediction.nrmse < 0.2)
    assert np.all(prediction.band_coverage > 0.5)


def hidden_effect(names: Names) -> None:
    """The spring of 6 N m/rad at joint 2, as in `worn.yaml`, is found, and the held-out error falls."""
    diagnosis = names["diagnosis"]
    assert [(f.effect, f.joint) for f in diagnosis.findings] == [("spring", 2)]
    stiffness = diagnosis.findings[0].parameters[0]
    # Four standard errors are missed with a chance of 6e-5; the log is fixed.
    assert abs(stiffness.value - 6.0) < 4 * stiffness.standard_error
    assert diagnosis.findings[0].gain.nrmse_after < diagnosis.findings[0].gain.nrmse_before


def payload(names: Names) -> None:
    """Mass within 3 % and centre within 5 mm of the tool that was mounted."""
    tool, body = names["tool"], names["payload"].quantities
    assert abs(body[0].value / tool.mass - 1) < 0.03
    assert np.abs([item.value for item in body[1:4]] - tool.lever).max() < 0.005


def drives(names: Names) -> None:
    """The dead band is found at its joint, and delay, dead band, rotor inertia and friction are the plant's."""
    result = names["result"]
    assert [(finding.effect, finding.joint) for finding in result.findings] == [("dead_band", 2)]
    # A tenth of the sample period; and a tenth of the dead band, which Coulomb friction nearly replaces.
    assert abs(names["delay"].value - names["DELAY"]) < 5e-4
    assert abs(names["band"].value / names["DEAD_BAND"] - 1) < 0.1
    for name, true in names["TRUE"].items():
        for joint in result.joints:
            assert abs(result.value(name, joint).value / true - 1) < 0.1
    assert result.held_out_error < 0.05 * result.described_error


def thermal_friction(names: Names) -> None:
    """The unseen motion is predicted cold and warm, and the fitted friction lies between the plant's own two parts."""
    errors = names["errors"]
    # Noise of about 2 %, and 2 % for one factor of two parts that fall differently.
    assert errors["cold", "with heat"].max() < 0.05
    assert errors["warm", "with heat"].max() < 0.05
    assert np.all(errors["warm", "without heat"] > 4 * errors["warm", "with heat"])
    coulomb, viscous = names["truth"][:, 0], names["truth"][:, 1]
    for joint, curve in enumerate(names["curves"].T):
        fitted = np.interp(names["elapsed"], names["minutes"], curve)
        # 2 %: a log averages over 10 s, in which the cold robot heats up.
        assert np.all((viscous[:, joint] - 0.02 < fitted) & (fitted < coulomb[:, joint] + 0.02))


def mujoco_corrected(names: Names) -> None:
    """The spring at joint 2 is found with its stiffness, and the corrected model follows the robot."""
    finding = names["diagnosis"].findings[0]
    assert (finding.effect, finding.joint) == ("spring", 2)
    # The spring is stated in MuJoCo's own file. 10 %: inertial parameters share part of its torque.
    assert abs(finding.parameters[0].value / names["REAL"]["stiffness"] - 1) < 0.1
    errors = names["torque_errors"]
    assert np.linalg.norm(errors["corrected"]) < 0.2 * np.linalg.norm(errors["original"])


def two_robots(names: Names) -> None:
    """The thesis' findings: repeatable parameters, friction that heat changes, and a damage that is dated and sized."""
    # The thesis' limit for inertial parameters.
    assert all(change.size and change.max() < 0.05 for change in names["changes"].values())
    assert np.abs(names["cold_over_warm"] - names["true_ratio"]).max() < 0.03
    results, damage, moment = names["results"], names["DAMAGE"], names["moment"]
    assert results[1, "with heat"] == []
    assert [(f.kind, f.joint) for f in results[2, "with heat"]] == [("damage", names["JOINT"])]
    found = results[2, "with heat"][0]
    assert found.earliest <= moment <= found.latest
    assert found.detected - moment < names["CYCLE"]
    # Five points of 32 % are small beside the change by heat. The monitor's own size is too small, as the text says.
    assert abs(names["cold_size"][0] - damage) < 0.05
    assert found.size / 100 < damage
    # Without heat the healthy robot gets alarms, too, and the damage is not found.
    assert results[1, "without heat"] != []
    assert all(f.kind != "damage" for f in results[2, "without heat"])


def your_own_robot(names: Names) -> None:
    """Friction is right within four standard errors, and the 95 % band holds the unseen torque."""
    values, errors, truth = names["values"], names["errors"], names["truth"]
    friction = names["names"]
    assert len(friction) == 6
    assert all(abs(values[name] - truth[name]) < 4 * errors[name] for name in friction)
    # 4,600 correlated samples of some hundred independent ones: five points are more than two standard deviations.
    assert np.abs(names["prediction"].band_coverage - 0.95).max() < 0.05


def your_own_effect(names: Names) -> None:
    """The hose is found alone at its joint, with its stiffness within 10 %, and the held-out error falls."""
    diagnosis, true = names["diagnosis"], names["TRUE"]
    assert [(f.effect, f.joint) for f in diagnosis.findings] == [("tight_hose", names["JOINT"])]
    assert abs(names["found"]["hose_stiffness"] / true["hose_stiffness"] - 1) < 0.1
    joint = names["JOINT"] - 1
    assert diagnosis.extended[joint] < diagnosis.baseline[joint]


CLAIMS: dict[str, Callable[[Names], None]] = {
    check.__name__: check
    for check in (
        first_tour,
        real_robot,
        hidden_effect,
        calibration,
        payload,
        drives,
        thermal_friction,
        mujoco_corrected,
        two_robots,
        your_own_robot,
        your_own_effect,
    )
}
