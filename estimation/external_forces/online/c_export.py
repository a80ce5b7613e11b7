"""The force observer as C: one step function for a controller, its state in a struct, without any library."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import casadi
import numpy as np
from numpy.typing import ArrayLike

from estimation.exports.c_code import check_prefix, generated
from estimation.external_forces.residuals.dynamics import dynamics_of
from estimation.external_forces.residuals.friction_levels import FRICTION_MEMORY
from estimation.external_forces.residuals.signals import SETTLING_CONSTANTS
from estimation.external_forces.thresholds.calibrations import Calibration
from estimation.external_forces.wrenches import UNOBSERVABLE_SHARE
from estimation.models.model import Model
from robots.common.errors import InputError
from robots.common.files import write_atomic
from robots.version import VERSION


def export_observer(
    model: Model,
    calibration: Calibration,
    path: str | Path,
    *,
    prefix: str = "robot",
    tool: Sequence[float] | None = None,
    force: bool = False,
) -> None:
    """Writes the C of `observer_code`.

    Raises:
        InputError: the file is there, and force is not given; or see `observer_code`.
    """
    write_atomic(Path(path), observer_code(model, calibration, prefix=prefix, tool=tool), force=force)


def observer_code(
    model: Model,
    calibration: Calibration,
    *,
    prefix: str = "robot",
    tool: Sequence[float] | None = None,
    gravity: ArrayLike | None = None,
    payload: ArrayLike | None = None,
) -> str:
    """Writes `ForceObserver` as C99 without dependencies but ``math.h``.

    The file holds a state type and two functions: ``PREFIX_observer_reset(state)`` and ``PREFIX_observer_step(state, t,
    q, dq, tau, factor, torque, deviation, &statistic, force)``, which returns 1 during a contact. ``factor`` is each
    joint's friction over that of the model, as the generated code of the thermal models gives it, or NULL. ``force`` is
    NAN where the joints do not feel some direction. Nothing is allocated.

    Args:
        model: an identified model without extensions.
        calibration: of `estimate_forces` with ``velocity="logged"``.
        prefix: of the functions' names.
        tool: position (3,) of the tool point in the flange's frame [m]; the flange by default.
        gravity: (3,) in the base frame [m/s2], where the base stands otherwise than described.
        payload: ten inertial parameters of a body on the flange.

    Raises:
        InputError: a model with extensions or without inertial parameters, smoothed velocities, or a prefix that is
            none in C.
    """
    check_prefix(prefix)
    if model.extensions:
        raise InputError("a model with extensions cannot be exported as C code", remedy="export the base model")
    if calibration.velocity != "logged":
        raise InputError(
            "the calibration was made with smoothed velocities, which a controller does not have",
            remedy="calibrate with --velocity logged on a log with dq1..",
        )
    dynamics = dynamics_of(model, gravity=gravity, payload=payload, tool=tool)
    q, dq, ddq = (casadi.SX.sym(name, dynamics.n) for name in ("q", "dq", "ddq"))
    outputs = dynamics.expressions(q, dq, casadi.DM(dynamics.values))
    # Row by row, so that the rows of the Jacobian follow each other.
    outputs[3] = casadi.vec(outputs[3].T)
    functions = [
        casadi.Function(f"{prefix}_dynamics", [q, dq], outputs),
        casadi.Function(f"{prefix}_variance", [q, dq, ddq], [dynamics.variance_expression(q, dq, ddq)]),
    ]
    source, work = generated(f"{prefix}_observer_model", functions)
    errors = calibration.errors
    arrays = {
        "LEVEL": errors.level,
        "REVERSAL": errors.reversal,
        "FRICTION": errors.friction,
        "NARROW": -0.5 / errors.width**2,
        "INSIDE": errors.leverage + errors.inside,
        "BEYOND": errors.beyond,
        "REACH2": errors.reach**2,
        "HOLDING": errors.holding,
        "SLIDING": errors.sliding,
        "HOLD": errors.coulomb / np.sqrt(3.0),
        "INVERSE": np.linalg.inv(errors.correlation),
        "SQUARE": calibration.friction_square,
    }
    numbers = {
        "CONSTANT": calibration.constant,
        "PERIOD": calibration.period,
        "MEMORY": FRICTION_MEMORY,
        "THRESHOLD": calibration.threshold.value,
        "SETTLING": SETTLING_CONSTANTS * calibration.constant,
        "FORGOTTEN": calibration.memory,
        "UNOBSERVABLE": UNOBSERVABLE_SHARE,
    }
    head = HEAD.format(name=model.robot.name, version=VERSION, prefix=prefix, n=dynamics.n)
    lines = [f"enum {{ NAME_N = {dynamics.n}, NAME_WORK = {work} }};"]
    lines += [f"static const double NAME_{key} = {_number(value)};" for key, value in numbers.items()]
    lines += [
        f"static const double NAME_{key}[] = {{{', '.join(_number(x) for x in np.ravel(values))}}};"
        for key, values in arrays.items()
    ]
    body = "\n".join(lines) + BODY
    return head + "#include <math.h>\n#include <string.h>\n" + source + body.replace("NAME", prefix)


def _number(value: float) -> str:
    return repr(float(value))


HEAD = """/* {name}: external forces from the drives' torques, generated by robot-oed {version}.
 *
 * void {prefix}_observer_reset({prefix}_observer *state);
 * int {prefix}_observer_step({prefix}_observer *state, double t, const double q[{n}], const double dq[{n}],
 *     const double tau[{n}], const double *factor, double torque[{n}], double deviation[{n}], double *statistic,
 *     double force[3]);
 *     returns 1 during a contact. t [s]; q [rad or m]; dq; tau [N m or N]; factor: friction over the model's, or NULL.
 *     torque: external joint torque, and its standard deviation on a healthy robot [N m or N]; statistic: 1 is the
 *     threshold; force: at the tool along the base's axes, if there is no moment [N].
 *
 * No memory is allocated.
 */
