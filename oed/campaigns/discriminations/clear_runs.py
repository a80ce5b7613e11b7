"""Runs that meet nothing: motions are drawn smaller about the home pose until they are free of collisions."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from estimation.diagnosis.experiment_plans.experiment_motions import MAKERS
from oed.campaigns.discriminations.motions import ExperimentBuilder, Run
from oed.experiments.safety_checks.freedom import freedom_of, freedom_text, is_free
from robots.collision import CollisionModel
from robots.common.errors import InfeasibleError

SHARES = (1.0, 0.75, 0.55, 0.4, 0.3, 0.2)
"""Parts of the range of all joints about the home pose that are tried, one after the other."""
EVERY = 20
"""Only each such sample of a motion is looked at first: most motions that collide do so at one of these."""


class ClearRuns:
    """Makes the runs of a robot's experiments, free of collisions where some size of the motions is.

    Args:
        build: makes the builder for a seed of the reference motion and a part of the range.
        bodies: what must not meet; None to take all motions as they come.
    """

    def __init__(self, build: Callable[[int, float], ExperimentBuilder], bodies: CollisionModel | None) -> None:
        self.build, self.bodies = build, bodies

    def reference(self, seed: int) -> tuple[ExperimentBuilder, tuple[Run, ...]]:
        """Gives the builder with the largest reference motion that is free, and that motion; the largest if none is.

        Raises:
            InfeasibleError: no motion keeps the limits.
        """
        first = None
        for share in SHARES:
            builder = self.build(seed, share)
            runs = builder.runs()
            first = first or (builder, runs)
            if not self.problem(runs):
                return builder, runs
        assert first is not None
        return first

    def runs(self, builder: ExperimentBuilder, kind: str, joint: int, variant: int) -> tuple[Run, ...]:
        """Makes the runs of a kind of experiment, as large as they are free.

        Args:
            builder: of the reference motion; smaller ones are made from its seed.
            kind: of the experiment.
            joint: that it examines, from 0.
            variant: of its stages.

        Raises:
            InfeasibleError: no size of the motions is free, or none keeps the limits.
        """
        problem = ""
        for share in (share for share in SHARES if share <= builder.share):
            smaller = builder if share == builder.share else self.build(builder.seed, share)
            runs = smaller.runs(MAKERS[kind](smaller.room, joint, variant), kind)
            problem = self.problem(runs)
            if not problem:
                return runs
        raise InfeasibleError(problem)

    def problem(self, runs: Sequence[Run]) -> str:
        """Says where the motions of runs meet something; empty if they are proved free, or not checked."""
        bodies = self.bodies
        for motion in {} if bodies is None else {id(run.motion): run.motion for run in runs}.values():
            assert bodies is not None
            # The whole check takes seconds, and most motions that collide are seen at once.
            if bodies.pairs and (bodies.clearance(motion.q[::EVERY]) < 0.0).any():
                return "its motions meet the robot itself or its surroundings in every size"
            freedom = freedom_of(bodies, motion)
            # None where the links have no shape at all: the result then says that nothing was checked.
            if freedom is not None and not is_free(freedom):
                return freedom_text(freedom)
        return ""
