"""What the choice of the low-pass does to estimates: the change of the model's torque under a neighbouring cut-off.

The cut-off of the positions is itself estimated, where their spectrum meets the noise. Two neighbouring cut-offs are
about as plausible, and the estimates differ between them. The variance between models adds to that within the model
(law of total variance; Buckland, Burnham and Augustin 1997).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.base_models.payload_and_gravity import base_torque
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.recordings.smoothed_motion import smooth_motion

Array = NDArray[np.float64]

# The neighbouring cut-off, as a share: half an octave, about the resolution at which a spectrum meets the noise.
NEIGHBOUR = 0.7
# Periods of the cut-off at the ends of a log in which a filter lacks data, and is not compared.
ENDS = 4.0


def cutoff_change(problem: Problem, values: Array) -> Array:
    """Computes the change of the base model's torque (N, n) [N m or N] with positions at the neighbouring cut-off.

    It is zero for recordings of which no cut-off is known.

    Args:
        problem: data and base model.
        values: base parameters (b,).
    """
    recording, base = problem.recording, problem.baseline.base
    change = np.zeros(recording.tau.shape)
    if recording.cutoffs is None:
        return change
    smoothed = [np.array(signal) for signal in (recording.q, recording.dq, recording.ddq)]
    inner = np.zeros(len(recording), dtype=bool)
    for run, cutoffs in zip(recording.runs, recording.cutoffs, strict=True):
        moving = np.ptp(recording.q[run], axis=0) > 0
        lower = np.where(moving & np.isfinite(cutoffs), NEIGHBOUR * cutoffs, 0.0)
        known = lower > 0
        if not known.any() or run.stop - run.start < 20:
            continue
        for signal, own in zip(smoothed, smooth_motion(recording.q[run], recording.step, lower), strict=True):
            signal[run] = np.where(known, own, signal[run])
        edge = int(ENDS / (float(lower[known].min()) * recording.step)) + 1
        inner[run.start + edge : max(run.stop - edge, run.start + edge)] = True
    q, dq, ddq = smoothed
    other = replace(recording, q=q, dq=dq, ddq=ddq)
    change[inner] = (base_torque(base, other, values) - base_torque(base, recording, values))[inner]
    return change * ~recording.sign_unknown
