"""What the help of the commands says beyond the options: groups, and examples to copy."""

from __future__ import annotations

from collections.abc import Mapping

COMMANDS: dict[str, tuple[str, ...]] = {
    "First steps": ("example", "robots", "robot", "effects", "explain", "doctor"),
    "Experiments": ("design", "pareto", "retime", "campaign", "export", "show"),
    "Robot and virtual robot": ("stream", "record", "loop", "controller", "simulate"),
    "Models": ("check", "identify", "actuators", "thermal", "predict", "payload", "calibrate"),
    "Diagnosis": ("diagnose", "compare", "monitor", "fleet", "force", "view", "benchmark"),
}
"""Commands by purpose; those that are not listed come last."""

OTHER = "Other commands"

OPTIONS = {
    "Robot": ("robot", "second", "tip", "joints", "lock", "unlimited", "assume_masses", "home"),
    "Input": (
        *(
            "trajectory",
            "log",
            "log_dir",
            "poses",
            "state",
            "without",
            "held_out",
            "healthy",
            "calibration",
            "before",
            "own_clocks",
            "gains",
            "mapping",
            "rate",
            "config",
            "torque_is",
            "model",
            "campaign_folder",
        ),
        *("payload", "gravity", "ambient", "plant", "after", "task", "design", "extension", "answers", "diagnosis"),
    ),
    "Output": (
        *(
            "out",
            "force",
            "png",
            "json",
            "quiet",
            "urdf",
            "mjcf",
            "c_code",
            "to",
            "degrees",
            "positions_only",
            "bare",
            "markdown",
        ),
        *("install_completion", "show_completion", "help", "version"),
    ),
}
"""Options by purpose, by the names of the parameters; all others are settings of the method."""

SETTINGS = "Settings"

EXAMPLES = {
    "design": (
        "oed design --robot er3a --out experiment",
        "oed design --robot arm.urdf --tip tool0 --criterion d --velocity-fraction 0.7 --out experiment",
        "oed design --robot er3a --for calibration --poses 30 --out poses",
    ),
    "pareto": ("oed pareto --robot er3a --criteria cond,d --points 5 --out pareto",),
    "retime": (
        "oed retime experiment/trajectory.csv --method toppra --out retimed",
        "oed retime waypoints.csv --robot er3a --out timed",
    ),
    "export": (
        "oed export experiment/trajectory.csv --degrees --positions-only --bare --out for_controller.csv",
        "oed export experiment/trajectory.csv --to ros-goal --out goal.yaml",
        "oed export experiment/trajectory.csv --to mcap --out planned.mcap",
        "oed export experiment/trajectory.csv --to urscript --period 0.008 --out excitation.script",
    ),
    "show": (
        "oed show experiment/trajectory.csv --out robot.html",
        "oed show log.csv --robot er3a --diagnosis diagnosed --out robot.html",
    ),
    "view": ("oed view results", "oed view results --out results.html"),
    "stream": (
        "oed stream experiment/trajectory.csv --host 192.168.0.10 --dry-run",
        "oed stream experiment/trajectory.csv --host 192.168.0.10 --log log.csv",
    ),
    "record": ("oed record --robot er3a --host 192.168.0.10 --log log.csv --duration 60",),
    "controller": (
        "oed controller --robot er3a --plant plant.yaml",
        "oed controller --robot er3a --replies echo --lose 0.05 --double 0.05 --late 0.05",
    ),
    "campaign": (
        "oed campaign --robot er3a --design experiment --out campaign",
        "oed campaign --robot er3a --out campaign --run 192.168.0.10",
    ),
    "loop": (
        "oed loop --robot er3a --host 192.168.0.10 --out loop",
        "oed loop --robot er3a --host 127.0.0.1 --design experiment --experiments 3 --out loop",
    ),
    "simulate": (
        "oed simulate --trajectory experiment/trajectory.csv --out log.csv",
        "oed simulate --trajectory experiment/trajectory.csv --plant plant.yaml --seed 1 --out log.csv",
    ),
    "check": (
        "oed check log.csv --robot er3a",
        "oed check logs --robot arm.urdf --torque-is current --json",
    ),
    "identify": (
        "oed identify --robot er3a --log log.csv --out model",
        "oed identify --robot ur10 --log rtde_recording.csv bag_folder --method all --out model",
    ),
    "actuators": (
        "oed actuators --robot go2.xml --log run.parquet --gains gains.yaml --out drives",
        "oed actuators --robot arm.xml --log run.csv --held-out other.csv --share all --out drives",
    ),
    "thermal": ("oed thermal --robot er3a --log logs --order auto --out thermal",),
    "diagnose": ("oed diagnose --robot er3a --log log.csv --held-out held_out.csv --out diagnosed",),
    "predict": ("oed predict --model model --log other.csv --out predicted.csv",),
    "compare": (
        "oed compare monday/model.json friday/model.json --out compared",
        "oed compare logs/day1.csv logs/day2.csv logs/day3.csv --robot er3a --out compared",
    ),
    "monitor": (
        "oed monitor --model thermal --log day1.csv day2.csv day3.csv --out monitored",
        "oed monitor --model model --log-dir logs --state robot7.state --out monitored --force",
    ),
    "fleet": (
        "oed fleet logs_of_all_robots --model model --workers 4 --out fleet",
        "oed fleet logs_of_all_robots --model model --cluster tcp://192.168.1.10:8786 --out fleet",
    ),
    "payload": (
        "oed payload --robot ur10 --log with.csv --without without.csv --to urscript --out payload",
        "oed payload --model model --log with.csv --to franka kuka --out payload",
    ),
    "calibrate": (
        "oed calibrate --robot arm.urdf --poses poses.csv --out calibrated",
        "oed calibrate --robot ur10 --poses poses.csv --lengths mm --angles deg --held-out other.csv --out calibrated",
    ),
    "force": (
        "oed force --model model --log log.csv --healthy healthy.csv --out forces",
        "oed force --model model --log log.csv --calibration forces/forces.json --out other",
    ),
    "benchmark": (
        "oed benchmark make blind --cases 24",
        "oed benchmark answer blind --by residual-fit",
        "oed benchmark score blind blind.residual-fit others/answers.json --markdown table.md",
    ),
    "example": ("oed example --out example", "oed example --for calibration --out calibration"),
    "robots": ("oed robots",),
    "robot": ("oed robot show ur10", "oed robot show arm.urdf --tip tool0 --json"),
    "effects": ("oed effects", "oed effects --json"),
    "explain": ("oed explain OED-L014", "oed explain"),
    "doctor": ("oed doctor",),
}
"""Command lines to copy, by command."""

FIRST = (
    "oed example                writes files to try the commands on, and the next three commands",
    "oed COMMAND --help         options and examples of a command",
    "oed --install-completion   completes commands and options in your shell",
)
"""Lines at the end of the help of ``oed``."""


def group_of(groups: Mapping[str, tuple[str, ...]], name: str, other: str) -> str:
    """Finds the group of a name.

    Args:
        groups: by title.
        name: of a command or a parameter.
        other: the title of those without a group.
    """
    return next((title for title, names in groups.items() if name in names), other)
