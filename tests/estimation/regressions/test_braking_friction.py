import numpy as np
import pytest
from scipy.optimize import minimize

from estimation.regressions.braking_friction import with_braking_friction
from estimation.regressions.moments import Moments
from estimation.regressions.parameter_priors import GaussianPrior
from robots.base_parameters import find_base_parameters
from robots.regressor import default_model
from robots.terms import BendingFriction


@pytest.fixture(scope="module")
def base(arm):
    friction = BendingFriction(speed=(1.0, 2.0), velocity_scale=0.01)
    return find_base_parameters(default_model(arm, friction=friction, rotor=False, offset=False))


def problem(base, curve, seed=0, rows=300):
    """Moments of random states whose friction follows a curve of the speed."""
    rng = np.random.default_rng(seed)
    q, ddq = rng.uniform(-3, 3, (rows, 2)), rng.uniform(-5, 5, (rows, 2))
    dq = rng.uniform(-1, 1, (rows, 2)) * [1.0, 2.0]
    Y = base.regressor(q, dq, ddq)
    rigid = np.array([not column.friction for column in base.columns])
    values = np.where(rigid, 1.0, 0.0)
    tau = Y @ values + curve(dq) + 0.05 * rng.normal(size=(rows, 2))
    moments = Moments.of(Y, tau, np.ones((rows, 2))).pulled(GaussianPrior(1e-3 * np.eye(base.size), values))
    weights = np.array([1.0, 0.5])
    return moments, moments.solve(weights, 1e-6), weights


def friction(base, values, speed):
    """The friction torque (n,) at joint velocities."""
    rows = base.model.friction_at(speed)[list(base.independent)]
    own = np.array([column.joint for column in base.columns])
    return np.array([(rows * values)[own == joint].sum() for joint in (1, 2)])


def test_a_curve_that_brakes_stays(base):
    """Coulomb friction that flattens with speed obeys all constraints: nothing is moved."""
    moments, values, weights = problem(base, lambda dq: np.sign(dq) + 0.8 * np.tanh(dq / 0.4) + 0.3 * dq)
    assert np.array_equal(with_braking_friction(base, moments, values, weights, 1e-6), values)


def test_friction_that_falls_with_speed_is_held(base):
    """A curve that falls over all speeds would drive the joint beyond the data: the nearest that does not is taken."""
    moments, values, weights = problem(base, lambda dq: np.sign(dq) * (2.0 - 1.2 * np.abs(dq) / [1.0, 2.0]))
    assert (friction(base, values, np.array([3.0, 6.0])) < 0).any()
    found = with_braking_friction(base, moments, values, weights, 1e-6)
    curve = np.array([friction(base, found, share * np.array([1.0, 2.0])) for share in np.linspace(0.02, 5.0, 250)])
    assert (curve > -0.02).all()  # between the speeds at which it is demanded, by some per cent of the friction
    assert (np.diff(curve[30:], axis=0) > -1e-6).all()

    # The same problem by another solver.
    from estimation.regressions.standard_parameters import nonnegative_rows

    rows = nonnegative_rows(base.model, np.array([1.0, 2.0]))[:, list(base.independent)]
    matrix = np.linalg.inv(moments.inverse(weights, 1e-6))

    def cost(x):
        return (x - values) @ matrix @ (x - values) / 1e3

    best = minimize(
        cost,
        np.maximum(values, 0.0),
        jac=lambda x: 2e-3 * matrix @ (x - values),
        method="SLSQP",
        constraints={"type": "ineq", "fun": lambda x: rows @ x, "jac": lambda x: rows},
        options={"maxiter": 500, "ftol": 1e-12},
    )
    assert cost(found) <= best.fun * (1 + 1e-4)
    assert (rows @ found >= -1e-7).all()


def test_another_friction_is_left_alone(arm):
    """The thesis' polynomial is fitted as it is."""
    base = find_base_parameters(default_model(arm))
    values = -np.ones(base.size)
    nothing = Moments.of(np.zeros((1, 2, base.size)), np.zeros((1, 2)), np.ones((1, 2)))
    assert with_braking_friction(base, nothing, values, np.ones(2), 0.0) is values
