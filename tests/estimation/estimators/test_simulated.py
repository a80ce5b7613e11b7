"""Estimators that simulate the closed loop, against a plant that shares no code with them."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicHermiteSpline

from estimation.closed_loops.closed_loop import ClosedLoop, inertia_matrices, stiff_controller
from estimation.estimators import (
    Controller,
    DirectAndInverse,
    InstrumentalVariables,
    Loop,
    OrdinaryLeastSquares,
    RegressionData,
    TotalLeastSquares,
)
from estimation.preprocessing import LowPass, resample
from estimation.regressions.moments import Moments
from estimation.regressions.preparation import Rows
from robots.base_parameters import find_base_parameters
from robots.common.errors import InputError
from robots.regressor import default_model
from robots.signals import Log, Motion

pytestmark = pytest.mark.slow

GRAVITY, ELBOW, WIDTH = 9.81, 0.4, 0.05
KP, KD = np.array([400.0, 150.0]), np.array([40.0, 15.0])
RUNS = 30


def closed_form(q, dq, inertia, rotor):
    """Inertia matrix and the torque of gravity and Coriolis of the arm, two links in a vertical plane (textbook)."""
    (h1x, h1y), (m2, h2x, h2y) = inertia[0, 1:3], inertia[1, :3]
    i1, i2 = inertia[0, 9], inertia[1, 9]
    s2, c2, q12 = np.sin(q[1]), np.cos(q[1]), q[0] + q[1]
    shared = ELBOW * (h2x * c2 - h2y * s2)
    matrix = np.array([[i1 + i2 + m2 * ELBOW**2 + 2 * shared, i2 + shared], [i2 + shared, i2]]) + np.diag(rotor)
    slope = -ELBOW * (h2x * s2 + h2y * c2)
    wrist = GRAVITY * (h2x * np.cos(q12) - h2y * np.sin(q12))
    bias = np.array(
        [
            slope * (2 * dq[0] * dq[1] + dq[1] ** 2)
            + GRAVITY * ((h1x + m2 * ELBOW) * np.cos(q[0]) - h1y * np.sin(q[0]))
            + wrist,
            -slope * dq[0] ** 2 + wrist,
        ]
    )
    return matrix, bias


@pytest.fixture(scope="module")
def truth(arm, fourier_motion):
    """The arm under a PD controller, integrated by scipy: reference, motion, torque, base parameters."""
    reference = fourier_motion(arm, 0, duration=10.0)
    q_r = CubicHermiteSpline(reference.t, reference.q, reference.dq)
    dq_r = CubicHermiteSpline(reference.t, reference.dq, reference.ddq)
    inertia, rotor, friction = np.asarray(arm.inertia), np.asarray(arm.rotor_inertia), np.asarray(arm.friction)

    def acceleration(t, q, dq):
        matrix, bias = closed_form(q, dq, inertia, rotor)
        drive = KP * (q_r(t) - q) + KD * (dq_r(t) - dq)
        return np.linalg.solve(matrix, drive - bias - friction[:, 0] * np.tanh(dq / WIDTH) - friction[:, 1] * dq), drive

    def flow(t, x):
        return np.concatenate([x[2:], acceleration(t, x[:2], x[2:])[0]])

    start = np.concatenate([reference.q[0], reference.dq[0]])
    path = solve_ivp(flow, (0, reference.t[-1]), start, method="LSODA", t_eval=reference.t, rtol=1e-8, atol=1e-10)
    q, dq = path.y[:2].T, path.y[2:].T
    both = [acceleration(t, a, b) for t, a, b in zip(reference.t, q, dq, strict=True)]
    motion = Motion(t=reference.t, q=q, dq=dq, ddq=np.array([a for a, _ in both]))
    model = default_model(arm, friction="coulomb-viscous", velocity_scale=WIDTH)
    base = find_base_parameters(model)
    return reference, motion, np.array([u for _, u in both]), base, base.from_standard(model.nominal)


@pytest.fixture(scope="module")
def controller():
    return Controller(proportional=KP, derivative=KD)


def test_the_loop_moves_as_the_plant(truth, controller):
    """The simulated loop follows scipy's integration of the closed-form arm, with an error of second order."""
    reference, motion, _, base, values = truth
    errors = []
    for substeps in (1, 2, 4):
        simulated = ClosedLoop(base).simulate(values, controller, reference, substeps)
        errors.append([np.sqrt(np.mean((getattr(simulated, s) - getattr(motion, s)) ** 2)) for s in ("q", "dq", "ddq")])
    errors = np.array(errors)
    # 0.06 rad of tracking error, 4 rad/s and 30 rad/s2: what is left is the integration's.
    assert (errors[1] < [1e-5, 2e-4, 3e-2]).all(), errors
    assert errors[2, 1] < errors[0, 1] / 5  # 16 but for the tolerance of scipy's integration


