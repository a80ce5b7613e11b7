"""What a diagnosis must get right about a case: every complaint in words."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from oed.benchmarks.truth.effects.base import Effect

# Names of the truth's parameters and those of the diagnosis, with the error that is allowed: seconds or a share.
TIMES = {"change_time": ("change_time", 0.2), "start": ("start", 0.2)}
SHARES = {
    "stribeck_velocity": ("stribeck_velocity", 0.5),
    "presliding_distance": ("presliding_travel", 0.5),
    "order": ("order", 0.01),
    "delay": ("delay", 0.2),
    "mass": ("mass_change", 0.2),
}


@dataclass(frozen=True, kw_only=True)
class Truth:
    """What was hidden, and squared NRMSE on the unseen log, summed over joints, without and with the true effects."""

    effects: tuple[Effect, ...]
    before: float | None = None
    after: float | None = None

    @property
    def pairs(self) -> set[tuple[str, int | None]]:
        """Effects by name and joint."""
        return {(effect.name, effect.joint) for effect in self.effects}


def complaints(truth: Truth, said: dict[str, Any], *, ratio: float = 0.7) -> list[str]:
    """Lists what is wrong with a diagnosis: verdict, names, joints, parameters, gain.

    Args:
        truth: what was hidden.
        said: the contents of a diagnosis.json.
        ratio: least share of the true model's gain.
    """
    found = {(finding["effect"], finding["joint"]) for finding in said["findings"]}
    strange = any(effect.name == "unexplained" for effect in truth.effects)
    allowed = {"unexplained"} if strange else {"named"} if truth.effects else {"none"}
    wrong = []
    if said["verdict"] not in allowed:
        wrong.append(f"verdict {said['verdict']}, not {' or '.join(allowed)}: {sorted(found, key=str)}")
    named = {pair for pair in found if pair[0] != "unexplained"}
    if strange and named:
        wrong.append(f"named {named}, which is not there")
    if not strange and found != truth.pairs:
        wrong.append(f"found {found}, hidden {truth.pairs}")
    wrong += _parameters(truth, said)
    if truth.before is not None and truth.after is not None:
        # Both start at the base model of the true effect's own model: one that is better, or extrapolates badly, makes
        # neither less nor more of a gain.
        gain = truth.before - sum(error**2 for error in said["extended"]["nrmse"])
        if gain < ratio * (truth.before - truth.after):
            wrong.append(f"a gain of {gain:.2e}, the true effect's own model has {truth.before - truth.after:.2e}")
    return wrong


def _parameters(truth: Truth, said: dict[str, Any]) -> list[str]:
    wrong = []
    for effect in truth.effects:
        for finding in said["findings"]:
            if (finding["effect"], finding["joint"]) != (effect.name, effect.joint):
                continue
            reported = {parameter["name"]: parameter for parameter in finding["parameters"]}
            for name, value in effect.truths().items():
                theirs, allowed = {**TIMES, **SHARES}.get(name, (None, 0.0))
                if theirs not in reported:
                    continue
                error = abs(reported[theirs]["value"] - value) / (1.0 if name in TIMES else abs(value))
                low, high = reported[theirs].get("ci95") or (None, None)
                unsure = low is None or high is None or (low <= value <= high)
                if error > allowed and not unsure:
                    wrong.append(f"{theirs} of {reported[theirs]['value']:.4g}, in truth {value:.4g}")
    return wrong
