"""Fits the stages of a heating cycle into its time, and notes what was shortened."""

from __future__ import annotations

from oed.campaigns.planning import Planner
from oed.campaigns.programme import Programme
from oed.campaigns.stages import Stage
from robots.common.errors import InfeasibleError

LEAST_PLATEAU = 0.3
"""Time at each speed below which the warm-up gives way instead [s]: 75 samples at 4 ms to average over."""


def fit_stages(planner: Planner, programme: Programme, excitation: Stage | None) -> tuple[list[Stage], tuple[str, ...]]:
    """Plans friction and warm-up stages that fit into the cycle.

    First, the times at constant speed of the friction stage are shortened, down to `LEAST_PLATEAU`. Then the warm-up is
    shortened, down to half of its requested time. Remaining time goes to the warm-up.

    Args:
        planner: plans the stages.
        programme: what is wanted.
        excitation: the excitation stage; None in a campaign without heating cycles.

    Returns:
        The stages but for the excitation, and what was changed.

    Raises:
        InfeasibleError: a cycle that is too short, with the time that would do.
    """
    period = planner.robot.period
    cycle = round(programme.cycle_time / period)
    poses = planner.poses()

    def friction(plateau: float) -> Stage:
        return planner.friction(poses, programme.levels, plateau)

    longest = friction(programme.plateau)
    if excitation is None:
        if len(longest.motion) > cycle:
            needed = len(longest.motion) * period
            raise _too_short(programme.cycle_time, f"the friction stage takes {needed:.1f} s", needed)
        return [longest], ()
    warm_ups = planner.warm_up(programme.warm_up, programme.duties, programme.warm_up_range)
    budget = cycle - len(excitation.motion) - len(warm_ups[0].motion)
    chosen, notes = longest, []
    warm_up_time = round(programme.warm_up / period)
    if len(longest.motion) > budget:
        low, high = min(LEAST_PLATEAU, programme.plateau), programme.plateau
        chosen = friction(low)
        # Bisection for the time at each speed: to a millisecond.
        for _ in range(10 if len(chosen.motion) <= budget else 0):
            middle = (low + high) / 2.0
            stage = friction(middle)
            if len(stage.motion) <= budget:
                chosen, low = stage, middle
            else:
                high = middle
        wanted = (cycle - budget + len(longest.motion)) * period
        notes.append(
            f"The stages take {wanted:.1f} s, more than the cycle of {programme.cycle_time:g} s. The friction stage "
            f"was shortened from {longest.duration:.1f} s to {chosen.duration:.1f} s, with {low:.2f} s instead of "
            f"{programme.plateau:g} s per speed."
        )
    left = budget - len(chosen.motion)
    if left < 0:
        needed = (cycle - left) * period
        warm_up_time += left
        # Share of the warm-up that must be left.
        if warm_up_time * period < 0.5 * programme.warm_up:
            reason = (
                f"excitation takes {excitation.duration:.1f} s and friction {chosen.duration:.1f} s, which leaves "
                f"{max(warm_up_time, 0) * period:.1f} s for the warm-up of {programme.warm_up:g} s"
            )
            raise _too_short(programme.cycle_time, reason, needed)
        notes.append(
            f"The warm-up was shortened from {programme.warm_up:g} s to {warm_up_time * period:.1f} s as well."
        )
    # Time left over in a cycle that the warm-up takes on [s]; beyond it the robot rests.
    if 0 < left * period <= 10.0:
        warm_up_time += left
    if warm_up_time != round(programme.warm_up / period):
        warm_ups = planner.warm_up(warm_up_time * period, programme.duties, programme.warm_up_range)
    return [chosen, *warm_ups], tuple(notes)


def _too_short(cycle_time: float, problem: str, needed: float) -> InfeasibleError:
    return InfeasibleError(
        f"a cycle of {cycle_time:g} s is too short: {problem}",
        allowed=f"{needed:.1f} s or more",
        remedy="lengthen the cycle, shorten the warm-up, or give a shorter design",
    )
