"""Motions with stops."""

import numpy as np

from robots.signals import Motion


def stop_and_go(rng, *, moves=50, stop=0.1, period=0.004):
    """Moves of two joints between random places with a stop after each: cosine velocity, at most 3 rad/s.

    Returns:
        The motion, and the number of the stop of each row (N,), -1 while the joints move.
    """
    here, states, stops = np.zeros(2), [], []
    for number in range(moves):
        there = rng.uniform(-1.8, 1.8, 2)
        duration = np.pi / 2 * np.abs(there - here).max() / 3.0 + 0.3
        x = np.pi * np.arange(0, duration, period)[:, None] / duration
        step, rate = there - here, np.pi / duration
        states.append((here + step * (1 - np.cos(x)) / 2, step * np.sin(x) / 2 * rate, step * np.cos(x) / 2 * rate**2))
        rest = np.zeros((int(stop / period), 2))
        states.append((there + rest, rest, rest))
        stops += [-1] * len(x) + [number] * len(rest)
        here = there
    q, dq, ddq = (np.concatenate(parts) for parts in zip(*states, strict=True))
    return Motion(t=period * np.arange(len(q)), q=q, dq=dq, ddq=ddq), np.array(stops)
