"""The experiment that a diagnosis recommends, done on the true robot, and the diagnosis of all logs together."""

from __future__ import annotations

from typing import Any

from oed.benchmarks.truth.cases import Case
from oed.benchmarks.truth.experiments import Stage, follow_up
from robots.robot import Robot
from robots.signals import Log


def follow(case: Case, robot: Robot, diagnosis: Any) -> dict[str, Any]:
    """Does the recommended experiment and diagnoses again, with the new logs beside the old."""
    from estimation import diagnose
    from robots.terms.situations.flange_body import point_mass

    plan = diagnosis.next_experiment
    if plan is None:
        return {"kind": None}
    stages = [
        Stage(t=s.motion.t, q=s.motion.q, pause=s.pause, payload=s.payload, gravity=s.gravity) for s in plan.stages
    ]
    logs = [Log(t=record.t, q=record.q, tau=record.tau) for record in case.logs]
    for stage, record in zip(stages, follow_up(case, stages), strict=True):
        logs.append(
            Log(
                t=record.t,
                q=record.q,
                tau=record.tau,
                payload=point_mass(stage.payload, (0.0, 0.0, 0.1)) if stage.payload else None,
                gravity=stage.gravity,
            )
        )
    said = diagnose(robot, logs).to_dict()
    found = [{"effect": f["effect"], "joint": f["joint"]} for f in said["findings"]]
    return {"kind": plan.kind, "promised": plan.resolves, "verdict": said["verdict"], "findings": found}
