"""A payload from logs with and without it, or from one log and a model."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from estimation.payloads import PayloadEstimate, identify_payload, load_payload
from estimation.preprocessing import LowPass, resample, smooth
from estimation.regressions.preparation import Prepared
from oed.reports.pages.payload_report import payload_page
from robots.common.errors import InputError, NotIdentifiableError
from robots.signals import Log
from robots.terms.situations.flange_body import point_mass
from tests.estimation.payloads.conftest import CENTRE, INERTIA, MASS, Experiment

pytestmark = pytest.mark.slow
# Two logs of 20 s show the mass to some 1 %, the centre to some 2 mm: four standard errors of eleven quantities are
# missed by chance once in 1000 draws, and the draw is fixed.
SIGMAS = 4.0


def agrees(found: PayloadEstimate) -> None:
    """Mass, centre and inertia are within four standard errors, and the errors are as small as they should be."""
    truth = [MASS, *CENTRE, *INERTIA[np.triu_indices(3)]]
    for item, value in zip(found.quantities, truth, strict=True):
        middle = item.unconstrained
        assert abs(middle - value) < SIGMAS * max(item.half_width, 1e-6) / 1.96 + 1e-9, item.name
    assert found.quantities[0].half_width < 0.05 * MASS
    assert max(item.half_width for item in found.quantities[1:4]) < 0.01
    assert found.body.possible
    assert all(joint.residual < 0.05 * joint.torque_rms for joint in found.joints)


@pytest.fixture(scope="module")
def difference(experiment: Experiment) -> PayloadEstimate:
    """The payload by two logs of one path, which need geometry only."""
    return identify_payload(
        experiment.loaded, robot=experiment.robot, without=experiment.free, model=experiment.estimate
    )


def test_the_difference_of_two_logs_of_one_path_shows_the_payload(difference: PayloadEstimate) -> None:
    """The logs are paired although their clocks are 100 s apart and the loaded arm sags."""
    assert difference.method == "difference"
    assert difference.warnings == ()
    assert difference.provenance["shift"] == pytest.approx(-100.0, abs=0.01)
    agrees(difference)


def test_one_log_and_a_model_show_the_payload(experiment: Experiment) -> None:
    """On a path that the model has not seen."""
    found = identify_payload(experiment.other, model=experiment.estimate.model)
    assert found.method == "model"
    agrees(found)


def test_logs_of_different_paths_are_fitted_jointly_and_the_distance_is_said(experiment: Experiment) -> None:
    """The warning names the joint and the distance."""
    found = identify_payload(
        experiment.other, robot=experiment.robot, without=experiment.free, model=experiment.estimate
    )
    assert found.method == "joint fit"
    assert any("different paths" in warning and "joint" in warning for warning in found.warnings)
    agrees(found)


def test_a_result_survives_its_file_and_a_change_of_frame(difference: PayloadEstimate, tmp_path: Path) -> None:
    """`save` and `load_payload`; in a frame 0.1 m in front of the flange the centre is nearer, the inertia the same."""
    pose = np.eye(4)
    pose[2, 3] = 0.1
    moved = difference.seen_from(pose)
    moved.save(tmp_path)
    again = load_payload(tmp_path)
    assert again.summary() == moved.summary()
    for a, b in zip(difference.quantities, moved.quantities, strict=True):
        shift = 0.1 if a.name == "centre_z" else 0.0
        assert (b.value, b.lower, b.upper) == pytest.approx(
            (a.value - shift, a.lower - shift, a.upper - shift), abs=1e-6
        )
    assert "frame of --frame" in moved.summary()
    assert list(again.to_frame().index) == [item.name for item in difference.quantities]
    with pytest.raises(InputError, match="overwrite"):
        moved.save(tmp_path)


def test_a_known_part_of_the_payload_is_not_counted(experiment: Experiment) -> None:
    """With 1.5 kg of it stated in the log the other .5 kg are found."""
    part = replace(experiment.other, payload=point_mass(1.5, tuple(CENTRE)))
    found = identify_payload(part, model=experiment.estimate.model)
    mass = found.quantities[0]
    assert abs(mass.value - 0.5) < SIGMAS * mass.half_width / 1.96


def test_a_log_without_wrist_motion_is_refused_with_the_motion_that_it_lacks(experiment: Experiment) -> None:
    """Joints 4 to 6 stand: the message names what is open, the wrist joints, and the design."""
    q = experiment.other.q.copy()
    q[:, 1:] = q[0, 1:]
    rng = np.random.default_rng(0)
    model = experiment.estimate.model
    # Only the vertical axis turns: gravity never shows the mass.
    motion = smooth(resample(experiment.other.t, q), LowPass(5.0))
    tau = model.torque(motion.q, motion.dq, motion.ddq)
    log = Log(t=motion.t, q=q, tau=tau + 0.3 * rng.normal(size=tau.shape))
    with pytest.raises(NotIdentifiableError, match=r"does not determine|joint 6") as caught:
        identify_payload(log, model=model)
    assert "--payload-only" in str(caught.value)
    assert "joint 6" in str(caught.value)


@pytest.mark.parametrize("reference", ["log", "model"])
def test_a_bare_arm_has_no_payload_and_the_most_that_it_may_have(
    experiment: Experiment, reference: str, tmp_path: Path
) -> None:
    """Without a payload in either log the mass is zero, up to a bound below 100 g; the file says the same."""
    half = len(experiment.free) // 2
    first, second = experiment.free.rows(slice(0, half)), experiment.free.rows(slice(half, None))
    given = (
        {"robot": experiment.robot, "without": first} if reference == "log" else {"model": experiment.estimate.model}
    )
    found = identify_payload(second, **given)
    assert not found.found
    mass = found.quantities[0]
    assert (mass.value, mass.lower) == (0.0, 0.0)
    assert max(mass.unconstrained, 0.0) <= mass.upper < 0.1
    assert found.determined == (True, *(9 * [False]))
    assert f"no payload found: at most {mass.upper:.2g} kg at 95 %" in found.summary()
    assert "centre of mass" not in found.summary()
    data = found.seen_from(np.diag([1.0, -1.0, -1.0, 1.0])).to_dict()
    assert (data["found"], data["mass"], data["centre_of_mass"]) == (False, 0.0, [0.0, 0.0, 0.0])
    assert data["quantities"][0]["ci95"] == [0.0, pytest.approx(mass.upper)]
    assert all(row["value"] == 0.0 and row["ci95"] == [None, None] for row in data["quantities"][1:])
    found.save(tmp_path)
    assert not load_payload(tmp_path).found
    assert payload_page(found).verdict == f"No payload was found: {found.limit}."


@pytest.mark.parametrize("options", [{}, {"model": None, "without": ()}])
def test_one_log_alone_is_refused(experiment: Experiment, options: dict) -> None:
    """Without a model and without a second log nothing separates the payload from the arm."""
    with pytest.raises(InputError, match="no reference for the payload"):
        identify_payload(experiment.loaded, robot=experiment.robot, **options)


def test_the_log_of_another_robot_is_refused(experiment: Experiment) -> None:
    """Of another number of joints by the number; of as many joints because no payload explains the torque."""
    short = Log(t=experiment.free.t, q=experiment.free.q[:, :5], tau=experiment.free.tau[:, :5])
    with pytest.raises(InputError, match="joints"):
        identify_payload(short, model=experiment.estimate.model)
    tau = experiment.other.tau[:, [2, 0, 1, 5, 3, 4]]
    with pytest.raises((InputError, NotIdentifiableError)):
        identify_payload(replace(experiment.other, tau=tau), model=experiment.estimate.model)


def test_a_motion_that_repeats_counts_once_for_what_the_arm_s_model_misses(experiment: Experiment, monkeypatch) -> None:
    """The period of a log reaches the covariance: no standard error is smaller by it, and some are larger."""
    found = identify_payload(experiment.other, model=experiment.estimate.model)
    monkeypatch.setattr(Prepared, "period", None)
    plain = identify_payload(experiment.other, model=experiment.estimate.model)
    ratio = np.sqrt(np.diag(found.covariance) / np.diag(plain.covariance))
    assert (ratio >= 1 - 1e-9).all()
    # Noise, which does not repeat, dominates here: the rest makes 1 or 2 %.
    assert ratio.max() > 1.005