"""
BODY = """

typedef struct {
    double t, begun, touched;
    int started, contact;
    double residual[NAME_N], acceleration[NAME_N], momentum[NAME_N], other[NAME_N], dq[NAME_N], before[NAME_N];
    double cross[NAME_N], square[NAME_N], amplitudes[4 * NAME_N];
} NAME_observer;

void NAME_observer_reset(NAME_observer *s)
{
    memset(s, 0, sizeof *s);
    for (int j = 0; j < NAME_N; ++j) s->square[j] = NAME_SQUARE[j];
}

static void NAME_force(const double *J, const double *z, const double *deviation, double *force)
{
    double B[3 * NAME_N], W[3 * NAME_N], A[9], b[3], scale[3], determinant = 1.0;
    for (int k = 0; k < 3; ++k)
        for (int j = 0; j < NAME_N; ++j) B[k * NAME_N + j] = J[k * NAME_N + j] / deviation[j];
    for (int k = 0; k < 3; ++k)
        for (int j = 0; j < NAME_N; ++j) {
            double sum = 0.0;
            for (int i = 0; i < NAME_N; ++i) sum += B[k * NAME_N + i] * NAME_INVERSE[i * NAME_N + j];
            W[k * NAME_N + j] = sum;
        }
    for (int k = 0; k < 3; ++k) {
        b[k] = 0.0;
        for (int j = 0; j < NAME_N; ++j) b[k] += W[k * NAME_N + j] * z[j];
        for (int l = 0; l < 3; ++l) {
            A[3 * k + l] = 0.0;
            for (int j = 0; j < NAME_N; ++j) A[3 * k + l] += W[k * NAME_N + j] * B[l * NAME_N + j];
        }
    }
    for (int k = 0; k < 3; ++k) scale[k] = A[4 * k] > 0.0 ? sqrt(A[4 * k]) : 1.0;
    for (int k = 0; k < 3; ++k) {
        b[k] /= scale[k];
        for (int l = 0; l < 3; ++l) A[3 * k + l] /= scale[k] * scale[l];
    }
    for (int k = 0; k < 3; ++k) {
        for (int l = 0; l < k; ++l) {
            for (int m = 0; m < l; ++m) A[3 * k + l] -= A[3 * k + m] * A[3 * l + m];
            A[3 * k + l] /= A[4 * l];
        }
        for (int m = 0; m < k; ++m) A[4 * k] -= A[3 * k + m] * A[3 * k + m];
        /* Of a matrix with a unit diagonal the smallest eigenvalue is the determinant over 2.25, or more. */
        determinant *= A[4 * k];
        if (!(determinant > 6.75 * NAME_UNOBSERVABLE)) {
            force[0] = force[1] = force[2] = NAN;
            return;
        }
        A[4 * k] = sqrt(A[4 * k]);
    }
    for (int k = 0; k < 3; ++k) {
        for (int l = 0; l < k; ++l) b[k] -= A[3 * k + l] * b[l];
        b[k] /= A[4 * k];
    }
    for (int k = 2; k >= 0; --k) {
        for (int l = k + 1; l < 3; ++l) b[k] -= A[3 * l + k] * b[l];
        b[k] /= A[4 * k];
    }
    for (int k = 0; k < 3; ++k) force[k] = b[k] / scale[k];
}

