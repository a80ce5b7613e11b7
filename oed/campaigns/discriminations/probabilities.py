"""Probability that an experiment distinguishes two effects, and whether any experiment could."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimation.diagnosis.base_models.baseline import FAINT
from estimation.diagnosis.experiment_plans.experiment_grams import Grams
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.power import chance_to_resolve
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.linear_algebra.orthonormal import orthonormal
from oed.campaigns.discriminations.discrimination import DiscriminationScore
from oed.campaigns.discriminations.motions import Run
from robots.common.arrays import Array
from robots.common.errors import NotIdentifiableError

EVALUATION_STEP = 0.01
"""About the step [s] at which effects are evaluated; the white part of the noise is averaged over it."""


@dataclass(frozen=True, eq=False)
class Instance:
    """An effect with one of its shapes; its mixtures of coefficients (m, k) all have the size asked for."""

    hypothesis: Hypothesis
    shape: tuple[float, ...]
    coefficients: Array
    mixtures: Array


class Discriminator:
    """Quantifies how well an experiment distinguishes two hypotheses."""

    def __init__(self, problem: Problem, pair: tuple[Hypothesis, Hypothesis], size: float) -> None:
        self.pair = pair
        self.instances = [item for hypothesis in pair for item in instances(problem, hypothesis, size)]
        self.grams = Grams(problem, self.instances)

    def __call__(self, kind: str, runs: tuple[Run, ...]) -> DiscriminationScore:
        """Judges an experiment by the worse of the two truths, each the median over its shapes and mixtures."""
        gram = self.grams.of([part for run in runs for part in run.parts(EVALUATION_STEP)])
        energies: list[float] = []
        shares: list[float] = []
        alone: list[float] = []
        for truth, rival in (self.pair, self.pair[::-1]):
            left: list[float] = []
            share, own = 0.0, 0.0
            for i, item in enumerate(self.instances):
                if item.hypothesis is not truth:
                    continue
                others = [j for j, other in enumerate(self.instances) if other.hypothesis is rival]
                remains = np.stack([self.grams.remainder(gram, i, j) for j in others])
                energy = np.einsum("mk,rkl,ml->rm", item.mixtures, remains, item.mixtures).clip(0.0).min(axis=0)
                raw = np.einsum("mk,kl,ml->m", item.mixtures, self.grams.block(gram, i), item.mixtures)
                visible = np.einsum("mk,kl,ml->m", item.mixtures, self.grams.remainder(gram, i, None), item.mixtures)
                left += energy.tolist()
                raw = np.maximum(raw, 1e-300)
                share, own = max(share, float(np.max(energy / raw))), max(own, float(np.max(visible / raw)))
            energies.append(float(np.median(left)))
            shares.append(share)
            alone.append(own)
        energy = min(energies)
        return DiscriminationScore(
            kind=kind,
            resolves=chance_to_resolve(energy),
            energy=energy,
            duration=float(sum(run.motion.duration for run in runs)),
            runs=len(runs),
            shares=(shares[0], shares[1]),
            visible=(alone[0], alone[1]),
        )


def instances(problem: Problem, hypothesis: Hypothesis, size: float) -> list[Instance]:
    """Scales an effect's shapes and coefficient mixtures to a given size in the reference motion.

    Raises:
        NotIdentifiableError: the effect is not visible in any of them.
    """
    grid = hypothesis.effect.grid(problem.situation, hypothesis.joint)
    kinds = ", ".join(kind.replace("_", " ") for kind in hypothesis.effect.experiments)
    if not grid:
        raise NotIdentifiableError(
            f"a single motion cannot show {hypothesis.label}",
            remedy=f"suitable experiments: {kinds}; record several logs and run oed diagnose",
        )
    # Shapes of each effect, spread over its grid: those it may have, and with which it may imitate the other.
    count = min(len(grid), 4)
    chosen = [grid[round((k + 0.5) * len(grid) / count - 0.5)] for k in range(count)]
    rms = np.maximum(np.sqrt(np.mean(problem.recording.tau**2, axis=0)), 1e-9)
    N = len(problem.recording)
    base = (problem.baseline.regressor / rms[:, None]).reshape(N * problem.n, -1)
    base = orthonormal(base, FAINT)
    random = np.random.default_rng(0)
    found = []
    # Share of an effect's energy that must be left beside the base model for its size to be measured there.
    visible_share = 1e-3
    for shape in chosen:
        joints, columns = problem.columns_of(hypothesis, shape)
        X = np.zeros((N, problem.n, columns[0].shape[1]))
        for at, part in zip(joints, columns, strict=True):
            X[:, at] = part / rms[at]
        flat = X.reshape(N * problem.n, -1)
        shows = (flat - base @ (base.T @ flat)).reshape(X.shape)
        raw = float(np.square(X).sum(axis=(0, 2)).max())
        # If the base model absorbs the effect in the reference motion, the size refers to the effect's whole torque.
        torque = shows if np.square(shows).sum(axis=(0, 2)).max() > visible_share * raw else X
        grams = np.einsum("njk,njl->jkl", torque, torque) / N
        gram = max(grams, key=lambda g: float(np.trace(g)))
        values, vectors = np.linalg.eigh(gram)
        kept = values > visible_share * max(float(values[-1]), 1e-12)
        if not kept.any() or values[-1] <= 1e-12:
            continue
        root = vectors[:, kept] / np.sqrt(values[kept])
        # Mixtures of an effect's coefficients.
        draws = random.standard_normal((8 if kept.sum() > 1 else 1, int(kept.sum())))
        mixtures = size * (draws / np.linalg.norm(draws, axis=1)[:, None]) @ root.T
        found.append(Instance(hypothesis, shape, mixtures[0], mixtures))
    if not found:
        raise NotIdentifiableError(
            f"{hypothesis.label} does not change the torques of {problem.situation.robot.name} in the present set-up",
            remedy=f"suitable experiments: {kinds}, with a known payload or a known tilt of the base",
        )
    return found


def require_separable(pair: tuple[Hypothesis, Hypothesis], judged: Sequence[DiscriminationScore]) -> None:
    """Refuses a pair of effects that no experiment can distinguish from the base model or from each other.

    Raises:
        NotIdentifiableError: with the reason.
    """
    possible = [j for j in judged if not j.note]
    tried = ", ".join(j.kind.replace("_", " ") for j in possible)
    remedy = (
        f"tried: {tried}. Use a known payload with its centre off the last joint's axis, or an additional "
        "measurement: joint torque, temperature, or position behind the gear"
    )
    # Share of an effect's energy below which what is left of it is rounding.
    alias = 1e-6
    for at, hypothesis in enumerate(pair):
        if max(j.visible[at] for j in possible) < alias:
            raise NotIdentifiableError(
                (
                    f"{hypothesis.label} cannot be distinguished from a change of the base model's parameters by any "
                    f"motion"
                ),
                remedy=remedy,
            )
    for at, hypothesis in enumerate(pair):
        if max(j.shares[at] for j in possible) < alias:
            raise NotIdentifiableError(
                (
                    f"no experiment of the catalogue distinguishes {hypothesis.label} from {pair[1 - at].label} with "
                    f"other base-model parameters"
                ),
                remedy=remedy,
            )
