"""Writes a CasADi function as C that treats as many samples at a time as the processor's vectors hold."""

from __future__ import annotations

import math

import casadi

from robots.batch.operations import operation

# `vec` is GCC's and Clang's portable vector type: its arithmetic needs no intrinsics and no luck with optimisers.
# Samples are transposed into it at the entrance and back at the exit; the last block repeats its last sample.
# VECTOR_LIBM is defined where the C library has sines of whole vectors (glibc's libmvec, to some 1e-16): one by one
# they cost as much as the rest of a regressor.
_HEAD = """#include <math.h>
#if defined(ONE_LANE)
#define W 1
#elif defined(__AVX512F__)
#define W 8
#elif defined(__AVX__)
#define W 4
#else
#define W 2
#endif
typedef double vec __attribute__((vector_size(8 * W)));
#if defined(__AVX512F__)
#define VECTOR(name) _ZGVeN8v_##name
#elif defined(__AVX2__)
#define VECTOR(name) _ZGVdN4v_##name
#elif defined(__AVX__)
#define VECTOR(name) _ZGVcN4v_##name
#else
#define VECTOR(name) _ZGVbN2v_##name
#endif
#if defined(VECTOR_LIBM) && !defined(ONE_LANE)
vec VECTOR(sin)(vec), VECTOR(cos)(vec), VECTOR(tanh)(vec);
#define OF(name, target, argument) target = VECTOR(name)(argument);
#else
#define OF(name, target, argument) EACH(target, name(argument[k]))
#endif
#define EACH(target, value) for (int k = 0; k < W; ++k) target[k] = value;

static void evaluate(const vec* restrict x, vec* restrict y) {
"""
_TAIL = """}

static const long long in_size[] = {%(in_sizes)s}, out_size[] = {%(out_sizes)s};

static void scatter(const vec* restrict y, long long size, double* restrict out) {
  const double* from = (const double*)y;
  for (long long j = 0; j < size; ++j)
    for (int k = 0; k < W; ++k) out[k * size + j] = from[j * W + k];
}

// Lane k takes row start + k * step of the inputs, the last lanes that of the last one left.
static void gather(vec* restrict x, const double** in, long long start, long long step, int left) {
  long long at = 0;
  for (int i = 0; i < %(n_in)d; ++i)
    for (long long j = 0; j < in_size[i]; ++j, ++at)
      for (int k = 0; k < W; ++k) x[at][k] = in[i][(start + (k < left ? k : left - 1) * step) * in_size[i] + j];
}

static void leave(const vec* restrict y, double** out, long long start, int left) {
  long long at = 0;
  for (int i = 0; i < %(n_out)d; at += out_size[i], ++i) {
    if (left == W) {
      scatter(y + at, out_size[i], out[i] + start * out_size[i]);
      continue;
    }
    for (int k = 0; k < left; ++k)
      for (long long j = 0; j < out_size[i]; ++j) out[i][(start + k) * out_size[i] + j] = y[at + j][k];
  }
}

void batch_all(long long samples, const double** in, double** out) {
  vec x[%(x_size)d], y[%(y_size)d];
  for (long long start = 0; start < samples; start += W) {
    const int left = samples - start < W ? (int)(samples - start) : W;
    gather(x, in, start, 1, left);
    evaluate(x, y);
    leave(y, out, start, left);
  }
}

void batch_sums(long long groups, long long size, const double** in, double** out) {
  vec x[%(x_size)d], y[%(y_size)d], total[%(y_size)d];
  const vec zero = {0};
  for (long long start = 0; start < groups; start += W) {
    const int left = groups - start < W ? (int)(groups - start) : W;
    for (int j = 0; j < %(y_size)d; ++j) total[j] = zero;
    for (long long row = 0; row < size; ++row) {
      gather(x, in, start * size + row, size, left);
      evaluate(x, y);
      for (int j = 0; j < %(y_size)d; ++j) total[j] += y[j];
    }
    leave(total, out, start, left);
  }
}
"""

