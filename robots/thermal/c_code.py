"""The online estimator as C for a controller: one self-contained file, the same arithmetic as `OnlineFriction`."""

from __future__ import annotations

import re

import numpy as np

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.thermal.online import OnlineFriction


def generate_c(online: OnlineFriction, *, name: str = "joint") -> str:
    """Writes an estimator as C99.

    The file holds a state type and three functions: ``NAME_reset(state, temperatures, spread)``,
    ``NAME_step(state, dq, measured, ambient, drives, T3)``, which returns the friction torque (``measured`` is NAN
    where none is), and ``NAME_temperature(state, zone)``. It allocates nothing and needs ``math.h`` alone.

    Args:
        online: the estimator; period, settings and coefficients are fixed in the code, its state is not.
        name: prefix of types and functions.

    Returns:
        The source.

    Raises:
        InputError: a name that is none in C.
    """
    if not re.fullmatch(r"[A-Za-z_]\w*", name):
        raise InputError(f"{name!r} is no name in C", allowed="letters, digits and underscores")
    model, settings = online.model, online.observer
    numbers = {
        "ALPHA": model.alpha,
        "BETA": model.beta,
        "T0": model.T0,
        "NOISE2": settings.torque_noise**2,
        "DRIFT2": settings.drift**2 * online.long.period,
        "SLOWEST": settings.slowest,
        "PERIOD": online.short.period,
    }
    title = f"Friction and temperature of one joint: {model.name} thermal model, period {online.short.period!r} s."
    lines = [f"/* {title} */"]
    lines += ["#include <math.h>", ""]
    lines += [f"enum {{ {name}_N = {len(online.state)}, {name}_Z = {len(model.zones)}, {name}_W = {online.steps} }};"]
    lines += [f"static const double {name}_{key} = {_number(value)};" for key, value in numbers.items()]
    lines += [_array(name, "F", online.coefficients), _array(name, "READ", online.readout)]
    lines += [_array(name, "BEGIN", online.begin)]
    short, long = online.short, online.long
    steps = {
        "S_PHI": short.Phi,
        "S_AROUND": short.around,
        "S_DRIVEN": short.driven,
        "S_BESIDE": short.beside,
        "S_HEAT": short.heat,
        "L_PHI": long.Phi,
        "L_HEAT": long.heat,
    }
    lines += [_array(name, key, values) for key, values in steps.items()]
    return "\n".join(lines) + "\n" + _BODY.replace("NAME", name)


def _number(value: float) -> str:
    return repr(float(value))


def _array(name: str, key: str, values: Array) -> str:
    flat = ", ".join(_number(value) for value in np.asarray(values).ravel())
    return f"static const double {name}_{key}[] = {{{flat}}};"