def test_a_joint_may_stick(arm):
    """Coulomb friction holds a joint whose drive stays below it, without creep and without small steps."""
    model = default_model(arm, friction="coulomb-viscous", velocity_scale=0.0)
    base = find_base_parameters(model)
    standard = model.nominal.copy()
    standard[[model.names.index(name) for name in ("f1_1", "f1_2")]] = 30.0
    values = base.from_standard(standard)
    t = 0.004 * np.arange(500)
    still = np.zeros((500, 2))
    reference = Motion(t=t, q=still + [np.pi / 2, 0.0] + 0.01, dq=still, ddq=still)
    simulated = ClosedLoop(base).simulate(values, Controller(proportional=KP, derivative=KD), reference)
    # A saturation a microradian per second wide stands for the sign.
    assert np.abs(simulated.q - reference.q).max() < 1e-5


def noisy_data(truth, seed, positions=3e-4, torque=0.3, cutoff=15.0):
    _, motion, tau, base, _ = truth
    rng = np.random.default_rng(seed)
    log = Log(
        t=motion.t,
        q=motion.q + positions * rng.standard_normal(motion.q.shape),
        tau=tau + torque * rng.standard_normal(tau.shape),
    )
    smoother = LowPass(cutoff)
    smooth = smoother.smooth(resample(log.t, log.q)).slice(50, -50)
    rows = Rows(smooth, log.tau[50:-50], (np.abs(smooth.dq) > 0.01).astype(float))
    moments = Moments.of(base.regressor(smooth.q, smooth.dq, smooth.ddq), rows.tau, rows.mask)
    return RegressionData(base=base, moments=moments, parts=[rows], ridge=1e-12, logs=[log], smoother=smoother)


@pytest.fixture(scope="module")
def monte_carlo(truth, controller):
    """Per estimator: mean errors over their standard errors, the errors of all runs, and the solutions."""
    loop = Loop(controller=controller, reference=[truth[0]])
    members = {
        "ols": OrdinaryLeastSquares(),
        "tls": TotalLeastSquares(),
        "iv": InstrumentalVariables(loop),
        "didim": DirectAndInverse(loop),
    }
    found = {name: [] for name in members}
    for seed in range(RUNS):
        data = noisy_data(truth, seed)
        for name, member in members.items():
            found[name].append(member.refine(data, *member.solve(data.moments, data.ridge)))
    means = {}
    for name, solutions in found.items():
        error = np.array([solution.values for solution in solutions]) - truth[4]
        means[name] = error.mean(axis=0) / (error.std(axis=0, ddof=1) / np.sqrt(RUNS)), error, solutions
    return means


def test_least_squares_is_biased_by_noise_in_the_positions(monte_carlo):
    """With 0.3 mrad of noise in the positions, least squares misses inertias by tens of standard errors of the mean."""
    assert np.abs(monte_carlo["ols"][0]).max() > 30
    assert np.median(np.abs(monte_carlo["ols"][0])) > 5


@pytest.mark.parametrize("name", ["iv", "didim"])
def test_simulated_instruments_have_no_bias(monte_carlo, name):
    """With the same noise, IV and DIDIM are unbiased: means of 30 runs within 4.5 standard errors of the truth."""
    # 13 parameters: a t variable of 29 degrees of freedom exceeds 4.5 in 1 of 9,800 draws, so this fails wrongly with a
    # chance of 1 in 750 per estimator; the draws are fixed.
    assert np.abs(monte_carlo[name][0]).max() < 4.5, monte_carlo[name][0]