# Only of functions (state, inputs, ...) -> state. One step follows the other, so that most lanes would idle.
_STEPS = """
// The first output is the first input of the next step; the second input has its own rows in each step.
void batch_steps(long long samples, long long steps, const double** in, double** out) {
  vec x[%(x_size)d], y[%(y_size)d];
  const long long k = %(state)d, m = %(driven)d;
  for (long long start = 0; start < samples; start += W) {
    const int left = samples - start < W ? (int)(samples - start) : W;
    gather(x, in, start, 1, left);
    for (long long step = 0; step < steps; ++step) {
      for (long long j = 0; j < m; ++j)
        for (int l = 0; l < W; ++l)
          x[k + j][l] = in[1][(step * samples + start + (l < left ? l : left - 1)) * m + j];
      evaluate(x, y);
      for (long long j = 0; j < k; ++j) x[j] = y[j];
      for (int l = 0; l < left; ++l)
        for (long long j = 0; j < k; ++j) out[0][(step * samples + start + l) * k + j] = y[j][l];
    }
  }
}
"""


def c_source(function: casadi.Function) -> str:
    """Writes the C of ``batch_all(samples, inputs, outputs)`` and ``batch_sums(groups, size, inputs, outputs)``.

    That of a step, (state, inputs, ...) -> state, also has ``batch_steps(samples, steps, inputs, states)``.

    Args:
        function: a function of SX with dense column vectors as inputs and outputs.

    Returns:
        The source text; its arrays are sample after sample.
    """
    inputs = [function.numel_in(i) for i in range(function.n_in())]
    outputs = [function.numel_out(i) for i in range(function.n_out())]
    names = ", ".join(f"w{i}" for i in range(max(1, function.sz_w())))
    lines = [f"  const vec zero = {{0}}; vec {names};"]
    for k in range(function.n_instructions()):
        identifier = function.instruction_id(k)
        into, source = function.instruction_output(k), function.instruction_input(k)
        if identifier == casadi.OP_CONST:
            lines.append(f"  w{into[0]} = zero + {_literal(function.instruction_constant(k))};")
        elif identifier == casadi.OP_INPUT:
            lines.append(f"  w{into[0]} = x[{sum(inputs[: source[0]]) + source[1]}];")
        elif identifier == casadi.OP_OUTPUT:
            lines.append(f"  y[{sum(outputs[: into[0]]) + into[1]}] = w{source[0]};")
        else:
            known = operation(identifier)
            if known.vector is not None:
                lines.append(f"  OF({known.vector}, w{into[0]}, w{source[0]})")
            elif known.c is None:
                lines.append(f"  w{into[0]} = " + known.numpy.format(*(f"w{i}" for i in source)) + ";")
            else:
                lines.append(f"  EACH(w{into[0]}, " + known.c.format(*(f"w{i}[k]" for i in source)) + ")")
    tail = _TAIL % {
        "in_sizes": ", ".join(map(str, inputs)),
        "out_sizes": ", ".join(map(str, outputs)),
        "x_size": max(1, sum(inputs)),
        "y_size": max(1, sum(outputs)),
        "n_in": len(inputs),
        "n_out": len(outputs),
    }
    if len(outputs) == 1 and len(inputs) > 1 and outputs[0] == inputs[0]:
        tail += _STEPS % {
            "x_size": sum(inputs),
            "y_size": sum(outputs),
            "state": inputs[0],
            "driven": inputs[1],
        }
        return "#define ONE_LANE\n" + _HEAD + "\n".join(lines) + "\n" + tail
    return _HEAD + "\n".join(lines) + "\n" + tail


def _literal(value: float) -> str:
    if math.isnan(value):
        return "NAN"
    if math.isinf(value):
        return "INFINITY" if value > 0 else "-INFINITY"
    return repr(float(value))
