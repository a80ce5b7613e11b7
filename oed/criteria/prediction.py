"""I-optimality: the variance of the torques predicted for a task."""

from __future__ import annotations

from oed.criteria.trace import Trace


class PredictionVariance(Trace):
    """trace(T (Y'Y)^-1), T the mean information matrix of the task's motion.

    That is the variance of the predicted torque at unit noise, summed over the joints and averaged over the task.

    It is the A criterion in the directions that the task asks for, see `task_transform`.
    """

    name = "i"
    label = "mean torque variance on the task, trace(T (Y'Y)^-1)"