_BODY = """
typedef struct {
    double x[NAME_N], P[NAME_N * NAME_N];
    double heat, cross, square, power;
    int count, seen;
} NAME_state;

static double NAME_dot(const double *a, const double *b)
{
    double sum = 0.0;
    for (int i = 0; i < NAME_N; ++i) sum += a[i] * b[i];
    return sum;
}

double NAME_temperature(const NAME_state *s, int zone)
{
    return NAME_dot(NAME_READ + zone * NAME_N, s->x);
}

double NAME_factor(const NAME_state *s)
{
    return NAME_ALPHA * (NAME_temperature(s, 0) - NAME_T0) + NAME_BETA;
}

void NAME_reset(NAME_state *s, const double *temperatures, double spread)
{
    for (int i = 0; i < NAME_N; ++i) {
        s->x[i] = 0.0;
        for (int z = 0; z < NAME_Z; ++z) s->x[i] += NAME_BEGIN[i * NAME_Z + z] * temperatures[z];
        for (int j = 0; j < NAME_N; ++j) {
            double sum = 0.0;
            for (int z = 0; z < NAME_Z; ++z) sum += NAME_BEGIN[i * NAME_Z + z] * NAME_BEGIN[j * NAME_Z + z];
            s->P[i * NAME_N + j] = spread * spread * sum;
        }
    }
    s->heat = s->cross = s->square = s->power = 0.0;
    s->count = s->seen = 0;
}

static void NAME_correct(NAME_state *s)
{
    double F[NAME_N * NAME_N], G[NAME_N * NAME_N], row[NAME_N], Ph[NAME_N];
    const double slope = s->power / s->count * NAME_ALPHA;
    const double under = 1.0 - slope * NAME_dot(NAME_READ, NAME_L_HEAT) / 2.0;
    for (int j = 0; j < NAME_N; ++j) {
        double sum = NAME_READ[j];
        for (int k = 0; k < NAME_N; ++k) sum += NAME_READ[k] * NAME_L_PHI[k * NAME_N + j];
        row[j] = slope / 2.0 * sum / under;
    }
    for (int i = 0; i < NAME_N; ++i)
        for (int j = 0; j < NAME_N; ++j) F[i * NAME_N + j] = NAME_L_PHI[i * NAME_N + j] + NAME_L_HEAT[i] * row[j];
    for (int i = 0; i < NAME_N; ++i)
        for (int j = 0; j < NAME_N; ++j) {
            double sum = 0.0;
            for (int k = 0; k < NAME_N; ++k) sum += F[i * NAME_N + k] * s->P[k * NAME_N + j];
            G[i * NAME_N + j] = sum;
        }
    for (int i = 0; i < NAME_N; ++i)
        for (int j = 0; j < NAME_N; ++j) {
            double sum = 0.0;
            for (int k = 0; k < NAME_N; ++k) sum += G[i * NAME_N + k] * F[j * NAME_N + k];
            for (int z = 0; z < NAME_Z; ++z)
                sum += NAME_DRIFT2 * NAME_BEGIN[i * NAME_Z + z] * NAME_BEGIN[j * NAME_Z + z];
            s->P[i * NAME_N + j] = sum;
        }
    if (s->seen && s->square > 0.0 && NAME_ALPHA != 0.0) {
        for (int i = 0; i < NAME_N; ++i) Ph[i] = NAME_ALPHA * NAME_dot(s->P + i * NAME_N, NAME_READ);
        const double variance = NAME_ALPHA * NAME_dot(NAME_READ, Ph) + NAME_NOISE2 * s->seen / s->square;
        const double gap = s->cross / s->square - NAME_factor(s);
        for (int i = 0; i < NAME_N; ++i) {
            s->x[i] += Ph[i] / variance * gap;
            for (int j = 0; j < NAME_N; ++j) s->P[i * NAME_N + j] -= Ph[i] * Ph[j] / variance;
        }
    }
    for (int i = 0; i < NAME_N; ++i)
        for (int j = 0; j < i; ++j) {
            const double mean = (s->P[i * NAME_N + j] + s->P[j * NAME_N + i]) / 2.0;
            s->P[i * NAME_N + j] = mean;
            s->P[j * NAME_N + i] = mean;
        }
}

double NAME_step(NAME_state *s, double dq, double measured, double ambient, double drives, double T3)
{
    const double speed = fabs(dq), sign = (dq > 0.0) - (dq < 0.0);
    const double cold = sign * NAME_F[0] + dq * (NAME_F[1] + speed * (NAME_F[2] + speed * NAME_F[3]));
    const double power = cold * dq > 0.0 ? cold * dq : 0.0;
    const double torque = cold * NAME_factor(s);
    double next[NAME_N];
    for (int i = 0; i < NAME_N; ++i)
        next[i] = NAME_dot(NAME_S_PHI + i * NAME_N, s->x) + NAME_S_AROUND[i] * ambient + NAME_S_DRIVEN[i] * drives
                  + NAME_S_BESIDE[i] * T3;
    const double slope = power * NAME_ALPHA;
    const double under = 1.0 - slope * NAME_dot(NAME_READ, NAME_S_HEAT) / 2.0;
    const double middle = (NAME_dot(NAME_READ, s->x) + NAME_dot(NAME_READ, next)) / 2.0;
    const double heat = (slope * (middle - NAME_T0) + power * NAME_BETA) / under;
    for (int i = 0; i < NAME_N; ++i) s->x[i] = next[i] + NAME_S_HEAT[i] * heat;
    s->heat += heat * NAME_PERIOD;
    s->power += power;
    ++s->count;
    if (!isnan(measured) && speed > NAME_SLOWEST) {
        s->cross += measured * cold;
        s->square += cold * cold;
        ++s->seen;
    }
    if (s->count == NAME_W) {
        NAME_correct(s);
        s->cross = s->square = s->power = 0.0;
        s->count = s->seen = 0;
    }
    return torque;
}
"""
