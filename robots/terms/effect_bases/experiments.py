"""The kinds of experiment that separate effects from each other."""

from __future__ import annotations

EXPERIMENTS: dict[str, str] = {
    "sweep": "constant speeds from slow to fast, in both directions, over the joint's whole range",
    "pause": "motion, a long pause, and the same motion again",
    "static_hold": "many static poses",
    "payload": "the same motion with and without a known payload",
    "single_joint": "one joint at a time, the others held",
    "micro_reversals": "small motions back and forth with several amplitudes",
    "mirrored": "the same motion, forwards and backwards in time",
    "second_base_pose": "the same motion with the base tilted by a known angle",
    "multisine": "a motion with higher frequencies",
    "repeat": "the same motion again",
}
"""Description of each kind of experiment, by the name that `Effect.experiments` uses."""