def test_total_least_squares_removes_most_of_the_bias(monte_carlo):
    """Knowing nothing but the recorded positions, total least squares takes nine tenths of the bias away."""
    ols, tls = (np.abs(monte_carlo[name][1].mean(axis=0)) for name in ("ols", "tls"))
    spread = monte_carlo["ols"][1].std(axis=0)
    strong = np.abs(monte_carlo["ols"][0]) > 20
    assert strong.sum() >= 4
    assert (tls[strong] < 0.2 * ols[strong]).all()
    assert (tls < ols + spread).all()


@pytest.mark.parametrize("name", ["iv", "didim"])
def test_their_standard_errors_are_honest(monte_carlo, name):
    """Stated 95 % intervals hold the truth in 90 to 99 % of 30 runs and 13 parameters."""
    _, error, solutions = monte_carlo[name]
    stated = np.sqrt([np.diag(solution.covariance) for solution in solutions])
    inside = np.mean(np.abs(error) < 1.96 * stated)
    # 390 intervals, those of a run correlated: a standard deviation of 1.8 %.
    assert 0.90 < inside < 0.99, inside


def test_without_a_reference_they_do_no_harm(truth):
    """With neither reference nor controller known, the measured motion stands in, and bias is still less than OLS's."""
    data = noisy_data(truth, 0)
    weak = {}
    for member in (OrdinaryLeastSquares(), InstrumentalVariables(), DirectAndInverse()):
        solution = member.refine(data, *member.solve(data.moments, data.ridge))
        weak[member.name] = np.abs(solution.values - truth[4])[truth[3].names.index("Im_2")]
    assert weak["iv"] < 0.4 * weak["ols"]
    assert weak["didim"] < 0.4 * weak["ols"]


def test_parameters_of_no_robot_are_replaced_for_simulation(truth, controller):
    """A start whose inertia matrix is not positive definite does not stop the simulation."""
    data = noisy_data(truth, 0)
    values, weights = OrdinaryLeastSquares().solve(data.moments, data.ridge)
    wrong = values.copy()
    wrong[truth[3].names.index("Im_2")] = -1.0
    assert np.linalg.eigvalsh(inertia_matrices(truth[3], wrong, truth[0])).min() < 0
    loop = Loop(controller=controller, reference=[truth[0]])
    solution = DirectAndInverse(loop).refine(data, wrong, weights)
    right = DirectAndInverse(loop).refine(data, values, weights)
    np.testing.assert_allclose(solution.values, right.values, rtol=0.02, atol=0.02)


def test_a_controller_that_nobody_declared_tracks(truth):
    """The stand-in controller is critically damped and follows the reference to a milliradian."""
    reference, _, _, base, values = truth
    simulated = ClosedLoop(base).simulate(values, stiff_controller(base, values, reference), reference)
    assert np.abs(simulated.q - reference.q).max() < 1e-3


def test_what_does_not_suit_is_refused(truth, controller):
    """References and controllers of other logs or joints are refused with what would be allowed."""
    reference, _, _, base, values = truth
    data = noisy_data(truth, 0)
    weights = np.ones(2)
    short = reference.slice(0, 500)
    for bad in (
        [reference, reference],
        [short],
        [Motion(t=reference.t, **{k: np.zeros((2500, 3)) for k in ("q", "dq", "ddq")})],
    ):
        with pytest.raises(InputError, match="allowed: "):
            InstrumentalVariables(Loop(controller=controller, reference=bad)).refine(data, values, weights)
    with pytest.raises(InputError, match="allowed: "):
        Controller(proportional=[1.0], derivative=[1.0, 2.0])
    with pytest.raises(InputError, match="allowed: "):
        Controller(proportional=[-1.0], derivative=[1.0])
    with pytest.raises(InputError, match="allowed: 2"):
        ClosedLoop(base).simulate(values, Controller(proportional=[1.0], derivative=[1.0]), reference)