int NAME_observer_step(NAME_observer *s, double t, const double *q, const double *dq, const double *tau,
                       const double *factor, double *torque, double *deviation, double *statistic, double *force)
{
    double momentum[NAME_N], rest[NAME_N], friction[NAME_N], J[6 * NAME_N], variance[NAME_N];
    double other[NAME_N], z[NAME_N], external[NAME_N], mean[NAME_N], work[NAME_WORK], a = 0.0;
    int slides[NAME_N];
    const double *in[3] = {q, dq, s->acceleration};
    double *out[4] = {momentum, rest, friction, J};
    double *spread[1] = {variance};
    const double step = t - s->t;
    const double longest = fmax(NAME_CONSTANT, 2.0 * NAME_PERIOD);
    const int fresh = !s->started || !(step > 0.0) || step > longest;
    NAME_dynamics(in, out, 0, work, 0);
    for (int j = 0; j < NAME_N; ++j) other[j] = tau[j] - rest[j] - (factor ? factor[j] : 1.0) * friction[j];
    if (fresh) {
        s->begun = t;
        s->contact = 0;
        for (int j = 0; j < NAME_N; ++j) s->residual[j] = s->acceleration[j] = 0.0;
    } else {
        a = exp(-step / NAME_CONSTANT);
        for (int j = 0; j < NAME_N; ++j) {
            external[j] = (momentum[j] - s->momentum[j]) / step - (other[j] + s->other[j]) / 2.0;
            mean[j] = (friction[j] + s->before[j]) / 2.0;
            slides[j] = fmin(fabs(dq[j]), fabs(s->dq[j])) >= NAME_SLIDING[j];
            s->residual[j] = a * s->residual[j] + (1.0 - a) * (external[j] + mean[j] * s->cross[j] / s->square[j]);
            s->acceleration[j] = a * s->acceleration[j] + (1.0 - a) * (dq[j] - s->dq[j]) / step;
        }
    }
    NAME_variance(in, spread, 0, work, 0);
    for (int j = 0; j < NAME_N; ++j) {
        const double now[4] = {
            exp(NAME_NARROW[j] * dq[j] * dq[j]),
            fabs(friction[j]),
            sqrt(NAME_INSIDE[j] * fmax(variance[j], 0.0) + NAME_BEYOND[j] * fmax(variance[j] - NAME_REACH2[j], 0.0)),
            NAME_HOLD[j] / (1.0 + (dq[j] / NAME_HOLDING[j]) * (dq[j] / NAME_HOLDING[j])),
        };
        double w[4];
        for (int k = 0; k < 4; ++k) {
            double *kept = s->amplitudes + k * NAME_N + j;
            *kept = fresh ? now[k] : a * *kept + (1.0 - a) * now[k];
            w[k] = *kept * *kept;
        }
        deviation[j] = sqrt(NAME_LEVEL[j] + NAME_REVERSAL[j] * w[0] + NAME_FRICTION[j] * w[1] + w[2] + w[3]);
        torque[j] = s->residual[j];
        z[j] = torque[j] / deviation[j];
        s->momentum[j] = momentum[j];
        s->other[j] = other[j];
        s->dq[j] = dq[j];
        s->before[j] = friction[j];
    }
    *statistic = 0.0;
    for (int i = 0; i < NAME_N; ++i)
        for (int j = 0; j < NAME_N; ++j) *statistic += z[i] * NAME_INVERSE[i * NAME_N + j] * z[j];
    *statistic /= NAME_THRESHOLD;
    if (!fresh) {
        /* A residual beyond the threshold counts as one at the threshold. */
        const double b = exp(-fmin(step, 2.0 * NAME_PERIOD) / NAME_MEMORY);
        const double counts = (1.0 - b) / sqrt(fmax(*statistic, 1.0));
        for (int j = 0; j < NAME_N; ++j) {
            if (!slides[j]) continue;
            s->cross[j] = b * s->cross[j] - counts * external[j] * mean[j];
            s->square[j] = b * s->square[j] + counts * mean[j] * mean[j];
        }
    }
    NAME_force(J, z, deviation, force);
    s->t = t;
    s->started = 1;
    if (*statistic > 1.0 && t - s->begun > NAME_SETTLING) {
        s->touched = t;
        s->contact = 1;
    }
    s->contact = s->contact && t - s->touched <= NAME_FORGOTTEN;
    return s->contact;
}
"""
