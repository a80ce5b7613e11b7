"""The monitor on an arm whose torque comes from pinocchio: what it names, and that restarts change nothing."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from estimation.monitoring import Monitor, MonitorSettings, baseline_of
from robots.common.errors import InputError
from tests.estimation.monitoring.arm import NOISE, Arm

pytestmark = pytest.mark.slow


def send(monitor, logs):
    for log in logs:
        monitor.begin(log.name)
        monitor.update(log.t, log.q, log.tau)
    monitor.finish()
    return monitor.findings


def damaged(joint, since, amount):
    """Friction factors (N, 6) of a damage."""

    def factor(t):
        scale = np.ones((len(t), 6))
        scale[t >= since, joint - 1] += amount
        return scale

    return factor


def test_damage_is_named_dated_and_sized(arm, monitor):
    """32 % more friction on joint 2 from 330 s on: one finding, dated within 30 s, its size within 3 points."""
    logs = [arm.log(300.0 * k, factor=damaged(2, 330.0, 0.32), name=f"log {k}") for k in range(3)]
    (found,) = send(monitor, logs)
    assert (found.kind, found.joint, found.effect, found.severity) == ("damage", 2, "friction_step", "act")
    assert found.earliest <= 330.0 <= found.latest
    assert found.latest - found.earliest <= 30.0
    assert found.size == pytest.approx(32.0, abs=3.0)
    assert found.low <= 32.0 <= found.high
    # A model errs by 5 % of the friction between cold and warm: no interval is narrower.
    assert found.high - found.low > 0.09 * (100 + found.size)
    assert found.log == "log 1"
    assert "oed diagnose" in found.advice()


def test_payload_is_not_damage(arm, monitor):
    """A body of 1 kg, 0.1 m in front of the flange, is a payload with its mass and centre."""
    torque = arm.payload(1.0)
    logs = [arm.log(300.0 * k, extra=lambda t, i: torque[i] * (t >= 330.0)[:, None]) for k in range(3)]
    (found,) = send(monitor, logs)
    assert found.kind == "payload"
    assert found.low <= 1.0 <= found.high
    assert "z 0.1" in found.text
    assert "x 0.0" in found.text or "x -0.0" in found.text


@pytest.mark.parametrize(("begin", "length", "size"), [(335.2, 0.5, 1.0), (339.45, 1.0, 20.0)])
def test_contact_is_short(arm, monitor, begin, length, size):
    """A short force is a contact, and nothing lasting; also one that ends in the next window of 10 s."""

    def push(t, index):
        s = np.clip((t - begin) / length, 0.0, 1.0)
        return size * np.sin(np.pi * s)[:, None] * np.array([0, 15.0, 10.0, 0, 3.0, 0])

    (found,) = send(monitor, [arm.log(300.0 * k, extra=push) for k in range(3)])
    assert found.kind == "contact"
    assert found.earliest <= begin + length / 2 <= found.latest
    assert found.severity == "watch"


@pytest.mark.parametrize("amount", [2.0, 4.0])
def test_an_error_that_comes_in_each_cycle_is_no_contact(arm, monitor, amount):
    """A new motion on which the model errs at one place for 0.3 s: it comes again in each cycle of 10 s."""
    bump = amount * NOISE * arm.size * np.exp(-(((arm.t - 4.0) / 0.3) ** 2))[:, None]
    logs = [arm.log(0.0, 120.0), arm.log(300.0, 120.0, extra=lambda t, i: bump[i])]
    assert [f.kind for f in send(monitor, logs) if f.kind == "contact"] == []


def test_healthy_robot_is_green(arm, monitor):
    """Six minutes without a change: no finding. At one false alarm in 1000 h the chance to fail is 1e-4."""
    assert send(monitor, [arm.log(300.0 * k) for k in range(6)]) == ()


def test_moves_with_stops_are_green(arm):
    """A model of smooth motions, fitted with a low cut-off, judges moves with stops: no finding.

    A low-pass of 1.5 Hz rings at a stop: the sign of the friction followed the ringing.
    """
    model = replace(arm.model, provenance={**arm.model.provenance, "cutoff_hz": 1.5})
    monitor = Monitor(baseline_of(model), MonitorSettings(heat="none"))
    assert send(monitor, [arm.moves_with_stops(300.0 * k, 60) for k in range(4)]) == ()


def test_damage_is_found_in_moves_with_stops(arm, monitor):
    """Half more friction of one joint shows between the stops."""
    logs = [arm.moves_with_stops(300.0 * k, 60) for k in range(4)]
    worse = Arm.__new__(Arm)
    worse.__dict__.update(arm.__dict__)
    friction = arm.machine.friction * np.where(np.arange(6) == 3, 1.5, 1.0)[:, None]
    worse.machine = replace(arm.machine, friction=friction)
    logs += [worse.moves_with_stops(300.0 * k, 60) for k in range(4, 8)]
    (found,) = send(monitor, logs)
    assert (found.kind, found.joint) == ("damage", 4)
    assert found.low < 50.0 < found.high


def test_chunks_and_restarts_change_nothing(arm, baseline, tmp_path):
    """Rows one log at a time, and in odd chunks with a restart after each third, give one state and one finding."""
    settings = MonitorSettings(heat="common")
    logs = [arm.log(300.0 * k, 30.0, factor=damaged(5, 320.0, 0.4)) for k in range(3)]
    whole = Monitor(baseline, settings)
    for log in logs:
        whole.update(log.t, log.q, log.tau)
    parts = Monitor(baseline, settings)
    rng, file = np.random.default_rng(1), tmp_path / "state.json"
    for log in logs:
        cuts = [0, *np.sort(rng.choice(len(log), 6, replace=False)).tolist(), len(log)]
        for number, (a, b) in enumerate(pairwise(cuts)):
            parts.update(log.t[a:b], log.q[a:b], log.tau[a:b])
            if number % 3 == 2:
                parts.save(file)
                parts = Monitor.load(file)
    whole.finish()
    parts.finish()
    assert parts.to_dict() == whole.to_dict()
    assert [f.joint for f in whole.findings] == [5]


def test_rows_that_are_wrong_are_refused(arm, monitor, tmp_path):
    """Shapes, gaps in the numbers, times that go back, and files that are no state."""
    log = arm.log(0.0, 2.0)
    with pytest.raises(InputError, match="shape"):
        monitor.update(log.t, log.q[:, :3], log.tau)
    bad = np.array(log.tau)
    bad[7, 2] = np.nan
    with pytest.raises(InputError, match=r"row 8.*not finite|not finite"):
        monitor.update(log.t, log.q, bad)
    monitor.update(log.t, log.q, log.tau)
    with pytest.raises(InputError, match="time does not increase"):
        monitor.update(log.t, log.q, log.tau)
    file = tmp_path / "state.json"
    file.write_text("{}")
    with pytest.raises(InputError, match="is not a monitor file"):
        Monitor.load(file)
